"""[seal] in a scene: from the file to result.json, the verdict and the picture."""

import tomllib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fem_seal import job
from fem_seal.errors import InvalidInput
from fem_seal.patch import Patch
from fem_seal.results import Result
from fem_seal.results.words import lines_of
from fem_seal.scene import Scene
from fem_seal.upscaling.profile import Hertz, Uniform
from fem_seal.upscaling.seal import profile_of, read_profile, realization, solve_seal

TEXT = """
[surface]
kind = "self-affine"
shape = [32, 32]
size = ["32 um", "32 um"]
hurst = 0.8
long_wavelength = "8 um"
short_wavelength = "4 um"
rms_slope = 0.1
[solid]
contact_modulus = "10 MPa"
[contact]
pressure = "0.2 MPa"
[fluid]
viscosity = "1 mPa s"
[flow]
pressure_drop = "0.5 bar"
sides = "periodic"
[seal]
leak_path = "0.1 mm"
circumference = "10 mm"
patches = 3
rtol = 0.9
[output]
products = ["seal"]
leak_rate_unit = "ml/h"
"""


def scene(**changes):
    data = tomllib.loads(TEXT)
    for name, section in changes.items():
        data[name] = data.get(name, {}) | section
    return Scene.from_mapping(data)


def without(section, key):
    data = tomllib.loads(TEXT)
    del data[section][key]
    return data


@pytest.fixture(scope="module")
def outcome(tmp_path_factory):
    """A run with a limit a thousand times what leaks, with pictures."""
    folder = tmp_path_factory.mktemp("seal") / "out"
    asked = scene(
        output={"products": ["seal", "contact", "pictures"]}, limit={"leak_rate": "1 l/h"}
    )
    return job.run(asked, folder), folder


@pytest.mark.render
def test_result(outcome):
    result, folder = outcome
    assert Result.from_folder(folder) == result
    assert (folder / "seal.png").stat().st_size > 10_000
    seal = result.seal
    leak = seal.leak_rate
    assert 0 < leak.lower <= leak.value <= leak.upper
    assert result.leak_rate_shown.value == pytest.approx(leak.value * 3.6e9)
    # Three patches of 32 µm lie along 0.1 mm, and 312 along 10 mm.
    assert (seal.patches_along, seal.patches_around) == (3, 312)
    assert len(seal.patches) == 3
    assert min(seal.loads) == 1.5e5
    assert max(seal.loads) == 2e5
    assert any(label == "seal" for label, _ in lines_of(result))


@pytest.mark.render
def test_verdict_counts_flow_loads_and_patches(outcome):
    result, _ = outcome
    assert result.verdict.decision == "within limit"
    names = {entry.name: entry.kind for entry in result.error_budget}
    assert names["flow and load table"] == "guaranteed"
    assert names["patches"] == "estimated"
    for name in ("scales apart", "size of the patch", "contact grid"):
        assert names[name] == "not covered"
    assert "patches (estimated" in result.verdict.sentence


@pytest.mark.render
def test_bounds_are_those_of_the_patches(outcome):
    """A network of patches conducts no more than its best patch, and no less than its worst."""
    seal = outcome[0].seal
    assert min(p.lower for p in seal.patches) <= seal.leak_rate.lower
    assert seal.leak_rate.upper <= max(p.upper for p in seal.patches)


def test_a_limit_between_the_ends_is_undecided():
    small = scene(seal={"patches": 1})
    patch = Patch(small)
    leak = solve_seal(patch).value
    asked = scene(seal={"patches": 1}, limit={"leak_rate": f"{leak * 3.6e9} ml/h"})
    from fem_seal.results import summarise

    result = summarise(Patch(asked))
    assert result.verdict.decision == "undecided"
    assert "seal.patches" in result.verdict.sentence
    assert "1.0e+02" not in result.verdict.sentence


def test_sealed_and_lifted_off():
    from fem_seal.results import summarise

    sealed = summarise(Patch(scene(contact={"pressure": 2e6}, seal={"patches": 1})))
    assert (sealed.state, sealed.seal.leak_rate.upper) == ("sealed", 0)
    assert sealed.verdict.decision == "sealed"
    lifted = summarise(Patch(scene(contact={"pressure": 4e4}, seal={"patches": 1})))
    assert (lifted.state, lifted.seal.leak_rate) == ("lifted off", None)


