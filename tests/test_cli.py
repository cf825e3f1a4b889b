"""The commands: exit statuses, one line for bad input and nothing written, and the real chain."""

import errno
import json
import os
import re
import sys
from importlib.metadata import version
from io import BytesIO, TextIOWrapper
from pathlib import Path

import numpy as np
import pytest
from project import RING, leak_scene, printed_by, started, unwrapped, write_toml
from test_listings import REFERENCE

import fem_seal
from fem_seal import cli, drawing
from fem_seal.errors import InvalidInput, NotConverged
from fem_seal.patch import Patch
from fem_seal.render.patch import OF_LIFTED_CONTACT
from fem_seal.theory.closed_forms import piecewise_linear_channel

VISCOSITY, PRESSURE_DROP = 1e-3, 1e5  # the defaults of fem-seal leak


pytestmark = pytest.mark.usefixtures("here")


def run(*arguments):
    """Exit status of a command in this process."""
    try:
        return cli.main([str(argument) for argument in arguments])
    except SystemExit as end:
        return end.code


def below(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def read_result(folder):
    return json.loads((folder / "result.json").read_text())


def save_gap(path, gap, spacing=(1e-6, 1e-6), **more):
    np.savez(path, gap=gap, spacing=spacing, **more)
    return path


@pytest.fixture
def wedge(tmp_path):
    """Gap that falls linearly along the flow: Q is known in closed form."""
    gap = np.repeat(np.linspace(2e-6, 1e-6, 9)[:, None], 5, axis=1)
    return save_gap(tmp_path / "wedge.npz", gap)


def wedge_leak_rate():
    """Q = Ly Δp / (12 η Lx <g⁻³>)."""
    length, width = 8e-6, 4e-6
    cube = piecewise_linear_channel(np.array([2e-6, 1e-6]))
    return width * PRESSURE_DROP * cube / (12 * VISCOSITY * length)


@pytest.mark.parametrize("method", ["adaptive", "uniform", "finite-difference"])
def test_leak_of_a_wedge(wedge, tmp_path, method, capsys):
    """What --json prints is result.json to the last digit, and nothing else."""
    assert run("leak", wedge, "--method", method, "--rtol", "0.01", "--out", "out", "--json") == 0
    result = read_result(tmp_path / "out")
    assert json.loads(capsys.readouterr().out) == result
    leak, exact = result["leak_rate"], wedge_leak_rate()
    if method != "finite-difference":
        assert leak["lower"] <= exact * (1 + 1e-9)
        assert leak["upper"] >= exact * (1 - 1e-9)
        assert leak["upper"] - leak["lower"] <= 0.01 * np.sqrt(leak["upper"] * leak["lower"])
    else:
        # The default links are exact for a linear gap in series; eliminated to rounding.
        assert leak["value"] == pytest.approx(exact, rel=1e-12)
    assert (result["state"], result["method"]) == ("leaking", method)


@pytest.mark.parametrize("limit", [("--max-unknowns", "2e1"), ("--max-seconds", "1 ns")])
def test_limit_is_reached(tmp_path, capsys, limit):
    """Exit status 3, one line, and the best bounds are written."""
    x = np.linspace(0, 2 * np.pi, 33)
    gap = 1e-6 * (1 + 0.9 * np.sin(x)[:, None] * np.sin(x))
    save_gap("gap.npz", gap)
    assert run("leak", "gap.npz", "--rtol", "1e-4", *limit, "--out", "out") == 3
    result = read_result(tmp_path / "out")
    assert result["converged"] is False
    assert 0 <= result["leak_rate"]["lower"] < result["leak_rate"]["upper"]
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert result["reason"] in error


def test_every_field_of_some_sections_is_an_option_of_leak(wedge, tmp_path):
    """Two ways to say the same: options, and a scene with these fields."""
    gas = {"viscosity": "18 uPa s", "molar-mass": "28 g/mol", "temperature": "20 degC"}
    drive = {"inlet-pressure": "1.2 bar", "outlet-pressure": "1e5", "method": "finite-difference"}
    options = {"kind": "gas", "slip": "no"} | gas | drive
    words = [f"--{key}={text}" for key, text in options.items()]
    assert run("leak", wedge, *words, "--out", "a") == 0
    scene = {
        "gap": {"path": str(wedge)},
        "fluid": {"kind": "gas", "slip": False} | {k.replace("-", "_"): v for k, v in gas.items()},
        "flow": {k.replace("-", "_"): v for k, v in drive.items()},
        "output": {"products": ["leak_rate"]},
    }
    scene["flow"]["outlet_pressure"] = 1e5
    write_toml(tmp_path / "same.toml", scene)
    assert run("run", "same.toml", "--out", "b") == 0
    first, second = (read_result(tmp_path / name) for name in "ab")
    assert first["gas"] == second["gas"]
    assert first["provenance"]["scene"] == second["provenance"]["scene"]


@pytest.mark.parametrize("unit", [1e-6, 1.0])
def test_heights_in_another_unit_than_the_grid_are_said(tmp_path, capsys, unit):
    """A plane gap has one slope: here 5 % along and 12 % across, 13 % in all, or 1e6 as much."""
    i, j = np.indices((6, 5))
    save_gap("gap.npz", (1 + 0.05 * i + 0.12 * j) * unit)
    assert run("leak", "gap.npz", "--out", "out") == 0
    assert read_result(tmp_path / "out")["gap_slope"] == pytest.approx(0.13 * unit / 1e-6, rel=1e-9)
    assert ("the same unit?" in unwrapped(capsys.readouterr().out)) is (unit == 1.0)


def test_sides_follow_from_the_gap_and_walls_of_a_periodic_one_are_said(capsys):
    """The way from inlet to outlet crosses y = 0: sealed by walls, leaking without them."""
    gap = np.zeros((8, 8))
    gap[:4, :2] = gap[3:, 6:] = 1e-6
    for periodic, walls in ((True, True), (True, False), (False, True), (False, False)):
        save_gap("gap.npz", gap, periodic=periodic)
        options = ("--sides", "wall") if walls else ()
        assert run("leak", "gap.npz", *options, "--representation", "constant") == 0
        lines = dict(
            line.split(maxsplit=1) for line in unwrapped(capsys.readouterr().out).splitlines()
        )
        joined = periodic and not walls
        assert lines["state"] == ("leaking" if joined else "sealed")
        sides = "periodic sides" if joined else "wall sides"
        assert lines["flow"].endswith(sides if walls else f"{sides} (default)")
        assert ("sides" in lines) is (periodic and walls)
        assert "--sides periodic" in lines.get("sides", "--sides periodic")


# Commands, and words of the one line that each says.
REFUSED = {
    "": "",
    "rn a.toml": "invalid choice: 'rn'",
    "study exakt": "fem-seal study: argument STUDY: invalid choice: 'exakt'",
    "run a.toml --over": "run: unrecognized arguments: --over; see fem-seal run --help",
    "study trade a.toml --over": "--over; see fem-seal study trade --help",
    "run none.toml": "none.toml",
    "run wedge.npz": "wedge.npz",
    "run .": "",
    "run map.csv": "fem-seal new map.csv writes a scene",
    "run scene.toml --jobs 2": "distribute the patches of a [seal], and this scene has none",
    "run scene.toml --memory 1": "distribute the patches of a [seal], and this scene has none",
    "run scene.toml --memory nan": "memory = nan GB must be finite and above 0 (--memory)",
    "sweep scene.toml --vary flow.rtol=0.1,0.2 --memory inf": "must be finite and above 0",
    "mesh scene.toml": "has no [shape]",
    "surface gap.toml": "a gap in place of a surface",
    "study trade ring.toml --out out": "take [shape] out of the scene",
    "study cross-validation ring.toml --out out": "take [shape] out of the scene",
    "study trade scene.toml --set flow.method=adaptive --set accuracy.total=0.2 --out out": (
        "take accuracy.total out of the scene"
    ),
    "sweep scene.toml --vary contact.area_fraction=0.1,1.5": "contact.area_fraction = 1.5",
    "sweep scene.toml --vary flow.rtol=0.1 --out /proc/here": "/proc/here",
    "sweep scene.toml --vary flow.rtol=0.1 --out scene.toml": "scene.toml",
    "sweep scene.toml --vary flow.rtol=0.1,0.2 --jobs 0": "--jobs",
    "sweep scene.toml --vary flow.rtol=0.1,0.2 --part 3/2": "--part",
    "sweep scene.toml --vary flow.rtol=0.1,0.2 --part 0/2": "--part",
    "render .": "",
    "render nowhere": "nowhere",
    "leak": "",
    "leak none.npz": "none.npz",
    "leak .": "",
    "leak two\nlines.npz": "lines.npz",
    "leak wedge.npz --unknown": "--unknown",
    "leak wedge.npz --kind gas": "a gas needs its viscosity",
    "leak wedge.npz --kind gas --viscosity=2e-5 --molar-mass=0.029 --temperature=293": (
        "flow.inlet_pressure is missing"
    ),
    "leak wedge.npz --rtol small": "small",
    "leak wedge.npz --strict": "limit",
    "leak wedge.npz --max-unknowns 1.5": "1.5",
    "leak wedge.npz --products cake": "cake",
    "leak wedge.npz --products sensitivity": "needs a scene with an elastic [contact]",
    "leak wedge.npz --outlet-pressure -1bar": "flow.outlet_pressure = '-1bar' must be at least 0",
    "leak wedge.npz --products mesh --method finite-difference": "finite-difference",
    # Without a folder they would be left out without a word.
    "leak wedge.npz --products leak_rate,pictures": "'pictures' of --products",
    "leak wedge.npz --unit mol/s": "mol/s",  # of a liquid
    "leak wedge.npz --out wedge.npz": "wedge.npz is a file; choose another folder",
    "leak wedge.npz --out wedge.npz/below": "wedge.npz/below cannot be written",
    "leak wedge.npz --out /proc/here": "the output folder /proc/here cannot be written",
    f"leak wedge.npz --out {'x' * 300}": "xxx cannot be written",
}


def test_refused(wedge, scene_file, tmp_path, refused, monkeypatch):
    """Before anything is computed. No abbreviation is taken for an option."""
    write_toml(tmp_path / "ring.toml", RING)
    write_toml(tmp_path / "gap.toml", leak_scene(gap={"path": "wedge.npz"}))
    np.savetxt("map.csv", np.eye(4), delimiter=",")
    monkeypatch.setattr(Patch, "contact", property(lambda patch: pytest.fail("computed")))
    for command, words in REFUSED.items():
        assert words in refused(*filter(None, command.split(" "))), command


def test_contact_that_does_not_converge(small_scene, tmp_path, capsys):
    small_scene["contact"]["max_iterations"] = 1
    write_toml(tmp_path / "scene.toml", small_scene)
    assert run("run", "scene.toml", "--out", "out") == 3
    assert capsys.readouterr().err.count("\n") == 1
    assert below(tmp_path) == ["scene.toml"]


@pytest.mark.render
def test_reference_scene_runs(tmp_path, capsys, monkeypatch):
    """The scene of docs/reference/scene.md, on fewer samples; its pictures are drawn afterwards."""
    (tmp_path / "reference.toml").write_text(REFERENCE)
    smaller = ("--set", "surface.shape=[24, 24]", "--set", "surface.short_wavelength=10 um")
    products = 'output.products=["contact", "leak_rate", "mesh"]'
    assert run("run", "reference.toml", *smaller, "--set", products, "--out", "out") == 0
    files = ["contact.npz", "flow.vtu", "result.json"]
    assert below(tmp_path / "out") == files
    result = read_result(tmp_path / "out")
    assert 0 < result["leak_rate"]["lower"] <= result["leak_rate"]["upper"]
    assert len(result["levels"]) > 1
    # The contact file is a gap file: the same gap again, equal to the solver's tolerance.
    assert run("leak", "out/contact.npz", "--out", "leak") == 0
    again = read_result(tmp_path / "leak")["leak_rate"]
    for bound in ("lower", "upper"):
        assert again[bound] == pytest.approx(result["leak_rate"][bound], rel=1e-6)
    assert run("render", "out", "--all") == 0
    again = read_result(tmp_path / "out")
    assert again | {"files": result["files"]} == result
    details = ["bounds.png", "mesh.png", "pressure.png", "relief.png"]
    assert below(tmp_path / "out") == sorted([*files, *OF_LIFTED_CONTACT, *details])
    assert {*OF_LIFTED_CONTACT, *details} < set(again["files"])
    # Without the mesh the flow cannot be drawn, which is said.
    (tmp_path / "out" / "flow.vtu").unlink()
    monkeypatch.setattr(drawing, "draw_pictures", lambda _, field, *more: field and 1 / 0)
    capsys.readouterr()
    assert run("render", "out") == 0
    first, second = capsys.readouterr().out.splitlines()
    assert "flow.png" not in first
    assert "flow.png is left as it was" in second


def test_nothing_is_drawn_or_compared_of_a_film_that_is_lifted_off(tmp_path, capsys):
    (tmp_path / "reference.toml").write_text(REFERENCE)
    settings = "contact.pressure=1 kPa", "surface.shape=[24, 24]", "surface.short_wavelength=10 um"
    overrides = [word for setting in settings for word in ("--set", setting)]
    assert run("run", "reference.toml", *overrides, "--out", "off") == 0
    capsys.readouterr()
    assert run("render", "off") == 0
    assert capsys.readouterr().out.startswith("no pictures")
    assert run("study", "cross-validation", "reference.toml", *overrides, "--out", "study") == 2
    assert "the gap is lifted off" in capsys.readouterr().err
    vary = "--vary", "contact.pressure=1 kPa,1 GPa"
    study = "study", "cross-validation", "reference.toml", *overrides, *vary, "--out", "study"
    assert run(*study) == 2
    said = capsys.readouterr()
    assert "pressure=1 GPa: sealed" in said.out
    assert "none of the 2 gaps leaks" in said.err


def test_version_is_that_of_the_package():
    """By the module too, where the script is not on the path."""
    printed = printed_by("-m", "fem_seal", "--version")
    assert printed == f"fem-seal {fem_seal.__version__}\n"
    assert version("fem_seal") == fem_seal.__version__


@pytest.mark.parametrize(
    "command",
    [["letter", "--size", "3"], ["percolation"], ["study", "saddle"], ["study", "closing"]],
)
def test_commands_that_are_scripts_now_name_them(command, capsys):
    """Whatever stands behind them."""
    assert run(*command) == 2
    script = re.search(r"python (?:-m )?(demos\S+)", capsys.readouterr().err)[1]
    path = script if script.endswith(".py") else script.replace(".", "/") + ".py"
    assert (Path(fem_seal.__file__).parents[1] / path).exists()


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (MemoryError("8 TB"), "not enough memory for this size (8 TB); choose a smaller one"),
        (OSError(errno.ENOSPC, "No space left", "out"), "No space left: out"),
        (InvalidInput("a is not b"), "a is not b"),
        (NotConverged("after 10 steps"), "after 10 steps"),
        (KeyboardInterrupt(), "interrupted; nothing half-written is left"),
    ],
)
def test_every_end_has_one_line_and_a_status_of_the_table(error, words, wedge, monkeypatch, capsys):
    """What the system refuses is refused like bad input, and the help says so."""

    def ends(*_):
        raise error

    monkeypatch.setattr(cli, "use_writable_cache", ends)
    status = run("leak", wedge)
    assert capsys.readouterr().err == f"fem-seal: {words}\n"
    meaning = {NotConverged: "not converged", KeyboardInterrupt: "interrupted"}
    assert cli.EXIT_STATUS[status].startswith(meaning.get(type(error), "refused: bad input, or "))
    assert run("--help") == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert f"{status}: {cli.EXIT_STATUS[status]}." in printed


