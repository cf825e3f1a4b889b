"""The state at which the passes through contact and flow ended, and its estimated error."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, log

from fem_seal.contact.state import ContactState
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate

SETTLED = 1 / 5  # passes have settled if ln Q changes by less than this part of the flow's rtol
FINER = "compare a finer grid (surface.shape)"


@dataclass(frozen=True, eq=False)
class LiftedState:
    """Contact and flow in one equilibrium.

    Attributes
    ----------
    state : "leaking", "sealed" or "lifted off"
        Lifted off: the fluid carries the whole load, and no equilibrium keeps the solids together.
    contact : ContactState or None
        Its pressure is the excess p_c over the fluid's; None if lifted off.
    fluid_pressure : GridField
        p_f on the contact's samples [Pa], above ambient.
    leak_rate : LeakRate or None
        Through the contact's gap, to the tolerance of the result; None if lifted off.
    passes : int
        Contacts and flows solved.
    change : float
        Spread of ln Q over the last three passes or, if they have not settled, over the range.
    converged : bool
        Whether the passes have settled.
    lowest, highest : float
        Least and largest leak rate [m³/s]: of the last three passes if they have settled, else of
        the second half of all, and of both starts where there were two. Of a sealed state that has
        not settled: 0, and the leak rate with the inlet's pressure under its contact.
    rtol : float
        Tolerance of the flow.
    rates : tuple of float
        Leak rates of all passes [m³/s], one per pass; those of both starts one after the other.
    mesh_width : float
        ln(upper/lower) of the flow with which the last mesh of the passes was made. Its pressure
        lifts the solid. Infinite if that flow leaks without a lower bound.
    flipping : int
        Of a state that has not settled: number of samples that open and close in the last passes,
        or that are open in one state and closed in the other where two starts lead to two states.
    two_states : bool
        Whether passes from both starts have settled, but at different leak rates.
    """

    state: str
    contact: ContactState | None
    fluid_pressure: GridField
    leak_rate: LeakRate | None
    passes: int
    change: float
    converged: bool
    lowest: float
    highest: float
    rtol: float = 0.0
    rates: tuple[float, ...] = ()
    mesh_width: float = 0.0
    flipping: int = 0
    two_states: bool = False

    @property
    def claimed(self) -> float:
        """Error of ln Q of a settled state, estimated.

        It is the change from pass to pass at which they count as settled, plus the width of the
        flow's bounds: the pressure that lifts the solid is only as exact as the flow. Equilibria
        from different meshes differed by up to half of that width, and a little more where single
        samples open and close. For a flow without bounds rtol stands for the width; such equilibria
        differed by half of it.
        """
        return max(self.change, SETTLED * self.rtol) + self.flow_width

    @property
    def flow_width(self) -> float:
        """ln(upper/lower) of the flow whose pressure lifts the solid; 0 where nothing leaks.

        The flow of the result is solved on the same mesh, refined where it must be: further for a
        decision against a limit, which makes the pressure no more exact. Without bounds it is rtol.
        """
        leak = self.leak_rate
        if leak is None or leak.state == "sealed":
            return 0.0
        if leak.lower is None:
            return self.rtol
        return max(self.mesh_width, min(relative_part(leak), self.rtol))

    @property
    def fluid_load(self) -> float:
        """Mean of p_f: the part of the load that the fluid carries [Pa]."""
        return float(self.fluid_pressure.values.mean())

    @property
    def reason(self) -> str:
        """Sentence that says why the state is not an equilibrium; empty if it has settled."""
        if self.converged:
            return ""
        low = f"{self.lowest:.3g}" if self.lowest else "0 (sealed)"
        high = f"{self.highest:.3g} m^3/s" if self.highest < inf else "that of a film lifted off"
        if self.two_states:
            return (
                "contact and flow settle at two states, from the pressure of the outlet and of the "
                f"inlet: {self.flipping} samples are open in one and closed in the other, and the "
                f"leak rate is between {low} and {high}; {FINER}"
            )
        if self.state == "sealed" and not self.flipping:
            return (
                f"the film is sealed after {self.passes} passes through contact and flow, but more "
                f"fluid pressure under the contact would open it: the leak rate is between {low} "
                f"and {high}; {FINER}"
            )
        samples = f"{self.flipping} samples open and close, and " if self.flipping else ""
        return (
            f"contact and flow have not settled after {self.passes} passes: {samples}the leak rate "
            f"varies from {low} to {high}; {FINER}"
        )


def most_claimed(rtol: float) -> float:
    """Largest error of ln Q that a settled state claims if its flows reach their tolerance."""
    return (SETTLED + 1) * rtol


def width_of(leak: LeakRate | None) -> float:
    """Width ln(upper/lower) of a bracket; infinite if its lower bound is 0, 0 without one."""
    if leak is None or leak.state == "sealed":
        return 0.0
    return inf if leak.lower == 0 else relative_part(leak)


def relative_part(leak: LeakRate) -> float:
    """Width ln(upper/lower) of a bracket; 0 without bounds or if sealed."""
    if not leak.lower:
        return 0.0
    lower, upper = leak.refined_bounds
    return log(upper / lower)


def spread(rates: Sequence[float]) -> float:
    """Spread of ln Q; 0 if all are sealed, infinite if only some are."""
    low, high = min(rates, default=0.0), max(rates, default=0.0)
    if low == high:
        return 0.0
    return log(high / low) if low > 0 else inf
