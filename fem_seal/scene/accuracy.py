"""The section that asks for a total error instead of a tolerance of the flow alone."""

from typing import TYPE_CHECKING

from pydantic import Field

from fem_seal.scene.messages import ContradictionError
from fem_seal.scene.sections import Count, Number, Section

if TYPE_CHECKING:
    from fem_seal.scene.scene import Scene


class Accuracy(Section):
    """How wrong the leak rate may be in all; contact grid and flow.rtol are chosen to suit."""

    total: Number = Field(gt=0, lt=1, description="relative error of the leak rate wanted")
    max_refinement: Count = Field(
        4, description="finest contact grid tried, in multiples of the samples of the surface"
    )


def check_accuracy(scene: "Scene") -> None:
    """Hold [accuracy] against the rest of a scene; ContradictionError where they do not agree."""
    if scene.accuracy is None:
        return
    if scene.surface is None:
        raise ContradictionError(
            "[accuracy] needs [surface] and [contact]: the contact of a given gap cannot be solved "
            "on another grid; set flow.rtol"
        )
    if not scene.needs_flow:
        raise ContradictionError(
            "[accuracy] is about the leak rate, which output.products does not name"
        )
    if "rtol" in scene.flow.model_fields_set:
        raise ContradictionError("accuracy.total chooses flow.rtol itself; give one of the two")
    if scene.flow.method == "finite-difference":
        raise ContradictionError(
            "accuracy.total needs bounds, and flow.method = 'finite-difference' has none; choose "
            "adaptive or uniform"
        )
