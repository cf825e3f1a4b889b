"""accuracy.total: the grid and tolerance chosen, the error reached, contradictory settings."""

import json
from dataclasses import replace
from math import exp, log, log1p
from unittest.mock import Mock

import numpy as np
import pytest
from project import write_toml

from fem_seal import cli
from fem_seal.accuracy import chosen_grid, chosen_patch
from fem_seal.coupling import stages
from fem_seal.digits import per_cent
from fem_seal.error_budget import combined, estimate
from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField
from fem_seal.grid_series import (
    OF_CHANGE,
    OF_UNRESOLVED,
    change_of,
    grid_error,
    grids,
    on_half,
    sealed_under,
    unresolved,
)
from fem_seal.leak_rate import Estimate
from fem_seal.patch import Given, Patch
from fem_seal.quantities.uncertainties import error_budget
from fem_seal.results import Result, read_contact
from fem_seal.scene import Scene
from fem_seal.scene_steps import CONTACTS, FLOWS
from fem_seal.solved import answer
from fem_seal.surface.resampling import resample
from fem_seal.threshold import sealing_load

# A patch of 64² samples, four in its shortest wave.
FIRST = {
    "surface": {
        **{"kind": "self-affine", "shape": [64, 64], "size": ["100 um", "100 um"]},
        **{"hurst": 0.8, "long_wavelength": "25 um", "short_wavelength": "6.25 um"},
        **{"rms_slope": 0.1, "seed": 1},
    },
    "solid": {"contact_modulus": "10 MPa"},
    "fluid": {"viscosity": "1 mPa s"},
    "flow": {"pressure_drop": "200 Pa", "sides": "periodic"},
    "output": {"products": ["leak_rate"]},
}
ALLOWED = log1p(0.1)  # of |ln Q|


@pytest.fixture
def accurate_scene(small_scene):
    small_scene["flow"]["method"] = "adaptive"
    small_scene["contact"] = {"pressure": "0.1 MPa"}
    small_scene["flow"]["lift"] = "none"
    return small_scene | {"accuracy": {"total": 0.2}}


@pytest.fixture
def chosen(accurate_scene, monkeypatch):
    """Function that chooses a grid for a total of 10 %, of which the grid takes a given part.

    It gives what `chosen_grid` returns, the samples of all contacts and the tolerances of all dry
    flows.
    """
    press, flow = Mock(wraps=CONTACTS["gfmd"]), Mock(wraps=FLOWS["adaptive"])
    monkeypatch.setitem(CONTACTS, "gfmd", press)
    monkeypatch.setitem(FLOWS, "adaptive", flow)

    def chosen(part, max_refinement, **changes):
        accuracy = {"accuracy.total": 0.1, "accuracy.max_refinement": max_refinement}
        scene = Scene.from_mapping(accurate_scene).with_(accuracy | changes)

        def error_of(coarser, patch):
            error = part(patch.surface.shape[0]) * ALLOWED
            return estimate("contact_grid", "", exp(-error), exp(error))

        monkeypatch.setattr("fem_seal.accuracy._grid_error", error_of)
        outcome = chosen_grid(Patch(scene), scene.total_error)
        contacts = [call.args[1].shape[0] for call in press.call_args_list]
        return outcome, contacts, [call.args[0].rtol for call in flow.call_args_list]

    return chosen


def test_a_small_error_of_a_grid_goes_with_the_square_of_its_spacing():
    """A smooth surface: u = κ dx²/8, and both parts of ε fall to a quarter on twice the samples."""
    x = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    height = GridField(np.add.outer(np.sin(x), 3 * np.cos(x)), (x[1], x[1]), periodic=True)
    # The second derivative of each wave is itself, 1/2 and 9/2 in the mean of its square;
    # differences in its place miss dx²/12 of it.
    missed = x[1] ** 2 / 12
    assert unresolved(height) == pytest.approx(np.sqrt(5) * x[1] ** 2 / 8, rel=missed)
    finer = resample(height, (128, 128))
    assert unresolved(finer) == pytest.approx(unresolved(height) / 4, rel=missed)
    # Without the step from its end to its beginning a plane is linear.
    plane = GridField(np.add.outer(np.arange(8.0), np.arange(5.0)), (1.0, 1.0))
    assert unresolved(plane) == 0
    parts = [grid_error(4 * c, c).log_error for c in (1e-3, 4e-3)]
    epsilon = OF_UNRESOLVED * 1e-3 + OF_CHANGE * 4e-3
    assert parts[0] == pytest.approx(epsilon * (1 + 4 * epsilon), rel=1e-12)
    assert parts[1] / parts[0] == pytest.approx(4, rel=4 * 4 * epsilon)


