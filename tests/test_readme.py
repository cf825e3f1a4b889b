"""The README's examples run and print what it says."""

import re

import pytest
from project import FIRST, NUMBER, ROOT, without_numbers

from fem_seal.patch import Patch
from fem_seal.results.words import summary_of
from fem_seal.scene import Scene
from fem_seal.solved import run

README = (ROOT / "README.md").read_text()


def numbers(text):
    return [float(number) for number in re.findall(rf"(?<![\w^]){NUMBER}", text)]


def assert_same_leak_rate(printed, stated):
    """Value, lower, upper and half-width [%]: two certified brackets of one number overlap.

    Each value is the middle of its bracket: they differ by both half-widths at most.
    """
    assert max(printed[1], stated[1]) <= min(printed[2], stated[2])
    assert max(printed[3], stated[3]) <= 2.5
    assert abs(printed[0] / stated[0] - 1) < 0.01 * (printed[3] + stated[3])


def assert_same_lifted_contact(printed, stated):
    """Area and mean gap to 1 %.

    The leak rates of two equilibria may differ by 6 %. Lifting made it 18 times as large, halved
    the area and doubled the gap: 6 % of it go with 1 % of these.
    """
    assert printed == pytest.approx(stated, rel=0.01)


def test_example_prints_what_the_readme_says(monkeypatch, capsys):
    [code] = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    [said] = re.findall(r"```\n(contact.*?)```", README, re.DOTALL)
    monkeypatch.chdir(ROOT)
    exec(code, {})
    printed = capsys.readouterr().out
    assert without_numbers(printed) == without_numbers(said)
    dry, lifted, headline, last = printed.splitlines()
    assert dry == said.splitlines()[0]  # to the digits shown
    assert_same_lifted_contact(numbers(lifted), numbers(said.splitlines()[1]))
    # All errors together are known to two digits, and follow the bounds of the flows.
    assert numbers(headline) == pytest.approx(numbers(said.splitlines()[2]), rel=0.04)
    assert_same_leak_rate(numbers(last), numbers(said.splitlines()[-1]))


def test_pictures_of_the_readme_load_at_once():
    """200 kB each at most."""
    pictures = re.findall(r"!\[[^]]*\]\((.*?)\)", README)
    assert pictures
    assert max((ROOT / picture).stat().st_size for picture in pictures) < 200_000


def test_first_command_prints_what_the_readme_says(tmp_path):
    """What `make demo` prints, but for its cost and without its pictures."""
    products = "output.products=['leak_rate']"
    result = run(Scene.from_file(FIRST, [products]), tmp_path / "out")
    unfolded = re.sub(r"\n {15}", " ", README)
    labels = "state|leak rate|flow|lift|errors|contact"
    said = dict(re.findall(rf"^    ({labels}) +(.*)$", unfolded, re.MULTILINE))
    assert len(said) == len(labels.split("|"))
    printed = {label: text for label, text in summary_of(result) if label in said}
    assert printed.keys() == said.keys()
    assert all(without_numbers(printed[k]) == without_numbers(said[k]) for k in said)
    assert_same_lifted_contact(numbers(printed["contact"]), numbers(said["contact"]))
    assert_same_leak_rate(numbers(printed["leak rate"]), numbers(said["leak rate"]))
    *carried, steps, change = numbers(printed["lift"])
    assert carried == pytest.approx(numbers(said["lift"])[:3], rel=0.01)
    assert (steps, change < 1) == (numbers(said["lift"])[3], True)
    # Factors of estimates follow the bounds of the flows, which are 2.5 % wide at most.
    assert numbers(printed["errors"]) == pytest.approx(numbers(said["errors"]), rel=0.025)
    [dry] = re.findall(rf"flow.lift=none`\), ({NUMBER}) m\^3/s would leak, an eighteenth", README)
    leak = Patch(Scene.from_file(FIRST, [products, "flow.lift=none", "flow.rtol=0.3"])).leak_rate
    assert leak.lower <= float(dry) <= leak.upper
    assert round(numbers(said["leak rate"])[0] / float(dry)) == 18
    assert "fem-seal run demos/scenes/first.toml" in (ROOT / "Makefile").read_text()
