"""Small scenes for the tests of lifted contacts."""

import numpy as np

from fem_seal.coupling import lifted_state
from fem_seal.lifting import lifting_problem
from fem_seal.patch import Patch
from fem_seal.progress import silent
from fem_seal.scene import Scene

E_STAR = 1e7  # Pa


def scene(
    load=1.5e5, inlet=1e5, n=32, seed=1, solid=None, fluid=None, output=None, contact=None, **flow
):
    """Rough rubber under water: `load` and `inlet` above ambient in Pa, `n` samples a side."""
    pressures = {} if "inlet_pressure" in flow else {"pressure_drop": inlet}
    return Scene.from_mapping(
        {
            "surface": {
                **{"kind": "self-affine", "shape": [n, n], "size": [1e-4, 1e-4], "hurst": 0.8},
                **{"long_wavelength": 5e-5, "short_wavelength": 4e-4 / n, "rms_slope": 0.1},
                "seed": seed,
            },
            "solid": {"contact_modulus": E_STAR, **(solid or {})},
            "contact": contact or {"pressure": load},
            "fluid": fluid or {"viscosity": 1e-3},
            "flow": {"sides": "periodic", "lift": "resolved", **pressures, **flow},
            "output": {"products": ["leak_rate"], **(output or {})},
            # The tests are about the lift; the grid's entry would lift twice.
            "accuracy": {"contact_grid": False},
        }
    )


def problem_of(scene, surface=None):
    """Contact and flow of a scene, on its own surface or another."""
    surface = Patch(scene).surface if surface is None else surface
    return lifting_problem(scene, scene.load, scene.flow_settings, surface, silent)


def from_pressure(problem, pressure):
    """The state from a uniform fluid pressure."""
    return lifted_state(problem, start=np.full(problem.height.shape, pressure))