def test_every_help_says_what_for_and_how(capsys):
    for name in cli.COMMANDS:
        assert run(name, "--help") == 0
        text = " ".join(capsys.readouterr().out.split())
        example = re.search(rf"Example: fem-seal {name}( .*)?$", text)
        assert example, name


def test_result_is_printed_where_the_terminal_knows_no_plus_minus(wedge, monkeypatch):
    """With an encoding that lacks ±, the line has another sign and nothing is lost."""
    terminal = TextIOWrapper(BytesIO(), encoding="ascii")
    monkeypatch.setattr(sys, "stdout", terminal)
    assert run("leak", wedge) == 0
    terminal.flush()
    assert b"leak rate" in terminal.buffer.getvalue()


def test_reader_of_the_output_may_go(wedge):
    """As `head` does: no message, no crash report of a library, and no error where Python writes at
    the end."""
    environment = os.environ | {"PYTHONUNBUFFERED": ""}
    command = ("-m", "fem_seal", "leak", wedge, "--method", "finite-difference")
    running = started(*command, env=environment)
    running.stdout.close()
    with running.stderr as stderr:
        assert stderr.read() == ""
    assert running.wait() == 0


def test_errors_of_a_scene_have_a_line_each(small_scene, tmp_path, capsys):
    """Of all sections, misspelt keys first."""
    small_scene["surface"] |= {"shape": [32, 0], "hrust": 1}
    small_scene["contact"] = {"pressure": "1 MPas"}
    assert run("run", write_toml(tmp_path / "a.toml", small_scene)) == 2
    head, *lines = capsys.readouterr().err.splitlines()
    assert head.endswith("a.toml has 3 errors:")
    for line, words in zip(lines, ("hrust is not", "shape[1] = 0 must", "MPas"), strict=True):
        assert line.startswith("  ")
        assert words in line


