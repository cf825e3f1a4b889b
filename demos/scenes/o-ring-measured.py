"""Make the file of o-ring-measured.toml, as if a confocal profilometer had written it.

192 x 192 points of a moulded rubber face, 150 µm wide: random roughness, the tilt of the sample on
its stage, and 3 % of the points lost, in specks and alone. The text is that of an instrument set to
German: semicolons, decimal commas, units in the header, `***` where a point is missing.

    python demos/scenes/o-ring-measured.py FOLDER
"""

import sys
from pathlib import Path

import numpy as np

from fem_seal.surface import Spectrum, self_affine

POINTS, STEP = 192, 0.78125  # points along a side of the map, and their distance [µm]
HEADER = f"""Confocal profilometer;demonstration
Date;12.03.2024 10:15
Objective;50x
X points;{POINTS}
Y points;{POINTS}
X step [µm];0,78125
Y step [µm];0,78125
Z unit;µm

"""


def heights() -> np.ndarray:
    """Heights (192, 192) [µm], x first; NaN where a point was lost."""
    rng = np.random.Generator(np.random.Philox(5))
    size = 256 * STEP
    cell = self_affine(
        Spectrum(0.8, 12.5, 4 * STEP), (256, 256), (size, size), rms_slope=0.3, seed=5
    )
    x = np.arange(POINTS)
    map_ = cell.values[:POINTS, :POINTS] + 0.004 * x[:, None] - 0.002 * x + 12.5
    for i, j in rng.integers(0, POINTS - 3, size=(60, 2)):
        map_[i : i + 3, j : j + 3] = np.nan
    map_[rng.random(map_.shape) < 0.016] = np.nan
    return map_


def write(folder: Path) -> None:
    """Write o-ring-measured.txt; x runs along the lines of the file."""
    lines = (
        ";".join("***" if np.isnan(z) else f"{z:.3f}".replace(".", ",") for z in line)
        for line in heights().T
    )
    text = HEADER + "\n".join(lines) + "\n"
    (folder / "o-ring-measured.txt").write_text(text, encoding="utf-8-sig", newline="\r\n")


if __name__ == "__main__":
    write(Path(sys.argv[1]))
