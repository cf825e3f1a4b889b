"""The conductivity tensor from a scene to its result: requirements, numbers, messages."""

import numpy as np
import pytest
from project import AIR

from fem_seal.errors import InvalidInput
from fem_seal.flow.bounds import TensorBounds
from fem_seal.patch import Patch
from fem_seal.quantities.of_patch import quantities
from fem_seal.quantities.tensor import ConductivityTensor
from fem_seal.results.words import summary_of
from fem_seal.scene import Scene
from fem_seal.solved import solve


@pytest.fixture
def scene(small_scene):
    """A bearing contact and the tensor of its gap."""
    small_scene["contact"] = {"model": "bearing", "area_fraction": 0.1}
    small_scene["flow"] = {"rtol": 0.2}
    small_scene["output"] = {"products": ["conductivity_tensor"]}
    return Scene.from_mapping(small_scene)


def test_tensor_of_a_scene(scene):
    """No pressures are needed, no leak rate is computed."""
    result = solve(scene).result()
    assert result.leak_rate is None
    found = result.quantities.conductivity_tensor
    for component in (found.xx, found.xy, found.yy):
        assert component.lower <= component.value <= component.upper
    assert found.hardest > 0
    assert found.hardest <= min(found.xx.value, found.yy.value)
    assert found.easiest >= max(found.xx.value, found.yy.value)
    assert result.converged
    assert "easiest at" in dict(summary_of(result))["tensor"]


def test_a_sealed_cell_has_no_easiest_direction(scene):
    closed = scene.with_({"contact.area_fraction": 0.9})
    words = dict(summary_of(solve(closed).result()))["tensor"]
    assert words.endswith("sealed in every direction")


def test_tensor_that_does_not_converge_ends_the_run_with_its_bounds(scene):
    result = solve(scene.with_({"flow": {"rtol": 0.001, "max_unknowns": 100}})).result()
    assert not result.converged
    assert "rtol = 0.001 was asked for" in result.reason
    found = result.quantities.conductivity_tensor
    assert not found.converged
    assert found.xx.upper > found.xx.lower


def test_viscosity_is_needed(scene):
    with pytest.raises(InvalidInput, match=r"tensor needs fluid\.viscosity"):
        scene.with_({"fluid": None})


@pytest.mark.parametrize("unit", [1e-200, 1.0, 1e100])
@pytest.mark.parametrize("angle", np.linspace(0, 90, 7))
def test_nothing_flows_across_a_single_channel(angle, unit):
    """Rounding left 1e-16 of the easiest conductivity in the hardest one, or less than nothing."""
    along = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
    channel = unit * np.outer(along, along)
    tensor = ConductivityTensor.of(TensorBounds(0.9 * channel, 1.1 * channel))
    assert tensor.hardest == 0
    assert tensor.easiest == pytest.approx(np.sqrt(0.99) * unit)


@pytest.mark.parametrize("angle", [-60.0, 0.0, 30.0, 90.0])
def test_angle_of_the_easiest_direction(angle):
    """A tensor made of principal values 4 and 1, turned."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    turn = np.array([[c, -s], [s, c]])
    matrix = turn @ np.diag([4.0, 1.0]) @ turn.T
    found = ConductivityTensor.of(TensorBounds(matrix, matrix))
    assert found.angle == pytest.approx(angle, abs=1e-9)
    assert (found.easiest, found.hardest) == pytest.approx((4, 1))


def test_tensor_of_a_gas_that_slips(scene):
    plain = scene.with_({"fluid": AIR | {"slip": False}})
    ends = {"flow.inlet_pressure": 2e5, "flow.outlet_pressure": 1e5}
    slipping = scene.with_({"fluid": AIR} | ends)
    tensors = [quantities(Patch(one)).conductivity_tensor for one in (plain, slipping)]
    # Slip only adds.
    assert tensors[1].xx.lower > tensors[0].xx.lower
    assert tensors[1].yy.upper > tensors[0].yy.upper
