"""What all parts of result.json share."""

from pydantic import BaseModel, ConfigDict


class Record(BaseModel):
    """Part of a result: nothing changes after it was made, nothing unknown is read."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)
