"""Leak rate by finite differences, an answer independent of the finite elements.

Reynolds' equation ∇·(K ∇p) = 0, K = g³/(12 η), becomes a network of resistors: at every node a
between inlet (p = p_in) and outlet (p = p_out)

    Σ_b c_ab (p_b - p_a) = 0,    c_ab = mean of K along the link a-b × its width / its length,

and the leak rate is Q = C Δp, C the conductance of the network between its two ends.
"""

from fem_seal.arguments import require_kind, require_positive
from fem_seal.film.grid_film import GridFilm, require_film
from fem_seal.film.law import leak_rate_of_square
from fem_seal.finite_difference.elimination import conductance
from fem_seal.finite_difference.slipping import film_without_slip
from fem_seal.finite_difference.stencil import flow_grid
from fem_seal.fluid import Slip
from fem_seal.leak_rate import LeakRate

METHOD = "finite-difference"


def by_differences(
    film: GridFilm,
    viscosity: float,
    pressure_drop: float,
    slip: Slip | None = None,
    link_rule: str = "linear-gap",
) -> LeakRate:
    """Leak rate of a film by central differences on its samples, without bounds.

    A sealed gap needs no solve. `converged` is False if the gap is open only along diagonals of its
    triangulation, which no link follows.

    Parameters
    ----------
    film
        Film; nodes are the vertices of a linear gap or the pixels' centres of a constant one.
    viscosity, pressure_drop, slip
        As of `FlowSettings`.
    link_rule
        Rule of `links.LINKS`: "linear-gap" is exact for a linear gap that varies along the flow
        only, "harmonic" for a stepwise one.

    Raises
    ------
    InvalidInput
        If the film is not on a grid, or numbers leave double precision.
    NotConverged
        If the iteration for slip does not converge.
    """
    require_positive(viscosity=viscosity, pressure_drop=pressure_drop)
    require_kind((Slip, type(None)), slip=slip)
    require_film(film, (GridFilm,))
    if film.sealed:
        return LeakRate.sealed(METHOD)
    # This refuses numbers out of range.
    leak_rate_of_square(film.largest_gap, viscosity, pressure_drop)
    residuals = {}
    if slip is not None:
        film, residuals["slip"] = film_without_slip(film, slip, link_rule)
    grid = flow_grid(film, viscosity, link_rule)
    if not grid.carrying.any():
        return LeakRate(
            state="leaking",
            method=METHOD,
            value=0.0,
            residuals=residuals,
            reason="the gap is open only along diagonals of its triangulation, which the "
            "five-point stencil does not follow; sample it finer",
        )
    value = conductance(grid.stencil) * pressure_drop
    return LeakRate(
        state="leaking",
        method=METHOD,
        value=value,
        unknowns=grid.unknowns,
        residuals=residuals,
        # One link joins the two ends in the end, so that inflow and outflow are equal.
        inflow=value,
        outflow=value,
    )
