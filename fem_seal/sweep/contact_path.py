"""What the points of a sweep hand on: surface, contact, or a start for the contact."""

from fem_seal.contact.load_path import Predictor
from fem_seal.contact.solve import Load
from fem_seal.contact.state import ContactState, GapState
from fem_seal.grid import GridField
from fem_seal.scene import Scene
from fem_seal.seal import Seal

# Where the area is prescribed the pressure is found by a search that may end elsewhere within its
# tolerance when it starts elsewhere: such contacts start as single runs do.
FORETOLD = ("pressure", "mean_gap")


class ContactPath:
    """The last point of a sweep, and what its contacts foretell about the next.

    A point with the surface of the last one takes it over; with its solid and contact, the contact
    too. Where only the value of a pressure or a mean gap is another, the contact starts from what
    the states before foretell, and is that of a single run within its certificate.
    """

    def __init__(self):
        self._last: tuple[Scene, GridField, GapState] | None = None
        self._predictor = Predictor()

    def lead(self, seal: Seal) -> None:
        """Give a seal what it can use."""
        if self._last is None:
            return
        scene, surface, contact = self._last
        if seal.scene.surface != scene.surface or seal.scene.accuracy is not None:
            self._last = None
            return
        seal.surface = surface
        if (seal.scene.solid, seal.scene.contact) == (scene.solid, scene.contact):
            seal.contact = contact
        elif _one_path(scene, seal.scene):
            seal.contact_start = self._predictor.start(_load(seal.scene))

    def follow(self, seal: Seal) -> None:
        """Take note of a seal that has been computed."""
        scene = seal.scene
        if seal.surface is None or scene.accuracy is not None:
            return
        if self._last is None or not _one_path(self._last[0], scene):
            self._predictor = Predictor()
        self._last = scene, seal.surface, seal.contact
        load = _load(scene)
        if load is not None and isinstance(seal.contact, ContactState):
            self._predictor.remember(load, seal.contact)


def _load(scene: Scene) -> Load | None:
    """Load of a contact whose start may be foretold."""
    for kind in FORETOLD:
        value = getattr(scene.contact, kind)
        if value is not None:
            return Load(kind, value)
    return None


def _one_path(one: Scene, other: Scene) -> bool:
    """Whether nothing that shapes the elastic contact differs but the value of the load."""
    loads = _load(one), _load(other)
    if None in loads or loads[0].kind != loads[1].kind or one.contact.model != "gfmd":
        return False
    unloaded = dict.fromkeys(FORETOLD)
    contacts = [scene.contact.model_copy(update=unloaded) for scene in (one, other)]
    return (one.surface, one.solid, contacts[0]) == (other.surface, other.solid, contacts[1])
