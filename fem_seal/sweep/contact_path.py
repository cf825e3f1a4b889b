"""Surface, contact or start for the contact that a point of a sweep hands on to the next."""

from fem_seal.contact.load_path import Predictor
from fem_seal.contact.settings import Load
from fem_seal.contact.state import ContactState, GapState
from fem_seal.errors import present
from fem_seal.grid import GridField
from fem_seal.parallel import Comm
from fem_seal.patch import Patch
from fem_seal.progress import Report, silent
from fem_seal.scene import Scene

# Loads whose contacts start from an extrapolation. The search for a prescribed area would end,
# within its tolerance, at another pressure than in a single run: it starts as single runs do.
EXTRAPOLATED = ("pressure", "mean_gap")


class ContactPath:
    """Hands surface and contact on from one point of a sweep to the next.

    A point with the same surface as the last one takes it over; if its solid and contact are the
    same too, it takes over the contact. If only the value of a pressure or a mean gap differs, the
    contact starts from an extrapolation of the last states. It agrees with that of a single run
    within its certificate.
    """

    def __init__(self) -> None:
        self._last: tuple[Scene, GridField, GapState] | None = None
        self._predictor = Predictor()

    def patch(
        self,
        scene: Scene,
        report: Report = silent,
        *,
        trust: bool = False,
        comm: Comm = None,
    ) -> Patch:
        """Patch of the next point, with surface and contact of the last one if they fit."""
        surface, contact, start = None, None, None
        if self._last is not None:
            last, last_surface, last_contact = self._last
            if scene.surface != last.surface:
                self._last = None
            else:
                surface = last_surface
                if (scene.solid, scene.contact) == (last.solid, last.contact):
                    contact = last_contact
                elif _one_path(last, scene):
                    start = self._predictor.start(present(_load(scene), "load"))
        return Patch(
            scene,
            report,
            trust=trust,
            surface=surface,
            contact=contact,
            contact_start=start,
            comm=comm,
        )

    def follow(self, patch: Patch) -> None:
        """Keep surface and contact of a patch that has been computed, for the next point."""
        scene = patch.scene
        if patch.surface is None or patch.contact is None:
            return
        if self._last is None or not _one_path(self._last[0], scene):
            self._predictor = Predictor()
        self._last = scene, patch.surface, patch.contact
        load = _load(scene)
        if load is not None and isinstance(patch.contact, ContactState):
            self._predictor.remember(load, patch.contact)


def _load(scene: Scene) -> Load | None:
    """Load of a contact whose start can be extrapolated; None for other contacts."""
    load = None if scene.contact is None else scene.load
    return load if load is not None and load.kind in EXTRAPOLATED else None


def _one_path(one: Scene, other: Scene) -> bool:
    """Whether two elastic contacts differ in nothing but the value of their load."""
    load, other_load, contact, other_contact = _load(one), _load(other), one.contact, other.contact
    if load is None or other_load is None or contact is None or other_contact is None:
        return False
    if load.kind != other_load.kind or not contact.is_elastic:
        return False
    unloaded = dict.fromkeys(EXTRAPOLATED)
    same = contact.model_copy(update=unloaded) == other_contact.model_copy(update=unloaded)
    return same and (one.surface, one.solid) == (other.surface, other.solid)
