"""The elastic half-space, or a layer on a rigid base, as an operator on periodic grids."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fem_seal.arguments import choose, require_known, require_positive
from fem_seal.contact.blocks import RowPasses
from fem_seal.contact.transform import RealTransform
from fem_seal.errors import InvalidInput
from fem_seal.parallel import cores
from fem_seal.surface.spectrum import multiplicity, wavenumbers

PRECISIONS = {"double": "float64", "mixed": "float32"}


def _fixed(depth: np.ndarray, nu: float) -> np.ndarray:
    """Bonded base: (2κ sinh 2ξ - 4ξ) / (2κ cosh 2ξ + 4ξ² + 1 + κ²), κ = 3 - 4ν."""
    kappa = 3 - 4 * nu
    # Multiply both by 2 exp(-2ξ), so that short waves in a thick layer do not overflow.
    decay = np.exp(-2 * depth)
    above = 2 * kappa * -np.expm1(-4 * depth) - 8 * depth * decay
    below = 2 * kappa * (1 + decay**2) + 2 * decay * (4 * depth**2 + 1 + kappa**2)
    return above / below


def _sliding(depth: np.ndarray, nu: float) -> np.ndarray:
    """Frictionless base: (cosh 2ξ - 1) / (sinh 2ξ + 2ξ), the same for every ν."""
    decay = np.exp(-2 * depth)
    return np.expm1(-2 * depth) ** 2 / (-np.expm1(-4 * depth) + 4 * depth * decay)


# Least factor of a layer: below it the terms of `_fixed` leave few digits of their difference, and
# the squares of pressures soon exceed single precision.
LEAST_COMPLIANCE = 1e-15


BASES = {"fixed": _fixed, "sliding": _sliding}


@dataclass(frozen=True)
class Layer:
    """An elastic layer of finite thickness on a rigid plane base.

    The normal compliance of wavenumber q is 2/(E* q) times a factor of ξ = q × thickness that tends
    to 1 for short waves (P. Meijers, Appl. Sci. Res. 18, 353 (1968); K. L. Johnson, Contact
    Mechanics (1985), section 5.8). E* = E/(1 - ν²) is the layer's own: the counter-face is rigid.
    """

    thickness: float  #: [m], > 0
    base: str = "fixed"  #: "fixed" or "sliding": bonded to the base, or without friction on it
    poisson_ratio: float = 0.5  #: ν in (-1, 0.5]; it matters for the bonded layer only

    def __post_init__(self) -> None:
        require_positive(thickness=self.thickness)
        require_known(BASES, self.base, "base")
        if not -1 < self.poisson_ratio <= 0.5:
            raise InvalidInput(f"poisson_ratio must lie in (-1, 0.5], got {self.poisson_ratio}")

    def compliance_factor(self, q: np.ndarray) -> np.ndarray:
        """Compliance relative to the half-space, in (0, 1], at wavenumbers q > 0 [1/m]."""
        return BASES[self.base](np.asarray(q) * self.thickness, self.poisson_ratio)


# On fewer samples a second thread costs about as much as it saves.
THREADED_FROM = 512**2


class HalfSpace:
    """Displacement under a pressure, ũ(q) = p̃(q) / k(q), and the inverse, by FFT.

    Dimensionless: with ℓ = (dx dy)^(1/2) and any height unit, pressures are in units of E* × height
    / (2ℓ), so that k(q) = qℓ for the half-space (elastic energy of Campañá, Müser, Phys. Rev. B 74,
    075420 (2006): (1/4) E* q |ũ|² a mode). The mean of every displacement is zero: it is determined
    by the load, not by elasticity.

    Signs: a pressure > 0 is compression; a displacement > 0 moves the solid away from the
    counter-face and opens the gap.

    Parameters
    ----------
    threads
        Threads of the FFTs and of the passes over the arrays; None for the cores of this process,
        or for one below `THREADED_FROM` samples.
    precision
        "mixed" or "double": precision of `steer`, in which a solver computes what only steers its
        iteration, and what is not yet near its tolerance.

    Attributes
    ----------
    exact, steer
        The work arrays, in double and in the steering precision.
    fft_pairs
        FFT pairs (forward and backward) spent so far.
    softest, stiffest
        Least k above 0 and largest k of a mode.
    point_stiffness
        Pressure on one sample over the displacement it causes there.
    rms_compliance
        Rms of 1/k over all modes: the rms displacement under white noise of rms 1.
    """

    def __init__(
        self,
        shape: tuple[int, int],
        spacing: tuple[float, float],
        layer: Layer | None = None,
        threads: int | None = None,
        precision: str = "mixed",
    ):
        self.shape, self.fft_pairs = shape, 0.0
        if threads is None:
            threads = cores() if shape[0] * shape[1] >= THREADED_FROM else 1
        self.layer, self.threads = layer, threads
        self.passes = RowPasses(threads)
        self.steering = np.dtype(choose(PRECISIONS, precision, "precision"))
        self.exact = RealTransform(shape, "float64", self.passes)
        self.steer = RealTransform(shape, self.steering.name, self.passes)
        stiffness = wave_stiffness(shape, spacing, layer)
        self.softest = float(np.min(stiffness, initial=np.inf, where=stiffness > 0))
        self.stiffest = float(stiffness.max())
        samples = shape[0] * shape[1]
        steering_stiffness = (stiffness / samples).astype(self.steering)
        # Stiffness of the mean, used only under mean-gap control. The mean pressure is then free
        # and costs no energy, so its stiffness must be large; around this value the number of
        # iterations changes little.
        steering_stiffness[0, 0] = self.stiffest / (2 * samples)
        self._steering_stiffness = self.steer.in_blocks(steering_stiffness)
        compliance = np.divide(1 / samples, stiffness, out=stiffness, where=stiffness > 0)
        weights = np.multiply(
            compliance, multiplicity(shape[1]), dtype=self.steering, casting="same_kind"
        )
        self.point_stiffness = 1 / float(weights.sum(dtype=float))
        # Both factors carry 1 / samples.
        self.rms_compliance = float(np.sqrt(samples * np.vdot(weights, compliance)))
        self._energy_weights = self.steer.in_blocks(weights)
        self._compliance = self.exact.in_blocks(compliance)

    @cached_property
    def _stiffness(self) -> list[np.ndarray]:
        """k(q) over the number of samples, in double; free-set-cg does without it."""
        samples = self.shape[0] * self.shape[1]
        return [
            np.divide(samples**-2, block, out=np.zeros_like(block), where=block > 0)
            for block in self._compliance
        ]

    @cached_property
    def _steering_compliance(self) -> list[np.ndarray]:
        """1/k(q) over the number of samples in the steering precision; only the lift needs it."""
        compliance = np.concatenate(self._compliance).T
        return self.steer.in_blocks(compliance.astype(self.steering))

    def displacement(self, pressure: np.ndarray) -> np.ndarray:
        """Displacement of zero mean [a view of the work array, until the next call]."""
        self.exact.values[...] = pressure
        return self.displace()

    def pressure(self, displacement: np.ndarray) -> np.ndarray:
        """Pressure of zero mean that causes a displacement [a view of the work array]."""
        self.exact.values[...] = displacement
        return self.stiffen()

    def stiffen(self) -> np.ndarray:
        """Turn the displacement in ``exact.values`` into its pressure, in place."""
        return self._apply(self.exact, self._stiffness)

    def displace_in_steer(self) -> np.ndarray:
        """Turn the pressure in ``steer.values`` into its displacement, in place."""
        return self._apply(self.steer, self._steering_compliance)

    def displace(self) -> np.ndarray:
        """Turn the pressure in ``exact.values`` into its displacement, in place."""
        return self._apply(self.exact, self._compliance)

    def precondition(self) -> np.ndarray:
        """Turn the gap in ``steer.values`` into the pressure that would close it, in place."""
        return self._apply(self.steer, self._steering_stiffness)

    def curvature(self) -> float:
        """Sum over the grid of the pressure in ``steer.values`` × its displacement, by Parseval.

        Half an FFT pair; the work array is destroyed.
        """
        self.fft_pairs += 0.5

        def energy(modes: np.ndarray, weights: np.ndarray) -> float:
            power = modes.real**2 + modes.imag**2
            power *= weights
            return float(power.sum())

        return sum(self.steer.forward(energy, self._energy_weights))

    def _apply(self, work: RealTransform, factors: list[np.ndarray]) -> np.ndarray:
        work.multiply(factors)
        self.fft_pairs += 1
        return work.values


def wave_stiffness(
    shape: tuple[int, int], spacing: tuple[float, float], layer: Layer | None
) -> np.ndarray:
    """Return k(q), zero for the mean, (nx, ny // 2 + 1)."""
    q = wavenumbers(shape, spacing)
    stiffness = q * (spacing[0] * spacing[1]) ** 0.5
    if layer is not None:
        waves = q > 0
        factor = layer.compliance_factor(q[waves])
        if not factor.min(initial=1.0) >= LEAST_COMPLIANCE:
            raise InvalidInput(
                f"a layer of thickness {layer.thickness:g} m yields to the longest wave of the "
                f"surface, {2 * np.pi / q[waves].min():.3g} m, less than {LEAST_COMPLIANCE:g} "
                "times as much as a half-space does: check the units of layer_thickness and surface"
            )
        stiffness[waves] /= factor
    return stiffness
