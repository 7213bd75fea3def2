#!/usr/bin/env bash
# Becomes the first process of the machine: pid1.sh ROOT, in new namespaces that machine.py makes.
set -euo pipefail
root=$1

mount --bind "$root" "$root"
mount -t proc proc "$root/proc"
# Units can read the kernel's /sys and cannot change it.
mount -t sysfs -o ro sysfs "$root/sys"
mount -t cgroup2 cgroup2 "$root/sys/fs/cgroup"
mount -t tmpfs -o mode=755 tmpfs "$root/dev"
for node in null:1:3 zero:1:5 full:1:7 random:1:8 urandom:1:9 tty:5:0; do
    IFS=: read -r name major minor <<< "$node"
    mknod -m 666 "$root/dev/$name" c "$major" "$minor"
done
mkdir "$root/dev/pts" "$root/dev/shm"
mount -t devpts -o newinstance,ptmxmode=0666,mode=620,gid=5 devpts "$root/dev/pts"
mount -t tmpfs tmpfs "$root/dev/shm"
ln -s pts/ptmx "$root/dev/ptmx"
ln -s /proc/self/fd "$root/dev/fd"
for number in 0:stdin 1:stdout 2:stderr; do ln -s "/proc/self/fd/${number%:*}" "$root/dev/${number#*:}"; done
mount -t tmpfs -o mode=755 tmpfs "$root/run"
mount -t tmpfs tmpfs "$root/tmp"

cd "$root"
pivot_root . mnt
umount --lazy /mnt
# Mounts in a unit's sandbox stay there; mounts made here also appear in the sandbox.
mount --make-rshared /
exec env -i container=tactus PATH=/usr/sbin:/usr/bin NOTIFY_SOCKET=/ready.socket \
    /lib/systemd/systemd --log-target=journal-or-kmsg --show-status=no --unit=multi-user.target
