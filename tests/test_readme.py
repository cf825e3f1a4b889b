"""The README's example runs and prints what it says."""

import re
import subprocess
import sys

from project import ROOT

README = (ROOT / "README.md").read_text()
NUMBER = r"[\d.]+(?:e[+-]\d+)?"


def test_example_prints_what_the_readme_says():
    [code] = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    [said] = re.findall(r"```\n(contact.*?)```", README, re.DOTALL)
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert re.sub(NUMBER, "#", done.stdout) == re.sub(NUMBER, "#", said)
    printed, stated = (
        [float(x) for x in re.findall(r" (" + NUMBER + ")", t)] for t in (done.stdout, said)
    )
    # Contact area and mean gap to the digits shown.
    assert printed[:2] == stated[:2]
    # Two certified intervals of one leak rate must overlap; each is 5 % wide at most.
    assert max(printed[3], stated[3]) <= min(printed[4], stated[4])
    assert max(printed[2:]) / min(printed[2:]) < 1.06


def test_files_that_the_readme_names_are_there():
    for name in re.findall(r"\]\((.*?)\)", README):
        assert (ROOT / name).is_file(), name
