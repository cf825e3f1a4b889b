"""Base class of the parts of result.json."""

from math import isfinite
from typing import Annotated

from pydantic import BaseModel, BeforeValidator, ConfigDict

from fem_seal.scene.readable import own_names

# A number that JSON can hold: what is infinite, or not known, is null.
Finite = Annotated[
    float | None,
    BeforeValidator(lambda x: x if not isinstance(x, float) or isfinite(x) else None),
]


class Record(BaseModel):
    """Part of a result: frozen, without unknown fields, made of an object with such attributes."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", populate_by_name=True, from_attributes=True
    )

    def __dir__(self) -> list[str]:
        """Names of a record, without those that pydantic adds."""
        return own_names(self)
