"""Draw the pictures of the pages again, small enough for a page: python docs/images/make.py.

flow.png is that of `make demo`, lift.png that of the same scene with its fluid's pressure resolved.
Both are drawn by `fem-seal run`, then made smaller and given fewer colours.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

from fem_seal import Scene
from fem_seal.job import run

HERE = Path(__file__).parent
SCENE = HERE.parents[1] / "demos" / "scenes" / "first.toml"
SIZES = {"flow.png": (801, 128), "lift.png": (900, 256)}  # width in pixels, colours


def small(picture: Path, width: int, colours: int, path: Path) -> None:
    """Write a picture with fewer pixels and colours."""
    with Image.open(picture) as image:
        whole = image.convert("RGB")
    size = width, round(whole.height * width / whole.width)
    shrunk = whole.resize(size, Image.Resampling.LANCZOS)
    shrunk.quantize(colours, dither=Image.Dither.NONE).save(path, optimize=True)


if __name__ == "__main__":
    for name, lift in (("flow.png", "none"), ("lift.png", "resolved")):
        with TemporaryDirectory() as folder:
            run(Scene.from_file(SCENE, [f"flow.lift={lift}"]), Path(folder) / "result")
            small(Path(folder) / "result" / name, *SIZES[name], HERE / name)
