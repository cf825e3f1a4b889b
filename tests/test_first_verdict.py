"""docs/guide/first-verdict.md, followed line by line, prints what it says."""

import re
import shlex
import shutil
import tomllib
from itertools import takewhile
from pathlib import Path

import pytest
from project import ROOT, unwrapped, without_numbers

from fem_seal import cli

PAGE = (ROOT / "docs" / "guide" / "first-verdict.md").read_text(encoding="utf-8")
# Commands, indented by four, and blocks: what one prints, or what the reader puts into the scene.
PARTS = re.findall(r"^    ((?:cp|fem-seal) [^\n]*)$|^```(text|toml)\n(.*?)^```", PAGE, re.M | re.S)
# The map is drawn once. The patch draws no pictures, which test_cli.py does. The seal has few
# patches and loose bounds; its range overlaps that of the page.
CHEAPER = {
    "fem-seal surface map.toml --out look.png": "fem-seal surface map.toml",
    "fem-seal run map.toml": (
        "fem-seal run map.toml --set \"output.products=['contact', 'leak_rate']\""
    ),
    "fem-seal run ring.toml": "fem-seal run ring.toml --set seal.patches=4 --set seal.rtol=1.8",
}


def put_in(scene, lines):
    """Put the lines of a block into a scene, in place of those of their keys or below a header.

    A line that begins with # takes that of its key out.
    """
    section = ""
    for line in lines.splitlines():
        if line.startswith("["):
            section = line
        elif line:
            key = line.removeprefix("# ").split(" = ")[0]
            head = rf"^(?:# )?{re.escape(section)}.*\n"
            body = re.search(rf"{head}((?:.+\n)*)", scene, re.MULTILINE)
            start, end = body.span(1)
            rest = re.sub(rf"^(?:# )?{key} = .*\n", "", scene[start:end], flags=re.MULTILINE)
            scene = f"{scene[: body.start()]}{section}\n{line}\n{rest}{scene[end:]}"
    return scene


def bounds(line):
    """Lower and upper end of a printed leak rate."""
    return [float(number) for number in re.search(r"(\S+) to (\S+) with all", line).groups()]


@pytest.mark.render
@pytest.mark.parametrize("seal", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_page(here, capsys, seal):
    """Lines of a block are printed as they stand, but for digits that the bounds leave open.

    The seal of the page, its last part, takes half of the time.
    """
    printed, edited = "", Path("map.toml")
    of_patch = takewhile(lambda part: "ring.toml" not in part[0], PARTS)
    for command, kind, block in PARTS if seal else of_patch:
        if kind == "toml":
            scene = put_in(edited.read_text(encoding="utf-8"), block)
            edited.write_text(scene, encoding="utf-8")
            for section, fields in tomllib.loads(block).items():
                assert fields.items() <= tomllib.loads(scene)[section].items()
        elif kind == "text":
            for line in unwrapped(block).splitlines():
                lines = [
                    text
                    for text in printed.splitlines()
                    if without_numbers(text) == without_numbers(line)
                ]
                assert lines, line
                if line.startswith("leak rate"):
                    # The patch is that of the page, to the flow's rtol; of the cheaper seal the
                    # range overlaps.
                    (low, high), (lower, upper) = bounds(lines[0]), bounds(line)
                    assert max(low, lower) <= min(high, upper)
                    if edited.name == "map.toml":
                        assert (low, high) == pytest.approx((lower, upper), rel=0.05)
                elif not line.startswith(("verdict", "errors")):
                    assert line in lines
        elif command.startswith("cp"):
            _, source, target = shlex.split(command)
            shutil.copy(source if Path(source).exists() else ROOT / source, target)
            edited = Path(target) if target.endswith(".toml") else edited
        else:
            assert cli.main(shlex.split(CHEAPER.get(command, command))[1:]) == 0
            printed = unwrapped(capsys.readouterr().out)
    assert Path("results/map/report.html").is_file()
    if not seal:
        return
    assert list(Path("results").glob("ring-*/seal.png"))
    ring = tomllib.loads(Path("ring.toml").read_text(encoding="utf-8"))
    # The window of the page is that of `fem-seal new`, by its rule.
    proposed = re.search(r"^# (window = .*?\])", Path("map.toml").read_text("utf-8"), re.MULTILINE)
    assert tomllib.loads(proposed[1])["window"] == ring["seal"]["window"]
    assert "crop" not in ring["surface"]
    assert "rtol" not in ring["flow"]