def test_realizations_are_seeds():
    patch = Patch(scene())
    other = realization(patch, 2)
    assert realization(patch, 0).surface is patch.surface
    assert other.scene.surface.seed == 2
    assert not np.array_equal(other.surface.values, patch.surface.values)


def test_profiles_have_the_mean_of_the_contact():
    hertz = profile_of(scene(seal={"pressure_profile": "hertz"}))
    assert isinstance(hertz, Hertz)
    x = (np.arange(20000) + 0.5) / 20000 * hertz.length
    assert np.mean(hertz(x)) == pytest.approx(2e5, rel=1e-5)
    assert profile_of(scene()) == Uniform(2e5, 1e-4)


def test_table_with_units(tmp_path):
    path = tmp_path / "profile.csv"
    path.write_text("# from a finite-element code\nx [mm], pressure [MPa]\n1, 0\n1.5, 2\n2; 0.5\n")
    profile = read_profile(path)
    assert profile.length == pytest.approx(1e-3)
    assert profile.pressure.tolist() == [0, 2e6, 0.5e6]
    asked = without("seal", "leak_path")
    asked["seal"]["pressure_profile"] = str(path)
    assert profile_of(Scene.from_mapping(asked)).highest == 2e6


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "at least two"),
        ("0 1\n1 2 3\n", "'1 2 3' is no line"),
        ("x [mm], pressure [kg]\n0 1\n1 2\n", "kg"),
        ("a\n0 1\n1 2\n", "should name two columns"),
        ("0 1\n0 2\n", "ascend"),
        ("0 nan\n1 2\n", "must be numbers"),
    ],
)
def test_bad_tables(tmp_path, text, words):
    path = tmp_path / "profile.csv"
    path.write_text(text)
    with pytest.raises(InvalidInput, match=words) as caught:
        read_profile(path)
    assert "profile.csv" in str(caught.value)


@settings(max_examples=30, deadline=None)
@given(st.binary(max_size=60))
def test_tables_of_any_bytes_are_read_or_refused(tmp_path_factory, content):
    path = tmp_path_factory.mktemp("tables") / "profile.csv"
    path.write_bytes(content)
    try:
        profile = read_profile(path)
    except InvalidInput:
        return
    assert profile.length > 0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"output": {"products": ["contact"]}}, "does not name 'seal'"),
        ({"output": {"products": ["seal", "leak_rate"]}}, "'leak_rate' beside 'seal'"),
        ({"flow": {"lift": "resolved"}}, "flow.lift = 'resolved' is for a single patch"),
        ({"flow": {"method": "finite-difference"}}, "needs bounds"),
        ({"accuracy": {"total": 0.1}}, r"\[accuracy\] does not go with \[seal\]"),
        ({"limit": {"leak_rate": "1 ml/h", "decide": True}}, "set seal.rtol"),
        ({"seal": {"pressure_profile": "parabola"}}, "uniform"),
        ({"seal": {"pressure_profile": "missing.csv"}}, "is not a file"),
        ({"seal": {"patches": 0}}, "patches"),
    ],
)
def test_bad_scenes(changes, words):
    with pytest.raises(InvalidInput, match=words):
        scene(**changes)


def test_more_bad_scenes():
    with pytest.raises(InvalidInput, match="leak_path is missing"):
        Scene.from_mapping(without("seal", "leak_path"))
    data = without("contact", "pressure")
    data["contact"]["area_fraction"] = 0.2
    with pytest.raises(InvalidInput, match=r"needs contact\.pressure"):
        Scene.from_mapping(data)
    data = tomllib.loads(TEXT)
    del data["seal"]
    with pytest.raises(InvalidInput, match=r"\[seal\] is missing"):
        Scene.from_mapping(data)


def test_the_upper_side_of_a_gas_is_open():
    gas = {"kind": "gas", "viscosity": 18e-6, "molar_mass": 0.029, "temperature": 293.0}
    data = tomllib.loads(TEXT)
    data["fluid"] = gas
    data["flow"] = {"inlet_pressure": 1.5e5, "outlet_pressure": 1e5, "sides": "periodic"}
    data["seal"]["patches"] = 1
    from fem_seal.results import summarise

    result = summarise(Patch(Scene.from_mapping(data)))
    slip = next(entry for entry in result.error_budget if entry.name == "slip")
    assert (slip.lower, slip.upper) == (1.0, None)
    # Without slip a gas is a liquid whose drop is T0/(2 T p0)(p_in² - p_out²), in steps of p.
    assert result.seal.leak_rate.value > 0
