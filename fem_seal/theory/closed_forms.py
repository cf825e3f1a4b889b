"""Answers known exactly, for any solver of Reynolds' equation; conductivities K in any one unit."""

import numpy as np

from fem_seal.errors import InvalidInput


def parallel_plates(gap: float, length: float, width: float, viscosity: float) -> float:
    """Conductance Q/Δp of a uniform gap, width g³ / (12 η length) (Poiseuille).

    Parameters
    ----------
    gap, length, width : [m]
    viscosity : [Pa s]

    Returns
    -------
    [m^3/(Pa s)]
    """
    return width * gap**3 / (12 * viscosity * length)


def series(conductivity: np.ndarray) -> float:
    """Conductivity of equal layers across the flow, the harmonic mean; 0 if a layer is closed.

    Parameters
    ----------
    conductivity : (n,) float, >= 0
    """
    K = np.asarray(conductivity, dtype=float)
    return float(K.size / np.sum(1 / K)) if np.all(K > 0) else 0.0


def parallel(conductivity: np.ndarray) -> float:
    """Conductivity of equal layers along the flow, the arithmetic mean.

    Parameters
    ----------
    conductivity : (n,) float, >= 0
    """
    return float(np.mean(conductivity))


def piecewise_linear_channel(gap: np.ndarray) -> float:
    """Cubed gap 1/<g⁻³> of a channel whose gap is linear between equidistant samples.

    ∫ g⁻³ over an interval from a to b is (a + b)/(2 a² b²) of its length.

    Parameters
    ----------
    gap : (n,) float [m], n >= 2

    Returns
    -------
    [m^3]; 0 if a sample is in contact.
    """
    g = np.asarray(gap, dtype=float)
    if not np.all(g > 0):
        return 0.0
    a, b = g[:-1], g[1:]
    return float(1 / np.mean((a + b) / (2 * a**2 * b**2)))


def cosine_channel(amplitude: float, *, across: bool) -> float:
    """Conductivity of the gap 1 + a cos(kx) over that of the gap 1, in whole wavelengths.

    Parameters
    ----------
    amplitude : a in [0, 1]
    across : True: the wave crests lie across the flow, 1/<g⁻³> = (1 - a²)^(5/2) / (1 + a²/2)
        (A. Sommerfeld's integrals of 1904); False: along it, <g³> = 1 + 3 a²/2

    Returns
    -------
    float

    Raises
    ------
    InvalidInput
        If the amplitude is out of range.
    """
    a = amplitude
    if not 0 <= a <= 1:
        raise InvalidInput(f"the amplitude of a cosine channel must lie in [0, 1], got {a}")
    return (1 - a**2) ** 2.5 / (1 + a**2 / 2) if across else 1 + 1.5 * a**2


def checkerboard(K1: float, K2: float) -> float:
    """Conductivity √(K1 K2) of a checkerboard of two phases.

    Or of any medium that looks the same with 1 and 2 swapped:
    J. B. Keller, J. Math. Phys. 5, 548 (1964); A. M. Dykhne, Sov. Phys. JETP 32, 63 (1971).
    """
    return float(np.sqrt(K1) * np.sqrt(K2))


def four_phase_checkerboard(K1: float, K2: float, K3: float, K4: float) -> tuple[float, float]:
    """Conductivities (Kxx, Kyy) of a periodic cell of four equal squares.

    The squares are numbered around their common corner: 1 at x < 1/2, y < 1/2; 2 at x > 1/2,
    y < 1/2; 3 at x > 1/2, y > 1/2; 4 at x < 1/2, y > 1/2. Conjectured by S. Mortola and S. Steffé;
    proved by G. W. Milton, J. Math. Phys. 42, 4873 (2001).

    Parameters
    ----------
    K1, K2, K3, K4 : float, > 0
    """
    total = K1 + K2 + K3 + K4
    triples = K2 * K3 * K4 + K1 * K3 * K4 + K1 * K2 * K4 + K1 * K2 * K3
    along_x, along_y = (K1 + K4) * (K2 + K3), (K1 + K2) * (K3 + K4)
    Kxx = np.sqrt(triples * along_x / (total * along_y))
    Kyy = np.sqrt(triples * along_y / (total * along_x))
    return float(Kxx), float(Kyy)


def smooth_checkerboard(x: np.ndarray, y: np.ndarray, amplitude: float) -> np.ndarray:
    """Conductivity field exp(A cos 2πx cos 2πy), which as a whole conducts exactly like K = 1.

    A shift by half a period turns K into 1/K, and by Keller's duality a medium and its reciprocal
    conduct like K and 1/K. Planes x = 0 and x = 1 are mirrors, fit for inlet and outlet.

    Parameters
    ----------
    x, y : float arrays, in periods
    amplitude : A, any; the contrast is exp(2 A)

    Returns
    -------
    float array of the shape of x and y together
    """
    return np.exp(amplitude * np.cos(2 * np.pi * x) * np.cos(2 * np.pi * y))


def disc_array(area_fraction: float) -> float:
    """Conductivity around impermeable discs in a square array, over that without discs.

    Rayleigh's method to the order of W. T. Perrins, D. R. McKenzie and R. C. McPhedran, Proc. R.
    Soc. Lond. A 369, 207 (1979). Against the full series it is too large by 7e-6 at f = 0.50,
    7e-4 at 0.64 and 2 % at 0.72; touching discs (π/4) seal.

    Parameters
    ----------
    area_fraction : f in [0, π/4)

    Returns
    -------
    float

    Raises
    ------
    InvalidInput
        If the discs would overlap.
    """
    f = area_fraction
    if not 0 <= f < np.pi / 4:
        raise InvalidInput(f"the area fraction of discs must lie in [0, π/4), got {f}")
    multipoles = 0.305827 * f**4 / (1 - 1.402958 * f**8) + 0.013362 * f**8
    return 1 - 2 * f / (1 + f - multipoles)


def dilute_discs(area_fraction: float) -> float:
    """Conductivity (1 - f)/(1 + f) around few impermeable discs: Maxwell, exact to order f².

    Also the upper bound of Z. Hashin and S. Shtrikman, J. Appl. Phys. 33, 3125 (1962), for every
    isotropic arrangement of contact of area fraction f.

    Parameters
    ----------
    area_fraction : f in [0, 1]
    """
    return (1 - area_fraction) / (1 + area_fraction)


def annulus(conductivity: float, inner_radius: float, outer_radius: float) -> float:
    """Conductance Q/Δp = 2π K / ln(r_out/r_in) of a ring between two circles.

    Parameters
    ----------
    conductivity : K [m^3/(Pa s)]
    inner_radius, outer_radius : [m]
    """
    return 2 * np.pi * conductivity / float(np.log(outer_radius / inner_radius))


def lognormal(mean_log_conductivity: float) -> float:
    """Conductivity exp<ln K> of an isotropic log-normal medium in the plane, of infinite size.

    G. Matheron, Éléments pour une théorie des milieux poreux (Masson, Paris, 1967).

    Parameters
    ----------
    mean_log_conductivity : <ln K>, K in the unit of the result
    """
    return float(np.exp(mean_log_conductivity))
