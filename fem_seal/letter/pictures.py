"""Data of the letter's Figs. 1 and 2: contacts of equal area in both models, and their flow."""

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
    """Folder of the gaps of Fig. 1."""

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
        return self.exists(name)


class FlowFolder(PointFolder[FlowPicture]):
    """Folder of the flows of Fig. 2."""

    suffix = ".npz"

    def load(self, path: Path) -> FlowPicture:
        """Read a flow."""
        return load_flow(path)

    def save(self, path: Path, point: FlowPicture) -> None:
        """Write a flow."""
        save_flow(path, point)

    def finished(self, name: str) -> bool:
        """Whether there is a file; pictures are large, and read once, for the figures."""
        return self.exists(name)


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


@dataclass(frozen=True)
class FlowMeasures:
    """Fig. 2 of one model as numbers; j is the flow density.

    Attributes
    ----------
    area, area_corrected : float
        A/A0, counted in samples and corrected for the perimeter.
    total : float
        Mean of j along the flow over the cell, the leak rate over its width [m²/s].
    body : float
        99.9 % quantile of |j| over the area that carries flow [m²/s].
    peak : float
        Largest |j| [m²/s].
    participation : float
        (∫ j² dA)² / ∫ j⁴ dA over A0: the part of the cell on which most of the dissipation would
        lie if j² were uniform there.
    half : float
        Smallest part of the cell through which half of ∫ |j| dA flows.
    """

    area: float
    area_corrected: float
    total: float
    body: float
    peak: float
    participation: float
    half: float

    @classmethod
    def of(cls, picture: FlowPicture) -> "FlowMeasures":
        """Measure a flow."""
        from fem_seal.contact.state import GapState

        flow, j = picture.flow, picture.density
        corners = flow.points[flow.cells]
        a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        areas = 0.5 * np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
        cell = float(np.prod(picture.gap.size))
        order = np.argsort(j)
        below = np.cumsum(areas[order])
        carried = np.cumsum((j * areas)[order])
        state = GapState(picture.gap)
        return cls(
            area=state.contact_area_fraction,
            area_corrected=state.contact_area_corrected,
            total=float(flow.flux[:, 0] @ areas) / cell,
            body=float(j[order][np.searchsorted(below, 0.999 * below[-1])]),
            peak=picture.peak,
            participation=float((j**2 @ areas) ** 2 / (j**4 @ areas)) / cell,
            half=float(below[-1] - below[np.searchsorted(carried, 0.5 * carried[-1])]) / cell,
        )


def decades(flows: dict[str, FlowMeasures], name: str) -> float:
    """log10 of a measure of the bearing model over that of the elastic one."""
    return float(np.log10(getattr(flows["bearing"], name) / getattr(flows["elastic"], name)))
