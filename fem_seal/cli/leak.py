"""fem-seal leak: the leak rate of a gap, without a scene file.

Each field of some sections of a scene is an option; the scene's model gives their names and help.
"""

import argparse
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Literal, get_args, get_origin

from fem_seal.cli.options import add_for_programs, add_output, add_path
from fem_seal.cli.printing import origin_of, print_result, require_limit
from fem_seal.digits import with_prefix
from fem_seal.errors import InvalidInput
from fem_seal.progress import Display

if TYPE_CHECKING:
    from fem_seal.scene import Scene

SECTIONS = ("gap", "fluid", "flow", "limit", "output")
# Options whose name is not that of the field.
NAMES = {"gap.unit": "length-unit", "limit.leak_rate": "limit", "output.leak_rate_unit": "unit"}
# The file is an argument, and no solid is bent by the fluid.
NO_OPTIONS = ("gap.path", "flow.ambient_pressure", "flow.lift")
# Products of more than a gap, and what they need.
NO_PRODUCTS = {"seal": "[seal]", "sensitivity": "an elastic [contact]"}
DRIVES = ("pressure_drop", "inlet_pressure", "outlet_pressure")
VISCOSITY, PRESSURE_DROP = 1e-3, 1e5  # assumed of a liquid if left out [Pa s], [Pa]
# What an option has if it is left out, where that is not the field's default.
DEFAULTS = {
    "output.products": "leak_rate",
    "fluid.viscosity": f"of a liquid {with_prefix(VISCOSITY, 'Pa s')}",
    "flow.pressure_drop": with_prefix(PRESSURE_DROP, "Pa"),
}


def add(command: argparse.ArgumentParser) -> None:
    """Add the options, one for each field of the sections."""
    from fem_seal.scene.readable import parts_of

    text = "gap (nx, ny) [m], spacing [m], periodic; or nc, h5, npy, txt"
    add_path(command, "gap_file", "GAP.npz", text)
    add_output(command, "none: the result is printed only")
    add_for_programs(command)
    for option, name, field in _fields():
        default = DEFAULTS.get(name, None if field.is_required() else field.default)
        shown = "" if default is None else f" ({default})"
        literals = (part for part in parts_of(field.annotation) if get_origin(part) is Literal)
        choices = [str(value) for literal in literals for value in get_args(literal)]
        choices = [value for value in choices if value not in NO_PRODUCTS]
        described = not choices or f'"{choices[0]}"' in field.description
        listed = "" if described else f"; {', '.join(choices)}"
        text = f"{name}: {field.description}{listed}{shown}".replace("%", "%%")
        command.add_argument(f"--{option}", dest=name, metavar="VALUE", help=text)
    command.set_defaults(command=_leak)


def _fields() -> Iterator[tuple[str, str, Any]]:
    """Name of the option, "section.field", and the field of the model."""
    from fem_seal.scene import Scene
    from fem_seal.scene.readable import sections_in

    for section in SECTIONS:
        for model in sections_in(Scene.model_fields[section].annotation):
            for key, field in model.model_fields.items():
                if (name := f"{section}.{key}") not in NO_OPTIONS:
                    yield NAMES.get(name, key.replace("_", "-")), name, field


def _scene(options: argparse.Namespace) -> "tuple[Scene, list[str]]":
    """Scene that the options describe, whose model checks them, and a line of what is assumed."""
    from fem_seal.scene import Scene
    from fem_seal.scene.files import override
    from fem_seal.scene.readable import parts_of

    given, assumed = vars(options), []
    data: dict[str, Any] = {
        "gap": {"path": str(options.gap_file)},
        "fluid": {"viscosity": VISCOSITY},
        "output": {"products": ["leak_rate"]},
    }
    if given["fluid.viscosity"] is None:
        if given["fluid.kind"] == "gas":
            raise InvalidInput("a gas needs its viscosity, such as --viscosity '18 uPa s'")
        assumed.append(f"viscosity {with_prefix(VISCOSITY, 'Pa s')} (--viscosity)")
    if given["fluid.kind"] != "gas" and not any(given[f"flow.{drive}"] for drive in DRIVES):
        data["flow"] = {"pressure_drop": PRESSURE_DROP}
        assumed.append(f"pressure drop {with_prefix(PRESSURE_DROP, 'Pa')} (--pressure-drop)")
    for option, name, field in _fields():
        if (text := given[name]) is not None:
            if not text:
                raise InvalidInput(f"--{option} is empty; give a value, or leave the option out")
            parts = list(parts_of(field.annotation))
            # What TOML has not: yes, no, and whole numbers such as 1e6.
            if int in parts and re.fullmatch(r"\d+[eE]\+?\d\d?", text):
                text = str(int(float(text)))
            text = {"yes": "true", "no": "false"}.get(text, text)
            is_list = any(get_origin(part) is tuple for part in parts)
            data = override(data, f"{name}=[{text}]" if is_list else f"{name}={text}")
    for product, needs in NO_PRODUCTS.items():
        if product in data["output"]["products"]:
            raise InvalidInput(f"--products {product} needs a scene with {needs}: fem-seal run")
    return Scene.from_mapping(data), [f"assumed    {', '.join(assumed)}"] if assumed else []


def _leak(options: argparse.Namespace) -> int:
    from fem_seal.scene.sections import PRODUCTS
    from fem_seal.solved import run, solve

    scene, assumed = _scene(options)
    require_limit(options, scene)
    out = options.out
    for product in scene.output.products:
        if out is None and PRODUCTS[product].folder:
            raise InvalidInput(f"{product!r} of --products is written into a folder: give --out")
    with Display() as report:
        if out is None:
            result = solve(scene, report).result()
        else:
            origin = origin_of(options)
            result = run(scene, out, overwrite=options.overwrite, report=report, origin=origin)
    return print_result(result, out, options, assumed)
