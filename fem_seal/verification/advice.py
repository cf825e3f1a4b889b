"""Sentences on the cheapest point of a trade for each accuracy."""

from collections.abc import Sequence

from fem_seal.verification.trade import Trade, TradePoint

TARGETS = (0.5, 0.2, 0.1, 0.05, 0.02)


def recommend(result: Trade, targets: Sequence[float] = TARGETS) -> tuple[str, ...]:
    """Sentence on the cheapest point of a trade for each total relative error.

    A single one if the leak rate still changes by its own size from one contact grid to the next:
    its limit is then unknown.
    """
    if result.uncertainty >= 1:
        return (
            "nothing to recommend: from one contact grid to the next the leak rate changes so much "
            f"that its limit is known to {100 * result.uncertainty:.0f} % only; take more samples",
        )
    return tuple(_advice(result, target) for target in sorted(targets, reverse=True))


def _advice(result: Trade, target: float) -> str:
    prefix = f"for {100 * target:g} %"
    accurate = [point for point in result.points if point.total_error <= target]
    if not accurate:
        least = min(result.points, key=lambda point: point.total_error)
        return f"{prefix}: nothing tried here; the best is {_describe(least)}"
    cheapest = min(accurate, key=lambda point: point.seconds)
    certified = [point for point in accurate if point.certified]
    if not certified:
        return f"{prefix}: only without bounds, {_describe(cheapest)}"
    bounded = min(certified, key=lambda point: point.seconds)
    if bounded is cheapest:
        return f"{prefix}: {_describe(bounded)}"
    return f"{prefix}: {_describe(bounded)}; without bounds of its own {_describe(cheapest)}"


def _describe(point: TradePoint) -> str:
    grid = " x ".join(map(str, point.samples))
    return (
        f"contact on {grid}, {point.flow}: about {point.seconds:.2g} s and "
        f"{point.memory_bytes / 1e6:.0f} MB (contact grid {100 * point.contact_error:.2g} %, "
        f"flow {100 * point.flow_error:.2g} %)"
    )
