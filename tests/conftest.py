"""What all tests share."""

import signal
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

# Modules that tests share lie beside the tests that need them most, under names that occur once
# (test_architecture.py), and are imported by these names from everywhere.
TESTS = Path(__file__).parent
# The letter of demos/ is a package of the checkout.
sys.path[:0] = [str(TESTS.parent), str(TESTS)]
sys.path[2:2] = sorted(str(path) for path in TESTS.iterdir() if path.is_dir())

from project import leak_scene, scene_of_samples, write_toml  # noqa: E402

from fem_seal import cli  # noqa: E402
from fem_seal.render import offscreen, plot, relief  # noqa: E402

_with_default = pytest.approx


def _relative(expected, **tolerances):
    """pytest.approx without its absolute tolerance of 1e-12, which holds any leak rate in m³/s.

    A test that compares with 0 gives `abs`.
    """
    if tolerances.get("abs") is None:
        tolerances = {"rel": 1e-6} | tolerances | {"abs": 0.0}
    return _with_default(expected, **tolerances)


pytest.approx = _relative

# Pictures of a third of the resolution: the same code draws them in a third of the time.
plot.DPI, relief.DPI, relief.WIDTH, offscreen.LONG_SIDE = 70, 70, 400, 400

# A shell starts what runs in the background with interrupts ignored, and a process passes that on:
# the commands that tests interrupt would not notice, and the tests would wait for ever.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# An example may compile a form or solve a contact. How long that takes says how busy the machine
# is, and nothing about the code.
settings.register_profile(
    "any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("any machine")

# DOLFINx 0.5 to 0.7 must be imported through this module first, or VTK crashes later.
if find_spec("dolfinx"):
    import fem_seal.fenicsx  # noqa: F401


def pytest_collection_modifyitems(items):
    """Begin with what starts mpirun: the longest test would be the last, with one core idle."""
    items.sort(key=lambda item: item.get_closest_marker("mpi") is None)


@pytest.fixture
def refused(tmp_path, capsys):
    """Function that runs a command of fem-seal which must end with one line and write nothing."""

    def refused(*arguments: object) -> str:
        """What it says; its status is 2."""
        before = sorted(tmp_path.rglob("*"))
        try:
            status = cli.main([str(argument) for argument in arguments])
        except SystemExit as end:
            status = end.code
        output, error = capsys.readouterr()
        assert (status, output) == (2, ""), error
        assert error.startswith("fem-seal")
        assert error.count("\n") == 1, error
        assert "Traceback" not in error
        assert sorted(tmp_path.rglob("*")) == before
        return error

    return refused


@pytest.fixture
def scene_of_gap(tmp_path):
    """Function that makes the scene of a gap from an array, with other sections beside it."""

    def scene(gap: object, spacing: tuple[float, float] = (1e-6, 1e-6), **sections: dict) -> dict:
        np.savez(tmp_path / "gap.npz", gap=gap, spacing=spacing)
        return leak_scene(gap={"path": str(tmp_path / "gap.npz")}) | sections

    return scene


@pytest.fixture
def small_scene() -> dict:
    """A scene that takes a fraction of a second: 32 x 32, elastic, leaking."""
    return scene_of_samples(32)


@pytest.fixture
def here(tmp_path, monkeypatch) -> Path:
    """An empty folder, in which the test runs."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def scene_file(small_scene, here) -> Path:
    """File of the small scene in the folder in which the test runs."""
    return write_toml(here / "scene.toml", small_scene)
