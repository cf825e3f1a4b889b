# %% [markdown]
# # How does a seal close?
#
# Just before a seal is tight all the fluid passes one saddle of the gap, between two patches of
# contact about to meet. How fast does the leak rate vanish with the load?
#
#     min over p ≥ 0 of ∫ p (S p / 2 - h),  S(q) = 2 / (E* q),       h = H (cos 2πy/λ - cos 2πx/λ)
#     ∇·(g³ ∇P) = 0,   Q = ∫ g³ |∇P|²
#
# Were the saddle a channel of fixed shape, Q would follow its gap as g³. Dapp and Müser (EPL 109,
# 44001, 2015) measured Q ∝ (p_c - p)^(69/20) in simulations: gap, width and length of the
# constriction all shrink, each with a power of its own. This demo checks the exponent.

# %%
import argparse
from itertools import pairwise
from pathlib import Path

from fem_seal.letter.saddle import (
    DISTANCES,
    EXPONENT,
    LocalExponent,
    close_saddle,
    closing_pressure,
    local_exponents,
)
from fem_seal.verification.pictures import saddle_figure

# %% [markdown]
# ## What to do
# Bisect the pressure p_c at which the lattice seals; then solve the contact at falling distances
# from it and enclose the leak rate to 1 %. The slope between neighbours in doubly logarithmic axes
# is the local exponent. Do so on two grids: a constriction that a grid cannot resolve closes too
# early.
#
# ## What to notice
# * Far from closing the exponent is near 4; it falls towards closing. The exponent of a fit
#   therefore depends on the range of loads.
# * The leak rate vanishes more slowly than the gap cubed: the constriction becomes shorter as well.
# * Both grids agree until the constriction is a few samples wide. Nearer to closing the coarse grid
#   is wrong although its bracket is as narrow as before: the bounds hold for the gap that was
#   computed.


# %%
def main(out: Path = Path("out"), n: int = 128) -> tuple[LocalExponent, ...]:
    """Close the saddle on n/2 and n samples, draw `closing_saddle.png`, check the claims above."""
    out.mkdir(parents=True, exist_ok=True)
    series = [close_saddle(closing_pressure(m), DISTANCES[:7]) for m in (n // 2, n)]
    saddle_figure(series, out / "closing_saddle.png")
    coarse, fine = map(local_exponents, series)
    for e in fine:
        print(f"(p_c - p)/p_c = {e.distance:.3f}: exponent {e.value:.2f} ± {e.error:.2f}")
    # The exponents fall, and reach the published one at a distance of a hundredth.
    assert all(near.value < far.value for far, near in pairwise(fine))
    assert fine[0].value > EXPONENT + 0.3
    assert abs(fine[-1].value - EXPONENT) < 0.1
    # The leak rate vanishes more slowly than the gap cubed, faster than the gap squared.
    assert all(2 * e.gap < e.value < 3 * e.gap for e in fine)
    # Far from closing both grids agree within their brackets, at a hundredth no longer.
    apart = [abs(a.value - b.value) > a.error + b.error for a, b in zip(coarse, fine, strict=True)]
    assert not apart[0]
    assert any(apart)
    return fine


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="leak rate of a closing saddle")
    parser.add_argument("--out", type=Path, default=Path("out"))
    parser.add_argument("--n", type=int, default=128)
    main(**vars(parser.parse_args()))
