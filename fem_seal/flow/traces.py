"""Power traces: stream functions that rise as r⁴ from a contact vertex, so that its cell conducts.

On a triangle with a contact vertex 1/g³ is not integrable, so a linear stream function of finite
energy would be constant. At a distance r from the contact the flux is proportional to g³ ~ r³,
hence ψ - ψ_0 ~ r⁴. With m = 4 and D_i = ψ_i - ψ_0:

    one contact vertex 0    ψ = ψ_0 + s^m ((1-τ) D_b + τ D_c),   s = λ_b + λ_c,  τ = λ_c/s
    a contact edge          ψ = ψ_0 + D_c λ_c^m,                 c the third vertex

Both are continuous across cells, have finite energy, and are linear in the vertex values. The
energy of each is a quadratic form that vanishes for constants, hence equal to the energy of a
linear ψ with a constant symmetric resistivity *tensor*: one form serves all cells.

Where slip rules, the flux is proportional to r² and ψ - ψ_0 ~ r³. m = 4 serves there too, since any
ψ gives a bound.
"""

import numpy as np

from fem_seal.film.law import CUBE, Conductivity

POWER = 4
_KAPPA = (POWER - 1) / (POWER + 1)
_NEAR_TRACE = 4.0  # ratio of two gaps below which Gauss points replace the closed forms
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(20)
_NODES, _WEIGHTS = (_NODES + 1) / 2, _WEIGHTS / 2


def segment_moments(b: np.ndarray, c: np.ndarray, power: int = 3) -> np.ndarray:
    """Integrals (3, n) over 0 ≤ τ ≤ 1 of ((1-τ)², τ(1-τ), τ²) / (b + (c-b)τ)^power, power 3 or 2.

    b and c (n,) are the gaps at the two ends, > 0. The terms of the closed forms cancel where they
    are close. For ratios below 4 the pole of the integrand lies at least a third of the interval's
    length outside it, so that 20 Gauss points have an error of 3^-40 ~ 1e-19. For larger ratios no
    term of the closed forms exceeds eight times their sum.
    """
    q = c / b
    near = (q < _NEAR_TRACE) & (q > 1 / _NEAR_TRACE)
    x = np.where(near, 2 * _NEAR_TRACE, q)
    moments = _CLOSED_MOMENTS[power](x, np.log(x)) / (x - 1) ** 3
    t = _NODES[:, None]
    basis = np.stack([(1 - t) ** 2, t * (1 - t), t * t])
    weighted = _WEIGHTS[:, None] / (1 + (q[near] - 1) * t) ** power
    moments[:, near] = (basis * weighted).sum(axis=1)
    return moments / b**power


def _moments_of_cube(x: np.ndarray, log: np.ndarray) -> np.ndarray:
    """The moments for power 3, b = 1 and c = x, times (x - 1)³."""
    return np.stack(
        [
            log + 1.5 - 2 * x + x * x / 2,
            -log - (1 + x) * (1 / x - 1) + (1 / x - x) / 2,
            log + 2 / x - 1.5 - 1 / (2 * x * x),
        ]
    )


def _moments_of_square(x: np.ndarray, log: np.ndarray) -> np.ndarray:
    """The moments for power 2, b = 1 and c = x, times (x - 1)³."""
    return np.stack([x * x - 1 - 2 * x * log, (x + 1) * log - 2 * (x - 1), x - 1 / x - 2 * log])


_CLOSED_MOMENTS = {3: _moments_of_cube, 2: _moments_of_square}


def one_contact_tensor(
    e_b: np.ndarray, e_c: np.ndarray, b: np.ndarray, c: np.ndarray, power: int = 3
) -> np.ndarray:
    """Resistivity (xx, xy, yy), (3, n), of cells with one contact vertex, in units of 1/gap^k.

    ∫|∇ψ|²/g^k = 1/((2m-k) 2|T|) ∫ |m D d - D' r|² / g(τ)^k dτ, with d = e_c - e_b, r = e_b + τ d,
    g(τ) = b + (c-b) τ. With the gradient G of the linear function of the same corner values, D =
    G·r and D' = G·d, so that m D d - D' r = G_x v_x + G_y v_y with

        v_x = ((m-1) d_x r_x, m r_x d_y - d_x r_y),  v_y = (m r_y d_x - d_y r_x, (m-1) d_y r_y),

    each linear in τ. In slender cells the components of the tensor differ by squares of the aspect.
    The formula never adds terms of different powers of the aspect, so that none is lost.

    e_b and e_c (2, n) are the edges from the contact vertex to the other two, b and c (n,) > 0 the
    gaps there. The power k is 3 or 2.
    """
    d, moments = e_c - e_b, segment_moments(b, c, power)
    (d_x, d_y), m = d, POWER

    def v(r: np.ndarray) -> np.ndarray:
        r_x, r_y = r
        v_x = (m - 1) * d_x * r_x, m * r_x * d_y - d_x * r_y
        v_y = m * r_y * d_x - d_y * r_x, (m - 1) * d_y * r_y
        return np.array([v_x, v_y])

    start, end = v(e_b), v(e_c)

    def integral(i: int, j: int) -> np.ndarray:
        mixed = (start[i] * end[j] + end[i] * start[j]).sum(axis=0)
        outer = [(v[i] * v[j]).sum(axis=0) for v in (start, end)]
        return moments[0] * outer[0] + moments[1] * mixed + moments[2] * outer[1]

    double_area = np.abs(e_b[0] * e_c[1] - e_b[1] * e_c[0])
    # The linear function has the energy |T| G·tensor·G.
    scale = 2 / ((2 * m - power) * double_area**2)
    return scale * np.stack([integral(0, 0), integral(0, 1), integral(1, 1)])


