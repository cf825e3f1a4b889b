#!/bin/sh
# Runs the tests on another release of Debian, in a clean root: tests/clean_root.sh trixie
#
# Needs root, debootstrap and a network. The last commit is what is tested. The root stays in
# .cache/RELEASE, 4 GB; a second run uses it again with a fresh checkout.
set -eu
cd "$(dirname "$0")/.."
release=$1
root=$PWD/.cache/$release

if [ ! -e "$root/complete" ]; then
    rm -rf "$root"
    debootstrap --variant=minbase --include=ca-certificates,make,git \
        "$release" "$root" http://deb.debian.org/debian
    touch "$root/complete"
fi

# The machine's name servers and certificates: without them neither Debian's mirror nor PyPI is
# reached from behind a company's proxy.
cp -L /etc/resolv.conf "$root/etc/resolv.conf"
cp -L /etc/hosts "$root/etc/hosts"
cp -L /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/ca-certificates.crt"

# A mirror may lag behind by more than the two weeks for which sid's index counts as valid.
echo 'Acquire::Check-Valid-Until "false";' >"$root/etc/apt/apt.conf.d/90mirror"

rm -rf "$root/fem_seal"
git clone -q --no-hardlinks . "$root/fem_seal"

# A mount namespace of its own: the kernel unmounts everything when the command ends.
unshare --mount sh -eu -c '
    mount -t proc proc "$0/proc"
    mount --rbind /dev "$0/dev"
    mount --rbind /sys "$0/sys"
    exec env -i HOME=/root LANG=C.UTF-8 PATH=/usr/sbin:/usr/bin:/sbin:/bin \
        PIP_CERT=/etc/ssl/certs/ca-certificates.crt \
        chroot "$0" make -C /fem_seal demo test' "$root"
