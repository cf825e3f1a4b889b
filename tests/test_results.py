"""The result folder: complete or absent, read back to the last digit, never another scene's."""

import os
import re
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from project import damaged, scene_of_samples

from fem_seal import run
from fem_seal.accuracy import Chosen
from fem_seal.errors import Inconsistent, InvalidInput
from fem_seal.leak_rate import FlowField, LeakRate
from fem_seal.patch import Patch
from fem_seal.pressure_profile import TabulatedProfile
from fem_seal.results import Result, ResultFolder, read_contact, read_flow
from fem_seal.results.arrays import write_flow
from fem_seal.results.records import PathRecord
from fem_seal.results.result import Provenance
from fem_seal.results.words import preparation_words
from fem_seal.scene import Scene
from fem_seal.scene_steps import FLOWS
from fem_seal.solved import Solved, answer, solve
from fem_seal.surface import MapStatistics
from fem_seal.upscaling import EndPressures
from fem_seal.upscaling.path_flow import SealFlow, lifted_off


@pytest.fixture(scope="module")
def answers():
    """Of the small scene under two contact areas."""
    scene = Scene.from_mapping(scene_of_samples(32))
    return [solve(scene.with_({"contact.area_fraction": area})) for area in (0.2, 0.1)]


@pytest.fixture
def scene(small_scene):
    return Scene.from_mapping(small_scene)


def content(folder):
    """All files below a folder with what is in them."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def test_read_back_exactly(scene, tmp_path):
    scene = scene.with_({"flow.method": "adaptive", "flow.rtol": 0.5})
    result, patch = run(scene, tmp_path / "out"), Patch(scene)
    assert Result.from_folder(tmp_path / "out") == result
    leak, contact, read = patch.leak_rate, patch.contact, read_contact(tmp_path / "out")
    for name in ("value", "lower", "upper"):
        assert getattr(result.leak_rate, name) == getattr(leak, name)
    assert [level.upper for level in result.levels] == [level.upper for level in leak.levels]
    np.testing.assert_array_equal(read.gap.values, contact.gap.values)
    np.testing.assert_array_equal(read.pressure.values, contact.pressure.values)
    assert (read.gap.spacing, read.gap.periodic) == (contact.gap.spacing, True)
    assert result.scene() == scene
    gap, pressure = contact.gap, contact.pressure
    assert result.contact_area_fraction == np.mean(gap.values == 0)
    # Sums of some thousand numbers in another order.
    assert result.mean_gap == pytest.approx(gap.values.mean(), rel=1e-13)
    assert result.mean_pressure == pytest.approx(pressure.values.mean(), rel=1e-13)
    assert 0 <= result.certificate <= scene.contact.tolerance
    assert 0 <= result.pressed_gap <= 1e-4
    assert 0 <= result.penetration <= scene.contact.tolerance
    assert result.seconds["total"] >= sum(v for k, v in result.seconds.items() if k != "total")
    assert result.peak_memory_bytes > gap.values.nbytes


@pytest.fixture
def field():
    rng = np.random.default_rng(1)
    return FlowField(
        points=rng.random((4, 2)) * 1e-5,
        cells=np.array([[0, 1, 2], [0, 2, 3]]),
        gap=rng.random(4) * 1e-7,
        pressure=rng.random(4) * 1e5,
        flux=rng.random((2, 2)) * 1e-12,
        facet_tags=np.array([[3, 0, 1], [2, 3, 0]], dtype=np.int8),
    )


def test_an_answer_that_contradicts_itself_is_none(field):
    """Other leak rates and their bounds: quantities/test_error_budget.py."""
    for change in (
        {"gap": field.gap[:3]},
        {"cells": field.cells + 1},
        {"flux": field.pressure},
        {"facet_tags": field.facet_tags[:1]},
    ):
        with pytest.raises(Inconsistent):
            replace(field, **change)
    with pytest.raises(Inconsistent):
        LeakRate(1.0, state="sealed", method="adaptive")
    for value, lower, upper in ((1.5, 2.0, 1.0), (3.0, 1.0, 2.0), (1.0, np.nan, 2.0)):
        with pytest.raises(Inconsistent):
            SealFlow(value, lower, upper, "leaking")


@pytest.mark.parametrize("lip", [0.5004, 0.5014, 0.5024])
def test_the_recorded_path_keeps_its_highest_total_pressure(lip):
    """A lip narrower than a 400th of the path: "at most 0.5 MPa" would else be at most 0.1 MPa."""
    profile = TabulatedProfile([0, lip - 1e-4, lip, lip + 1e-4, 1], [1e5, 1e5, 5e5, 1e5, 1e5])
    flow = lifted_off(profile, EndPressures(6e5))
    record = PathRecord.of(flow.path)
    assert max(record.total_pressure) == 5e5
    # The key of earlier versions.
    assert record.model_dump(by_alias=True)["contact_pressure"] == record.total_pressure


def test_flow_field_is_read_back_exactly(field, tmp_path):
    """Also that of an earlier version, which has no tags; none is there unless it was asked for."""
    with pytest.raises(InvalidInput, match="name 'mesh' in output"):
        read_flow(tmp_path)
    for written in (field, replace(field, facet_tags=None)):
        write_flow(tmp_path, written)
        read = read_flow(tmp_path)
        for name in ("points", "cells", "gap", "pressure", "flux", "facet_tags"):
            np.testing.assert_array_equal(getattr(read, name), getattr(written, name), name)


@pytest.mark.parametrize("name", ["gap", "pressure", "flux", "facet_tags"])
def test_damaged_array_of_a_flow(field, tmp_path, name):
    """A number that is none is refused by the array's name, not drawn."""
    damaged = getattr(field, name).astype(float)
    damaged.flat[-1] = np.nan
    write_flow(tmp_path, replace(field, **{name: damaged}))
    with pytest.raises(InvalidInput, match=f"flow.vtu.*no whole array '{name}'"):
        read_flow(tmp_path)


