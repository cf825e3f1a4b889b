#!/bin/sh
# Builds the image of Dockerfile and runs the first scene in it, without an image from elsewhere:
# debootstrap makes the one that it starts from (make image).
#
# Needs root, debootstrap, buildah and a network. The last commit is what goes into the image.
# Everything is below .cache/image, 8 GB, and removed at the end.
set -eu
cd "$(dirname "$0")/.."
work=$PWD/.cache/image
release=$(sed -n 's/^FROM debian:\(.*\)-slim$/\1/p' Dockerfile)
mirror=${MIRROR:-$(apt-get indextargets --format '$(REPO_URI)' 'Identifier: Packages' | head -n 1)}

mkdir -p "$work"
trap 'rm -rf "$work"' EXIT
git clone -q . "$work/checkout"
debootstrap --variant=minbase "$release" "$work/base" "$mirror"
# The machine's certificates, as in clean_root.sh, where no package of Debian overwrites them.
cp -L /etc/ssl/certs/ca-certificates.crt "$work/base/etc/machine.crt"

# As root, without the kernel's name spaces, which a container would not give to another.
buildah() {
    command buildah --root "$work/images" --runroot "$work/run" --storage-driver vfs "$@"
}
export BUILDAH_ISOLATION=chroot
base=$(buildah from scratch)
buildah add -q "$base" "$work/base" /
buildah config --env PIP_CERT=/etc/machine.crt "$base"
buildah commit -q --rm "$base" "debian:$release-slim"
rm -rf "$work/base"
buildah build --pull-never -t fem_seal "$work/checkout"

# `docker run --rm -v SCENES:/scenes fem_seal run first.toml`
mkdir "$work/scenes"
cp demos/scenes/first.toml "$work/scenes"
container=$(buildah from --pull-never fem_seal)
program=$(sed -n 's/^ENTRYPOINT \["\(.*\)"\]$/\1/p' Dockerfile)
buildah run -v "$work/scenes:/scenes" "$container" "$program" run first.toml
ls "$work/scenes/results/first/flow.png"
