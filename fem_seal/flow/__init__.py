"""Reynolds flow through a gap by finite elements, with bounds of the leak rate from both sides."""

from fem_seal.flow.dolfinx_mesh import FlowFunctions, film_from_dolfinx, flow_functions
from fem_seal.flow.leak import leak_rate
from fem_seal.flow.marking import Tuning
from fem_seal.flow.solution import Start
from fem_seal.flow_settings import FlowSettings
from fem_seal.limits import Limits