def test_each_step_is_computed_once(scene, monkeypatch):
    patch, by_differences, solves = Patch(scene), FLOWS["finite-difference"], []
    counted = lambda *a: solves.append(a) or by_differences(*a)  # noqa: E731
    monkeypatch.setitem(FLOWS, "finite-difference", counted)
    assert patch.contact is patch.contact
    answer(Chosen(patch)).result()
    answer(Chosen(patch)).result()
    assert len(solves) == 2  # on the grid of the scene, and on half of its samples


def test_same_scene_may_be_run_again_and_other_files_stay(scene, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    run(scene, tmp_path)
    run(scene.with_({"output.products": ["leak_rate"]}), tmp_path)
    assert set(content(tmp_path)) == {"notes.txt", "result.json", "contact.npz"}


def test_changed_input_file_is_another_scene(scene_of_gap, tmp_path):
    flow = {"pressure_drop": 1.0, "method": "finite-difference"}
    run(Scene.from_mapping(scene_of_gap(np.ones((3, 3)), flow=flow)), tmp_path / "out")
    changed = Scene.from_mapping(scene_of_gap(np.full((3, 3), 2.0), flow=flow))
    with pytest.raises(InvalidInput, match="another scene"):
        run(changed, tmp_path / "out")


@pytest.mark.parametrize("stops", range(1, 9))
@pytest.mark.parametrize("ends", ["interrupted", "killed"])
def test_a_move_that_is_cut_short_is_finished(answers, tmp_path, stops, ends):
    """Once all files are staged the new result is in, at the end of this run or by the next."""
    old, new = answers
    old.save(tmp_path / "out")
    (tmp_path / "out" / "notes.txt").write_text("mine")
    steps = []

    def step(function):
        def counted(*arguments, **options):
            steps.append(arguments)
            if ends == "killed" and len(steps) >= stops:
                raise Killed
            if len(steps) == stops:
                raise KeyboardInterrupt
            return function(*arguments, **options)

        return counted

    with pytest.MonkeyPatch.context() as patch:
        for module, name in ((os, "replace"), (Path, "rename"), (Path, "unlink"), (Path, "rmdir")):
            patch.setattr(module, name, step(getattr(module, name)))
        with suppress(Killed, KeyboardInterrupt):
            new.save(tmp_path / "out", overwrite=True)

    def written() -> Solved:
        """The answer whose result is in the folder; the gap there is that of the same answer."""
        result = Result.from_folder(tmp_path / "out")
        [whole] = [answer for answer in answers if answer.patch.scene == result.scene()]
        gap = read_contact(tmp_path / "out").gap
        assert np.array_equal(gap.values, whole.patch.film.gap.values)
        return whole

    # Whoever reads now sees the old result, the new one or none, and never parts of both.
    if "result.json" in content(tmp_path / "out"):
        at_once = written()
        assert at_once is new or ends == "killed" or stops == 1
    # The next run finds the new result, which is that of its own scene, unless it was not staged.
    with ResultFolder(tmp_path / "out", Provenance.of(new.patch.scene), overwrite=stops == 1):
        pass
    after = content(tmp_path / "out")
    assert set(after) == {"contact.npz", "result.json", "notes.txt"}
    assert written() is new or stops == 1


class Killed(BaseException):
    """Stands for kill -9: nothing on the disk changes from here on."""


def test_a_foreign_file_is_not_replaced_unless_overwritten(scene, tmp_path):
    (tmp_path / "contact.npz").write_text("mine")
    with pytest.raises(InvalidInput, match=r"contact\.npz that belongs to no result"):
        run(scene, tmp_path)
    assert content(tmp_path) == {"contact.npz": b"mine"}
    run(scene, tmp_path, overwrite=True)
    assert Result.from_folder(tmp_path).files == ("contact.npz",)


def test_a_run_does_not_replace_its_input(scene, small_scene, tmp_path):
    run(scene, tmp_path / "out")
    before = content(tmp_path)
    sections = {key: small_scene[key] for key in ("fluid", "flow", "output")}
    leak = Scene.from_mapping({**sections, "gap": {"path": str(tmp_path / "out" / "contact.npz")}})
    with pytest.raises(InvalidInput, match="lies in the output folder and would be replaced"):
        run(leak, tmp_path / "out", overwrite=True)
    assert content(tmp_path) == before


def test_a_result_names_no_files_of_other_folders(scene, small_scene, tmp_path):
    """A folder from elsewhere may say so; what it names is not removed."""
    run(scene, tmp_path / "out")
    (tmp_path / "precious").write_text("mine")
    result = Result.from_folder(tmp_path / "out")
    hostile = result.model_copy(update={"files": ("../precious", str(tmp_path / "precious"))})
    (tmp_path / "out" / "result.json").write_text(hostile.to_json())
    run(scene, tmp_path / "out", overwrite=True)
    assert (tmp_path / "precious").read_text() == "mine"


DAMAGED_BUDGET = b'{"schema": 1, "error_budget": [{}]}'
DAMAGED_VERDICT = b'{"schema": 1, "verdict": "within"}'
# A result has no such number; one from elsewhere would break what shows it.
BEYOND = [f'"mean_gap": {number}'.encode() for number in ("1e999", "-1e999", "Infinity", "NaN")]


@pytest.mark.parametrize(
    "text",
    [
        *(b"", b"{}", b'{"schema": 2}', b"[1]", b"not json", b"\xff\xfe"),
        *(DAMAGED_BUDGET, DAMAGED_VERDICT, *BEYOND),
    ],
)
def test_damaged_result(answers, tmp_path, text):
    with pytest.raises(InvalidInput, match="cannot read the result"):
        Result.from_folder(tmp_path)
    words = "beyond double precision" if text in BEYOND else "of this version"
    if text in BEYOND:
        text = re.sub(rb'"mean_gap": [^,]*', text, answers[0].result().to_json().encode())
    (tmp_path / "result.json").write_bytes(text)
    origin = Provenance.of(answers[0].patch.scene)
    with pytest.raises(InvalidInput, match=f"is not a result.*{words}"):
        Result.from_folder(tmp_path)
    with pytest.raises(InvalidInput, match=f"is not a result.*{words}"):
        ResultFolder(tmp_path, origin).__enter__()
    with ResultFolder(tmp_path, origin, overwrite=True) as folder:
        assert folder.staged.is_dir()


LIFT_OF_A_SOLID_ALONE = {
    "model": "resolved",
    "solid_pressure": 1e5,
    "lowest": 1e-16,
    "highest": 2e-16,
    "dry": {"contact_area_fraction": 0.2, "mean_gap": 1e-7},
}


@pytest.mark.parametrize(
    ("place", "value", "words"),
    [
        (("seconds",), {}, "seconds: .*'total'"),
        (("error_budget", 0, "lower"), -1.0, "factors of a leak rate"),
        (("lift",), LIFT_OF_A_SOLID_ALONE, "lift: .*the fluid's load"),
        # In ml/h it would be infinite.
        (("leak_rate", "value"), 1e305, "beyond double precision"),
    ],
)
def test_a_result_that_contradicts_itself_is_none(answers, tmp_path, place, value, words):
    """One sentence of the reader, status 2: what shows a result never meets such a part."""
    (tmp_path / "result.json").write_text(damaged(answers[0].result().to_json(), place, value))
    with pytest.raises(InvalidInput, match=f"is not a result.*{words}"):
        Result.from_folder(tmp_path)


def test_words_of_a_preparation():
    """How many points were filled is what was missing before and is not any more."""
    numbers = {"samples": (8, 8), "rms_height": 2e-6, "rms_slope": 0.1, "seam": 1.5}
    steps = (("read", 7), ("crop", 5), ("fill linear", 0), ("detrend plane", 0))
    records = tuple(MapStatistics(name=name, missing=count, **numbers) for name, count in steps)
    assert preparation_words(records) == (
        "read: 2 um, 0.1, 1.5; crop: 2 um, 0.1, 1.5; fill linear (5 points): 2 um, 0.1, 1.5; "
        "detrend plane: 2 um, 0.1, 1.5 (rms height, rms slope, seam)"
    )
