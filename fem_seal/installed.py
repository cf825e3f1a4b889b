"""Reasons for a failed import: a missing package, or an environment variable that hides it."""

import os
import sys
from importlib.util import find_spec
from pathlib import Path

# Environment variables that change the search path; each can hide an installed package.
PYTHON_VARIABLES = ("PYTHONPATH", "PYTHONHOME")
# Debian's dolfinx.pth makes Python look for DOLFINx below PETSC_DIR, or here if that is not set.
DEBIAN_PETSC = Path("/usr/lib/petsc")


def hidden_by_petsc_dir() -> bool:
    """Whether Debian's DOLFINx is installed and PETSC_DIR makes Python look elsewhere."""
    elsewhere = os.environ.get("PETSC_DIR")
    there = (DEBIAN_PETSC / "lib/python3/dist-packages/dolfinx").is_dir()
    return bool(elsewhere) and there and not find_spec("dolfinx")


def how_to_get_fenicsx() -> str:
    """Remedy that makes `import dolfinx` work here."""
    if hidden_by_petsc_dir():
        return (
            f"it is installed, but PETSC_DIR = {os.environ['PETSC_DIR']!r} hides it: unset "
            "PETSC_DIR"
        )
    return "on Debian: apt-get install python3-dolfinx" + _variables(", unless ", " hides it")


def how_to_add(package: str) -> str:
    """Command that adds a package of PyPI to this Python."""
    # Where setup.sh has installed: a newer numpy, which some packages require, breaks petsc4py.
    if (Path(sys.prefix) / "debian.txt").is_file():
        return f".venv/bin/pip install -c .venv/debian.txt {package}"
    return f"python -m pip install {package}"


def why_not_imported(error: ImportError) -> str:
    """Sentence on a failed import; names the environment variables that may cause it."""
    hint = _variables("", " may hide the right one: unset it", "fem-seal doctor says what to do")
    if hidden_by_petsc_dir():
        hint = how_to_get_fenicsx()
    reason = str(error).strip().partition("\n")[0]
    return f"the package {error.name or ''} cannot be imported ({reason}); {hint}"


def _variables(before: str, after: str, otherwise: str = "") -> str:
    set_here = [f"{name} = {os.environ[name]!r}" for name in PYTHON_VARIABLES if name in os.environ]
    return f"{before}{' or '.join(set_here)}{after}" if set_here else otherwise
