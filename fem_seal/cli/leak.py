"""fem-seal leak: the leak rate of a gap, without a scene file."""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from fem_seal.cli.common import (
    add_command,
    add_for_programs,
    add_output,
    print_result,
    require_limit,
    run_and_print,
)

if TYPE_CHECKING:
    from fem_seal.scene import Scene


def pair(text: str) -> list[object]:
    """Read two lengths that a comma separates."""
    return [_number_or_text(part.strip()) for part in text.split(",")]


def count(text: str) -> int | str:
    """Read a whole number, also 1e6; return other text as it is: the scene refuses it."""
    try:
        number = float(text)
    except ValueError:
        return text
    return int(number) if number.is_integer() else text


def truth(text: str) -> bool:
    """Read yes or no."""
    answers = {"yes": True, "true": True, "no": False, "false": False}
    if text.lower() not in answers:
        raise argparse.ArgumentTypeError(f"{text!r} is neither yes nor no")
    return answers[text.lower()]


# Each option sets one field of the scene, which checks its value: option -> section, field, type of
# its value, help.
Field = tuple[str, str, Callable[[str], object], str]
FIELDS: dict[str, Field] = {
    "rtol": ("flow", "rtol", float, "largest (upper - lower) / sqrt(lower upper) (0.05)"),
    "sides": ("flow", "sides", str, "wall or periodic (periodic where the gap repeats, else wall)"),
    "representation": ("flow", "representation", str, "linear or constant (linear)"),
    "method": ("flow", "method", str, "adaptive, uniform or finite-difference (adaptive)"),
    "links": ("flow", "links", str, "links of finite-difference: arithmetic, harmonic, …"),
    "viscosity": ("fluid", "viscosity", str, "in Pa s or with a unit (1e-3)"),
    "pressure-drop": ("flow", "pressure_drop", str, "in Pa or with a unit (1e5)"),
    "limit": ("limit", "leak_rate", str, "such as '1 ml/h': do the bounds keep it?"),
    "unit": ("output", "leak_rate_unit", str, "unit of the leak rate beside SI, such as ml/h"),
    "max-unknowns": ("flow", "max_unknowns", count, "such as 1e6; then the best bounds so far"),
    "max-seconds": ("flow", "max_seconds", str, 'such as "5 min"; then the best bounds so far'),
    "max-memory": ("flow", "max_memory", str, 'such as "2 GB"; then the best bounds so far'),
}
# Settings that the file of a gap may lack.
FIELDS |= {
    "array": ("gap", "array", str, "name of the array, if the file has many"),
    "length-unit": ("gap", "unit", str, "unit of the gap, such as um, if the file has none"),
    "size": ("gap", "size", pair, "nx dx,ny dy, such as '1 mm,1 mm', if the file has none"),
    "periodic": ("gap", "periodic", truth, "yes or no, if the file does not record it (no)"),
    "transpose": ("gap", "transpose", truth, "yes exchanges the axes (no)"),
    "turn": ("gap", "turn", int, "degrees by which the gap is turned from x towards y: 0, 90, …"),
    "contact-below": ("gap", "contact_below", str, "gaps below this length are contact"),
}
DEFAULTS = {"viscosity": 1e-3, "pressure_drop": 1e5}


def add(subparsers: argparse._SubParsersAction) -> None:
    """Add the command."""
    command = add_command(
        subparsers,
        "leak",
        "compute the leak rate of a gap, without a scene file",
        "fem-seal leak gap.npz --sides periodic --unit ml/h --limit '1 ml/h'",
    )
    command.add_argument(
        "gap",
        type=Path,
        metavar="GAP.npz",
        help="gap (nx, ny) [m], spacing [m], periodic; or nc, h5, npy, txt",
    )
    for name, (_, _, kind, text) in FIELDS.items():
        command.add_argument(f"--{name}", type=kind, metavar="VALUE", help=text)
    command.add_argument(
        "--products",
        default="leak_rate",
        metavar="LIST",
        help="of leak_rate, mesh, pictures, constriction, …, with commas between (leak_rate)",
    )
    add_output(command, "none: the result is printed only")
    add_for_programs(command)
    command.set_defaults(command=_leak)


def scene_of(options: argparse.Namespace) -> dict[str, dict[str, object]]:
    """Sections of the scene that the options describe."""
    sections: dict[str, dict[str, object]] = {
        "gap": {"path": str(options.gap)},
        "fluid": {"viscosity": DEFAULTS["viscosity"]},
        "flow": {"pressure_drop": DEFAULTS["pressure_drop"]},
        "output": {"products": [name.strip() for name in options.products.split(",")]},
    }
    for name, (section, field, _, _) in FIELDS.items():
        value = getattr(options, name.replace("-", "_"))
        if value is not None:
            sections.setdefault(section, {})[field] = _number_or_text(value)
    return sections


def _number_or_text(value: object) -> object:
    """Read a plain number, in SI units; return other text, such as one with a unit, as it is."""
    try:
        return float(value) if isinstance(value, str) else value
    except ValueError:
        return value


def _assumed(scene: "Scene", options: argparse.Namespace) -> list[str]:
    """Line with the viscosity and the pressure drop that are assumed."""
    from fem_seal.digits import with_prefix

    assumed = []
    if options.viscosity is None:
        assumed.append(f"viscosity {with_prefix(scene.viscosity, 'Pa s')} (--viscosity)")
    if options.pressure_drop is None:
        drop = with_prefix(scene.drive.pressure_drop, "Pa")
        assumed.append(f"pressure drop {drop} (--pressure-drop)")
    return [f"assumed    {', '.join(assumed)}"] if assumed else []


def _leak(options: argparse.Namespace) -> int:
    from fem_seal.scene import Scene

    scene = Scene.from_mapping(scene_of(options))
    if options.out is not None:
        return run_and_print(scene, options.out, options, head=_assumed(scene, options))
    return _only_print(scene, options)


def _only_print(scene: "Scene", options: argparse.Namespace) -> int:
    from fem_seal import parallel
    from fem_seal.progress import Display
    from fem_seal.solved import solve

    require_limit(options, scene)
    with Display(parallel.is_root()) as report:
        result = solve(scene, report).result()
    return print_result(result, None, options, _assumed(scene, options))
