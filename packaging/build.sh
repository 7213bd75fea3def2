#!/usr/bin/env bash
# Makes target/package/tactus.deb of the programs in a folder (target/dist if none is named), and checks it: build.sh [FOLDER]
set -euo pipefail
cd "$(dirname "$0")/.."
programs=${1:-target/dist}
out=target/package
made=$out/made
for tool in dpkg-shlibdeps:dpkg-dev readelf:binutils; do
    command -v "${tool%:*}" >/dev/null || { apt-get update -qq && apt-get install -qq --no-install-recommends "${tool#*:}" >/dev/null; }
done

mkdir -p $made
"$programs/tactus" completions bash > $made/tactus.bash
"$programs/tactus" completions zsh > $made/_tactus
# zsh reads the file at the first Tab, and has to complete that one, too.
echo '[ "$funcstack[1]" = "_tactus" ] && _clap_dynamic_completer_tactus "$@"' >> $made/_tactus
"$programs/tactus" completions fish > $made/tactus.fish
packaging/licences.py tactus tactus-daemon tactus-web tactus-mock > $made/third-party-licences.txt

root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT
chmod 755 "$root"
while read -r source destination mode; do
    source=${source//@programs@/$programs}
    source=${source//@made@/$made}
    for file in $source; do
        case $destination in
        */) target=$root/$destination${file##*/} ;;
        *) target=$root/$destination ;;
        esac
        install -D --mode="$mode" "$file" "$target"
    done
done < <(grep -v '^#' packaging/files)
strip --strip-unneeded "$root"/usr/bin/*
gzip --best --no-name "$root"/usr/share/man/man1/*

# The packages of the shared libraries that the programs load. dpkg-shlibdeps wants to stand beside a debian/control.
scratch=$(mktemp -d)
trap 'rm -rf "$root" "$scratch"' EXIT
mkdir "$scratch/debian"
echo "Source: tactus" > "$scratch/debian/control"
libraries=$(cd "$scratch" && dpkg-shlibdeps -O "$root"/usr/bin/* 2>/dev/null | sed -n 's/^shlibs:Depends=//p')
[ -n "$libraries" ] || { echo "dpkg-shlibdeps names no libraries"; exit 1; }

mkdir "$root/DEBIAN"
version=$("$programs/tactus" --version | cut -d' ' -f2)
sed -e "s/@VERSION@/$version/" -e "s/@ARCHITECTURE@/$(dpkg --print-architecture)/" -e "s/@LIBRARIES@/$libraries/" \
    -e "s/@SIZE_KIB@/$(du --summarize --block-size=1024 "$root" | cut -f1)/" packaging/control > "$root/DEBIAN/control"
(cd "$root" && find etc -type f -printf '/%p\n' | sort) > "$root/DEBIAN/conffiles"
(cd "$root" && find usr -type f -print0 | sort -z | xargs -0 md5sum) > "$root/DEBIAN/md5sums"
chmod 644 "$root/DEBIAN"/*
install --mode=755 packaging/postinst packaging/prerm packaging/postrm "$root/DEBIAN/"
dpkg-deb --root-owner-group -Zgzip -z1 --build "$root" $out/tactus.deb

# A reviewer of packages would look at this first.
fail() { echo "$out/tactus.deb: $1"; exit 1; }
rm -rf "$root"
dpkg-deb --raw-extract $out/tactus.deb "$root"
[ -z "$(dpkg-deb --contents $out/tactus.deb | awk '$2 != "root/root"')" ] || fail "some files do not belong to root"
[ -z "$(find "$root" -type f -perm /022)" ] || fail "others may write some files"
diff <(cd "$root" && find etc -type f -printf '/%p\n' | sort) <(sort "$root/DEBIAN/conffiles") || fail "some files in /etc are no conffiles"
for program in tactus tactusd tactus-web tactus-mock; do
    [ "$("$root/usr/bin/$program" --version)" = "$program $(dpkg-deb --field $out/tactus.deb Version | sed 's/-[^-]*$//')" ] ||
        fail "$program has another version"
    ! readelf --sections "$root/usr/bin/$program" | grep -q '\.debug_info' || fail "$program is not stripped"
    zgrep -q '^\.SH NAME' "$root/usr/share/man/man1/$program.1.gz" || fail "$program has no manual page"
done
notices=$root/usr/share/doc/tactus/third-party-licences.txt
for crate in zenoh libusb1-sys zstd-sys tokio; do
    grep -q "^# .*\b$crate " "$notices" || fail "the licence of $crate is missing"
done
for part in "relink the programs" "Copyright © 2001 Johannes Erdfelt" "GNU LESSER GENERAL PUBLIC LICENSE" "END OF TERMS AND CONDITIONS"; do
    awk '/^# / { is_libusb = /^# libusb1-sys / } is_libusb' "$notices" | grep "$part" > /dev/null || fail "libusb's licence lacks: $part"
done
for script in postinst prerm postrm; do sh -n "$root/DEBIAN/$script" || fail "$script does not parse"; done
if command -v lexgrog > /dev/null; then
    lexgrog "$root"/usr/share/man/man1/*.gz > /dev/null || fail "a manual page has no name that whatis could list"
fi
bash -n "$root/usr/share/bash-completion/completions/tactus" || fail "bash's completions do not parse"
"$root/usr/bin/tactus" validate "$root"/etc/tactus/tactusd.toml "$root"/etc/tactus/rigs/*.toml "$root"/usr/share/tactus/*/*.toml \
    "$root"/usr/share/tactus/*/*.star > /dev/null
dpkg-deb --info $out/tactus.deb
dpkg-deb --contents $out/tactus.deb
