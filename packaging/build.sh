#!/usr/bin/env bash
# Makes target/package/tactus.deb from the programs in target/release, and checks its content.
set -euo pipefail
cd "$(dirname "$0")/.."
out=target/package
command -v dpkg-shlibdeps >/dev/null || { apt-get update -qq && apt-get install -qq --no-install-recommends dpkg-dev; }

mkdir -p $out target/release/completions
target/release/tactus completions bash > target/release/completions/tactus.bash
target/release/tactus completions zsh > target/release/completions/_tactus
target/release/tactus completions fish > target/release/completions/tactus.fish
target/tools/bin/cargo-deb deb --package tactus --no-build --compress-type gz --compress-system \
    --output $out/tactus.deb

# The first checks of a package reviewer.
fail() { echo "$out/tactus.deb: $1"; exit 1; }
root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT
dpkg-deb --raw-extract $out/tactus.deb "$root"
[ -z "$(find "$root" ! -path "$root/DEBIAN*" ! -path "$root" -printf '%u:%g\n' | grep -v '^root:root$')" ] || fail "contains files that root does not own"
[ -z "$(find "$root" -type f -perm /022)" ] || fail "contains files that others may write"
diff <(cd "$root" && find etc -type f -printf '/%p\n' | sort) <(sort "$root/DEBIAN/conffiles") || fail "has files in /etc that are not conffiles"
for program in tactus tactusd tactus-web tactus-mock; do
    [ "$("$root/usr/bin/$program" --version)" = "$program $(dpkg-deb --field $out/tactus.deb Version | sed 's/-[^-]*$//')" ] ||
        fail "$program has a different version"
    ! readelf --sections "$root/usr/bin/$program" | grep -q '\.debug_info' || fail "$program is not stripped"
done
for script in postinst prerm postrm; do sh -n "$root/DEBIAN/$script" || fail "$script does not parse"; done
bash -n "$root/usr/share/bash-completion/completions/tactus" || fail "the completions for bash do not parse"
"$root/usr/bin/tactus" validate "$root"/etc/tactus/tactusd.toml "$root"/etc/tactus/rigs/*.toml "$root"/usr/share/tactus/*/*.toml \
    "$root"/usr/share/tactus/*/*.star > /dev/null
dpkg-deb --info $out/tactus.deb
dpkg-deb --contents $out/tactus.deb
