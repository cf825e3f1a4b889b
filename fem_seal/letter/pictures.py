"""Data of the letter's Figs. 1 and 2: contacts of equal area by both models, and their flow."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fem_seal.errors import present
from fem_seal.files import atomic_write, write_npz
from fem_seal.grid import GridField
from fem_seal.leak_rate import FlowField
from fem_seal.letter.flow_points import certified
from fem_seal.letter.surfaces import RoughCase, at_area
from fem_seal.points import PointFolder
from fem_seal.registry import choose

CONTACT_AREA, FLOW_AREA = 0.46, 0.2
SEED = 1


@dataclass(frozen=True, eq=False)
class FlowPicture:
    """A contact with its flow.

    Attributes
    ----------
    gap : GridField
        Gap [m].
    flow : FlowField
        Flow on the last mesh.
    """

    gap: GridField
    flow: FlowField

    @property
    def density(self) -> np.ndarray:
        """|j| on each triangle [m^2/s]."""
        return np.linalg.norm(self.flow.flux, axis=1)

    @property
    def peak(self) -> float:
        """Largest |j| [m^2/s]."""
        return float(self.density.max())


def contact_picture_data(case: RoughCase, model: str, threads: int = 1) -> GridField:
    """Gap [m] of a model at the area of Fig. 1."""
    return at_area(case.surface(SEED), model, CONTACT_AREA, threads).gap


def flow_picture_data(case: RoughCase, model: str, rtol: float, threads: int = 1) -> FlowPicture:
    """Gap and flow of a model at the area of Fig. 2."""
    gap = at_area(case.surface(SEED), model, FLOW_AREA, threads).gap
    return FlowPicture(gap, present(certified(gap, rtol, field=True).field, "field of the flow"))


class GapFolder(PointFolder[GridField]):
    """Gaps of Fig. 1."""

    suffix = ".npz"

    def load(self, path: Path) -> GridField:
        """Read a gap."""
        from fem_seal.gap_file import load_gap

        return load_gap(path)

    def save(self, path: Path, point: GridField) -> None:
        """Write a gap."""
        save_gap(path, point)

    def finished(self, name: str) -> bool:
        """Whether there is a file; pictures are large, and read once, for the figures."""
        return self.there(name)


class FlowFolder(PointFolder[FlowPicture]):
    """Flows of Fig. 2."""

    suffix = ".npz"

    def load(self, path: Path) -> FlowPicture:
        """Read a flow."""
        return load_flow(path)

    def save(self, path: Path, point: FlowPicture) -> None:
        """Write a flow."""
        save_flow(path, point)

    def finished(self, name: str) -> bool:
        """Whether there is a file; pictures are large, and read once, for the figures."""
        return self.there(name)


def save_gap(path: Path, gap: GridField) -> None:
    """Write a gap as `fem_seal.load_gap` reads it."""
    _save(path, {"gap": gap.values, "spacing": gap.spacing, "periodic": gap.periodic})


def save_flow(path: Path, picture: FlowPicture) -> None:
    """Write gap, mesh and flow."""
    gap, flow = picture.gap, picture.flow
    _save(
        path,
        {
            "gap": gap.values,
            "spacing": gap.spacing,
            "periodic": gap.periodic,
            "points": flow.points,
            "cells": flow.cells,
            "film": flow.gap,
            "pressure": flow.pressure,
            "flux": flow.flux,
        },
    )


def load_flow(path: Path) -> FlowPicture:
    """Read what `save_flow` wrote."""
    with np.load(path) as data:
        gap = GridField(data["gap"], tuple(data["spacing"]), bool(data["periodic"]))
        flow = FlowField(
            data["points"], data["cells"], data["film"], data["pressure"], data["flux"]
        )
    return FlowPicture(gap, flow)


def _save(path: Path, arrays: dict[str, object]) -> None:
    with atomic_write(path) as staged:
        write_npz(staged, arrays, compressed=True)


def decades(flows: dict[str, FlowPicture], statistic: str) -> float:
    """log10 of the bearing model's flow density over the elastic one's.

    Parameters
    ----------
    flows : by model
    statistic : "peak", or "body" for the 99.9 % quantile over the area that carries flow
    """
    density = choose(_DENSITIES, statistic, "flow density")
    return float(np.log10(density(flows["bearing"]) / density(flows["elastic"])))


def _body(picture: FlowPicture) -> float:
    """99.9 % quantile of |j| over the area that carries flow [m^2/s]."""
    corners = picture.flow.points[picture.flow.cells]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    order = np.argsort(picture.density)
    below = np.cumsum(areas[order])
    return float(picture.density[order][np.searchsorted(below, 0.999 * below[-1])])


_DENSITIES = {"peak": lambda picture: picture.peak, "body": _body}
