"""From a surface and a load to the elastic contact."""

from dataclasses import replace

import numpy as np

from fem_seal.arguments import require_kind
from fem_seal.contact.area_control import contact_of_area
from fem_seal.contact.contact_pair import ContactPair
from fem_seal.contact.methods import USUAL_STOPPING, ContactStopping
from fem_seal.contact.settings import USUAL_ARITHMETIC, Arithmetic, ElasticSolid, Load
from fem_seal.contact.state import ContactState
from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField


def press(
    height: GridField,
    solid: ElasticSolid,
    load: Load,
    stopping: ContactStopping = USUAL_STOPPING,
    arithmetic: Arithmetic = USUAL_ARITHMETIC,
    start: np.ndarray | GridField | ContactState | None = None,
) -> ContactState:
    """Dry contact of a rough face with an elastic solid; `fem_seal.solve` adds the fluid.

    Without friction and adhesion. The fluid's pressure, which lifts the solid in a scene
    (`flow.lift`), is not in it.
    Minimises ``V = (A0/4) E* Σ q |ũ(q)|²`` under a load and u >= h (Dapp et al., Phys. Rev. Lett.
    108, 244301 (2012)), small slopes, periodic.

    Parameters
    ----------
    height
        Heights [m], periodic; the highest points touch first.
    solid
        Half-space, or a layer of finite thickness.
    load
        No pressure and no area are first touch. An area is reached to 1 part in 1000 or half a
        sample or, where equal heights touch together, to the nearer side of the jump; a mean gap
        to 1 part in 10 000.
    stopping
        Solver and tolerance. At every tolerance pressed samples touch to 1e-4 of the rms height.
    arithmetic
        Threads and precision.
    start
        Pressure [Pa] to start from, an array or a field, or the state of another load; it is set
        to zero on samples that it leaves open.

    Raises
    ------
    InvalidInput
        If the heights are not periodic, or the start is no pressure on their grid.
    NotConverged
        If the certificate does not reach the tolerance, if pressed samples do not touch or samples
        overlap by more than 1e-4 of the rms height, or if the mean gap is not the prescribed one.
    """
    require_kind(ElasticSolid, solid=solid)
    require_kind(Load, load=load)
    pair = ContactPair(height, solid, arithmetic)
    first = _start_pressure(start, height.shape)
    if load.value == 0:
        return pair.touching()
    if first is not None:
        first = pair.complementary(first)
    reach = {
        "pressure": pair.under_pressure,
        "mean_gap": pair.at_mean_gap,
        "area_fraction": lambda *args: contact_of_area(pair, *args),
    }[load.kind]
    return replace(reach(load.value, stopping, first), fft_pairs=pair.half_space.fft_pairs)


def _start_pressure(
    start: np.ndarray | GridField | ContactState | None, shape: tuple[int, int]
) -> np.ndarray | None:
    """Pressure to start from as an array [Pa]."""
    if start is None:
        return None
    given = start.pressure if isinstance(start, ContactState) else start
    values = np.asarray(given.values if isinstance(given, GridField) else given, float)
    if values.shape != shape or not np.isfinite(values).all() or values.min() < 0:
        raise InvalidInput(
            f"start must be a finite pressure >= 0 of shape {shape}; got shape {values.shape}, "
            f"from {values.min(initial=0.0):g} to {values.max(initial=0.0):g} Pa"
        )
    return values
