#!/usr/bin/env bash
# The README's two commands on a bare Debian 12: cargo, gcc and git, and nothing else. Makes the machine's files in target/bare, clones
# the last commit into them, runs both commands, and prints their times. As root.
set -euo pipefail
repository=$(cd "$(dirname "$0")/../.." && pwd)
work=$repository/target/bare
root=$work/root
command -v mmdebstrap >/dev/null || { apt-get update -qq && apt-get install -qq --no-install-recommends mmdebstrap >/dev/null; }

if [ ! -e "$work/made" ]; then
    rm -rf "$work"
    mkdir -p "$work"
    TMPDIR=$work mmdebstrap --quiet --mode=root --variant=minbase --include=gcc,libc6-dev,git,ca-certificates \
        bookworm "$root" /etc/apt/sources.list.d/debian.sources
    touch "$work/made"
fi

# The toolchain at hand, without what rustup adds.
mkdir -p "$root/opt/rust" "$root/etc/ssl/certs"
cp -a "$(rustc --print sysroot)/." "$root/opt/rust/"
# The way to the registry is this machine's.
cp -L /etc/resolv.conf "$root/etc/resolv.conf"
cp -L /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/ca-certificates.crt"

rm -rf "$root/home/tactus"
git clone --quiet --no-local "$repository" "$root/home/tactus"

for folder in proc dev; do
    if ! mountpoint -q "$root/$folder"; then
        mount --rbind "/$folder" "$root/$folder"
        # What is unmounted there at the end stays mounted here.
        mount --make-rslave "$root/$folder"
    fi
done
trap 'umount --recursive --lazy "$root/proc" "$root/dev"' EXIT

inside() {
    local start=$SECONDS
    chroot "$root" /usr/bin/env --ignore-environment HOME=/root PATH=/opt/rust/bin:/usr/bin:/bin TERM=dumb LANG=C.UTF-8 \
        bash -o pipefail -c "cd /home/tactus && $1"
    echo "== $1: $((SECONDS - start)) s" | tee -a "$work/seconds"
}

: > "$work/seconds"
inside "cargo fetch --locked --quiet"
inside "cargo run --release -- run element-centres 2>&1 | tee /tmp/first"
inside "cargo build --release --workspace 2>&1 | tee /tmp/second"
inside "cargo test --workspace"

compiled() { grep '^ *Compiling' "$root/tmp/$1" | awk '{print $2, $3}' | sort -u; }
# fastrand is built for a procedural macro first, and then for the tests: two builds of two kinds.
anew=$(comm -12 <(compiled first) <(compiled second) | grep -v '^fastrand ' || true)
cat "$work/seconds"
[ -z "$anew" ] || { echo "compiled twice: $anew"; exit 1; }
