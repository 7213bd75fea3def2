#!/usr/bin/env bash
# Makes the root file system of the boot test from Debian's packages, if it does not exist yet: base.sh FILE.tar
set -euo pipefail
[ ! -f "$1" ] || exit 0
mkdir -p "$(dirname "$1")"
command -v mmdebstrap >/dev/null || { apt-get update -qq && apt-get install -qq --no-install-recommends mmdebstrap >/dev/null; }

# The programs were linked on this machine, so the root file system uses the same Debian release, from the same mirrors.
suite=$(. /etc/os-release && echo "${VERSION_CODENAME:?a Debian release is needed}")
sources=()
[ ! -f /etc/apt/sources.list.d/debian.sources ] || sources=(/etc/apt/sources.list.d/debian.sources)
mmdebstrap --quiet --mode=root --format=tar --variant=essential \
    --include=systemd,systemd-sysv,udev,kmod,libnss-systemd,dbus,passwd \
    --dpkgopt='path-exclude=/usr/share/doc/*' --dpkgopt='path-exclude=/usr/share/man/*' \
    --dpkgopt='path-exclude=/usr/share/locale/*' --dpkgopt='path-exclude=/usr/lib/udev/hwdb.d/*' \
    --aptopt='Acquire::Languages "none"' --aptopt='APT::Install-Recommends "false"' \
    "$suite" "$1.new" "${sources[@]}"
mv "$1.new" "$1"
