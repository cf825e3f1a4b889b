"""Exact solutions of Reynolds' equation ∇·(K ∇p) = 0, to test any solver.

K is the film conductivity; a function of conductivities returns a conductivity in the same unit.
"""

import numpy as np

from fem_seal.errors import InvalidInput


def piecewise_linear_channel(gap: np.ndarray) -> float:
    """Cube of the equivalent uniform gap, 1/<g⁻³>, of a channel whose gap varies along the flow.

    The gap (n,) is linear between equidistant samples; where it goes from a to b, the mean of g⁻³
    is (a + b)/(2 a² b²). 0 if a sample is in contact.
    """
    g = np.asarray(gap, dtype=float)
    if not np.all(g > 0):
        return 0.0
    a, b = g[:-1], g[1:]
    return float(1 / np.mean((a + b) / (2 * a**2 * b**2)))


def cosine_channel(amplitude: float, *, across: bool) -> float:
    """Conductivity of the gap 1 + a cos(kx) over that of the gap 1, for whole wavelengths.

    If the crests lie across the flow, 1/<g⁻³> = (1 - a²)^(5/2) / (1 + a²/2) (integrals of A.
    Sommerfeld, Z. Math. Phys. 50, 97 (1904)); if along it, <g³> = 1 + 3 a²/2.
    """
    a = amplitude
    if not 0 <= a <= 1:
        raise InvalidInput(f"the amplitude of a cosine channel must lie in [0, 1], got {a}")
    return (1 - a**2) ** 2.5 / (1 + a**2 / 2) if across else 1 + 1.5 * a**2


def checkerboard(K1: float, K2: float) -> float:
    """Conductivity √(K1 K2) of a checkerboard of two phases.

    It holds for every isotropic two-phase medium that does not change if the phases are swapped (J.
    B. Keller, J. Math. Phys. 5, 548 (1964); A. M. Dykhne, Sov. Phys. JETP 32, 63 (1971)).
    """
    return float(np.sqrt(K1) * np.sqrt(K2))


def four_phase_checkerboard(K1: float, K2: float, K3: float, K4: float) -> tuple[float, float]:
    """Conductivities (Kxx, Kyy) of a periodic cell of four equal squares.

    The squares are numbered around their common corner: 1 at x < 1/2, y < 1/2; 2 at x > 1/2, y <
    1/2; 3 at x > 1/2, y > 1/2; 4 at x < 1/2, y > 1/2. Conjectured by S. Mortola and S. Steffé;
    proved by G. W. Milton, J. Math. Phys. 42, 4873 (2001).
    """
    total = K1 + K2 + K3 + K4
    triples = K2 * K3 * K4 + K1 * K3 * K4 + K1 * K2 * K4 + K1 * K2 * K3
    along_x, along_y = (K1 + K4) * (K2 + K3), (K1 + K2) * (K3 + K4)
    Kxx = np.sqrt(triples * along_x / (total * along_y))
    Kyy = np.sqrt(triples * along_y / (total * along_x))
    return float(Kxx), float(Kyy)


def smooth_checkerboard(x: np.ndarray, y: np.ndarray, amplitude: float) -> np.ndarray:
    """Conductivity field K = exp(A cos 2πx cos 2πy), whose effective conductivity is exactly 1.

    A shift by half a period turns K into 1/K, and by Keller's duality the effective conductivity of
    1/K is the reciprocal of that of K. The lines x = 0 and x = 1 can serve as inlet and outlet:
    they are lines of mirror symmetry, hence isobars. x and y are in periods; the contrast is exp(2
    A).
    """
    return np.exp(amplitude * np.cos(2 * np.pi * x) * np.cos(2 * np.pi * y))


def disc_array(area_fraction: float) -> float:
    """Conductivity around impermeable discs in a square array, over that without discs.

    Rayleigh's method to the order of W. T. Perrins, D. R. McKenzie and R. C. McPhedran, Proc. R.
    Soc. Lond. A 369, 207 (1979). The result exceeds the full series by 7e-6 at f = 0.50, 7e-4 at
    0.64 and 2 % at 0.72; at f = π/4 the discs touch and seal.
    """
    f = area_fraction
    if not 0 <= f < np.pi / 4:
        raise InvalidInput(f"the area fraction of discs must lie in [0, π/4), got {f}")
    multipoles = 0.305827 * f**4 / (1 - 1.402958 * f**8) + 0.013362 * f**8
    return 1 - 2 * f / (1 + f - multipoles)
