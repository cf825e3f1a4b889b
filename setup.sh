#!/bin/sh
# Prepares .venv on Debian 12 or 13: FEniCSx from Debian, everything else from PyPI.
# Run it as root or with sudo at hand; running it again does nothing that is already done.
# OpenBLAS halves the time of finite differences: Debian's own BLAS is the reference one.
set -eu
cd "$(dirname "$0")"

sudo=
[ "$(id -u)" = 0 ] || sudo=sudo
packages="python3-dolfinx python3-gmsh python3-meshio python3-scipy python3-venv python3-pip libegl1 libopenblas0-serial"

missing() {
    for package in "$@"; do
        dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || echo "$package"
    done
}

# The user may work with another DOLFINx, of conda or of a container, which Debian's would not help.
if [ -n "$(missing python3-dolfinx)" ] && [ "$(command -v python3)" != /usr/bin/python3 ] &&
    python3 -c 'import dolfinx' 2>/dev/null; then
    echo "setup.sh: $(command -v python3) has a DOLFINx: install fem_seal beside it with" \
        "\"pip install .\" (docs/guide/installing.md), or leave that environment to install Debian's" >&2
    exit 2
fi

if [ -n "$(missing $packages)" ]; then
    export DEBIAN_FRONTEND=noninteractive
    $sudo apt-get update -q
    # Debian 13 has no python3-pyfftw; pip brings it there.
    fftw=$(apt-cache madison python3-pyfftw | grep -q . && echo python3-pyfftw || true)
    $sudo apt-get install -q -y --no-install-recommends $packages $fftw
fi

# Debian's own interpreter: another python3 on PATH cannot see python3-dolfinx.
# A stray PETSC_DIR hides it as well.
unset PETSC_DIR SLEPC_DIR PYTHONPATH PYTHONHOME || true
[ -x .venv/bin/python ] || /usr/bin/python3 -m venv --system-site-packages .venv

# The programs in .venv name it by its absolute path, which a renamed or copied checkout changes.
# pip writes fem-seal anew below.
here=$(pwd -P)
there=$(sed -n '1s|^#!\(.*\)/.venv/bin/python.*|\1|p' .venv/bin/pip)
if [ -n "$there" ] && [ "$there" != "$here" ]; then
    grep -lI "$there/.venv" .venv/bin/* | while read -r file; do
        sed -i "s|$there/.venv|$here/.venv|g" "$file"
    done
fi

# petsc4py is compiled against Debian's numpy: pip must not shadow it with a newer one.
/usr/bin/python3 - >.venv/debian.txt <<'PY'
from importlib.metadata import version

for package in ("numpy", "scipy", "mpi4py", "petsc4py"):
    print(f"{package}=={version(package)}")
PY
.venv/bin/python -m pip install -q --disable-pip-version-check -c .venv/debian.txt -e '.[test]'
echo "$here" >.venv/ready
