"""The doctor: it names what fails and the remedy; a probe that crashes does no harm."""

import sys

import pytest

from fem_seal import cli
from fem_seal.cli import doctor


@pytest.mark.parametrize(
    ("code", "found"),
    [
        ("print('1.2.3')", "1.2.3"),
        ("import nothing_of_this_name", "ModuleNotFoundError: No module named"),
        ("import os; os.abort()", "ended with status -6"),
        ("pass", "ended with status 0"),
        ("import time; time.sleep(60)", "no answer"),
    ],
)
def test_probe(code, found, monkeypatch):
    """Silence, death and going on for ever are failures as much as an exception is."""
    if "sleep" in code:
        monkeypatch.setattr(doctor, "PATIENCE", 0.2)
    works, said = doctor._try([sys.executable, "-c", code])
    assert works == (found == "1.2.3")
    assert said.startswith(found)


def test_no_mpirun(monkeypatch):
    monkeypatch.setenv("PATH", "/nowhere")
    finding = doctor._mpi()
    assert not finding.works
    assert not finding.required
    assert "apt-get install" in finding.remedy


def test_table_and_exit_status(monkeypatch, capsys):
    good = doctor.Finding("good", "all", True, "1.0", "")
    bad = doctor.Finding("bad", "flow", False, "not found", "install it")
    extra = doctor.Finding("extra", "files", False, "not installed", "fetch it", required=False)
    monkeypatch.setattr(doctor, "examine", lambda: iter([good, extra]))
    assert cli.main(["doctor"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "ok    good   1.0",
        "no    extra  not installed",
        "             for files: fetch it",
    ]
    monkeypatch.setattr(doctor, "examine", lambda: iter([good, bad]))
    assert cli.main(["doctor"]) == 2
    assert "not working here: bad" in capsys.readouterr().err
