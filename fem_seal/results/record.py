"""Base class of the parts of result.json."""

from pydantic import BaseModel, ConfigDict

from fem_seal.scene.readable import own_names


class Record(BaseModel):
    """Part of a result: frozen, without unknown fields."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)

    def __dir__(self) -> list[str]:
        """Names of a record, without those that pydantic adds."""
        return own_names(self)
