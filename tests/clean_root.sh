#!/bin/sh
# Runs a command, else demo and tests, on another release of Debian, in a clean root:
#
#     tests/clean_root.sh trixie
#     tests/clean_root.sh sid make demo
#
# Needs root, debootstrap and a network. The last commit is what is tested. The root stays in
# .cache/RELEASE, 4 GB; a second run uses it again with a fresh checkout. Debian's packages come
# from the mirror of this machine's own sources, or from that of the variable MIRROR.
set -eu
cd "$(dirname "$0")/.."
release=$1
shift
[ $# -gt 0 ] || set -- make demo test
root=$PWD/.cache/$release

if [ ! -e "$root/complete" ]; then
    # Security updates have a mirror of their own, which comes after that of the release.
    mirror=${MIRROR:-$(apt-get indextargets --format '$(REPO_URI)' 'Identifier: Packages' | head -n 1)}
    [ -n "$mirror" ] || {
        echo "clean_root.sh: apt knows no mirror of Debian here; name one in MIRROR" >&2
        exit 2
    }
    rm -rf "$root"
    debootstrap --variant=minbase --include=ca-certificates,make,git "$release" "$root" "$mirror"
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
    root=$1
    shift
    mount -t proc proc "$root/proc"
    mount --rbind /dev "$root/dev"
    mount --rbind /sys "$root/sys"
    exec env -i HOME=/root LANG=C.UTF-8 PATH=/usr/sbin:/usr/bin:/sbin:/bin \
        PIP_CERT=/etc/ssl/certs/ca-certificates.crt \
        chroot "$root" sh -c "cd /fem_seal && exec \"\$@\"" sh "$@"' sh "$root" "$@"
