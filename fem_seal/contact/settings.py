"""Settings of a contact: the solid, one load, and the arithmetic."""

from dataclasses import dataclass
from typing import Literal, cast, get_args

from fem_seal.arguments import require_count, require_known, require_not_negative, require_positive
from fem_seal.contact.halfspace import PRECISIONS, Layer
from fem_seal.errors import InvalidInput

# Peak memory of a surface with its elastic contact in mixed precision [bytes a sample]: the least
# that was measured (4096 x 4096 samples), below which no contact is begun, and the usual one, by
# which memory is predicted (whole runs take 0.9 to 1.2 of that). 512 x 512 to 2048 x 2048 samples
# took 99 to 102.
LEAST_BYTES, USUAL_BYTES = 72, 85


@dataclass(frozen=True)
class ElasticSolid:
    """The elastic solid."""

    contact_modulus: float  #: E* [Pa], 1/E* = (1 - ν1²)/E1 + (1 - ν2²)/E2
    layer: Layer | None = None  #: layer of finite thickness; None for a half-space

    def __post_init__(self) -> None:
        require_positive(contact_modulus=self.contact_modulus)


@dataclass(frozen=True)
class Arithmetic:
    """How the transforms are computed."""

    threads: int | None = None  #: of FFTs and passes over arrays; None: `HalfSpace` chooses
    #: "double", or "mixed": single precision until the certificate comes near the tolerance; the
    #: result is double
    precision: str = "mixed"

    def __post_init__(self) -> None:
        require_known(PRECISIONS, self.precision, "precision")
        if self.threads is not None:
            require_count(threads=self.threads)


USUAL_ARITHMETIC = Arithmetic()


LoadKind = Literal["pressure", "area_fraction", "mean_gap"]


@dataclass(frozen=True)
class Load:
    """The one prescribed quantity."""

    kind: LoadKind
    value: float  #: mean pressure [Pa] >= 0, contact area fraction in [0, 1), or mean gap [m] > 0

    def __post_init__(self) -> None:
        require_known(get_args(LoadKind), self.kind, "load")
        # Full contact is a matter of pressure.
        check = require_positive if self.kind == "mean_gap" else require_not_negative
        check(**{self.kind: self.value})
        if self.kind == "area_fraction" and self.value >= 1:
            raise InvalidInput(f"area_fraction must lie in [0, 1), got {self.value}")


def one_load(**named_loads: float | None) -> Load:
    """Return the only load that is not None."""
    loads = [
        Load(cast(LoadKind, kind), value)
        for kind, value in named_loads.items()
        if value is not None
    ]
    if len(loads) != 1:
        named = ", ".join(load.kind for load in loads) or "none"
        raise InvalidInput(f"give exactly one load out of {', '.join(named_loads)}; got {named}")
    return loads[0]
