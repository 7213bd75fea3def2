#!/usr/bin/env bash
# Verifies the unit files as systemd reads them: known keys only, and an exposure of at most 2.0.
set -euo pipefail
cd "$(dirname "$0")"
command -v systemd-analyze >/dev/null || { apt-get update -qq && apt-get install -qq --no-install-recommends systemd; }

# `verify` wants the program to exist; where it will be installed is not this machine's business.
root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT
for unit in *.service; do
    sed "s|^ExecStart=/usr/bin/[^ ]*|ExecStart=$(command -v true)|" "$unit" > "$root/$unit"
    # An unknown key is only a message: any message is an error.
    messages=$(systemd-analyze verify "$root/$unit" 2>&1) || { echo "$unit: $messages"; exit 1; }
    [ -z "$messages" ] || { echo "$unit: $messages"; exit 1; }
    # The threshold counts tenths.
    systemd-analyze security --offline=yes --no-pager --threshold=20 "$root/$unit" | tail -1
done
echo "unit files verified"