def test_leak_says_what_it_assumes(wedge, capsys):
    assert run("leak", wedge) == 0
    line = capsys.readouterr().out.splitlines()[0]
    assert line == (
        "assumed    viscosity 1 mPa s (--viscosity), pressure drop 100 kPa (--pressure-drop)"
    )
    assert run("leak", wedge, "--viscosity", "2 mPa s", "--pressure-drop", "1 bar") == 0
    assert "assumed" not in capsys.readouterr().out


def test_strict(wedge, capsys):
    """Above the limit; undecided, and within one: test_accuracy.py."""
    assert run("leak", wedge, "--limit", "0.01 ml/h", "--strict") == 4
    assert "above limit (--strict)" in capsys.readouterr().err


def test_result_keeps_scene_and_command_as_written(small_scene, tmp_path):
    """With comments and spaces of the scene file, which is read once, as from a pipe."""
    text = "# my seal\n" + write_toml(tmp_path / "a.toml", small_scene).read_text()
    reader, written = os.pipe()
    os.write(written, text.encode())
    os.close(written)
    path = f"/dev/fd/{reader}"
    command = ["run", path, "--set", "output.products=['contact']", "--out", "out"]
    assert run(*command) == 0
    provenance = read_result(tmp_path / "out")["provenance"]
    assert provenance["scene_text"] == text
    assert provenance["command"] == command
