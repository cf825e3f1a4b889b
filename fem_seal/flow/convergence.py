"""Convergence history of a refinement, and whether its tolerance is within reach."""

from collections.abc import Sequence

import numpy as np

LONG = 16  # growth of the unknowns over which the order of convergence is measured
MOST_UNKNOWNS = 2**31 - 1  # largest number of unknowns for the indices of PETSc

ConvergenceHistory = Sequence[tuple[int, float]]


def out_of_reach(history: ConvergenceHistory, rtol: float, growth: float) -> str:
    """Message if the bounds converge too slowly ever to reach a tolerance, "" if they may reach it.

    A line of tiny gaps across the flow must be resolved along its whole length, and the unknowns
    that this takes are inversely proportional to its width. The cost of a single narrow spot grows
    only as a logarithm. The measured order p of width ~ unknowns^-p over the last sixteenfold
    growth distinguishes the two.

    Parameters
    ----------
    history : unknowns and relative width of the bounds of each mesh
    rtol : tolerance of the relative width
    growth : usual growth of the unknowns from mesh to mesh. Where a mesh grows faster, it has been
        refined along lines before a solve could tell which of them matter: the history must then be
        as many meshes long as sixteenfold growth usually takes
    """
    unknowns, width = history[-1]
    meshes = round(np.log(LONG) / np.log(growth))
    starts = [k for k, (before, _) in enumerate(history[:-meshes]) if LONG * before <= unknowns]
    if not starts or width <= rtol:
        return ""
    judged = history[starts[-1] :]
    before, widest = judged[0]
    # If the width has risen meanwhile, a new channel has been resolved: no order can be measured.
    if not width < widest < np.inf or max(value for _, value in judged) > widest:
        return ""
    order = np.log(widest / width) / np.log(unknowns / before)
    if np.log(unknowns) + np.log(width / rtol) / order <= np.log(MOST_UNKNOWNS):
        return ""
    return (
        f"as the last meshes went, more than {MOST_UNKNOWNS} unknowns would be needed, which "
        "cannot be numbered"
    )
