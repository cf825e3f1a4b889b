"""One self-contained HTML page of a result folder: the verdict, the pictures, the numbers.

The page itself is the template report.html.jinja beside this file.
"""

import base64
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from fem_seal.error_budget import combined, factor_words
from fem_seal.errors import printable
from fem_seal.files import atomic_write, temporary_folder
from fem_seal.render.convergence import bounds_plot, close_in
from fem_seal.results import Result
from fem_seal.results.words import first_sentence, remarks, summary_of
from fem_seal.scene import Scene
from fem_seal.scene.readable import rows_of_mapping
from fem_seal.tables import leaves

MEDIA = {".png": "image/png", ".svg": "image/svg+xml"}
# Pictures with captions, in the order of the page; that of a seal comes before those of its patch.
ORDER = (
    "seal", "flow", "gap", "lift", "contact_pressure", "contact", "shape", "sensitivity",
    "pressure", "relief", "mesh", "bounds",
)  # fmt: skip
OF_A_CONTACT = ("contact", "contact_pressure", "gap")
# The table of numbers leaves out what the page shows elsewhere, arrays, and the fluxes of the
# pressure before its correction: above the upper bound they would seem to contradict it.
ELSEWHERE = {"provenance", "error_budget", "cautions", "files", "inflow", "outflow"}


def report(folder: str | Path) -> Path:
    """Write report.html of a result folder, its pictures (.png, .svg) inside; return its path."""
    folder = Path(folder)
    result = Result.from_folder(folder)
    provenance = result.provenance
    day, _, time = provenance.date.partition("T")
    version = provenance.versions.get("fem_seal", "of an unknown version")
    numbers = result.model_dump(mode="json", by_alias=True, exclude=ELSEWHERE)
    origin = {
        "versions": provenance.versions,
        "inputs": {Path(name).name: digest for name, digest in provenance.inputs.items()},
        "seed": provenance.seed,
        "processes": provenance.processes,
    }
    loader = PackageLoader("fem_seal.render", "")
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined)
    text = environment.get_template("report.html.jinja").render(
        title=printable(folder.resolve().name),
        made=f"Computed on {day} at {time[:5]} UTC by fem_seal {version}.",
        verdict=first_sentence(result),
        remarks=remarks(result),
        result=result,
        pictures=list(_pictures(folder, result)),
        summary=summary_of(result),
        scene=rows_of_mapping(provenance.scene, Scene),
        numbers=list(flat(numbers)),
        provenance=list(flat(origin)),
        factors=factor_words,
        combined=combined,
    )
    path = folder / "report.html"
    with atomic_write(path, durable=False) as staged:
        staged.write_text(text, encoding="utf-8")
    return path


def flat(parts: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Numbers and texts of nested results under names such as leak_rate.lower, without arrays.

    Numbers have more digits than any of them is correct to, too few to show rounding errors.
    """
    for name, value in leaves(parts):
        if isinstance(value, float):
            yield name, f"{value:.8g}"
        elif value not in (None, "") and not isinstance(value, list):
            yield name, value if isinstance(value, str) else json.dumps(value)


def _pictures(folder: Path, result: Result) -> Iterator[tuple[str, str]]:
    """Name and data of the pictures of the folder, and of the plot of the bounds."""
    # No links: they could point to any other file.
    images = {
        path.name: path.read_bytes()
        for path in folder.iterdir()
        if path.suffix in MEDIA and path.is_file() and not path.is_symlink() and path.name[0] != "."
    }
    if close_in(result.levels) and "bounds.png" not in images:
        with temporary_folder() as scratch:
            bounds_plot(result.levels, scratch / "bounds.png")
            images["bounds.png"] = (scratch / "bounds.png").read_bytes()
    places = {name: k for k, name in enumerate(ORDER)}
    for name in sorted(images, key=lambda name: (places.get(Path(name).stem, len(ORDER)), name)):
        stem, suffix = Path(name).stem, Path(name).suffix
        # Results of older versions have the dry contact, which is not the state of a lifted one.
        if result.state != "lifted off" or stem not in OF_A_CONTACT:
            data = base64.b64encode(images[name]).decode("ascii")
            yield stem, f"data:{MEDIA[suffix]};base64,{data}"
