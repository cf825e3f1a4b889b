"""Anderson's acceleration of a fixed-point iteration p -> r(p) (J. ACM 12, 547 (1965))."""

import numpy as np


class Mixture:
    """The last passes of an iteration, and the mixture of them with the least residual.

    The arrays are kept in single precision, to save memory: samples that open or close change the
    pressure by far more than the rounding.

    Parameters
    ----------
    depth : int
        Passes before the last one that are mixed with it.
    """

    def __init__(self, depth: int) -> None:
        self.depth = depth
        self._pressures: list[np.ndarray] = []
        self._residuals: list[np.ndarray] = []

    def add(self, pressure: np.ndarray, response: np.ndarray) -> None:
        """Add a pass: the pressure that it begins with, and the one it leads to [Pa]."""
        residual = (response - pressure).astype(np.float32)
        self._pressures = [*self._pressures[-self.depth :], pressure.astype(np.float32)]
        self._residuals = [*self._residuals[-self.depth :], residual]

    def step(self, part: float) -> np.ndarray:
        """Mixture of the pressures plus `part` times the mixture of the residuals [Pa]."""
        pressure, residual = self._pressures[-1], self._residuals[-1]
        differences = [residual - other for other in self._residuals[:-1]]
        if differences:
            gram = [[float(np.vdot(a, b)) for b in differences] for a in differences]
            sides = [float(np.vdot(a, residual)) for a in differences]
            weights = np.linalg.lstsq(np.array(gram), np.array(sides), rcond=None)[0]
            for weight, other, change in zip(
                weights, self._pressures[:-1], differences, strict=True
            ):
                pressure = pressure - np.float32(weight) * (self._pressures[-1] - other)
                residual = residual - np.float32(weight) * change
        return (pressure + np.float32(part) * residual).astype(float)
