# %% [markdown]
# # How does a seal close?
#
# Just before a seal is tight all the fluid passes one saddle of the gap, between two contact spots
# about to meet. How fast does the leak rate Q vanish with the load P₀? The contact pressure p_c
# has the mean P₀, the surface is h = H (cos 2πy/λ - cos 2πx/λ), S(q) = 2 / (E* q) the compliance:
#
#     strong: g = S p_c - h + const ≥ 0, p_c ≥ 0, p_c g = 0;  ∇·(g³ ∇p) = 0, p = 1 and 0 at the ends
#     weak: ∫ (S p_c - h) (r - p_c) dA ≥ 0 for all r ≥ 0 of mean P₀;  ∫ g³ ∇p·∇q dA = 0, q = 0 there
#
# If the saddle were a channel of fixed shape, Q = ∫ g³ |∇p|² dA would go as the cube of its gap.
# Dapp and Müser (EPL 109, 44001, 2015) found Q ∝ (P* - P₀)^(69/20). The demo runs in one process,
# since threads solve the contacts.

# %%
import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import curve_fit

from fem_seal.contact import ContactState, ContactStopping, ElasticSolid, Load, press
from fem_seal.film import GridFilm
from fem_seal.flow import FlowSettings, leak_rate
from fem_seal.grid import GridField
from fem_seal.render.plot import new_figure
from fem_seal.threshold import threshold_of_pressure

EXPONENT = 69 / 20
# (P* - P₀)/P*; at the smallest one 1024 samples just resolve the saddle.
DISTANCES = 0.32 * 10 ** (-np.arange(9) / 4)
CENTRES = np.sqrt(DISTANCES[1:] * DISTANCES[:-1])


@dataclass(frozen=True)
class Saddle:
    """A saddle that closes. Units: λ, H, E* H/λ, and H³ Δp/(12 η) of the leak rates."""

    samples: int  #: along a period
    closing: float  #: load P* that seals
    gaps: tuple[float, ...]  #: at the saddle, at each distance
    bounds: tuple[tuple[float, float], ...]  #: of the leak rate

    @property
    def rates(self) -> np.ndarray:
        return np.sqrt(np.prod(self.bounds, axis=1))

    @property
    def exponents(self) -> np.ndarray:
        """d ln Q / d ln(P* - P₀) between neighbouring distances."""
        return np.diff(np.log(self.rates)) / np.diff(np.log(DISTANCES))

    @property
    def errors(self) -> np.ndarray:
        """Half-widths of the exponents, from the brackets of both leak rates."""
        half = 0.5 * np.log([upper / lower for lower, upper in self.bounds])
        return (half[1:] + half[:-1]) / -np.diff(np.log(DISTANCES))


def pressed(samples: int, pressure: float) -> ContactState:
    """One period of the lattice, with the saddle in its middle, under a mean pressure."""
    wave = np.cos(2 * np.pi * np.arange(samples) / samples)
    lattice = GridField(wave[None, :] - wave[:, None], (1 / samples, 1 / samples), periodic=True)
    stopping = ContactStopping(tolerance=1e-10)
    return press(lattice, ElasticSolid(1.0), Load("pressure", pressure), stopping)


