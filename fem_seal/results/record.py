"""Base class of the parts of result.json."""

from pydantic import BaseModel, ConfigDict


class Record(BaseModel):
    """Part of a result: frozen, without unknown fields."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)
