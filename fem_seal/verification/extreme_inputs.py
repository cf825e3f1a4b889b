"""Arrays and numbers as they come from elsewhere: layouts, types, what is not finite."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from fem_seal.gap_file import load_gap
from fem_seal.grid import GridField
from fem_seal.scene import Scene
from fem_seal.verification.finding import Outcome, refusal, right, wrong
from fem_seal.verification.probe import flow, rough

LAST_DIGITS = 1e-13


def array_layouts() -> Outcome:
    """float32, Fortran order, read-only, strided and memory-mapped arrays."""
    values = rough((16, 16), 0.3).values.astype(np.float32)
    frozen = values.copy()
    frozen.setflags(write=False)
    layouts = [values, np.asfortranarray(values), frozen, np.repeat(values, 2, 0)[::2]]
    with TemporaryDirectory() as folder:
        np.save(Path(folder) / "gap.npy", values)
        layouts.append(np.load(Path(folder) / "gap.npy", mmap_mode="r"))
        leaks = [flow(GridField(layout, (1.0, 1.0), periodic=True)) for layout in layouts]
    bounds = np.array([[leak.lower, leak.upper] for leak in leaks])
    spread = float(np.abs(bounds / bounds[0] - 1).max())
    # Sums may differ in the last digit from run to run, with the alignment of the arrays.
    told = f"the same bounds to {spread:.0e}"
    same = spread < LAST_DIGITS and not frozen.flags.writeable
    return right("the same bounds to the last digits") if same else wrong(told)


def not_finite() -> Outcome:
    """NaN and infinity in a gap."""
    return _each_refused(
        {
            f"{bad}": lambda bad=bad: GridField(np.array([[1.0, bad], [1, 1]]), (1, 1))
            for bad in (np.nan, np.inf, -np.inf)
        }
    )


def negative_gap() -> Outcome:
    """A negative gap, in an array and in a file."""
    gap = np.ones((4, 4))
    gap[1, 2] = -1e-9

    def from_file() -> None:
        with TemporaryDirectory() as folder:
            path = Path(folder) / "gap.npz"
            np.savez(path, gap=gap, spacing=(1.0, 1.0))
            load_gap(path)

    return _each_refused(
        {
            "array": lambda: flow(GridField(gap, (1.0, 1.0))),
            "file": from_file,
        }
    )


def shapes_and_spacings() -> Outcome:
    """Empty, one- and three-dimensional arrays; zero, negative and infinite spacings."""
    good = np.ones((4, 4))
    return _each_refused(
        {
            "empty": lambda: GridField(np.ones((0, 4)), (1, 1)),
            "line": lambda: GridField(np.ones(4), (1, 1)),
            "volume": lambda: GridField(np.ones((2, 2, 2)), (1, 1)),
            **{
                f"spacing {s}": lambda s=s: GridField(good, (1.0, s))
                for s in (0.0, -1.0, np.inf, np.nan)
            },
        }
    )


def flow_numbers() -> Outcome:
    """Viscosity, pressure drop and tolerance of zero, negative, infinite and NaN."""
    gap = GridField(np.ones((4, 4)), (1.0, 1.0))
    cases = {}
    for bad in (0.0, -1.0, np.inf, np.nan):
        cases[f"viscosity {bad}"] = lambda bad=bad: flow(gap, viscosity=bad)
        cases[f"pressure drop {bad}"] = lambda bad=bad: flow(gap, pressure_drop=bad)
        cases[f"rtol {bad}"] = lambda bad=bad: flow(gap, rtol=bad)
    return _each_refused(cases)


def sides_that_do_not_repeat() -> Outcome:
    """Periodic sides of a gap that does not repeat."""
    gap = GridField(1 + np.random.default_rng(0).random((4, 4)), (1.0, 1.0))
    return _each_refused({"sides": lambda: flow(gap, sides="periodic")})


SURFACE = {
    "kind": "self-affine",
    "shape": [32, 32],
    "size": ["32 um", "32 um"],
    "hurst": 0.8,
    "long_wavelength": "16 um",
    "short_wavelength": "4 um",
    "rms_slope": 0.1,
}


def scene_numbers() -> Outcome:
    """Scenes: H outside (0, 1], cut-offs out of order or below the grid, areas outside [0, 1)."""
    surfaces = {
        "hurst 0": {"hurst": 0},
        "hurst 1.5": {"hurst": 1.5},
        "cut-offs": {"short_wavelength": "20 um"},
        "below the grid": {"short_wavelength": "0.5 um"},
        "beyond the cell": {"long_wavelength": "100 um"},
        "infinite": {"rms_slope": float("inf")},
    }
    cases = {name: _scene(SURFACE | change, 0.1) for name, change in surfaces.items()}
    cases |= {f"area {area}": _scene(SURFACE, area) for area in (-0.1, 1.0, float("nan"))}
    return _each_refused(
        {name: lambda scene=scene: Scene.from_mapping(scene) for name, scene in cases.items()}
    )


def _scene(surface: dict[str, object], area: float) -> dict[str, object]:
    return {
        "surface": surface,
        "solid": {"contact_modulus": "10 MPa"},
        "contact": {"area_fraction": area},
        "output": {"products": ["contact"]},
    }


def _each_refused(cases: dict) -> Outcome:
    """All of them must end in a clear error; the first message stands for them."""
    said = {name: refusal(work) for name, work in cases.items()}
    taken = [name for name, text in said.items() if text is None]
    if taken:
        return wrong(f"taken without a word: {', '.join(taken)}")
    return Outcome("refused", next(iter(said.values())))
