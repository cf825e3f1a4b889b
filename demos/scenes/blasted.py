"""Make the map of blasted.toml, as if measured: a blasted steel face in three formats.

64 x 48 points of random roughness with flattened peaks, the tilt and bow of a sample on a stage,
noise, and points that the instrument has lost: a speck and some singles. The map does not repeat.

    python demos/scenes/blasted.py FOLDER
"""

import sys
from pathlib import Path

import h5py
import numpy as np
from scipy.io import netcdf_file

from fem_seal.surface import Spectrum, self_affine

SHAPE, SPACING = (64, 48), (1.0, 1.0)  # µm


def heights() -> np.ndarray:
    """Heights (64, 48) [µm], NaN where a point was lost."""
    rng = np.random.Generator(np.random.Philox(11))
    spectrum = Spectrum(0.8, 64.0, 4.0, 32.0)
    cell = self_affine(spectrum, (128, 128), (128.0, 128.0), rms_height=0.25, seed=11)
    rough = cell.values[: SHAPE[0], : SHAPE[1]]
    x, y = np.meshgrid(*(np.arange(n) / n for n in SHAPE), indexing="ij")
    map_ = np.minimum(rough, 0.3) + 0.8 * x - 0.3 * y - 0.4 * (x - 0.5) ** 2
    map_ += 1e-3 * (rng.random(SHAPE) - 0.5)
    map_[rng.random(SHAPE) < 0.01] = np.nan
    map_[20:26, 30:35] = np.nan
    # Instruments count in steps. Rounding also hides differences between compilers and FFTs.
    return np.round(map_, 6)


def write(folder: Path) -> None:
    """Write blasted.nc in µm (in the layout of SurfaceTopography), .h5 in nm and .npz in m."""
    map_ = heights()
    with netcdf_file(folder / "blasted.nc", "w", version=2) as file:
        for name, n, d in zip("xy", SHAPE, SPACING, strict=True):
            file.createDimension(name, n)
            axis = file.createVariable(name, "f8", (name,))
            axis[...] = np.arange(n) * d
            axis.length, axis.unit, axis.periodic = n * d, "um", 0
        for name, kind, values in (
            ("heights", "f8", np.nan_to_num(map_)),
            ("mask", "b", np.isnan(map_)),
        ):
            file.createVariable(name, kind, ("x", "y"))[...] = values
        file.variables["heights"].unit = "um"
    with h5py.File(folder / "blasted.h5", "w") as file:
        file.create_dataset("heights", data=map_ * 1e3, track_times=False).attrs["unit"] = "nm"
        file.create_dataset("spacing", data=SPACING, track_times=False).attrs["unit"] = "um"
        file["periodic"] = False
    spacing = np.array(SPACING) * 1e-6
    np.savez(folder / "blasted.npz", heights=map_ * 1e-6, spacing=spacing, periodic=False)


if __name__ == "__main__":
    write(Path(sys.argv[1]))
