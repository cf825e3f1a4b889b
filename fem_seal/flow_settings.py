"""Settings of a solver of the flow: fluid, pressures, method, accuracy."""

from dataclasses import dataclass
from typing import Literal, get_args

from fem_seal.arguments import require_kind, require_known, require_not_negative, require_positive
from fem_seal.errors import InvalidInput
from fem_seal.fluid import Slip
from fem_seal.limits import Limits

NO_LIMITS = Limits()
MethodName = Literal["adaptive", "uniform", "finite-difference"]
LinkRuleName = Literal["linear-gap", "arithmetic", "harmonic", "geometric", "mean-gap"]


@dataclass(frozen=True)
class FlowSettings:
    """Fluid, pressures, method and accuracy of a flow.

    Finite differences take neither `decide`, `field` nor `limits.unknowns`; `rtol` and the other
    limits are then those of a lift.
    """

    viscosity: float  #: η [Pa s]
    #: p_in - p_out [Pa]; for a gas that of the liquid that leaks as much without slip
    pressure_drop: float
    slip: Slip | None = None  #: of a gas at the walls
    #: "adaptive", "uniform" (the pixel or given mesh and its uniform refinements) or
    #: "finite-difference"
    method: str = "adaptive"
    #: largest (upper - lower) / √(lower upper); for a gas that slips it holds for the bounds at the
    #: mean pressure, since no mesh closes the rest
    rtol: float = 0.05
    #: in place of rtol, a leak rate [m³/s]: refine until it does not lie between the bounds
    decide: float | None = None
    #: error of ln Q outside the bounds, such as that of the lift; it widens them for `decide`
    margin: float = 0.0
    limits: Limits = NO_LIMITS  #: a refinement that one of them ends has not converged
    field: bool = False  #: whether the flow on the last mesh is wanted, and not only its leak rate
    link_rule: str = "linear-gap"  #: mean of K along a link of finite differences
    #: leak rate [m³/s]: a lift that leaks less is not refined further, and has not settled
    negligible: float = 0.0

    def __post_init__(self) -> None:
        require_positive(viscosity=self.viscosity, pressure_drop=self.pressure_drop, rtol=self.rtol)
        require_not_negative(margin=self.margin, negligible=self.negligible)
        require_known(get_args(MethodName), self.method, "method")
        require_known(get_args(LinkRuleName), self.link_rule, "link_rule")
        require_kind((Slip, type(None)), slip=self.slip)
        require_kind(Limits, limits=self.limits)
        if self.method != "finite-difference" and self.link_rule != FlowSettings.link_rule:
            raise InvalidInput(f"method = {self.method!r} has no links: leave link_rule out")
        unread = self.decide is not None or self.field or self.limits.unknowns is not None
        if self.method == "finite-difference" and unread:
            raise InvalidInput(
                f"method = {self.method!r} has neither bounds nor a mesh: leave out decide, field "
                "and limits.unknowns"
            )
        if self.decide is not None:
            require_positive(decide=self.decide)
        elif self.margin:
            raise InvalidInput("margin widens the bounds for decide alone: give both or neither")
