"""What the commands share: options, the run itself and what they print."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from fem_seal import parallel
from fem_seal.errors import NotConverged

if TYPE_CHECKING:
    from fem_seal.results import Result
    from fem_seal.results.result import AccuracyRecord
    from fem_seal.scene import Scene


def add_scene(command: argparse.ArgumentParser) -> None:
    """Take a scene file and changes to it."""
    command.add_argument("scene", type=Path, metavar="SCENE.toml", help="the scene file")
    command.add_argument(
        "--set",
        dest="overrides",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="change a field, such as flow.rtol=0.02; may be repeated",
    )


def add_output(command: argparse.ArgumentParser, default: str) -> None:
    """Take a result folder."""
    command.add_argument("--out", type=Path, metavar="DIR", help=f"result folder ({default})")
    command.add_argument(
        "--overwrite", action="store_true", help="replace another scene's result in DIR"
    )


def run_and_print(scene: "Scene", out: Path, overwrite: bool) -> int:
    """Run a scene into a folder, print its result and give the exit status."""
    from fem_seal.job import run
    from fem_seal.progress import Display

    with Display(parallel.is_root()) as report:
        result = run(scene, out, overwrite=overwrite, report=report)
    return print_result(result, out)


def print_result(result: "Result", out: Path | None) -> int:
    """Print the numbers a user asked for and give the exit status."""
    if parallel.is_root():
        say("\n".join(summary(result, out)))
    if result.converged:
        return 0
    return parallel.fail(f"fem-seal: {result.reason}", NotConverged.exit_status)


def say(text: str) -> None:
    """Print to standard output, from the first process only."""
    if parallel.is_root():
        print(text, flush=True)  # noqa: T201 (the output of the command)


def summary(result: "Result", out: Path | None) -> list[str]:
    """Lines for people; result.json has all digits."""
    from fem_seal.results.words import lines_of

    lines = [f"state      {result.state}"]
    if result.leak_rate:
        lines.append(f"leak rate  {_leak_rate(result)}")
        lines.append(f"flow       {result.method}, {result.unknowns} unknowns")
    lines.extend(f"{label:10} {text}" for label, text in lines_of(result))
    if result.accuracy:
        lines.append(f"accuracy   {_chosen(result.accuracy)}")
    contact = f"area fraction {result.contact_area_fraction:.4f}, mean gap {result.mean_gap:.3e} m"
    if result.mean_pressure is not None:
        contact += f", mean pressure {result.mean_pressure:.3e} Pa"
    lines.append(f"contact    {contact}")
    memory = result.peak_memory_bytes / 1e6
    lines.append(f"cost       {result.seconds['total']:.1f} s, {memory:.0f} MB")
    if out is not None:
        lines.append(f"result     {', '.join(('result.json', *result.files))} in {out}")
    return lines


def _chosen(accuracy: "AccuracyRecord") -> str:
    contact, flow = (
        "unknown" if part is None else f"{100 * part:.2g} %"
        for part in (accuracy.contact_error, accuracy.flow_error)
    )
    nx, ny = accuracy.samples
    return (
        f"chosen for {100 * accuracy.total:g} %: contact on {nx} x {ny} (error about {contact}), "
        f"flow.rtol = {accuracy.rtol:.2g} (at most {flow})"
    )


def _leak_rate(result: "Result") -> str:
    leak = result.leak_rate
    if result.state == "sealed":
        return "0 m^3/s: no open path joins inlet and outlet"
    if leak.lower is None:
        return f"{leak.value:.4e} {leak.unit} (finite differences: no bounds)"
    half = (leak.upper - leak.lower) / (leak.upper + leak.lower)
    return (
        f"{leak.value:.4e} {leak.unit}, within [{leak.lower:.4e}, {leak.upper:.4e}] "
        f"(±{100 * half:.2g} %)"
    )
