# %% [markdown]
# # What does a per cent cost?
#
# The leak rate of a rough contact has two errors. The flow is solved on a mesh; the bounds enclose
# that error,
#
#     lower ≤ Q(gap) ≤ upper,     flow part = (upper - lower) / (upper + lower),
#
# and it falls with the tolerance rtol. The gap itself comes from a contact solved on a grid,
#
#     min over p ≥ 0 of ∫ p (S p / 2 - h),     S(q) = 2 / (E* q),
#
# The grid misses asperities between its samples, and no flow solver can see that error. To estimate
# it, the contact of the *same* surface (its Fourier series sampled anew) is solved on grids of n/4,
# n/2, n and 2n points, and each leak rate is compared with that on the finest; what a still finer
# grid would change of that one is estimated.
#
# The demo computes all combinations of contact grid, flow method and tolerance, and names the
# cheapest one for each accuracy.

# %%
import argparse
from pathlib import Path

from fem_seal.scene import Scene
from fem_seal.verification.pictures import trade_figure
from fem_seal.verification.trade import Trade, TradePoint, recommend, trade

SCENE = Path(__file__).parent / "scenes" / "first.toml"

# %% [markdown]
# ## The seal
# Shortest wavelength eight samples, a rubber of 10 MPa pressed on with 0.12 MPa: a fifth of the
# nominal area touches.


# %%
def patch(n: int) -> Scene:
    """That of first.toml with other waves and less load, on n × n samples."""
    changes = ["surface.long_wavelength=50 um", f"surface.short_wavelength={800 / n} um"]
    changes += [f"surface.shape=[{n}, {n}]", "surface.seed=2", "contact.pressure=0.12 MPa"]
    return Scene.from_file(SCENE, changes)


# %%
def adaptive(result: Trade) -> dict[tuple[int, float], TradePoint]:
    """The certified points by samples along the flow and tolerance."""
    return {
        (point.samples[0], point.flow.rtol): point
        for point in result.points
        if point.flow.method == "adaptive"
    }


# %% [markdown]
# ## What to notice
# * On each contact grid a tighter tolerance soon gains nothing: the points lie on the dotted line,
#   the contact part of the error.
# * A loose flow on the finest contact is better than a tight one on the coarsest.
# * Finite differences are cheapest, but give no error estimate: their error is known only because
#   the bounds were computed as well.
# * The error is largest on the grid on which the shortest wave has two samples, however the flow is
#   solved.


# %%
def main(out: Path = Path("out"), n: int = 64) -> Trade:
    """Compute the trade, draw `price_of_accuracy.png` into `out`, check the claims above."""
    out.mkdir(parents=True, exist_ok=True)
    result = trade(patch(n), tolerances=(0.3, 0.1, 0.03))
    trade_figure(result, out / "price_of_accuracy.png", "one seal")
    print(f"leak rate {result.reference:.3e} m³/s ± {100 * result.uncertainty:.1f} %")
    print("\n".join(recommend(result)))
    points = adaptive(result)
    # On the coarsest grid ten times the accuracy of the flow changes the total error little ...
    coarse, fine = n // 4, 2 * n
    flow_gain = points[coarse, 0.3].flow_error - points[coarse, 0.03].flow_error
    assert points[coarse, 0.03].contact_error > 2 * flow_gain
    # ... and is worth less than a finer contact.
    assert points[fine, 0.3].total_error < points[coarse, 0.03].total_error
    # The best answer of all stands on the finest contact grid.
    assert min(result.points, key=lambda point: point.total_error).samples[0] == fine
    return result


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="error against time and memory")
    parser.add_argument("--out", type=Path, default=Path("out"))
    parser.add_argument("--n", type=int, default=64)
    main(**vars(parser.parse_args()))
