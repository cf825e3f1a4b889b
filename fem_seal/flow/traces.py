"""Power traces: stream functions that rise as r⁴ from a contact vertex, so that its cell conducts.

On a triangle with a contact vertex 1/g³ is not integrable, so a linear stream function of finite
energy would be constant. At a distance r from the contact the flux is proportional to g³ ~ r³,
hence ψ - ψ_0 ~ r⁴. With m = 4 and D_i = ψ_i - ψ_0:

    one contact vertex 0    ψ = ψ_0 + s^m ((1-τ) D_b + τ D_c),   s = λ_b + λ_c,  τ = λ_c/s
    a contact edge          ψ = ψ_0 + D_c λ_c^m,                 c the third vertex

Both are continuous across cells, have finite energy, and are linear in the vertex values. The
energy of each is a quadratic form that vanishes for constants, hence equal to the energy of a
linear ψ with a constant symmetric resistivity *tensor*: one form serves all cells.
"""

import numpy as np

POWER = 4
_KAPPA = (POWER - 1) / (POWER + 1)
_NEAR = 4.0  # ratio of two gaps below which Gauss points replace the closed forms
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(20)
_NODES, _WEIGHTS = (_NODES + 1) / 2, _WEIGHTS / 2


def segment_moments(b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Integrals over 0 ≤ τ ≤ 1 of ((1-τ)², τ(1-τ), τ²) / (b + (c-b)τ)³.

    Parameters
    ----------
    b, c : (n,) > 0, gap at the two ends

    Returns
    -------
    (3, n)

    Notes
    -----
    The terms of the closed forms cancel where b and c are close. For ratios below 4 the pole of the
    integrand lies at least a third of the interval's length outside it, so that 20 Gauss points
    have an error of 3^-40 ~ 1e-19. For larger ratios no term of the closed forms exceeds eight
    times their sum.
    """
    q = c / b
    near = (q < _NEAR) & (q > 1 / _NEAR)
    x = np.where(near, 2 * _NEAR, q)
    log, d3 = np.log(x), (x - 1) ** 3
    moments = np.stack(
        [
            (log + 1.5 - 2 * x + x * x / 2) / d3,
            (-log - (1 + x) * (1 / x - 1) + (1 / x - x) / 2) / d3,
            (log + 2 / x - 1.5 - 1 / (2 * x * x)) / d3,
        ]
    )
    t = _NODES[:, None]
    basis = np.stack([(1 - t) ** 2, t * (1 - t), t * t])
    weighted = _WEIGHTS[:, None] / (1 + (q[near] - 1) * t) ** 3
    moments[:, near] = (basis * weighted).sum(axis=1)
    return moments / b**3


def one_contact_tensor(
    e_b: np.ndarray, e_c: np.ndarray, b: np.ndarray, c: np.ndarray
) -> np.ndarray:
    """Resistivity tensor (xx, xy, yy) of cells with one contact vertex.

    Parameters
    ----------
    e_b, e_c : (2, n), edges from the contact vertex to the other two
    b, c : (n,) > 0, gap at these two

    Returns
    -------
    (3, n), in units of 1/gap³

    Notes
    -----
    ∫|∇ψ|²/g³ = 1/((2m-3) 2|T|) ∫ |m D d - D' r|² / g(τ)³ dτ, with d = e_c - e_b, r = e_b + τ d,
    g(τ) = b + (c-b) τ. With the gradient G of the linear function of the same corner values,
    D = G·r and D' = G·d, so that m D d - D' r = G_x v_x + G_y v_y with

        v_x = ((m-1) d_x r_x, m r_x d_y - d_x r_y),  v_y = (m r_y d_x - d_y r_x, (m-1) d_y r_y),

    each linear in τ. In slender cells the components of the tensor differ by squares of the aspect.
    The formula never adds terms of different powers of the aspect, so that none is lost.
    """
    d, moments = e_c - e_b, segment_moments(b, c)
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
    scale = 2 / ((2 * m - 3) * double_area**2)
    return scale * np.stack([integral(0, 0), integral(0, 1), integral(1, 1)])


def contact_edge_resistivity(c: np.ndarray) -> np.ndarray:
    """Scalar resistivity of cells with a contact edge and gap `c` at the third vertex.

    ∫|∇ψ|²/g³ = m² D² |∇λ_c|² c^-3 2|T| / ((2m-4)(2m-3)).
    """
    return 2 * POWER**2 / ((2 * POWER - 4) * (2 * POWER - 3)) / c**3


def resistivity(
    xy: np.ndarray,
    aspect: np.ndarray | float,
    gaps: np.ndarray,
    contact: np.ndarray,
    inverse_cube: np.ndarray,
) -> np.ndarray:
    """Resistivity tensor (xx, xy, yy) of cells; that of power traces at contact vertices.

    Parameters
    ----------
    xy, aspect : arrays
        Coordinates (3, n, 2) of the corners, and the factors that scale x and y.
    gaps : (3, n) float
        Gap at the corners.
    contact : (3, n) bool
        Contact vertices.
    inverse_cube : (n,) float
        Mean of 1/gap³.

    Returns
    -------
    (n, 3) float
        Zero where the mean is infinite, and where all corners are contact vertices.
    """
    count = contact.sum(axis=0)
    isotropic = np.where(np.isinf(inverse_cube), 0.0, inverse_cube)
    two = np.flatnonzero(count == 2)
    isotropic[two] = contact_edge_resistivity(gaps[:, two].max(axis=0))
    tensor = np.zeros((len(isotropic), 3))
    tensor[:, 0] = tensor[:, 2] = isotropic
    one = np.flatnonzero(count == 1)
    turned = (contact[:, one].argmax(axis=0) + np.arange(3)[:, None]) % 3
    _, b, c = gaps[turned, one]
    first, *others = xy[turned, one]
    # Subtract before scaling: differences of integers are exact, products with the aspect are not.
    e_b, e_c = (((other - first) * aspect).T for other in others)
    tensor[one] = one_contact_tensor(e_b, e_c, b, c).T
    return tensor


def mean_gradient_values(psi: np.ndarray, contact: np.ndarray) -> np.ndarray:
    """Corner values of the linear function whose gradient is the cell mean of ∇ψ.

    Parameters
    ----------
    psi : (n, 3), corner values of the stream function
    contact : (n, 3) bool, corners that are contact

    Returns
    -------
    (n, 3)

    Notes
    -----
    By parts: on an edge from a contact vertex 0 to an open one ∫ψ = |e| (m ψ_0 + ψ_1)/(m + 1),
    on other edges ψ is linear.
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