def test_sides_open_next_to_closing():
    """More doubt never makes the claim smaller; a constriction that may close opens the lower side.

    The upper side then at least allows the constriction to be higher by what the grid leaves out.
    """
    left_out = 0.01, 0.1, 0.5, 1.0, 2.0, 20.0
    errors = [grid_error(-log(q), u) for q in (0.7, 0.01) for u in left_out]
    for several in (errors[:6], errors[6:]):
        uppers = [error.upper for error in several]
        assert uppers == sorted(uppers)
        opened = [error.lower is None for error in several]
        assert opened == sorted(opened)
    assert [error.lower is None for error in errors[:6]] == [False] * 3 + [False, True, True]
    assert errors[5].upper == pytest.approx(21.0**3, rel=1e-12)
    for more in ({"lifted": True}, {"counted": 0.0}, {"counted": 1.0}):
        assert grid_error(-log(0.7), 0.01, **more).log_error > errors[0].log_error
    assert grid_error(-log(0.7), 0.01, counted=4.0).lower is None
    sealed = grid_error(change_of(Estimate(0.0), Estimate(1.0)), 0.01)
    assert sealed.lower is None
    assert sealed.upper >= errors[0].upper


def test_grids_double_up_to_the_limit():
    """A coarse one for the estimate; none of less than eight samples."""
    assert grids((64, 32), 4) == [(32, 16), (64, 32), (128, 64), (256, 128)]
    assert grids((16, 16), 7) == [(8, 8), (16, 16), (32, 32), (64, 64)]
    assert grids((15, 15), 1) == [(8, 8), (15, 15)]
    assert grids((101, 13), 1) == [(101, 13)]


def test_half_of_the_samples_may_be_asked_to_be_even():
    """Half of 30 and 34, and the next even numbers; a quarter of a mirrored map is half of them."""
    flat = GridField(np.zeros((30, 34)), (1.0, 1.0), periodic=True)
    patch = Patch(
        Scene.from_mapping(FIRST | {"contact": {"pressure": "0.1 MPa"}}), given=Given(surface=flat)
    )
    assert on_half(patch).surface.shape == (15, 17)
    assert on_half(patch, even=True).surface.shape == (16, 16)


def test_the_flow_gets_what_the_contact_leaves(chosen):
    """85 % of the total on 64²: the bracket of rtol = 10 % is wider than the rest."""
    (patch, choice, missed), contacts, flows = chosen(lambda n: 0.85 * 64 / n, 2)
    assert choice.samples == patch.surface.shape == (64, 64)
    assert choice.contact_error == pytest.approx(exp(0.85 * ALLOWED) - 1, rel=1e-9)
    assert choice.rtol == pytest.approx(2 * np.sinh(0.15 * ALLOWED), rel=1e-9)
    # The contact is not solved again for the narrower bracket.
    assert contacts == [16, 32, 64]
    assert flows == [0.1, 0.1, 0.1, choice.rtol]
    assert log1p(choice.contact_error) + log1p(choice.flow_error) <= ALLOWED * (1 + 1e-9)
    assert patch.leak_rate.converged
    assert not missed


def test_no_solve_more_than_needed(chosen):
    """The grid takes 80 % of the total on 32², which leaves less than the bracket of rtol = 10 %.

    That is asinh(0.05); on 64² it takes 40 %.
    """
    (_, choice, _), contacts, flows = chosen(lambda n: 0.8 * 32 / n, 4)
    assert choice.rtol == 0.1
    assert (contacts, flows) == ([16, 32, 64], [0.1] * 3)


