"""Scene: the content of a scene file, checked, frozen and in SI units."""

from fem_seal.scene.contact import Contact, Solid
from fem_seal.scene.fluid import Fluid
from fem_seal.scene.measured import FileSurface, Gap, Heights, ProfileSurface
from fem_seal.scene.scene import Scene
from fem_seal.scene.seal import Seal
from fem_seal.scene.sections import Accuracy, Flow, Limit, Output
from fem_seal.scene.surface import SelfAffine
from fem_seal.scene.tolerances import Tolerances
