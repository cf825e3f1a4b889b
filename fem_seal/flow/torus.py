"""Numberings of a cell that is periodic in both directions: jumps across seams, and windings.

A pressure with mean gradient e grows by e·(Lx, 0) across the seam x = Lx and by e·(0, Ly) across
the seam y = Ly; a stream function of mean flux f grows by -f_y Lx and f_x Ly. Each is a periodic
function plus J·n, where n counts the seams crossed and J are its two jumps. Open cells carry flow
only if their cluster winds around the cell. A contact patch that winds by n restricts the jumps of
the stream function to J·n = 0.
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.film.winding import unwind
from fem_seal.flow.cell_data import CellContact, CellData
from fem_seal.flow.numbering import Numbering, numbered
from fem_seal.flow.topology import (
    continuous_labels,
    passable_sides,
    patch_ties,
)
from fem_seal.mesh.grouping import components
from fem_seal.mesh.mesh import side_ends
from fem_seal.mesh.torus import Torus


def jumps_along(windings: np.ndarray) -> np.ndarray:
    """Jumps (k, 2) of the pressures to solve for: a basis of the jumps that drive different flows.

    With two independent windings every jump drives a flow. With a single primitive winding w only
    J·w matters, and one jump with J·w = 1 is enough.
    """
    if not len(windings):
        return np.empty((0, 2))
    if _rank(windings) == 2:
        return np.eye(2)
    m, n = _primitive(windings)
    return np.array([[m, n]]) / (m * m + n * n)


def jumps_across(windings: np.ndarray) -> np.ndarray:
    """Jumps (k, 2) that stream functions may have, constant on patches with these windings."""
    if not len(windings):
        return np.eye(2)
    if _rank(windings) == 2:
        return np.empty((0, 2))
    m, n = _primitive(windings)
    return np.array([[-n, m]], dtype=float)


def _rank(windings: np.ndarray) -> int:
    a, b = windings[0]
    return 2 if (windings[:, 0] * b != windings[:, 1] * a).any() else 1


def _primitive(windings: np.ndarray) -> tuple[int, int]:
    """The shortest winding in the common direction of all windings.

    A cluster that winds in this direction contains it: a closed path that does not cross itself
    never winds twice around a torus.
    """
    m, n = (windings[0] // np.gcd(*windings[0])).tolist()
    return m, n


@dataclass(frozen=True, eq=False)
class OpenTorus:
    """Cells that wind around the torus, and the sides through which they are joined."""

    kept: np.ndarray  #: (C,) bool, cells that carry flow
    pairs: np.ndarray  #: (n, 2) int, side slots of each passable edge
    component: np.ndarray  #: (C,) int, component of each cell; joined cells have the same
    windings: np.ndarray  #: (k, 2) int, closed paths around the torus


def open_torus(mesh: Torus, data: CellData) -> OpenTorus:
    """Find the cells that can carry flow around the torus."""
    pairs, _ = passable_sides(mesh, data)
    # Sides along x = Lx and along y = Ly, as (1, 0) and (0, 1).
    far = mesh.copy[mesh.cells.ravel()[side_ends(pairs.ravel())]].all(axis=1).reshape(-1, 2, 2)
    jump = far[:, 0].astype(int) - far[:, 1]
    inside = ~jump.any(axis=1)
    piece = components(pairs[inside] // 3, len(mesh.cells))
    first, second = piece[pairs[~inside] // 3].T
    unwound = unwind(first, second, jump[~inside], int(piece.max()) + 1)
    component = unwound.root[piece]
    kept = np.isin(component, unwound.winding_roots) & (data.K > 0)
    return OpenTorus(kept, pairs[kept[pairs[:, 0] // 3]], component, unwound.windings)


def pressure_numbering(mesh: Torus, data: CellData, cells: OpenTorus) -> Numbering:
    """Number the periodic part of the pressure, with one unknown per point and side of contact.

    The offset is 0. One corner of each component has no unknown: its pressure is 0.
    """
    vertex = mesh.twin[mesh.cells]
    label, count = continuous_labels(vertex, len(mesh.xy), data.zero_gap, cells.kept, cells.pairs)
    label = label.reshape(-1, 3)[cells.kept]
    _, first = np.unique(cells.component[cells.kept], return_index=True)
    free = np.ones(count, dtype=bool)
    free[label[first, 0]] = False
    of_corner, used = numbered(label, free)
    return Numbering(of_corner, np.zeros(label.shape, dtype=np.int8), used)


@dataclass(frozen=True, eq=False)
class StreamNumbering:
    """Periodic part of the stream function, and the jumps J that it admits: ψ = part + J·n."""

    numbering: Numbering  #: numbering of the periodic part; its offset is 0
    seams_crossed: np.ndarray  #: (C, 3, 2), number n of seams crossed at each corner
    #: (k, 2), basis of the jumps J that the contact patches admit; empty if they block every
    #: direction
    jumps: np.ndarray


def stream_numbering(
    mesh: Torus, data: CellContact, kept: np.ndarray, merge_blocked: bool
) -> StreamNumbering:
    """Number the stream function on the torus; arguments as in `topology.dual_numbering`."""
    pairs = patch_ties(mesh, data, kept, merge_blocked)
    patch = components(np.concatenate(pairs), len(mesh.xy))
    on_seam = np.flatnonzero(mesh.copy.any(axis=1))
    twin, copy = mesh.twin[on_seam], mesh.copy[on_seam].astype(int)
    unwound = unwind(patch[twin], patch[on_seam], copy, int(patch.max()) + 1)
    of_cell = patch[mesh.cells[kept]]
    label = unwound.root[of_cell]
    live = np.zeros(len(unwound.root), dtype=bool)
    live[label[~data.blocked[kept]] if merge_blocked else label] = True
    live[live.argmax()] = False
    of_corner, count = numbered(label, live)
    numbering = Numbering(of_corner, np.zeros(label.shape, dtype=np.int8), count)
    return StreamNumbering(numbering, unwound.offset[of_cell], jumps_across(unwound.windings))
