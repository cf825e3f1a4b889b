"""The section that asks for a total error instead of a tolerance of the flow alone."""

from pydantic import Field

from fem_seal.scene.sections import Count, Number, Section


class Accuracy(Section):
    """How wrong the leak rate may be in all; contact grid and flow.rtol are chosen to suit."""

    total: Number = Field(gt=0, lt=1, description="relative error of the leak rate wanted")
    max_refinement: Count = Field(
        4, description="finest contact grid tried, in multiples of the samples of the surface"
    )