def saddle(samples: int) -> Saddle:
    """Find the pressure that closes the saddle, then enclose leak rates ever nearer to it."""
    start, is_sealed = pressed(samples, 0.5), lambda gap: GridFilm(gap, "periodic").sealed
    closing = threshold_of_pressure(
        start, lambda pressure, _: pressed(samples, pressure), is_sealed, precision=1e-6
    ).pressure_sealed
    gaps = [pressed(samples, closing * (1 - distance)).gap for distance in DISTANCES]
    settings = FlowSettings(viscosity=1 / 12, pressure_drop=1.0, rtol=0.01)
    bounds = tuple(leak_rate(GridFilm(gap, "periodic"), settings).bounds for gap in gaps)
    tightest = tuple(float(gap.values[samples // 2, samples // 2]) for gap in gaps)
    return Saddle(samples, closing, tightest, bounds)


def limit(coarse: Saddle, fine: Saddle) -> tuple[float, float]:
    """Exponent at closing, β of β + a x^ω, on infinitely fine grids, with its error.

    The change from n to 2n samples is added once more to each exponent; an exponent that changes
    more counts less in the fit. The error is that of fit and extrapolation.
    """
    change = fine.exponents - coarse.exponents
    width = np.hypot(fine.errors, change)
    (on_fine, _), (best, covariance) = (
        curve_fit(lambda x, b, a, w: b + a * x**w, CENTRES, y, p0=(y[-1], 1, 0.5), sigma=width)
        for y in (fine.exponents, fine.exponents + change)
    )
    return float(best[0]), float(np.hypot(covariance[0, 0] ** 0.5, best[0] - on_fine[0]))


# %% [markdown]
# ## What to notice
# * Far from closing the exponent is near 4; it falls towards closing.
# * The leak rate vanishes more slowly than the gap cubed: the constriction becomes shorter as well.
# * Both grids agree until the constriction is a few samples wide. Nearer to closing the coarse grid
#   is wrong although its bracket is as narrow as before: the bounds hold for the computed gap.


# %%
def show(saddles: list[Saddle], path: Path) -> None:
    """Draw leak rates and local exponents against the distance in load; print the exponents."""
    with new_figure((10, 4.4), path) as figure:
        axis = {"xscale": "log", "xlabel": "distance in load, $(P_* - P_0)\\,/\\,P_*$"}
        rates, slopes = figure.subplots(1, 2, subplot_kw=axis)
        for one in saddles:
            style = {"marker": "o", "ms": 4, "lw": 1, "label": f"{one.samples} samples a period"}
            rates.plot(DISTANCES, one.rates, **style)
            slopes.errorbar(CENTRES, one.exponents, one.errors, capsize=2, **style)
        finest = saddles[-1]
        law = finest.rates[-1] * (DISTANCES / DISTANCES[-1]) ** EXPONENT
        rates.plot(DISTANCES, law, "k--", lw=1, label="$(P_* - P_0)^{69/20}$")
        slopes.axhline(EXPONENT, color="k", ls="--", lw=1)
        rates.set(yscale="log", ylabel="leak rate [H³ Δp/(12 η)]", title="The leak rate vanishes,")
        slopes.set(ylabel="$d\\,\\ln Q\\,/\\,d\\,\\ln(P_* - P_0)$", title="and its exponent falls")
        rates.legend(frameon=False, fontsize=8)
    for distance, exponent, error in zip(CENTRES, finest.exponents, finest.errors, strict=True):
        print(f"(P* - P₀)/P* = {distance:.4f}: exponent {exponent:.2f} ± {error:.2f}")
    print("at closing: {:.3f} ± {:.3f}; published 3.45".format(*limit(*saddles[-2:])))


def main(out: Path = Path("out"), samples: tuple[int, ...] = (64, 128)) -> list[Saddle]:
    """Close the saddle on grids, each twice as fine, draw it, check the claims above."""
    saddles = [saddle(n) for n in samples]
    show(saddles, out / "closing_saddle.png")
    coarse, fine = saddles[-2:]
    first, gap = fine.exponents[:6], np.diff(np.log(fine.gaps[:7])) / np.diff(np.log(DISTANCES[:7]))
    # First nearer to 4. The exponent of a fit to four distances is known to half its change there.
    assert first[0] > (4 + EXPONENT) / 2
    assert (np.diff(first) < 0).all()
    assert abs(first[-1] - EXPONENT) < (first[-4] - first[-1]) / 2
    assert ((2 * gap < first) & (first < 3 * gap)).all()
    # Far from closing both grids agree within their brackets, nearest to it from 512 samples on.
    apart = abs(coarse.exponents - fine.exponents) > coarse.errors + fine.errors
    assert (apart[0], apart[-1]) == (False, coarse.samples < 512)
    return saddles


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="leak rate of a closing saddle")
    parser.add_argument("--out", type=Path, default=Path("out"))
    parser.add_argument("--samples", type=int, nargs="+", default=(64, 128))
    main(**vars(parser.parse_args()))
