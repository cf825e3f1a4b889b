"""What all tests share."""

from importlib.util import find_spec

import pytest
from hypothesis import HealthCheck, settings

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
