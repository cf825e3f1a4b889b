"""fem-seal render: the pictures of a result folder, drawn again."""

import argparse

from fem_seal.cli.options import add_path
from fem_seal.cli.printing import say
from fem_seal.progress import Display

FLOW = "flow.png"


def add(command: argparse.ArgumentParser) -> None:
    """Add the folder, and what is drawn."""
    add_path(command, "folder", "DIR", "folder of fem-seal run or leak --out")
    command.add_argument(
        "--all",
        action="store_true",
        help="also how the bounds closed and, of a grid whose flow.vtu is kept (product 'mesh'), "
        "pressure, refined mesh and relief",
    )
    command.set_defaults(command=_render)


def _render(options: argparse.Namespace) -> int:
    from fem_seal.drawing import draw

    with Display() as report:
        names = draw(options.folder, report, everything=options.all)
    nothing = "no pictures, since nothing is left to draw of a film that is lifted off,"
    say(f"{', '.join(names) or nothing} in {options.folder}")
    if FLOW not in names and (options.folder / FLOW).is_file():
        say(f"{FLOW} is left as it was: it is drawn from flow.vtu, which the product 'mesh' keeps")
    return 0
