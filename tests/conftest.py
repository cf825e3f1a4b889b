"""What all tests share."""

from importlib.util import find_spec
from pathlib import Path

import pytest

# DOLFINx 0.5 to 0.7 must be imported through this module first, or VTK crashes later.
if find_spec("dolfinx"):
    import fem_seal.fenicsx  # noqa: F401

ROOT = Path(__file__).parents[1]


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


def write_toml(path: Path, scene: dict) -> Path:
    """Write sections of numbers, strings and lists; enough TOML for scenes."""
    lines = []
    for section, fields in scene.items():
        lines.append(f"[{section}]")
        lines.extend(f"{key} = {_toml(value)}" for key, value in fields.items())
    path.write_text("\n".join(lines) + "\n")
    return path


def _toml(value: object) -> str:
    if isinstance(value, str | Path):
        return f'"{value}"'
    if isinstance(value, list):
        return f"[{', '.join(map(_toml, value))}]"
    return str(value).lower() if isinstance(value, bool) else repr(value)
