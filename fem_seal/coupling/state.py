"""The equilibrium of contact and flow, and its estimated error."""

from dataclasses import dataclass
from math import inf

from fem_seal.contact.state import ContactState
from fem_seal.errors import Inconsistent
from fem_seal.grid import GridField
from fem_seal.leak_rate import FlowState, LeakRate
from fem_seal.network.network import Network

# An equilibrium has settled if its ln Q errs by at most this part of the flow's rtol.
SETTLED = 1 / 2
# Largest change of ln Q of which first orders tell something; larger tolerances count as this one.
LARGEST_CHANGE = 0.3


@dataclass(frozen=True, eq=False)
class LiftedState:
    """Contact and flow in one equilibrium.

    Lifted off: a uniform film, however thick, would carry more than the load. No contact is
    searched for.
    """

    fluid_pressure: GridField  #: p_f on the contact's samples [Pa], above ambient
    #: its pressure is the excess p_c over the fluid's, 0 if the solid floats; None if lifted off
    contact: ContactState | None = None
    leak_rate: LeakRate | None = None  #: through the contact's gap; None if lifted off
    steps: int = 0  #: Newton's steps
    change: float = 0.0  #: change of ln Q by the flow of the last stage, to first order
    error: float = 0.0  #: error of ln Q, estimated
    lowest: float = inf  #: least leak rate that is not excluded [m³/s]
    highest: float = inf  #: largest leak rate that is not excluded [m³/s]
    opened_gap: float = 0.0  #: critical gap of the opened film that leaks so much [m]; 0 if none
    residuals: tuple[float, ...] = ()  #: rms of F over the pressure drop, at each step's start
    network: Network | None = None  #: on which p_f was solved; None if lifted off
    reason: str = ""  #: sentence on why it has not settled; empty if it has

    def __post_init__(self) -> None:
        if self.leak_rate is None:
            if self.contact is not None or self.network is not None:
                raise Inconsistent("a contact and its network without their leak rate")
        elif not self.lowest <= self.leak_rate.value <= self.highest:
            raise Inconsistent(f"a leak rate of {self.leak_rate.value:g} outside its range")

    @property
    def state(self) -> FlowState:
        """Lifted off, or the state of the leak rate."""
        return "lifted off" if self.leak_rate is None else self.leak_rate.state

    @property
    def converged(self) -> bool:
        """Whether the equilibrium has settled."""
        return not self.reason

    @property
    def is_range(self) -> bool:
        """Whether its leak rate is known as a range alone.

        It has not settled, or it is sealed and more fluid pressure under the contact would open it.
        """
        return not self.converged or (self.state == "sealed" and self.highest > 0)

    @property
    def fluid_load(self) -> float:
        """Mean of p_f: the part of the load that the fluid carries [Pa]."""
        return float(self.fluid_pressure.values.mean())

    @property
    def floats(self) -> bool:
        """Whether the solid rests on the fluid alone, without contact."""
        return self.contact is not None and not self.contact.contact.any()
