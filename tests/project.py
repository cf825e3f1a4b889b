"""Folders and modules of the project, writing of scene files, environments of other processes."""

import ast
import csv
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fem_seal.parallel import OF_MPI

if TYPE_CHECKING:
    from fem_seal.film import Film
    from fem_seal.leak_rate import LeakRate

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "fem_seal"
FIRST = ROOT / "demos" / "scenes" / "first.toml"
# For mpirun as root, with more processes than cores, where there may be no network.
MPI_ENVIRONMENT = {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_btl": "^tcp",
    "OMPI_MCA_mpi_yield_when_idle": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "OMP_NUM_THREADS": "1",
}
# In another process: pictures are drawn as small as `conftest` draws them here.
SMALL_PICTURES = """from fem_seal.render import offscreen, plot
plot.DPI, offscreen.LONG_SIDE = 70, 400"""


def leak_rate(film: "Film", **options: Any) -> "LeakRate":
    """`flow.leak_rate` with the fields of its settings beside its own options."""
    from fem_seal import flow

    names = {field.name for field in fields(flow.FlowSettings)}
    own = {name: options.pop(name) for name in names.intersection(options)}
    return flow.leak_rate(film, flow.FlowSettings(**own), **options)


def refused_calls(*rows: tuple[Callable[[], object], str]) -> Callable[..., None]:
    """Test of calls that are refused in one sentence, which has the words beside each."""
    import pytest

    from fem_seal.errors import InvalidInput

    @pytest.mark.parametrize(("call", "words"), rows)
    def test(call, words, here):
        with pytest.raises(InvalidInput, match=words) as refusal:
            call()
        assert "\n" not in str(refusal.value)
        assert "pydantic" not in str(refusal.value)

    return test


def observed_orders(errors: Sequence[float]) -> np.ndarray:
    """Orders between errors of meshes or steps, each half as large as the one before."""
    return np.log2(np.divide(errors[:-1], errors[1:]))


@cache
def trees() -> dict[Path, ast.Module]:
    """Syntax trees of all modules of the package."""
    modules = sorted(PACKAGE.rglob("*.py"))
    return {path: ast.parse(path.read_text(encoding="utf-8")) for path in modules}


def imported(tree: ast.Module) -> Iterator[str]:
    """Full names of all imports, inside functions and for type checking as well."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def alone() -> dict[str, str]:
    """Environment for another process that is not part of an MPI run.

    Once MPI has started in this process, its variables would make a child believe that mpirun had
    started it.
    """
    return {name: value for name, value in os.environ.items() if not name.startswith(OF_MPI)}


def printed_by(*command: object, cwd: Path = ROOT, **variables: str) -> str:
    """What another process prints, which must end well; by Python if no program is named."""
    words = [str(word) for word in command]
    words = words if words[0] == "mpirun" else [sys.executable, *words]
    options = {"capture_output": True, "text": True, "timeout": 600, "check": False}
    done = subprocess.run(words, env=alone() | variables, cwd=cwd, **options)
    assert done.returncode == 0, done.stderr
    return done.stdout


def started(*arguments: object, **options: object) -> subprocess.Popen:
    """Another Python, with pipes for what it prints."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    command = [sys.executable, *map(str, arguments)]
    return subprocess.Popen(command, **pipes | {"env": alone()} | options)


def scene_of_samples(n: int, **surface: object) -> dict:
    """Sections of a scene with n x n samples 1 um apart: rough, elastic, leaking."""
    return {
        "surface": {
            "kind": "self-affine",
            "shape": [n, n],
            "size": [f"{n} um", f"{n} um"],
            "hurst": 0.8,
            "long_wavelength": f"{n // 2} um",
            "short_wavelength": "4 um",
            "rms_slope": 0.1,
            "seed": 1,
            **surface,
        },
        "solid": {"contact_modulus": "10 MPa"},
        "contact": {"area_fraction": 0.1},
        "fluid": {"viscosity": "1 mPa s"},
        "flow": {"pressure_drop": "1 bar", "sides": "periodic", "method": "finite-difference"},
        "output": {"products": ["contact", "leak_rate"]},
    }


# A gas that slips by the kinetic law, unless that is said otherwise.
AIR = {"kind": "gas", "viscosity": 1.8e-5, "molar_mass": 0.029, "temperature": 293.0}


def leak_scene(**sections: dict) -> dict:
    """Sections of a scene of a liquid, with that of its gap or its shape."""
    return {
        "fluid": {"viscosity": 1e-3},
        "flow": {"pressure_drop": 1e5},
        "output": {"products": ["leak_rate"]},
    } | sections


def toml(scene: dict) -> str:
    """Numbers, strings, lists and tables as TOML, sections below the other keys."""
    lines = [f"{key} = {_toml(one)}" for key, one in scene.items() if not isinstance(one, dict)]
    for section, content in scene.items():
        if isinstance(content, dict):
            lines += [f"[{section}]", *(f"{key} = {_toml(one)}" for key, one in content.items())]
    return "\n".join(lines) + "\n"


# A face seal that is meshed and solved in a second.
RING = {
    "shape": {
        **{"kind": "face-seal", "inner_radius": "20 mm", "outer_radius": "25 mm"},
        **{"mesh_size": "2 mm", "gap": "3 um"},
    },
    "fluid": {"viscosity": "1 mPa s"},
    "flow": {"pressure_drop": "1 bar", "rtol": 0.3},
}


def write_toml(path: Path, scene: dict) -> Path:
    """Write a scene file."""
    path.write_text(toml(scene))
    return path


def _toml(value: object) -> str:
    match value:
        case dict():
            return f"{{{', '.join(f'{key} = {_toml(inner)}' for key, inner in value.items())}}}"
        case list():
            return f"[{', '.join(map(_toml, value))}]"
        case bool():
            return str(value).lower()
        case str() | Path():
            return json.dumps(str(value))
    return repr(value)


def damaged(text: str, place: Sequence[str | int], value: object) -> str:
    """JSON in which another value stands at a place, given by its keys from the outside in."""
    data = part = json.loads(text)
    for key in place[:-1]:
        part = part[key]
    part[place[-1]] = value
    return json.dumps(data)


def unwrapped(text: str) -> str:
    """Printed lines of a result, each on a line of its own."""
    return re.sub(r"\n {11}", " ", text)


# A number as it is printed, and a line without its numbers.
NUMBER = r"\d[\d.]*(?:e[+-]?\d+)?"


def without_numbers(text: str) -> str:
    return re.sub(NUMBER, "#", text)


def rows(folder: str | Path) -> list[dict[str, str]]:
    """Rows of the table of a sweep without what differs from run to run."""
    with (Path(folder) / "sweep.csv").open(newline="") as file:
        table = list(csv.DictReader(file))
    for row in table:
        del row["seconds"], row["peak_memory_bytes"]
    return table