def contact_edge_resistivity(c: np.ndarray, power: int = 3) -> np.ndarray:
    """Scalar resistivity of cells with a contact edge and gap `c` at the third vertex.

    ∫|∇ψ|²/g^k = m² D² |∇λ_c|² c^-k 2|T| / ((2m-k-1)(2m-k)), k the power.
    """
    m = POWER
    return 2 * m**2 / ((2 * m - power - 1) * (2 * m - power)) / c**power


def _side_by_side(
    cubic_tensor: np.ndarray, square_tensor: np.ndarray, cubic: np.ndarray, square: np.ndarray
) -> np.ndarray:
    """Resistivity (3, n) for α g³ + β g² from those for g³ and for g².

    1/(u + v) ≤ τ²/u + (1 - τ)²/v for any τ; τ is chosen such that the trace is least.
    """
    ease = np.stack(
        [
            cubic / (cubic_tensor[0] + cubic_tensor[2]),
            square / (square_tensor[0] + square_tensor[2]),
        ]
    )
    total = ease.sum(axis=0) ** 2
    weights = (
        cubic / (cubic_tensor[0] + cubic_tensor[2]) ** 2 / total,
        square / (square_tensor[0] + square_tensor[2]) ** 2 / total,
    )
    return weights[0] * cubic_tensor + weights[1] * square_tensor


def resistivity(
    xy: np.ndarray,
    aspect: np.ndarray | float,
    gaps: np.ndarray,
    contact: np.ndarray,
    mean_inverse_K: np.ndarray,
    law: Conductivity = CUBE.lower,
) -> np.ndarray:
    """Resistivity tensor (n, 3) of cells: xx, xy, yy; that of power traces at contact vertices.

    Zero where the mean is infinite, and where all corners are contact vertices.

    Parameters
    ----------
    xy, aspect
        Coordinates (3, n, 2) of the corners, and the factors that scale x and y.
    gaps, contact : (3, n)
        Gap at the corners, and which of them are contact vertices.
    mean_inverse_K : (n,)
        Mean of the inverse of the law.
    law
        Lower bound of the conductivity.
    """
    count = contact.sum(axis=0)
    isotropic = np.where(np.isinf(mean_inverse_K), 0.0, mean_inverse_K)
    two = np.flatnonzero(count == 2)
    largest_gap = gaps[:, two].max(axis=0)
    isotropic[two] = _edge_resistivity(largest_gap, law)
    tensor = np.zeros((len(isotropic), 3))
    tensor[:, 0] = tensor[:, 2] = isotropic
    one = np.flatnonzero(count == 1)
    turned = (contact[:, one].argmax(axis=0) + np.arange(3)[:, None]) % 3
    _, b, c = gaps[turned, one]
    first, *others = xy[turned, one]
    # Subtract before scaling: differences of integers are exact, products with the aspect are not.
    e_b, e_c = (((other - first) * aspect).T for other in others)
    of_traces = one_contact_tensor(e_b, e_c, b, c)
    if not law.is_cube:
        square = one_contact_tensor(e_b, e_c, b, c, power=2)
        of_traces = _side_by_side(of_traces, square, *_from_contact(law, np.maximum(b, c)))
    tensor[one] = of_traces.T
    return tensor


def _from_contact(law: Conductivity, largest_gap: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """α >= 0 and β of a lower bound α g³ + β g² for gaps up to `largest_gap` (n,)."""
    cubic, square = law.lower_line(np.zeros_like(largest_gap), largest_gap)
    return np.maximum(cubic, 0.0), square + np.minimum(cubic, 0.0) * largest_gap


def _edge_resistivity(largest_gap: np.ndarray, law: Conductivity) -> np.ndarray:
    """`contact_edge_resistivity` under a law; `largest_gap` (n,) is the gap at the third vertex."""
    cubic_law = contact_edge_resistivity(largest_gap)
    if law.is_cube:
        return cubic_law
    cubic, square = _from_contact(law, largest_gap)
    return 1 / (cubic / cubic_law + square / contact_edge_resistivity(largest_gap, power=2))


def mean_gradient_values(psi: np.ndarray, contact: np.ndarray) -> np.ndarray:
    """Corner values (n, 3) of the linear function whose gradient is the cell mean of ∇ψ.

    Integrate by parts: on an edge from a contact vertex 0 to an open vertex 1 the integral of ψ is
    |e| (m ψ_0 + ψ_1)/(m + 1); on other edges ψ is linear. `psi` and `contact` (n, 3) are ψ at the
    corners, and which of them are contact.
    """
    values = psi.copy()
    count = contact.sum(axis=1)
    one = np.flatnonzero(count == 1)
    k = contact[one].argmax(axis=1)
    base, b, c = psi[one, k], (one, (k + 1) % 3), (one, (k + 2) % 3)
    D_b, D_c = psi[b] - base, psi[c] - base
    values[b], values[c] = base + D_b + _KAPPA * D_c, base + D_c + _KAPPA * D_b
    two = np.flatnonzero(count == 2)
    k = (~contact[two]).argmax(axis=1)
    base = psi[two, (k + 1) % 3]
    values[two, k] = base + (psi[two, k] - base) * 2 / (POWER + 1)
    return values
