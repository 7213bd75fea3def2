#!/usr/bin/env bash
# A real kernel's USB stack without hardware: makes the machine where it is not made yet, copies our programs into it, runs the checks.
# Names of checks as arguments run only those: `tests/vm/run.sh ftdi hid`; `--prepare` only makes the machine. README.md says the rest.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
repository=$(cd "$here/../.." && pwd)
work=$repository/target/vm
binaries=${TACTUS_BINARIES:-$repository/target/dist}

# From Debian 12 and no other release: the machine is one too, and the programs are built against its C library.
if ! command -v qemu-system-x86_64 >/dev/null || ! command -v mmdebstrap >/dev/null; then
    apt-get update -qq
    # A newer qemu-utils than that release's would forbid its qemu.
    apt-get install -qq --no-install-recommends --allow-downgrades \
        qemu-system-x86/bookworm qemu-utils/bookworm mmdebstrap/bookworm e2fsprogs/bookworm
fi

"$here/build.sh" "$work"
[ "${1:-}" != --prepare ] || exit 0

# What the checks need, as a disk that the machine reads: our programs without their symbols, the shipped files, the checks.
stage=$(mktemp -d "$work/stage.XXXXXX")
trap 'rm -rf "$stage"' EXIT
mkdir "$stage/bin"
for program in tactus tactusd tactus-mock; do
    strip --strip-all -o "$stage/bin/$program" "$binaries/$program"
done
cp -r "$repository/README.md" "$repository/config" "$repository/experiments" "$here/guest" "$stage/"
printf '%s\n' "$@" > "$stage/chosen"

python3 "$here/machine.py" run "$work" "$stage"
