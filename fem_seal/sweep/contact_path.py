"""Surface, contact or start for the contact that a point of a sweep hands on to the next."""

from fem_seal.contact.predictor import extrapolated
from fem_seal.contact.state import ContactState, GapState
from fem_seal.grid import GridField
from fem_seal.parallel import Comm
from fem_seal.patch import Given, Patch
from fem_seal.progress import Report
from fem_seal.scene import Scene

# Loads whose contacts start from an extrapolation. The search for a prescribed area would end,
# within its tolerance, at another pressure than in a single run: it starts as single runs do.
EXTRAPOLATED = ("pressure", "mean_gap")


class ContactPath:
    """Hands the surface, which all points of a chain share, and the contact on to the next point.

    A point with the solid, contact and load of the last one takes its contact over. If only the
    value of a pressure or a mean gap differs, the contact starts from an extrapolation of the last
    states. It agrees with that of a single run within its certificate.
    """

    def __init__(self) -> None:
        self._last: tuple[Scene, GridField, GapState] | None = None
        #: the last two loads of a path, with their contacts
        self._states: list[tuple[float, ContactState]] = []

    def patch(
        self,
        scene: Scene,
        report: Report,
        *,
        trust: bool,
        comm: Comm,
    ) -> Patch:
        """Patch of the next point, with the surface, and the contact of the last one if it fits."""
        surface, contact, start = None, None, None
        if self._last is not None:
            last, surface, pressed = self._last
            if (scene.solid, scene.contact, scene.load) == (last.solid, last.contact, last.load):
                contact = pressed
            elif _path(scene) is not None and _path(scene) == _path(last):
                start = extrapolated(scene.load.value, self._states)
        return Patch(scene, report, given=Given(surface, contact, start), trust=trust, comm=comm)

    def follow(self, patch: Patch) -> None:
        """Keep surface and contact of a patch that has been computed, for the next point."""
        scene = patch.scene
        if patch.surface is None or patch.contact is None:
            return
        path = _path(scene)
        if self._last is None or path is None or path != _path(self._last[0]):
            self._states = []
        self._last = scene, patch.surface, patch.contact
        if path is not None and isinstance(patch.contact, ContactState):
            self._states = [*self._states[-1:], (scene.load.value, patch.contact)]


def _path(scene: Scene) -> tuple[object, ...] | None:
    """All of an elastic contact but the value of its load; None if no start is extrapolated."""
    if scene.contact is None or not scene.contact.is_elastic or scene.load.kind not in EXTRAPOLATED:
        return None
    unloaded = scene.contact.model_copy(update=dict.fromkeys(EXTRAPOLATED))
    return scene.surface, scene.solid, scene.load.kind, unloaded
