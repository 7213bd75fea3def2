#!/usr/bin/env bash
# Makes the machine in the given folder: a kernel and a small Debian, booted and saved. Does nothing if the inputs have not changed.
# Remove the folder to get Debian's updates.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
work=$1

# The saved state depends on this version of qemu and on the content of these files.
inputs=$(cat "$here/build.sh" "$here/machine.py" "$here/unpack-kernel.py" "$here/boot" <(qemu-system-x86_64 --version) | sha256sum)
if [ -f "$work/made" ] && [ "$(cat "$work/made")" = "$inputs" ]; then
    exit 0
fi
rm -rf "$work"
mkdir -p "$work"
log=$work/build.log
echo "making the machine (about two minutes, once); the log is target/vm/build.log"
trap 'tail -n 30 "$log" >&2; echo "the machine was not made" >&2' ERR

step() {
    local start=$SECONDS
    "$@" >> "$log" 2>&1
    echo "  $1: $((SECONDS - start)) s"
}

# The kernel, without the initial file system and the boot loader tools that its package depends on. It is unpacked here; under
# emulation this would take half a minute.
kernel() {
    apt-get update -qq
    local version
    version=$(apt-cache depends linux-image-amd64 | sed -n 's/.*Depends: linux-image-//p')
    mkdir "$work/packages"
    (cd "$work/packages" && apt-get download "linux-image-$version" busybox-static)
    for package in "$work"/packages/*.deb; do
        dpkg -x "$package" "$work/unpacked"
    done
    python3 "$here/unpack-kernel.py" "$work/unpacked/boot/vmlinuz-$version" "$work/vmlinux"
    echo "$version" > "$work/kernel-version"
}

# Debian's essential packages, systemd and udev to handle devices as real machines do, and Python for the checks.
files() {
    TMPDIR=$work mmdebstrap --mode=root --variant=essential --architectures=amd64 \
        --include=systemd,systemd-sysv,udev,kmod,python3 \
        --dpkgopt='path-exclude=/usr/share/doc/*' --dpkgopt='path-exclude=/usr/share/man/*' \
        --dpkgopt='path-exclude=/usr/share/locale/*' --dpkgopt='path-exclude=/usr/share/info/*' \
        --dpkgopt='path-exclude=/usr/lib/udev/hwdb.d/*' \
        --aptopt='Acquire::Languages "none"' --aptopt='APT::Install-Recommends "false"' \
        --format=directory bookworm "$work/root" /etc/apt/sources.list.d/debian.sources
    rm -rf "$work"/root/var/lib/apt/lists/* "$work"/root/var/cache/apt/*
}

# The kernel modules for the machine's disks and our devices, with all their dependencies.
modules() {
    local version kernel root=$work/root
    version=$(cat "$work/kernel-version")
    kernel=$work/unpacked/lib/modules/$version
    depmod_files=("$kernel"/modules.builtin "$kernel"/modules.builtin.modinfo "$kernel"/modules.order)
    mkdir -p "$root/lib/modules/$version"
    cp "${depmod_files[@]}" "$root/lib/modules/$version/"
    chroot_modules=$root/all
    mkdir -p "$chroot_modules/lib"
    mv "$work/unpacked/lib/modules" "$chroot_modules/lib/modules"
    chroot "$root" depmod -b /all "$version"
    needed virtio_pci virtio_blk ext4 crc32c_generic > "$work/first-modules"
    needed virtio_pci virtio_blk ext4 crc32c_generic af_packet unix autofs4 \
        usbcore vhci-hcd usbserial ftdi_sio cdc-acm usbhid hid-generic |
        while read -r module; do
            mkdir -p "$root/lib/modules/$version/$(dirname "$module")"
            cp "$chroot_modules/lib/modules/$version/$module" "$root/lib/modules/$version/$module"
        done
    rm -rf "$chroot_modules"
    chroot "$root" depmod "$version"
}

# Paths of modules below their version's folder, each after its dependencies.
needed() {
    for module in "$@"; do
        chroot "$work/root" modprobe -d /all -S "$(cat "$work/kernel-version")" --show-depends "$module"
    done | sed -n "s|^insmod /all/lib/modules/[^/]*/\([^ ]*\).*|\1|p" | awk '!seen[$0]++'
}

# Once udev runs, the machine's only task is /usr/local/sbin/boot. Nothing else of Debian is started.
setup() {
    local root=$work/root units=$work/root/etc/systemd/system
    echo guest > "$root/etc/hostname"
    echo 0123456789abcdef0123456789abcdef > "$root/etc/machine-id"
    printf '127.0.0.1 localhost guest\n' > "$root/etc/hosts"
    : > "$root/etc/fstab"
    install -m 755 "$here/boot" "$root/usr/local/sbin/boot"
    cat > "$units/lab.target" <<'UNIT'
[Unit]
Requires=basic.target lab.service
After=basic.target
UNIT
    cat > "$units/lab.service" <<'UNIT'
[Unit]
After=basic.target systemd-udevd.service
Requires=systemd-udevd.service
[Service]
Type=exec
StandardOutput=tty
StandardError=tty
TTYPath=/dev/ttyS0
ExecStart=/usr/local/sbin/boot
UNIT
    local unit
    for unit in timers.target systemd-networkd.socket systemd-networkd.service systemd-firstboot.service \
        systemd-hwdb-update.service systemd-journal-catalog-update.service systemd-update-done.service ldconfig.service; do
        ln -sf /dev/null "$units/$unit"
    done
}

# The root file system, and the small initial file system from which the kernel finds it.
disks() {
    local version first=$work/first
    version=$(cat "$work/kernel-version")
    truncate -s 800M "$work/root.ext4"
    mke2fs -q -t ext4 -O ^has_journal,^metadata_csum -E lazy_itable_init=0 -m 0 -d "$work/root" "$work/root.ext4"
    mkdir -p "$first"/{bin,modules,proc,sys,dev,root}
    cp "$work/unpacked/bin/busybox" "$first/bin/busybox"
    local number=10 module
    while read -r module; do
        cp "$work/root/lib/modules/$version/$module" "$first/modules/$number-$(basename "$module")"
        number=$((number + 1))
    done < "$work/first-modules"
    cat > "$first/init" <<'INIT'
#!/bin/busybox sh
b=/bin/busybox
$b mount -t devtmpfs none /dev
for module in /modules/*; do $b insmod "$module"; done
until [ -b /dev/vda ]; do $b sleep 0.05; done
$b mount -t ext4 -o noatime /dev/vda /root
$b mount --move /dev /root/dev
exec $b switch_root /root /lib/systemd/systemd
INIT
    chmod 755 "$first/init"
    (cd "$first" && find . | "$work/unpacked/bin/busybox" cpio -o -H newc > "$work/first.cpio")
}

booted() {
    python3 "$here/machine.py" save "$work"
}

step kernel
step files
step modules
step setup
step disks
rm -rf "$work/packages" "$work/unpacked" "$work/root" "$work/first"
step booted
echo "$inputs" > "$work/made"
