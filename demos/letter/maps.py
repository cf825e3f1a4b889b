"""Figs. 1 and 2 of the letter: contact and flow of both models."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from demos.letter.contacts import MODELS, RoughCase
from demos.letter.currents import FLOW_AREA
from demos.letter.flows import FlowMeasures, Picture, picture
from demos.letter.style import paths
from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.render.colours import CONTACT, NO_FLOW
from fem_seal.render.flow import FLOW_COLOURS, draw_flow
from fem_seal.render.page import Window, add_bar, page, window_of
from fem_seal.render.samples import CONTACT_KEY, draw_contact
from fem_seal.render.scale import Scale

PANEL_SIDE = 3.5  # longer side of each panel of Figs. 1 and 2 [inch]
MAGNIFIED = 0.25  # part of each side of the cell that their lower row shows
DECADES = 5  # length of the colour bar of Fig. 2
CONTACT_AREA = 0.46  # of Fig. 1


def pictures(case: RoughCase, rtol: float, folder: Path, name: str) -> dict[str, FlowMeasures]:
    """Solve both models, draw Figs. 1 and 2 beside the point of that name; Fig. 2 as numbers."""
    contacts = {model: picture(case, model, CONTACT_AREA, None) for model in MODELS}
    contact_figure(contacts, paths(folder, f"{name}-fig1"))
    flows = {model: picture(case, model, FLOW_AREA, rtol) for model in MODELS}
    flow_figure(flows, paths(folder, f"{name}-fig2"))
    return {model: FlowMeasures.of(flow) for model, flow in flows.items()}


def contact_figure(contacts: dict[str, Picture], files: Sequence[Path]) -> None:
    """Fig. 1: contact and open domains of each model, and a part magnified below."""
    films = {model: GridFilm(picture.gap, "periodic") for model, picture in contacts.items()}
    window, shape = window_of(next(iter(films.values()))), (2, len(films))
    with page(window, *files, shape=shape, side=PANEL_SIDE, key=CONTACT_KEY) as axes:
        for (model, film), whole, part in zip(films.items(), *axes, strict=True):
            draw_contact(whole, film, title=_title(model, film.gap))
            draw_contact(part, film, window=_part(film.gap))


def flow_figure(flows: dict[str, Picture], files: Sequence[Path]) -> None:
    """Fig. 2: flow density of both models on one scale, and a part magnified below."""
    peak = float(flows["bearing"].density.max())
    name = "flow density / peak of the bearing model"
    scale = Scale(name, 10.0**-DECADES, 1.0, True, FLOW_COLOURS, "min")
    window, shape = window_of(GridFilm(flows["bearing"].gap, "periodic")), (2, len(flows))
    key = (CONTACT, NO_FLOW)
    with page(window, *files, shape=shape, side=PANEL_SIDE, key=key) as axes:
        for (model, picture), whole, part in zip(flows.items(), *axes, strict=True):
            field = replace(picture.flow, flux=picture.flow.flux / peak)
            film = GridFilm(picture.gap, "periodic")
            draw_flow(whole, field, film, scale, title=_title(model, picture.gap))
            draw_flow(part, field, film, scale, window=_part(picture.gap))
        for row in axes:
            add_bar(row[-1], scale)


def _title(model: str, gap: GridField) -> str:
    return f"{model}, A/A0 = {np.mean(gap.values == 0):.3f}"


def _part(gap: GridField) -> Window:
    """Window of the magnified part, at the centre of the cell."""
    Lx, Ly = gap.size
    low, high = 0.5 * (1 - MAGNIFIED), 0.5 * (1 + MAGNIFIED)
    return Window(low * Lx, high * Lx, low * Ly, high * Ly)
