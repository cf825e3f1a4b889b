"""The product "sensitivity", derivatives of ln Q by each input and height, against differences.

Taylor remainders of order 2, and what dimensions prescribe. Ranges of inputs: test_inputs.py.
"""

import json
from math import log

import numpy as np
import pytest
from lifted_scenes import problem_of
from project import FIRST, observed_orders

from fem_seal.contact.settings import Load
from fem_seal.contact.state import ContactState
from fem_seal.coupling.state import LiftedState
from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate
from fem_seal.network.film_pressure import FilmPressure
from fem_seal.network.network import Network
from fem_seal.patch import Patch
from fem_seal.results import read_contact
from fem_seal.scene import Scene
from fem_seal.scene_steps import elastic_contact
from fem_seal.sensitivity import EPSILON, sensitivity
from fem_seal.solved import solve

EXACT = [
    "surface.shape=[32, 32]",
    "surface.short_wavelength=12.5 um",
    "contact.pressure=0.08 MPa",
    "contact.tolerance=1e-12",
    "flow.method=finite-difference",
    "flow.pressure_drop=0.3 bar",
]


# Air that slips; its pressure hangs on the gap of the critical constriction.
AIR = [
    *("fluid.kind=gas", "fluid.viscosity=18 uPa s", "fluid.molar_mass=29 g/mol"),
    *("fluid.temperature=20 degC", "fluid.slip=kinetic", "flow.pressure_drop="),
    *("flow.inlet_pressure=1.3 bar", "flow.outlet_pressure=1 bar", "flow.ambient_pressure=1 bar"),
]


def scene(*settings: str) -> Scene:
    return Scene.from_file(FIRST, [*EXACT, *settings])


class Equilibrium:
    """Contact of a scene, lifted or dry, and ln Q of the network on its samples.

    It is searched from another equilibrium, if there is one `near`.
    """

    def __init__(self, scene: Scene, lift: bool, height: GridField | None = None, near=None):
        self.scene, self.load = scene, scene.load
        self.height = Patch(scene).surface if height is None else height
        self.problem = problem_of(scene, self.height)
        self.epsilon = EPSILON * float(self.height.values.std())
        self.contact, self.pressure = elastic_contact(scene, self.height, None, self.load), None
        if lift:
            self.pressure = np.zeros(self.height.shape) if near is None else near.pressure
            self._settle()

    def _settle(self):
        """Contact and flow in turn, which converges at this load."""
        for _ in range(200):
            before = self.pressure
            self.contact = self.problem.contact_under(before, self.contact)
            tightest = self.problem.film(self.contact.gap).constriction.gap
            self.pressure = self.problem.pressure_of(self.flow.on_samples, tightest)
            if np.abs(self.pressure - before).max() < 1e-9 * self.load.value:
                return
        raise AssertionError("contact and flow have not settled in 200 passes")

    @property
    def flow(self) -> FilmPressure:
        grid = self.problem.first_network
        return self.problem.film_pressure(self.contact.gap.values, grid, self.epsilon)

    @property
    def log_rate(self) -> float:
        flow = self.flow
        settings = self.scene.flow_settings
        return log(flow.conductance * settings.pressure_drop / settings.viscosity)

    @property
    def sensitivity(self):
        lifted = None if self.pressure is None else self._lifted_state
        return sensitivity(self.scene, self.load, self.height, self.contact, lifted)

    @property
    def _lifted_state(self) -> LiftedState:
        pressure, network = self.problem.field(self.pressure), self.problem.first_network
        leak = LeakRate.sealed("adaptive")  # not asked for
        return LiftedState(pressure, self.contact, leak, lowest=0.0, highest=0.0, network=network)


@pytest.fixture(autouse=True)
def one_network(monkeypatch):
    """That of the samples, on which the tests differentiate, also of a dry contact."""
    monkeypatch.setattr(Network, "refined", lambda network, *_: network)


@pytest.fixture(scope="module", params=[False, True], ids=["dry", "lifted"])
def state(request):
    return Equilibrium(scene(), request.param)


def test_derivatives_by_inputs(state):
    found = state.sensitivity.by_input
    assert set(found) == {
        *("heights", "contact.pressure", "solid.contact_modulus"),
        *("fluid.viscosity", "flow.pressure_drop"),
    }
    require_differences(state, found)


def test_derivatives_by_inputs_of_a_gas_that_slips():
    lifted = Equilibrium(scene(*AIR), lift=True)
    require_differences(lifted, lifted.sensitivity.by_input)


