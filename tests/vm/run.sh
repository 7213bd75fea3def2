#!/usr/bin/env bash
# Tests a real kernel's USB stack without hardware: makes the machine if there is none, copies our programs into it, runs the checks.
# Names of checks as arguments run only those: `tests/vm/run.sh ftdi hid`; `--prepare` only makes the machine. README.md has the details.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
repository=$(cd "$here/../.." && pwd)
work=$repository/target/vm
binaries=${TACTUS_BINARIES:-$repository/target/dist}

# Only Debian 12 works: the machine is Debian 12 too, and the programs are built against its C library.
if ! command -v qemu-system-x86_64 >/dev/null || ! command -v mmdebstrap >/dev/null; then
    apt-get update -qq
    # A qemu-utils newer than this release's would conflict with its qemu.
    apt-get install -qq --no-install-recommends --allow-downgrades \
        qemu-system-x86/bookworm qemu-utils/bookworm mmdebstrap/bookworm e2fsprogs/bookworm
fi

"$here/build.sh" "$work"
[ "${1:-}" != --prepare ] || exit 0

# A disk with what the checks need: our programs without symbols, the shipped files, the checks.
stage=$(mktemp -d "$work/stage.XXXXXX")
trap 'rm -rf "$stage"' EXIT
mkdir "$stage/bin"
for program in tactus tactusd tactus-mock; do
    strip --strip-all -o "$stage/bin/$program" "$binaries/$program"
done
mkdir -p "$stage/docs/book"
cp -r "$repository/docs/book/how-to" "$stage/docs/book/"
cp -r "$repository/config" "$repository/experiments" "$here/guest" "$stage/"
printf '%s\n' "$@" > "$stage/chosen"

python3 "$here/machine.py" run "$work" "$stage"
