"""Numbers and sentences of sixteen small scenes, to be the same before and after a change of form.

    python tests/frozen.py write before.json
    python tests/frozen.py write after.json
    python tests/frozen.py compare before.json after.json

Both records are made on one machine and stay outside the repository: a number that an earlier
version printed is no reference for a test.
"""

import argparse
import json
import sys
from collections.abc import Iterator
from math import isclose
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from project import scene_of_samples, write_toml

from fem_seal import run
from fem_seal.results.words import summary_of
from fem_seal.scene import Scene
from fem_seal.sweep import sweep

RTOL = 1e-9
# Different in each run, or a matter of the machine.
LEFT_OUT = {"seconds", "peak_memory_bytes", "provenance", "cost", "version", "finished"}
GAS = {
    "fluid": {
        "kind": "gas",
        "viscosity": "18 uPa s",
        "molar_mass": "28 g/mol",
        "temperature": "20 degC",
        "slip": "kinetic",
    },
    "flow": {
        "inlet_pressure": "1.2 bar",
        "outlet_pressure": "1 bar",
        "sides": "periodic",
        "rtol": 0.03,
    },
}
ROUND = {
    "shape": {
        "kind": "face-seal",
        "inner_radius": "20 mm",
        "outer_radius": "25 mm",
        "mesh_size": "2 mm",
        "gap_expression": "2e-6 * (1 + 0.3 * cos(3 * theta)) + 2e-5 * (x + 0.025)",
    },
    "fluid": {"viscosity": "1 mPa s"},
    "flow": {"pressure_drop": "2 bar", "rtol": 0.02},
    "output": {"products": ["leak_rate"]},
}


def rough(**sections: dict) -> dict:
    """Scene of a rough periodic surface of 64 x 64 samples, with other fields in some sections."""
    scene = scene_of_samples(64)
    scene["flow"] = {"pressure_drop": "0.2 bar", "sides": "periodic"}
    if not sections.keys() & {"accuracy", "seal"}:
        scene["flow"]["rtol"] = 0.03
    return {name: scene.get(name, {}) | sections.get(name, {}) for name in {**scene, **sections}}


def products(*names: str) -> dict:
    return {"products": list(names)}


def pressed(pressure: str, **sections: dict) -> dict:
    """The rough scene under a pressure in place of a contact area."""
    return rough(**sections) | {"contact": {"pressure": pressure}}


def scenes(folder: Path) -> dict[str, dict]:
    """Scenes by name; files that they read are written into a folder."""
    x, y = np.meshgrid(np.linspace(0, 1, 48), np.linspace(0, 1, 40), indexing="ij")
    heights = 1e-6 * (np.sin(9 * x + 4 * y) + np.cos(14 * y - 5 * x * x) + 3 * x)
    np.save(folder / "heights.npy", np.where((x - 0.3) ** 2 + y**2 < 0.005, np.nan, heights))
    np.save(folder / "gap.npy", np.maximum(0, 1e-6 + heights - 3e-6 * x))
    stated = {"unit": "m", "size": ["48 um", "40 um"], "periodic": False}
    measured = {"kind": "file", "path": folder / "heights.npy", **stated, "detrend": "quadratic"}
    measured |= {"fill": "harmonic", "make_periodic": "mirror"}
    gap = rough(gap={"path": folder / "gap.npy", **stated}, flow={"sides": "wall"})
    gas = pressed("0.11 MPa") | GAS
    limit = {"leak_rate": "1e-6 ml/h"}
    known = {"contact": {"pressure": "10 %"}, "heights": "5 %"}
    seal = {"leak_path": "0.5 mm", "circumference": "150 mm", "pressure_profile": "hertz"}
    seal |= {"patches": 2, "rtol": 0.2}
    return {
        "patch": pressed("0.11 MPa", flow={"lift": "none"}, limit=limit),
        "area": rough(output=products("contact", "leak_rate", "constriction", "trapped_volume")),
        "gap": {name: gap[name] for name in ("gap", "fluid", "flow", "output")},
        "bearing": rough(contact={"model": "bearing", "area_fraction": 0.2}),
        "lift": pressed("0.11 MPa"),
        "range": pressed("0.11 MPa", flow={"lift": "range"}),
        "gas with slip": {**gas, "output": products("contact", "leak_rate", "constriction")},
        "seal": pressed("0.11 MPa", seal=seal, limit=limit, output=products("seal")),
        "shape": ROUND,
        "tolerances": pressed("0.11 MPa", flow={"lift": "none"}, tolerances=known),
        "tensor": rough(output=products("conductivity_tensor", "hydraulic_aperture", "leak_rate")),
        "threshold": rough(output=products("contact", "threshold")),
        "accuracy": rough(accuracy={"total": 0.4, "max_refinement": 2}),
        "measured map": rough() | {"surface": measured},
        "finite differences": rough(flow={"method": "finite-difference"}),
        "sweep": rough(),
    }


def answer(name: str, scene: Path, folder: Path) -> dict:
    """Numbers of a scene, and its sentences by their labels."""
    if name == "sweep":
        fractions = [("0.05",), ("0.2",), ("0.5",)]
        table = sweep(scene, (("contact.area_fraction",), fractions), folder).table
        return {"points": [point.row for point in table]}
    result = run(Scene.from_file(scene), folder)
    words: dict[str, list[str]] = {}
    for label, text in summary_of(result):
        words.setdefault(label, []).append(text)
    return {"numbers": json.loads((folder / "result.json").read_text()), "words": words}


def write(path: Path) -> None:
    """Compute all scenes and write their answers into one JSON file."""
    answers = {}
    with TemporaryDirectory() as name:
        folder = Path(name)
        for number, (title, sections) in enumerate(scenes(folder).items()):
            scene = write_toml(folder / f"{number}.toml", sections)
            answers[title] = answer(title, scene, folder / str(number))
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
