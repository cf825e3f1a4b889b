"""Draw the pictures of README and of the guide again: python docs/images/make.py [NAME.png ...].

Each is drawn by the command that stands beside it on its page, then made smaller and given fewer
colours. Without names all are drawn, and the figures of the letter's page, which take ten CPU
minutes.
"""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
COLOURS = 256
NOT_CONVERGED = 3  # exit status of fem-seal
FEM_SEAL = "-m fem_seal"
FIRST = "demos/scenes/first.toml"
# Width in pixels; arguments of Python (of several commands with && between them), in a folder with
# demos and meshes; the file that they draw.
PICTURES = {
    "flow.png": (801, f"{FEM_SEAL} run {FIRST} --out made", "made/flow.png"),
    "lift.png": (900, f"{FEM_SEAL} run {FIRST} --out made", "made/lift.png"),
    "limit.png": (800, "demos/when_is_a_limit_kept.py", "out/limit.png"),
    "map.png": (
        1000,
        f"{FEM_SEAL} surface demos/scenes/o-ring-measured.txt --out look.png",
        "look.png",
    ),
    "seal.png": (
        1000,
        f"{FEM_SEAL} run demos/scenes/o-ring.toml --out made",
        "made/seal.png",
    ),
    "flange.png": (900, f"{FEM_SEAL} run demos/scenes/flange.toml --out made", "made/flow.png"),
    "surface.png": (
        1000,
        f"{FEM_SEAL} surface demos/scenes/blasted.toml --out surface.png",
        "surface.png",
    ),
    "closing.png": (
        1100,
        f"demos/closing_contact.py {FIRST} --loads 12 --out made",
        "made/closing.png",
    ),
    "sweep.png": (
        900,
        f"{FEM_SEAL} sweep {FIRST} --set surface.shape=[128,128] --vary "
        "contact.pressure=0.05MPa,0.1MPa,0.15MPa,0.2MPa,0.25MPa,0.3MPa,0.35MPa "
        "--vary surface.seed=1..8 --picture --out made",
        "made/sweep.png",
    ),
    "when_lift_matters.png": (900, "demos/when_does_the_fluid_matter.py", "out/lift.png"),
    "newton.png": (900, "demos/how_the_lift_is_solved.py", "out/newton.png"),
    "gas.png": (800, "demos/gas_that_slips.py", "out/gas_that_slips.png"),
    "relief.png": (
        900,
        f"{FEM_SEAL} run {FIRST} --out made --set "
        'output.products=["leak_rate","constriction","pictures","mesh"] && '
        f"{FEM_SEAL} render made --all",
        "made/relief.png",
    ),
    "price.png": (
        1000,
        f"{FEM_SEAL} study trade {FIRST} --set surface.shape=[64,64] --set surface.seed=2 "
        "--set surface.long_wavelength=50um --set surface.short_wavelength=12.5um "
        "--set contact.pressure=0.12MPa --out made",
        "made/trade.png",
    ),
}
LETTER = "-m demos.letter.reproduce --size 1024 --seeds 1 --only currents pictures grids"
PICTURES |= {
    f"../letter/{name}.png": (width, f"{LETTER} --out made", f"made/{name}.png")
    for name, width in (("fig1", 1100), ("fig2", 1200), ("fig3", 1300))
}


def small(picture: Path, width: int, path: Path) -> None:
    """Write a picture with fewer pixels and colours."""
    with Image.open(picture) as image:
        whole = image.convert("RGB")
    size = width, round(whole.height * width / whole.width)
    shrunk = whole.resize(size, Image.Resampling.LANCZOS)
    # MAXCOVERAGE keeps the colours of thin lines, k-means those of smooth ground.
    few = shrunk.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, kmeans=3, dither=Image.Dither.NONE)
    few.save(path, optimize=True)


def make(arguments: str, names: list[str]) -> None:
    """Draw the pictures of some commands in a folder of its own, and put them into their places."""
    with TemporaryDirectory() as folder:
        for needed in ("demos", "meshes"):
            (Path(folder) / needed).symlink_to(ROOT / needed)
        for command in arguments.split(" && "):
            done = subprocess.run([sys.executable, *command.split()], cwd=folder, check=False)
            # A sweep draws its picture also if some of its points have not converged.
            if done.returncode != NOT_CONVERGED:
                done.check_returncode()
        for name in names:
            width, _, drawn = PICTURES[name]
            small(Path(folder) / drawn, width, HERE / name)


if __name__ == "__main__":
    wanted = sys.argv[1:] or list(PICTURES)
    for arguments in dict.fromkeys(PICTURES[name][1] for name in wanted):
        make(arguments, [name for name in wanted if PICTURES[name][1] == arguments])
