"""The section that prescribes a total error instead of a tolerance of the flow alone."""

from pydantic import Field

from fem_seal.scene.measured import Truth
from fem_seal.scene.sections import Count, Number, Section


class Accuracy(Section):
    """Largest total error of the leak rate; contact grid and flow.rtol are chosen for it."""

    total: Number | None = Field(
        None, gt=0, lt=1, description="largest relative error of the leak rate"
    )
    max_refinement: Count = Field(
        4, description="finest contact grid tried, in multiples of the samples of the surface"
    )
    contact_grid: Truth = Field(
        True, description="whether half of the samples say what the grid of the contact changes"
    )
