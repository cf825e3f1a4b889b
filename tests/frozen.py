"""Numbers and sentences of sixteen small scenes, to be the same before and after a change of form.

    python tests/frozen.py write before.json
    python tests/frozen.py write after.json
    python tests/frozen.py compare before.json after.json

Both records are made on one machine and stay outside the repository: a number that an earlier
version printed is no reference for a test.
"""

import argparse
import json
import shutil
import sys
from collections.abc import Iterator
from math import isclose
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from project import ROOT, leak_scene, scene_of_samples, write_toml

from fem_seal import run
from fem_seal.results.words import summary_of
from fem_seal.scene import Scene
from fem_seal.sweep import sweep

RTOL = 1e-9
# Different in each run, or a matter of the machine.
LEFT_OUT = {"seconds", "peak_memory_bytes", "provenance", "cost", "version", "finished"}
PATCH = scene_of_samples(64)
PATCH["flow"] = {"pressure_drop": "0.2 bar", "sides": "periodic", "rtol": 0.03}
PRESSED = "contact.area_fraction= & contact.pressure=0.11 MPa"
DRY = f"{PRESSED} & flow.lift=none"
LIMIT = "limit.leak_rate=1e-6 ml/h"
GAS = (
    "fluid.kind=gas & fluid.viscosity=18 uPa s & fluid.molar_mass=28 g/mol & fluid.slip=kinetic & "
    "fluid.temperature=20 degC & flow.pressure_drop= & flow.inlet_pressure=1.2 bar & "
    "flow.outlet_pressure=1 bar"
)
SEAL = (
    "seal.leak_path=0.5 mm & seal.circumference=150 mm & seal.pressure_profile=hertz & "
    "seal.patches=2 & seal.rtol=0.2 & flow.rtol="
)
MEASURED = {
    **{"kind": "file", "path": "heights.npy", "unit": "m", "size": ["48 um", "40 um"]},
    **{"periodic": False, "detrend": "quadratic", "fill": "harmonic", "make_periodic": "mirror"},
}
# Scenes by name: file, and what is set in it. All files are written together.
SCENES = {
    "patch": ("patch", f"{DRY} & {LIMIT}"),
    "area": ("patch", "output.products=[contact, leak_rate, constriction, trapped_volume]"),
    "gap": ("gap", ""),
    "bearing": ("patch", "contact.model=bearing & contact.area_fraction=0.2"),
    "lift": ("patch", PRESSED),
    "range": ("patch", f"{PRESSED} & flow.lift=range"),
    "gas with slip": ("patch", f"{PRESSED} & {GAS} & output.products=[leak_rate, constriction]"),
    "seal": ("patch", f"{PRESSED} & {SEAL} & {LIMIT} & output.products=[seal]"),
    "shape": ("face-seal", "flow.rtol=0.02"),
    "tolerances": ("patch", f"{DRY} & tolerances.contact.pressure=10 % & tolerances.heights=5 %"),
    "tensor": ("patch", "output.products=[conductivity_tensor, hydraulic_aperture, leak_rate]"),
    "threshold": ("patch", "output.products=[contact, threshold]"),
    "accuracy": ("patch", "accuracy.total=0.4 & accuracy.max_refinement=2 & flow.rtol="),
    "measured map": ("map", ""),
    "finite differences": ("patch", "flow.method=finite-difference"),
    "sweep": ("patch", ""),
}


def write_files(folder: Path) -> None:
    """Write the files that the scenes read."""
    x, y = np.meshgrid(np.linspace(0, 1, 48), np.linspace(0, 1, 40), indexing="ij")
    heights = 1e-6 * (np.sin(9 * x + 4 * y) + np.cos(14 * y - 5 * x * x) + 3 * x)
    np.save(folder / "heights.npy", np.where((x - 0.3) ** 2 + y**2 < 0.005, np.nan, heights))
    gap = np.maximum(0, 1e-6 + heights - 3e-6 * x)
    np.savez(folder / "gap.npz", gap=gap, spacing=(1e-6, 1e-6))
    shutil.copy(ROOT / "demos/scenes/face-seal.toml", folder)
    write_toml(folder / "patch.toml", PATCH)
    write_toml(folder / "map.toml", PATCH | {"surface": MEASURED})
    write_toml(folder / "gap.toml", leak_scene(gap={"path": "gap.npz"}))


def answer(name: str, folder: Path) -> dict:
    """Numbers of a scene, and its sentences by their labels."""
    file, settings = SCENES[name]
    path, out = folder / f"{file}.toml", folder / name
    if name == "sweep":
        fractions = [("0.05",), ("0.2",), ("0.5",)]
        table = sweep(path, (("contact.area_fraction",), fractions), out).table
        return {"points": [point.row for point in table]}
    result = run(Scene.from_file(path, list(filter(None, settings.split(" & ")))), out)
    words: dict[str, list[str]] = {}
    for label, text in summary_of(result):
        words.setdefault(label, []).append(text)
    return {"numbers": json.loads((out / "result.json").read_text()), "words": words}


def write(path: Path) -> None:
    """Compute all scenes and write their answers into one JSON file."""
    with TemporaryDirectory() as name:
        write_files(Path(name))
        answers = {title: answer(title, Path(name)) for title in SCENES}
    path.write_text(json.dumps(answers, indent=1))


def leaves(value: object, place: str = "") -> Iterator[tuple[str, object]]:
    """Numbers and texts of nested parts, with the keys that lead to them."""
    if isinstance(value, dict | list):
        parts = value.items() if isinstance(value, dict) else enumerate(value)
        for key, part in parts:
            if key not in LEFT_OUT:
                yield from leaves(part, f"{place}/{key}")
    else:
        yield place, value


def differences(before: dict, after: dict) -> list[str]:
    """One line for each number or text that has changed, gone or is new."""
    old, new = dict(leaves(before)), dict(leaves(after))
    lines = [f"gone     {place}: {old[place]}" for place in old if place not in new]
    lines += [f"new      {place}: {new[place]}" for place in new if place not in old]
    for place in old:
        if place in new and not same(old[place], new[place]):
            lines.append(f"changed  {place}: {old[place]} -> {new[place]}")
    return lines


def same(one: object, other: object) -> bool:
    if isinstance(one, float) and isinstance(other, float):
        return isclose(one, other, rel_tol=RTOL)
    return one == other


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("do", choices=("write", "compare"))
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE")
    arguments = parser.parse_args()
    if arguments.do == "write":
        write(arguments.files[0])
    else:
        before, after = (json.loads(path.read_text()) for path in arguments.files)
        lines = differences(before, after)
        print("\n".join(lines) or "nothing has changed")
        sys.exit(bool(lines))
