"""Data of the letter's Figs. 1 and 2: contacts of equal area in both models, and their flow."""

from dataclasses import dataclass

import numpy as np

from demos.letter.contacts import RoughCase, at_area, certified
from fem_seal.contact import GapState
from fem_seal.grid import GridField
from fem_seal.leak_rate import FlowField

SEED = 1


@dataclass(frozen=True, eq=False)
class Picture:
    """A contact, and its flow on the last mesh unless it was not asked for."""

    gap: GridField  #: [m]
    flow: FlowField | None = None

    @property
    def density(self) -> np.ndarray:
        """|j| on each triangle [m²/s]."""
        return np.linalg.norm(self.flow.flux, axis=1)


def picture(case: RoughCase, model: str, area: float, rtol: float | None) -> Picture:
    """Press the first surface to an area, and compute its flow if there is a tolerance for it."""
    gap = at_area(case.surface(SEED), model, area).gap
    return Picture(gap, None if rtol is None else certified(gap, rtol, field=True).field)


@dataclass(frozen=True)
class FlowMeasures:
    """Fig. 2 of one model as numbers; j is the flow density."""

    area: float  #: A/A0, counted in samples
    corrected: float  #: A/A0 less what pixels add along the perimeter
    total: float  #: mean of j along the flow over the cell: the leak rate over its width [m²/s]
    body: float  #: 99.9 % quantile of |j| over the area that carries flow [m²/s]
    peak: float  #: largest |j| [m²/s]
    #: (∫j²)²/∫j⁴ over A0: the part of the cell on which the dissipation would lie if it were even
    participation: float
    half: float  #: smallest part of the cell through which half of ∫|j| flows

    @classmethod
    def of(cls, shown: Picture) -> "FlowMeasures":
        """Measure a flow."""
        flow, j = shown.flow, shown.density
        corners = flow.points[flow.cells]
        a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        areas = 0.5 * np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
        cell = float(np.prod(shown.gap.size))
        order = np.argsort(j)
        below = np.cumsum(areas[order])
        carried = np.cumsum((j * areas)[order])
        state = GapState(shown.gap)
        return cls(
            area=state.contact_area_fraction,
            corrected=state.contact_area_corrected,
            total=float(flow.flux[:, 0] @ areas) / cell,
            body=float(j[order][np.searchsorted(below, 0.999 * below[-1])]),
            peak=float(j.max()),
            participation=float((j**2 @ areas) ** 2 / (j**4 @ areas)) / cell,
            half=float(below[-1] - below[np.searchsorted(carried, 0.5 * carried[-1])]) / cell,
        )


def decades(flows: dict[str, FlowMeasures], name: str) -> float:
    """log10 of a measure of the bearing model over that of the elastic one."""
    return float(np.log10(getattr(flows["bearing"], name) / getattr(flows["elastic"], name)))
