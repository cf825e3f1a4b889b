"""The weak forms of the flow through a film, by name, in the symbols of docs/reference/glossary.md.

The pressure p of the fluid in a film of height g solves the Reynolds equation

    ∇·(K ∇p) = 0,  K = g³/(12 η),  p given at inlet and outlet, no flow across walls and contact;

in weak form: find p with the prescribed values so that reynolds(p, q, K) = 0 for all q that are
zero at inlet and outlet. That p minimises energy(p, K), and the minimum is Q Δp: any other pressure
gives an upper bound of the leak rate Q (Dirichlet's principle). The lower bound is the same form
with the resistivity in place of K, energy(ψ, 1/K) of a stream function ψ of unit flux (Thomson's
principle).

`integrals.py` integrates these forms over the cells of a nested mesh, one batch of cells after the
other, with exact cell averages of K and 1/K. demos/ordinary_dolfinx.py solves the equation step by
step on one ordinary mesh, also with quadratic elements.
"""

from typing import TypeAlias

from fem_seal.fenicsx import ufl
from fem_seal.film.law import film_conductivity

Expr: TypeAlias = ufl.core.expr.Expr

__all__ = ["energy", "film_conductivity", "reynolds"]


def reynolds(p: Expr, q: Expr, K: Expr) -> ufl.Form:
    """Bilinear form (K ∇p, ∇q) = ∫ K ∇p·∇q dx [W]; p, q [Pa], K [m³/(Pa s)] or a tensor."""
    return ufl.inner(K * ufl.grad(p), ufl.grad(q)) * ufl.dx


def energy(p: Expr, K: Expr) -> ufl.Form:
    """Power (K ∇p, ∇p) = ∫ ∇p·K·∇p dx [W] that the flow dissipates; Q Δp at its minimum."""
    return reynolds(p, p, K)
