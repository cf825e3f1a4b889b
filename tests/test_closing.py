"""A closing contact: the loads, gap and flow against theory, and the animation of both."""

from itertools import pairwise

import numpy as np
import pytest
from PIL import Image
from project import ROOT, scene_of_samples, write_toml

from fem_seal import cli
from fem_seal.errors import InvalidInput
from fem_seal.render import closing_animation, closing_strip
from fem_seal.scene import Scene
from fem_seal.sweep.closing import FIRST, closing_contact, loads_to_closing
from fem_seal.sweep.closing_picture import REDUCTION

COUNT = 4


def scene(**changes):
    sections = scene_of_samples(32)
    sections["contact"] = {"pressure": "0.1 MPa"}
    sections["flow"] |= {"method": "adaptive", "rtol": 0.2}
    return Scene.from_mapping({**sections, **changes})


@pytest.fixture(scope="module")
def loads():
    return loads_to_closing(scene(), COUNT)


@pytest.fixture(scope="module")
def steps(loads):
    return list(closing_contact(scene(), loads))


def test_distance_from_the_last_load_falls_as_the_square_of_the_loads_that_are_left(loads):
    left = 1 - np.array(loads) / loads[-1]
    np.testing.assert_allclose(np.sqrt(left / (1 - FIRST)), np.linspace(1, 0, COUNT), atol=1e-7)


def test_the_last_load_alone_seals(steps):
    assert [step.leak_rate.state for step in steps] == ["leaking"] * (COUNT - 1) + ["sealed"]


def test_contact_grows_and_the_leak_rate_falls_with_the_load(steps):
    """The gap falls everywhere with the load, and the leak rate with the gap."""
    for low, high in pairwise(steps):
        lower, higher = low.film.gap.values, high.film.gap.values
        # Each gap is known to the tolerance of its contact.
        assert (higher - lower).max() < 1e-4 * lower.max()
        assert high.film.contact_area_fraction > low.film.contact_area_fraction
        assert high.leak_rate.upper < low.leak_rate.lower


def test_a_limit_does_not_end_the_flows_early(loads):
    """A limit that is far away is decided on the first mesh."""
    limited = scene(limit={"leak_rate": "1 m^3/s"})
    (step,) = closing_contact(limited, loads[:1])
    assert step.leak_rate.lower > 0.6 * step.leak_rate.upper  # rtol 0.2 of the mean of both


@pytest.mark.render
def test_film_has_a_frame_for_each_load_in_common_colours(steps, tmp_path):
    with Image.open(closing_animation(steps, tmp_path / "closing.gif")) as film:
        assert film.n_frames == COUNT
        frames = []
        for k in range(COUNT):
            film.seek(k)
            frames.append(np.asarray(film.convert("RGB")))
    # The bars are the same pixels in all frames; the drawings between them are not.
    width = frames[0].shape[1]
    bar = slice(width - 190 // REDUCTION, width)
    for frame in frames[1:]:
        assert (frame[:, bar] == frames[0][:, bar]).all()
        assert (frame != frames[0]).any()


@pytest.mark.render
def test_strip_shows_at_most_three_loads(steps, tmp_path):
    whole = closing_strip(steps, tmp_path / "whole.png")
    doubled = closing_strip([*steps, *steps], tmp_path / "doubled.png")
    with Image.open(whole) as one, Image.open(doubled) as other:
        assert one.size == other.size


def test_nothing_to_draw_is_refused(steps, tmp_path):
    with pytest.raises(InvalidInput, match="no load leaves a flow to draw"):
        closing_strip(steps[-1:], tmp_path / "closing.png")
    with pytest.raises(InvalidInput, match=r"animations end in \.gif"):
        closing_animation(steps, tmp_path / "closing.mp4")


@pytest.mark.parametrize(
    ("contact", "match"),
    [
        ({"area_fraction": 0.1}, "contact.pressure"),
        ({"model": "bearing", "area_fraction": 0.1}, "gfmd"),
    ],
)
def test_a_contact_without_a_pressure_is_refused(contact, match):
    with pytest.raises(InvalidInput, match=match):
        loads_to_closing(scene(contact=contact), COUNT)


def test_a_scene_without_a_fluid_is_refused():
    sections = scene_of_samples(32) | {
        "contact": {"pressure": "0.1 MPa"},
        "output": {"products": ["contact"]},
    }
    del sections["fluid"], sections["flow"]
    with pytest.raises(InvalidInput, match=r"needs \[fluid\]"):
        loads_to_closing(Scene.from_mapping(sections), COUNT)


def test_wrong_loads_are_refused_before_any_work():
    with pytest.raises(InvalidInput, match="2 to 200 loads, got 1"):
        loads_to_closing(scene(), 1)
    with pytest.raises(InvalidInput, match="must be positive pressures"):
        next(closing_contact(scene(), [1e5, -1e5]))


def test_pressures_of_the_command_need_units(tmp_path, capsys):
    command = ["study", "closing", str(ROOT / "demos/scenes/first.toml"), "--out", str(tmp_path)]
    assert cli.main([*command, "--pressures", "0.1MPa,2"]) == 2
    assert "has no unit" in capsys.readouterr().err
    assert not list(tmp_path.glob("closing*"))


def test_the_command_leaves_nothing_where_all_loads_seal(tmp_path, capsys):
    sections = scene_of_samples(32)
    sections["contact"] = {"pressure": "0.1 MPa"}
    path = write_toml(tmp_path / "scene.toml", sections)
    command = ["study", "closing", str(path), "--out", str(tmp_path / "out"), "--pressures", "1GPa"]
    assert cli.main(command) == 2
    assert "no load leaves a flow" in capsys.readouterr().err
    assert not list((tmp_path / "out").glob("closing*"))
