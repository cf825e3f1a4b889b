"""fem-seal new: the scene that it writes can be read, and has the properties of the file."""

import shlex
import tomllib
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from project import ROOT

from fem_seal import cli
from fem_seal.patch import Patch
from fem_seal.scene import Scene

HEIGHTS = 1e-6 * np.random.default_rng(1).normal(size=(24, 16))
STATED = ["--length-unit", "um", "--size", "24 um,16 um"]


pytestmark = pytest.mark.usefixtures("here")


def new(name, *options):
    assert cli.main(["new", name, *options]) == 0
    return tomllib.loads(Path(f"{Path(name).stem}.toml").read_text(encoding="utf-8"))


def test_instrument_that_says_everything(capsys):
    """Unit and steps stay in the file; the scene presses the same heights, without holes."""
    data = new(str(ROOT / "demos" / "scenes" / "o-ring-measured.txt"))
    assert "1149 missing (3.1 %); 781.25 nm by 781.25 nm apart" in capsys.readouterr().out
    surface = data["surface"]
    assert surface.pop("path").endswith("o-ring-measured.txt")
    steps = {"detrend": "plane", "fill": "harmonic", "make_periodic": "mirror"}
    assert surface == {"kind": "file"} | steps
    scene = Scene.from_file("o-ring-measured.toml")
    assert Patch(scene).surface.shape == (382, 382)
    assert cli.main(["surface", "o-ring-measured.toml"]) == 0
    text = Path("o-ring-measured.toml").read_text(encoding="utf-8")
    assert "#   Confocal profilometer" in text
    assert "yours" in text


def test_file_that_says_nothing(capsys):
    np.savetxt("map.txt", HEIGHTS * 1e6)
    data = new("map.txt")
    assert not {"unit", "size"} & data["surface"].keys()
    said = capsys.readouterr().out
    assert "still needs surface.unit and surface.size, which the file does not say" in said
    assert cli.main(["surface", "map.toml"]) == 2
    assert "have no unit" in capsys.readouterr().err
    # Options say it in its place.
    Path("map.toml").unlink()
    data = new("map.txt", *STATED)
    assert data["surface"]["unit"] == "um"
    patch = Patch(Scene.from_file("map.toml"))
    assert patch.prepared.steps[0].rms_height == pytest.approx(HEIGHTS.std(), rel=1e-12)
    assert patch.surface.spacing == pytest.approx((1e-6, 1e-6), rel=1e-12)


@pytest.mark.parametrize(("missing", "spikes"), [(383, 0), (38, 4)])
def test_a_scene_that_new_writes_may_fill_what_it_takes_away(missing, spikes):
    """Of nearly all points, and of a tenth with the spikes that are taken away as well."""
    values = HEIGHTS.copy()
    values.flat[:missing] = np.nan
    values.flat[values.size - 3 * spikes :: 3] = 1e-4 * np.arange(1, 1 + spikes)
    np.savez("map.npz", heights=values, spacing=(1e-6, 1e-6))
    new("map.npz")
    assert np.isfinite(Patch(Scene.from_file("map.toml")).surface.values).all()


def test_mark_of_missing_points():
    heights = HEIGHTS * 1e6
    heights[3:9, 2:12] = -9999
    np.savetxt("map.txt", heights)
    surface = new("map.txt", *STATED)["surface"]
    assert surface["missing"] == -9999
    # 60 of 384 points are more than the tenth that is filled without a word.
    assert 60 / 384 < surface["max_missing"] < 0.3
    assert Patch(Scene.from_file("map.toml")).prepared.steps[0].missing == 60


def test_map_that_repeats():
    """Its name needs quotes and escapes."""
    name = 'a "b" \\ µ \x7f.npz'
    np.savez(name, heights=HEIGHTS, spacing=[1e-6, 1e-6], periodic=True)
    assert new(name)["surface"] == {"kind": "file", "path": name, "detrend": "mean"}


def test_profiles():
    rows = HEIGHTS.T.ravel()[:200].reshape(100, 2) * 1e6
    x = np.arange(100) * 0.5
    np.savetxt("stylus.txt", np.column_stack([x, rows]), header="x [um] z [um]")
    surface = new("stylus.txt")["surface"]
    assert surface["kind"] == "profiles"
    assert Patch(Scene.from_file("stylus.toml")).surface.shape == (256, 256)