def require_differences(state, found):
    """Derivatives are central differences of whole solutions.

    Passes that end at 1e-9 of the load leave 1e-4 over the step of 1e-5, more than its square.
    """
    step = 1e-5
    for name, derivative in found.items():
        ends = [
            Equilibrium(
                state.scene.scaled({name: 1 + sign * step}), state.pressure is not None, near=state
            )
            for sign in (1, -1)
        ]
        difference = (ends[0].log_rate - ends[1].log_rate) / (2 * step)
        assert derivative == pytest.approx(difference, rel=0, abs=1e-4), name


def test_taylor_remainder_of_heights(state):
    """|ln Q(h + ε δ) - ln Q(h) - ε <∂ ln Q/∂h, δ>| falls with ε² while no sample flips."""
    draw = np.random.default_rng(3)
    direction = draw.standard_normal(state.height.shape)
    slope = float(np.vdot(state.sensitivity.by_height.values, direction))
    rms, remainders = float(state.height.values.std()), []
    for step in (4e-6 * rms, 2e-6 * rms, 1e-6 * rms):
        moved = GridField(
            state.height.values + step * direction, state.height.spacing, periodic=True
        )
        other = Equilibrium(state.scene, state.pressure is not None, moved)
        assert np.array_equal(other.contact.contact, state.contact.contact)
        remainders.append(abs(other.log_rate - state.log_rate - step * slope))
    # ε follows the rms height, which the direction changes; that is of second order, too. ln Q is
    # known to 1e-12, an eighth of the least remainder, which is 0.2 of an order.
    assert min(remainders) > 5e-12
    assert observed_orders(remainders) == pytest.approx([2, 2], abs=0.2), remainders


def test_ties_between_the_derivatives(state):
    """Q = (Δp/η) s³ F(P/(s E*), p_in/(s E*)), whatever the surface.

    The flow and the adjoint equations are solved to 1e-6.
    """
    found = state.sensitivity
    by = found.by_input
    assert abs(found.by_height.values.sum()) < 1e-6 * np.abs(found.by_height.values).sum()
    assert by["fluid.viscosity"] == pytest.approx(-1, rel=1e-6)
    load, drop = by["contact.pressure"], by["flow.pressure_drop"]
    if state.pressure is None:
        assert drop == pytest.approx(1, rel=1e-6)
    assert by["heights"] == pytest.approx(4 - load - drop, rel=1e-6)
    assert by["solid.contact_modulus"] == pytest.approx(1 - load - drop, rel=1e-6)


def test_a_flat_counter_face():
    """The solid's displacement, in place of heights, says what little conducts in contact."""
    half_open = np.where(np.arange(32) < 16, np.full((32, 32), 1e-6), 0.0)
    heights, gap, pressure = (
        GridField(values, (1e-6, 1e-6), periodic=True)
        for values in (np.zeros((32, 32)), half_open, 1e5 * (half_open == 0))
    )
    made = scene()
    by = sensitivity(made, made.load, heights, ContactState(gap, pressure, 1e7)).by_input
    assert by["fluid.viscosity"] == pytest.approx(-1, rel=1e-6)
    assert by["flow.pressure_drop"] == pytest.approx(1, rel=1e-6)


def test_refused():
    sealed = Equilibrium(scene("contact.pressure=0.6 MPa"), lift=False)
    with pytest.raises(InvalidInput, match="the patch is sealed"):
        sealed.sensitivity  # noqa: B018
    with pytest.raises(InvalidInput, match="step function"):
        sensitivity(sealed.scene, Load("area_fraction", 0.2), sealed.height, sealed.contact)


def test_product(tmp_path, monkeypatch):
    """Numbers in result.json, the map in contact.npz; none where nothing leaks."""
    monkeypatch.undo()  # networks are refined
    products = 'output.products=["leak_rate", "sensitivity"]'
    plain = [*EXACT[:3], "flow.pressure_drop=0.3 bar", products, "accuracy.contact_grid=false"]
    solved = solve(Scene.from_file(FIRST, plain))
    solved.save(tmp_path)
    stored = json.loads((tmp_path / "result.json").read_text())["quantities"]["sensitivity"]
    by = solved.patch.sensitivity.by_input
    assert stored == by
    # The state has settled to its tolerance only, and the mesh of its flow is not the network.
    assert by["heights"] == pytest.approx(
        4 - by["contact.pressure"] - by["flow.pressure_drop"], rel=1e-3
    )
    read = read_contact(tmp_path).log_rate_by_height
    assert np.array_equal(read.values, solved.patch.sensitivity.by_height.values)
    sealed = solve(Scene.from_file(FIRST, [*plain, "contact.pressure=0.6 MPa"]))
    assert sealed.quantities.sensitivity is None
