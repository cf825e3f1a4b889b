"""Other codes, each run in a process of its own from the environment that `make peers` makes.

* Tamaas 2.9.0 (L. Frérot et al., J. Open Source Softw. 5, 2121 (2020)): contact. Its wheel is
  serial, with FFTW built without SIMD.
* ContactMechanics 1.8.3: contact, by constrained conjugate gradients.
* reynoldsflow 0.1.3: flow, by finite volumes and hypre.
"""

import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from fem_seal.grid import GridField

# Tamaas and ContactMechanics want a newer numpy than Debian's petsc4py, which reynoldsflow uses.
FLOW_PYTHON, CONTACT_PYTHON = (
    Path(__file__).parents[2] / f".venv-peers/{name}/bin/python" for name in ("flow", "contact")
)
TOLERANCE = 1e-6
# The peak that getrusage gives is inherited from the parent process.
PEAK = """
def peak():
    with open("/proc/self/status") as status:
        return int(next(s for s in status if s.startswith("VmHWM:")).split()[1])
"""
FLOW = """
import json, sys, time
import numpy as np
from reynoldsflow import transport
transport.solve_fluid_problem(np.ones((8, 8)), solver="petsc-cg.hypre")
gaps = np.load(sys.argv[1])
base, started = peak(), time.perf_counter()
kept, pressure, flux = transport.solve_fluid_problem(gaps, solver="petsc-cg.hypre")
seconds = time.perf_counter() - started
value = transport.compute_total_flux(kept, flux, len(gaps))[0]
print(json.dumps({"value": value, "unknowns": int((kept > 0).sum()), "seconds": seconds,
                  "memory": (peak() - base) / 1e3}))
"""
# Each contact code takes heights, size and load (E* = 1) and leaves the pressure. A small contact
# before the measured one loads the libraries.
_CONTACT = """
import json, sys, time
import numpy as np
{imports}
def solve(heights, size, load, tolerance):
{solve}
file = np.load(sys.argv[1])
solve(np.random.default_rng(0).random((16, 16)), (1.0, 1.0), 0.1, 1e-3)
started = time.process_time()
pressure = solve(file["heights"], tuple(file["size"]), float(file["load"]), float(sys.argv[3]))
seconds = time.process_time() - started
np.save(sys.argv[2], pressure)
print(json.dumps({{"seconds": seconds}}))
"""
CONTACT = {
    "tamaas": _CONTACT.format(
        imports="import tamaas as tm\ntm.set_log_level(tm.LogLevel.error)",
        solve="""
    model = tm.Model(tm.model_type.basic_2d, list(size), list(heights.shape))
    model.E, model.nu = 1.0, 0.0
    solver = tm.PolonskyKeerRey(model, np.array(heights), tolerance)
    solver.max_iter = 20000
    solver.solve(load)
    return np.array(model.traction)
""",
    ),
    # It stops by penetration, here at the tolerance times the rms height.
    "contact-mechanics": _CONTACT.format(
        imports="""
from ContactMechanics import PeriodicFFTElasticHalfSpace
from ContactMechanics.Optimization import constrained_conjugate_gradients
from SurfaceTopography import Topography
""",
        solve="""
    substrate = PeriodicFFTElasticHalfSpace(heights.shape, 1.0, size)
    done = constrained_conjugate_gradients(
        substrate, Topography(np.array(heights), size, periodic=True),
        external_force=load * size[0] * size[1], pentol=tolerance * heights.std())
    assert done.success, done.message
    return np.array(done.jac) * heights.size / (size[0] * size[1])
""",
    ),
}


def run(python: str | Path, code: str, *arguments: object) -> dict:
    """Run a piece of code in a process of its own and read the JSON it prints last."""
    command = [str(python), "-c", PEAK + code, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError((done.stderr.splitlines() or ["no message"])[-1])
    return json.loads(done.stdout.splitlines()[-1])


def contact(
    code: str, heights: GridField, load: float, tolerance: float = TOLERANCE
) -> tuple[np.ndarray, float]:
    """Contact pressure (E* = 1) of another code, and its CPU seconds."""
    with tempfile.TemporaryDirectory() as folder:
        given, taken = Path(folder) / "surface.npz", Path(folder) / "pressure.npy"
        np.savez(given, heights=heights.values, size=heights.size, load=load)
        seconds = run(CONTACT_PYTHON, CONTACT[code], given, taken, tolerance)["seconds"]
        return np.load(taken), seconds


def flow(gap: np.ndarray) -> dict:
    """Leak rate of reynoldsflow on a square of unit side, K = g³, with unknowns and seconds."""
    with tempfile.TemporaryDirectory() as folder:
        given = Path(folder) / "gap.npy"
        np.save(given, gap)
        return run(FLOW_PYTHON, FLOW, given)


def gap_of(pressure: np.ndarray, heights: GridField, load: float) -> tuple[np.ndarray, float]:
    """Gap of any code's pressure (E* = 1), up to a constant, and its duality gap.

    The duality gap Σ p (g - min g) / (h_rms Σ p) is computed here alike for all.
    """
    pressure = np.maximum(pressure, 0)
    pressure = pressure * (load / pressure.mean())
    (nx, ny), (dx, dy) = heights.shape, heights.spacing
    q = 2 * np.pi * np.hypot(np.fft.fftfreq(nx, dx)[:, None], np.fft.rfftfreq(ny, dy)[None, :])
    q[0, 0] = np.inf
    gap = np.fft.irfft2(2 / q * np.fft.rfft2(pressure), s=heights.shape) - heights.values
    apart = np.vdot(pressure, gap - gap.min()) / (pressure.sum() * heights.values.std())
    return gap - np.vdot(pressure, gap) / pressure.sum(), float(apart)


def linear_samples(gap: np.ndarray, factor: int) -> np.ndarray:
    """Values of the P1 gap at the centres of `factor`² squares per pixel, a power of two.

    `gap` is periodic. The centres are the odd vertices of a grid twice as fine.
    """
    fine = GridField(gap, (1.0, 1.0), periodic=True)
    for _ in range(factor.bit_length()):
        fine = fine.refined()
    return fine.values[1::2, 1::2]