def test_profiles_without_x(capsys):
    """Their step is still needed; the scene has the place for it."""
    np.savetxt("stylus.txt", HEIGHTS.T.ravel()[:300] * 1e6)
    surface = new("stylus.txt", "--length-unit", "um")["surface"]
    assert "step" not in surface
    said = capsys.readouterr().out
    assert "1 profile of 300 samples\n" in said
    assert "still needs surface.step, which the file does not say" in said
    text = Path("stylus.toml").read_text(encoding="utf-8").replace("# step", "step")
    Path("stylus.toml").write_text(text, encoding="utf-8")
    assert Patch(Scene.from_file("stylus.toml")).surface.shape == (256, 256)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["map.toml"], "is a scene already"),
        (["map.txt", "--out", ""], "the name is empty"),
        (["none.txt"], "is not a file"),
        (["map.txt", "--out", "map.toml"], "map.toml is there already"),
        (["map.txt", "--out", "b.toml", "--size", "1 mm"], "surface.size[1] is missing"),
        (["map.txt", "--out", "b.toml", "--size", "0 mm,1 mm"], "must be greater than 0"),
        (["map.txt", "--out", "b.toml", "--length-unit", "kg"], "no unit of length"),
        (["empty.txt", "--out", "b.toml"], "all 12 points of empty.txt are missing"),
        (["words.txt", "--out", "b.toml"], "holds no line of numbers"),
        (["x.txt", "--size", "1 mm,1 mm"], "--size is of a map, and x.txt holds profiles"),
        (["inf.txt", "--out", "b.toml"], "1 of 6 values of inf.txt are infinite"),
    ],
)
def test_refused(arguments, message, here, refused):
    np.savetxt("map.txt", HEIGHTS)
    (here / "map.toml").write_text("")
    np.savetxt("x.txt", np.column_stack([np.arange(9), HEIGHTS[:9, 0]]), header="x [um] z [um]")
    (here / "words.txt").write_text("no numbers")
    (here / "inf.txt").write_text("0 1 5\n2 1e999 3\n")
    (here / "empty.txt").write_text("NODATA_value 0\n" + "0 0 0 0\n" * 3)
    assert message in refused("new", *arguments)


def test_commands_that_read_a_large_map_say_what_they_do(monkeypatch):
    heard = []

    @contextmanager
    def display():
        yield lambda stage, _: heard.append(stage)

    np.savetxt("map.txt", HEIGHTS * 1e6)
    for words in (["new", "map.txt", *STATED], ["surface", "map.toml"], ["run", "map.toml"]):
        heard.clear()
        monkeypatch.setattr(f"fem_seal.cli.{words[0]}.Display", display)
        assert cli.main([*words, *["--dry-run"] * (words[0] == "run")]) == 0
        assert heard


def test_table_of_a_flat_surface(capsys):
    """It has no spectrum, which is no failure."""
    np.savez("flat.npz", heights=np.full((8, 8), 1e-6), spacing=(1e-6, 1e-6))
    assert cli.main(["surface", "flat.npz", "--csv", "a.csv", "--out", "a.png"]) == 0
    assert "a flat surface has no spectrum" in capsys.readouterr().out
    table = Path("a.csv").read_text(encoding="utf-8").splitlines()
    assert table == ["# Sq = 0.0 m", "# Sdq = 0.0", "# Ssk = 0.0", "q [1/m],C [m^4],modes"]


def test_surface_of_a_file_without_a_scene(capsys):
    """The command that it prints, and that which this prints, can be typed as they stand."""
    np.savetxt("my map.txt", HEIGHTS * 1e6)
    assert cli.main(["surface", "my map.txt", *STATED, "--csv", "a.csv"]) == 0
    said = capsys.readouterr().out
    (command,) = (line for line in said.splitlines() if line.startswith("fem-seal new"))
    words = shlex.split(command.partition(" writes a scene")[0])
    assert words == ["fem-seal", "new", "my map.txt", *STATED]
    assert cli.main(words[1:]) == 0
    assert "fem-seal run 'my map.toml'" in capsys.readouterr().out
    assert "detrend mean" in said
    assert cli.main(["surface", "my map.txt", *STATED, "--set", "surface.detrend=plane"]) == 0
    assert "detrend plane" in capsys.readouterr().out
    assert cli.main(["surface", "my map.toml", "--length-unit", "um"]) == 2
    assert "are for a file of heights" in capsys.readouterr().err