@pytest.mark.parametrize(
    ("part", "changes"),
    [(1.2, {}), (0.95, {"flow.lift": "resolved", "flow.pressure_drop": 2e4})],
)
def test_a_total_that_no_grid_keeps_is_not_converged(chosen, part, changes):
    """Nor is one of which the grid leaves 5 % to a lift.

    Passes to such a tolerance may not settle.
    """
    outcome, _, flows = chosen(lambda n: part, 1, **changes)
    patch, choice, missed = outcome
    leak = patch.leak_rate
    assert (choice.samples, choice.rtol, {0.1, *flows}) == ((32, 32), 0.1, {0.1})
    percent = per_cent(exp(part * ALLOWED) - 1)
    assert f"part of the error is about {percent} on 32 x 32" in missed
    assert "max_refinement" in missed
    solved = answer(outcome)
    assert solved.reason == solved.leak_rate.reason == missed
    assert not solved.converged
    # Its bounds are kept.
    assert leak.lower < leak.value < leak.upper


def test_the_total_error_is_kept_and_recorded(accurate_scene, tmp_path, capsys):
    """Against the same surface on 256 x 256, four times the finest grid chosen or more.

    The reference is itself off: by its bracket, ±1 %, and by some 0.5 % of the contact grid, the
    change from 128 to 256 samples over two.
    """
    accurate_scene["surface"]["seed"] = 2
    path = write_toml(tmp_path / "scene.toml", accurate_scene)
    assert cli.main(["run", str(path), "--out", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    result = Result.from_folder(tmp_path / "out")
    chosen, leak = result.accuracy, result.leak_rate
    nx, ny = chosen.samples
    assert nx <= 64
    assert f"chosen for 20 %: contact on {nx} x {ny}" in said
    assert f"flow.rtol = {chosen.rtol:.2g}" in said
    assert chosen.trials[-1].samples == read_contact(tmp_path / "out").gap.shape == (nx, ny)
    # The promise is made of its two parts.
    half = 0.5 * log(leak.upper / leak.lower)
    assert log1p(chosen.flow_error) == pytest.approx(half, rel=1e-9)
    assert log1p(chosen.contact_error) + half <= log1p(0.2) * (1 + 1e-9)
    # Both count, and what a dry contact leaves out: a fluid pressure as high as the contact's.
    counted = [entry.name for entry in result.error_budget if entry.counted]
    assert counted == ["flow", "contact grid", "fluid pressure"]
    own = Patch(result.scene())
    settings = replace(own.flow_settings, rtol=0.02)
    finer = own.with_(Given(surface=resample(own.surface, (256, 256)), flow_settings=settings))
    assert abs(leak.value / finer.leak_rate.value - 1) <= 0.2 + 0.015


@pytest.mark.parametrize("lift", ["none", "resolved"])
def test_the_samples_of_the_scene_are_no_chosen_grid(accurate_scene, lift):
    accurate_scene["flow"]["lift"] = lift
    with pytest.raises(InvalidInput, match="no contact grid yet"):
        _ = Patch(Scene.from_mapping(accurate_scene)).leak_rate


def test_a_sealed_grid_counts_only_at_a_distance_from_opening(tmp_path):
    """64² samples and coarser are sealed, 128² leak: undecided, or the finer grid's answer.

    Far above the load that seals, and only there, the same surface is within a limit.
    """
    scene = FIRST | {
        "surface": FIRST["surface"] | {"seed": 22},
        "contact": {"pressure": "0.24 MPa"},
        "flow": FIRST["flow"] | {"lift": "none"},
        "limit": {"leak_rate": "1e-17 ml/h"},
        "accuracy": {"total": 0.1, "max_refinement": 1},
    }
    path = write_toml(tmp_path / "scene.toml", scene)
    run = ["run", str(path), "--strict", "--out", str(tmp_path / "out"), "--overwrite"]
    assert cli.main(run) == 4
    record = json.loads((tmp_path / "out" / "result.json").read_text())
    assert (record["state"], record["verdict"]["decision"]) == ("sealed", "undecided")
    assert record["accuracy"]["contact_error"] is None
    patch, choice, _ = chosen_patch(Scene.from_file(path, ["accuracy.max_refinement=2"]))
    assert patch.leak_rate.state == "leaking"
    assert [trial.leak_rate > 0 for trial in choice.trials] == [False, False, True]
    assert cli.main([*run, "--set", "contact.pressure=0.4 MPa"]) == 0


@pytest.mark.parametrize("lift", ["none", "range", "resolved"])
def test_less_load_only_opens(lift):
    """Sealed under a part of the load where the contact under that part is, or may be, sealed."""
    flow = FIRST["flow"] | {"lift": lift, "pressure_drop": "20 kPa"}
    sealed = Patch(Scene.from_mapping(FIRST | {"contact": {"pressure": "0.4 MPa"}, "flow": flow}))
    assert sealed.leak_rate.state == "sealed"
    load = sealing_load(sealed)
    # The fluid takes at most 20 kPa of the load, and `sealing_load` is up to 1 % too large.
    safe, unsafe = (load + 2e4) / 4e5, 0.98 * load / 4e5
    assert sealed_under(sealed, 1.001 * safe)
    assert not sealed_under(sealed, unsafe)


def test_a_smaller_cut_of_a_sealed_bearing_contact_only_opens():
    """It is sealed from the area on at which its critical constriction closes, exactly."""
    cut = FIRST | {"contact": {"model": "bearing", "area_fraction": 0.8}}
    sealed = Patch(Scene.from_mapping(cut | {"flow": FIRST["flow"] | {"lift": "none"}}))
    seals = sealing_load(sealed) / sealed.contact.contact_area_fraction
    assert sealed_under(sealed, seals * (1 + 1e-9))
    assert not sealed_under(sealed, seals * (1 - 1e-9))


def test_a_bearing_contact_of_an_area_that_leaks(accurate_scene):
    """Its area lacks no load. Held against 256² samples, whose own error is not counted."""
    accurate_scene["contact"] = {"model": "bearing", "area_fraction": 0.2}
    del accurate_scene["solid"]
    accurate_scene["accuracy"] = {"total": 0.5}
    patch, choice, missed = chosen_patch(Scene.from_mapping(accurate_scene))
    assert patch.leak_rate.converged
    assert not missed
    fine = patch.with_(Given(surface=resample(patch.surface, (256, 256))))
    assert abs(log(patch.leak_rate.value / fine.leak_rate.value)) <= log1p(0.5)
    assert choice.contact_error > 0


def test_the_lift_is_part_of_the_total(accurate_scene):
    """All entries of the budget together, the lift's too, keep the total that was asked for."""
    total = 0.1
    accurate_scene["flow"]["lift"] = "resolved"
    accurate_scene["surface"]["short_wavelength"] = "8 um"
    accurate_scene["accuracy"] = {"total": total}
    patch, choice, missed = chosen_patch(Scene.from_mapping(accurate_scene))
    assert patch.leak_rate.converged
    assert not missed
    parts = choice.contact_error, choice.flow_error, choice.lift_error
    assert min(parts) > 0
    assert sum(map(log1p, parts)) <= log1p(total) * (1 + 1e-9)
    # And the budget, which multiplies the same parts, counts no less than any one of them.
    factors = combined(error_budget(patch))
    assert 1 / (1 + total) <= factors.lower <= 1 / (1 + max(parts))
    assert 1 + max(parts) <= factors.upper <= 1 + total


def test_a_lift_that_has_not_settled_has_no_known_error(accurate_scene, monkeypatch):
    monkeypatch.setattr(stages, "MOST_STAGES", 0)
    accurate_scene["flow"]["lift"] = "resolved"
    patch, choice, _ = chosen_patch(Scene.from_mapping(accurate_scene))
    assert not patch.leak_rate.converged
    assert choice.lift_error is None
