"""Valid scenes of all features at once: each ends with an answer that agrees with itself."""

from copy import deepcopy

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from project import AIR

import fem_seal as fs
from fem_seal.scene import Scene

LIQUID = {"kind": "liquid", "viscosity": "1 mPa s"}
DROPS = [
    {"pressure_drop": "0.1 bar"},
    {"pressure_drop": "1 bar"},
    {"inlet_pressure": "2 bar", "outlet_pressure": "1 bar"},
    {"inlet_pressure": "1.5 bar", "outlet_pressure": "0.5 bar", "ambient_pressure": "1 bar"},
]
LOADS = [
    *({"pressure": pressure} for pressure in ("20 kPa", "0.1 MPa", "0.2 MPa", "0.3 MPa")),
    *({"area_fraction": area} for area in (0.05, 0.35)),
    {"mean_gap": "0.1 um"},
]
WATER_RATES, TOTALS = ("1e-6 ml/h", "1e-3 ml/h", "1 l/h"), ({"total": 0.5}, {"contact_grid": False})


@st.composite
def scenes(draw):
    """A mapping for `Scene`; many are refused, since some of their fields contradict others."""
    n, gas = draw(st.sampled_from([16, 24, 32])), draw(st.booleans())
    elastic, load = draw(st.integers(0, 4)) > 0, draw(st.sampled_from(LOADS))
    flow = deepcopy(draw(st.sampled_from(DROPS[2:] if gas else DROPS)))
    wave = {"long_wavelength": f"{n // 2} um", "short_wavelength": "4 um", "rms_slope": 0.1}
    size = {"shape": [n, n], "size": [f"{n} um", f"{n} um"], "hurst": 0.8}
    data = {
        "surface": {"kind": "self-affine", **size, **wave, "seed": draw(st.integers(1, 99))},
        "contact": {"model": "gfmd" if elastic else "bearing", **load},
        "fluid": AIR | draw(st.sampled_from([{}, {"slip": "kinetic"}])) if gas else LIQUID,
        "flow": flow,
        "output": {"products": ["leak_rate", *draw(st.sampled_from([(), ("threshold", "mesh")]))]},
    }
    if elastic:
        layer = draw(st.sampled_from([{}, {}, {"layer_thickness": "5 um"}]))
        data["solid"] = {"contact_modulus": "10 MPa"} | layer
    for key, values in {
        "lift": (None, "resolved", "none", "range"),
        "sides": (None, "wall", "periodic"),
        "method": (None, None, "uniform", "finite-difference"),
        "rtol": (None, 0.1, 0.3),
    }.items():
        if (value := draw(st.sampled_from(values))) is not None:
            flow[key] = value
    if draw(st.booleans()):
        data["limit"] = {"leak_rate": draw(st.sampled_from(WATER_RATES))}
    if draw(st.booleans()):
        pressed = {"contact": {"pressure": "5 %"}} if "pressure" in load else {}
        data["tolerances"] = {"fluid": {"viscosity": "10 %"}} | pressed
    if draw(st.booleans()):
        data["accuracy"] = draw(st.sampled_from(TOTALS))
    return data


@pytest.mark.slow
@settings(max_examples=150, derandomize=True, suppress_health_check=list(HealthCheck))
@given(scenes())
def test_valid_scenes_have_answers_that_agree_with_themselves(data):
    """The value between its ends, the verdict as these; a liquid twice as viscous leaks half."""
    try:
        scene = Scene.from_mapping(data)
    except fs.InvalidInput:
        return
    solved = fs.solve(scene)
    low, value, high = solved.headline.lower, solved.headline.value, solved.headline.upper
    assert (low or 0) <= (value or low or 0) * (1 + 1e-12)
    assert high is None or value <= high * (1 + 1e-12)
    if scene.limit is not None:
        limit = scene.limit.volume_rate(scene.drive)
        if solved.verdict.decision == "within limit":
            assert high <= limit * (1 + 1e-9)
        if solved.verdict.decision == "above limit":
            assert solved.state == "lifted off" or low >= limit * (1 - 1e-9)
    assert solved.result().state == solved.state
    if scene.fluid.kind == "liquid" and solved.state == "leaking":
        thick = fs.solve(scene.with_({"fluid.viscosity": 2 * scene.viscosity, "limit": None}))
        assert thick.leak_rate.value == pytest.approx(solved.leak_rate.value / 2, rel=1e-6)
