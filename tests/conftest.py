"""What all tests share."""

import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# Modules that tests share lie beside the tests that need them most, under names that occur once
# (test_architecture.py), and are imported by these names from everywhere.
TESTS = Path(__file__).parent
sys.path[:0] = [str(TESTS), *sorted(str(path) for path in TESTS.iterdir() if path.is_dir())]

# An example may compile a form or solve a contact. How long that takes says how busy the machine
# is, and nothing about the code.
settings.register_profile(
    "any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("any machine")

# DOLFINx 0.5 to 0.7 must be imported through this module first, or VTK crashes later.
if find_spec("dolfinx"):
    import fem_seal.fenicsx  # noqa: F401


@pytest.fixture
def small_scene() -> dict:
    """A scene that takes a fraction of a second: 32 x 32, elastic, leaking."""
    return {
        "surface": {
            "kind": "self-affine",
            "shape": [32, 32],
            "size": ["32 um", "32 um"],
            "hurst": 0.8,
            "long_wavelength": "16 um",
            "short_wavelength": "4 um",
            "rms_slope": 0.1,
            "seed": 1,
        },
        "solid": {"contact_modulus": "10 MPa"},
        "contact": {"area_fraction": 0.1},
        "fluid": {"viscosity": "1 mPa s"},
        "flow": {"pressure_drop": "1 bar", "sides": "periodic", "method": "finite-difference"},
        "output": {"products": ["contact", "leak_rate"]},
    }
