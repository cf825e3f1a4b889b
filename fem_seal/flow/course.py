"""Whether a refinement that goes on as it has gone so far can reach its tolerance at all."""

from collections.abc import Sequence

import numpy as np

LONG = 16  # growth of the unknowns after which their course can be judged
MOST_UNKNOWNS = 2**31 - 1  # that the indices of PETSc can number

Course = Sequence[tuple[int, float]]


def out_of_reach(course: Course, rtol: float) -> str:
    """Say so if the bounds close too slowly ever to reach a tolerance, "" if they may.

    A line of tiny gaps must be resolved along its whole length, which costs as many unknowns as it
    is narrower than a pixel, whereas the cost of a tight spot grows as a logarithm. The course
    tells one from the other: the order p of gap ~ unknowns^-p over the last sixteenfold growth.

    Parameters
    ----------
    course : (unknowns, relative gap of the bounds) of each mesh
    rtol : tolerance of the relative gap
    """
    unknowns, gap = course[-1]
    starts = [k for k, (before, _) in enumerate(course) if LONG * before <= unknowns]
    if not starts or gap <= rtol:
        return ""
    judged = course[starts[-1] :]
    before, widest = judged[0]
    # What has risen since then is newly found, and nothing is known yet of how it falls.
    if not gap < widest < np.inf or max(value for _, value in judged) > widest:
        return ""
    order = np.log(widest / gap) / np.log(unknowns / before)
    if np.log(unknowns) + np.log(gap / rtol) / order <= np.log(MOST_UNKNOWNS):
        return ""
    return (
        f"as the last meshes went, more than {MOST_UNKNOWNS} unknowns would be needed, which "
        "cannot be numbered"
    )
