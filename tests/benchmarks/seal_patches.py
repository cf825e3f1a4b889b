"""What a patch of a seal costs: CPU seconds of contacts, flows, bounds between loads, coarser grid.

    python tests/benchmarks/seal_patches.py [--samples 512] [--patches 2] [--rtol 0.1] [--map]

A uniform profile of 0.6 MPa against 2 bar of water, under which K falls sixtyfold along the path.
With --map the patches are a mirrored map of 320 x 240 points and its twins, under 0.5 MPa.
"""

import argparse
import resource
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import numpy as np

from fem_seal.scene import Scene
from fem_seal.surface import Spectrum, self_affine
from fem_seal.upscaling import solved_patches
from fem_seal.upscaling.patch_conductivity import LoadedPatch
from fem_seal.upscaling.realizations import realizations

sys.path.append(str(Path(__file__).parents[1]))
from project import scene_of_samples


def scene(samples: int, patches: int, rtol: float) -> Scene:
    """Eight long waves along a patch of 0.512 mm, four samples in the shortest wave."""
    side = 0.512  # mm
    sections = scene_of_samples(samples, f"{4 * side / samples} mm")
    sections["surface"] |= {"size": [f"{side} mm", f"{side} mm"], "rms_slope": 0.3}
    sections["surface"] |= {"long_wavelength": f"{side / 8} mm"}
    return Scene.from_mapping(
        sections
        | {
            "contact": {"pressure": "0.6 MPa"},
            "flow": {"inlet_pressure": "3 bar", "outlet_pressure": "1 bar"},
            "output": {"products": ["seal"]},
            "seal": {
                **{"leak_path": "4 mm", "circumference": "100 mm", "pressure_profile": "uniform"},
                **{"patches": patches, "rtol": rtol},
            },
        }
    )


def of_map(folder: Path, patches: int, rtol: float) -> Scene:
    """A map of 320 x 240 points without a window, eight points in the shortest wave."""
    side, step = 512, 1e-6  # points, and their distance [m]
    spectrum = Spectrum(0.8, side / 8 * step, 8 * step)
    cell = self_affine(spectrum, (side, side), (side * step, side * step), rms_slope=0.3, seed=1)
    path = folder / "map.npz"
    np.savez(path, heights=cell.values[:320, :240], spacing=[step, step], periodic=False)
    sections = scene(side, patches, rtol).to_mapping()
    sections["surface"] = {"kind": "file", "path": str(path), "make_periodic": "mirror"}
    sections["contact"] = {"pressure": "0.5 MPa"}
    return Scene.from_mapping(sections)


STAGES = {
    "contacts": (LoadedPatch, "_state"),
    "flows": (LoadedPatch, "_leak_rate"),
    "bounds between loads": (LoadedPatch, "_enclosure"),
    "coarser grid": (solved_patches, "_contact_error"),
}
spent: dict[str, list[float]] = {}


def timed(stage: str, owner: object, name: str) -> None:
    """Let a function add its CPU seconds to those of a stage; the stages inside it are its own."""
    function = getattr(owner, name)

    def measured(*arguments: object) -> object:
        start, outside = process_time(), {key: len(times) for key, times in spent.items()}
        try:
            return function(*arguments)
        finally:
            inside = sum(sum(times[outside.get(key, 0) :]) for key, times in spent.items())
            if owner is solved_patches:
                for key, times in spent.items():
                    del times[outside.get(key, 0) :]
                inside = 0.0
            spent.setdefault(stage, []).append(process_time() - start - inside)

    setattr(owner, name, measured)


def main(samples: int, patches: int, rtol: float, map: bool) -> None:
    """Solve patch by patch; print what each cost, and the memory of the process so far."""
    for stage, place in STAGES.items():
        timed(stage, *place)
    with TemporaryDirectory() as folder:
        asked = of_map(Path(folder), patches, rtol) if map else scene(samples, patches, rtol)
        solve(realizations(asked))


def solve(patches: tuple[Scene, ...]) -> None:
    """Solve patches one by one; print what each cost."""
    for number, one in enumerate(patches, 1):
        spent.clear()
        start = process_time()
        task = solved_patches.PatchTask("", "", one)
        solved = task.compute(None, lambda stage, detail: None, None)
        whole = process_time() - start
        table = solved.table
        parts = ", ".join(
            f"{stage} {sum(times):.1f} ({' '.join(f'{t:.1f}' for t in times if t > 0.05)})"
            for stage, times in spent.items()
        )
        K = np.sqrt(table.lower * table.upper)
        print(f"patch {number}: {whole:.1f} CPU s, {len(table.loads)} net loads; {parts}")
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        print(f"  K from {K[0]:.3e} to {K[-1]:.3e}, converged {not solved.reason}, {memory:.2f} GB")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=512)
    parser.add_argument("--patches", type=int, default=2)
    parser.add_argument("--rtol", type=float, default=0.1)
    parser.add_argument("--map", action="store_true")
    main(**vars(parser.parse_args()))
