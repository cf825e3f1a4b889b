"""One self-contained HTML page of a result folder: the verdict, the pictures, all the numbers."""

import base64
import html
import json
from collections.abc import Iterable, Iterator
from pathlib import Path

from fem_seal.digits import per_cent, rounded_down, rounded_up
from fem_seal.errors import printable
from fem_seal.files import atomic_write, temporary_folder
from fem_seal.leak_rate import relative_half_width
from fem_seal.quantities.error_budget import (
    IN_BOUNDS,
    ONE_PATCH,
    Uncertainty,
    combined,
    factor_words,
)
from fem_seal.render.report_page import PAGE
from fem_seal.render.report_words import CAPTIONS, OF_A_PATCH, caption, described
from fem_seal.results import Result
from fem_seal.results.rates import unit_words
from fem_seal.results.words import summary_of
from fem_seal.scene import Scene
from fem_seal.scene.readable import rows_of_mapping
from fem_seal.tables import html_table

PICTURES = {".png": "image/png", ".svg": "image/svg+xml"}


def report(folder: str | Path) -> Path:
    """Write report.html of a result folder, with the pictures embedded.

    Parameters
    ----------
    folder : result folder of `fem_seal.run`; the report shows all pictures (.png, .svg) in it

    Returns
    -------
    Path of report.html in that folder.
    """
    folder = Path(folder)
    result = Result.from_folder(folder)
    numbers = result.model_dump(mode="json", by_alias=True)
    levels, provenance = numbers.pop("levels"), numbers.pop("provenance")
    # These are fluxes of the pressure before its correction: above the upper bound they would
    # seem to contradict it (docs/reference/results.md).
    numbers = {name: value for name, value in numbers.items() if name not in ("inflow", "outflow")}
    scene = provenance.pop("scene")
    provenance["inputs"] = {
        Path(name).name: digest for name, digest in provenance["inputs"].items()
    }
    text = PAGE.substitute(
        title=html.escape(printable(folder.resolve().name)),
        described=html.escape(described(scene)),
        made=html.escape(_made(result)),
        verdict=html.escape(first_sentence(result)),
        remarks=_items(map(html.escape, remarks(result))),
        summary=html_table(summary_of(result)),
        pictures="\n".join(_figures(folder, result)) or _no_pictures(result),
        scene=html_table(rows_of_mapping(scene, Scene)),
        counted=_counted(result),
        open=_not_covered(result),
        levels=_levels(levels, result),
        numbers=html_table(flat(numbers)),
        provenance=html_table(flat(provenance)),
    )
    path = folder / "report.html"
    with atomic_write(path, durable=False) as staged:
        staged.write_text(text, encoding="utf-8")
    return path


def _made(result: Result) -> str:
    """Sentence on when the result was computed, and by which version."""
    day, _, time = result.provenance.date.partition("T")
    version = result.provenance.versions.get("fem_seal", "of an unknown version")
    return f"Computed on {day} at {time[:5]} UTC by fem_seal {version}."


def first_sentence(result: Result) -> str:
    """First sentence: the decision or, without a limit, the state; the headline; the comparison."""
    judged, head = result.verdict, result.together
    if head is None:
        text = f"{100 * result.contact_area_fraction:.3g} % of the nominal area is in contact"
        if result.state == "lifted off":
            text = "lifted off, the fluid carries the whole load"
    else:
        decision = judged.decision if judged else result.state
        parts = (f"{decision}: {head}", judged.comparison if judged else "")
        text = "; ".join(filter(None, parts))
    return f"{text[0].upper()}{text[1:]}."


def remarks(result: Result) -> list[str]:
    """Sentences below the verdict: why a sealed gap is sealed, and cautions."""
    budget, first = result.error_budget or (), first_sentence(result)
    sentences = []
    if not result.converged:
        sentences.append(f"What was asked for was not reached: {result.reason}")
    if result.state == "sealed":
        sentences.append(
            "Zero is the leak rate as computed; errors that are not covered may open a path"
        )
        own = [e.sentence for e in budget if e.counted and e.key not in IN_BOUNDS]
        sentences.extend(sentence for sentence in own if sentence not in result.cautions)
    sentences.extend(caution for caution in result.cautions if caution not in first)
    return [f"{text[0].upper()}{text[1:]}." for text in dict.fromkeys(sentences)]


def flat(value: object, name: str = "") -> Iterator[tuple[str, str]]:
    """List every number of nested results with its path, "leak_rate.lower", except nulls.

    Parameters
    ----------
    value : nested dicts and lists of JSON
    name : path of the value so far

    Yields
    ------
    (str, str)
        Path and number.
    """
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from flat(inner, f"{name}.{key}" if name else str(key))
    elif isinstance(value, list) and any(isinstance(inner, dict | list) for inner in value):
        for k, inner in enumerate(value):
            yield from flat(inner, f"{name}[{k}]")
    elif value is not None and value != "":
        yield name, _shown(value)


def _shown(value: object) -> str:
    if isinstance(value, float):
        # More digits than any of these numbers has correct, too few to show rounding errors.
        return f"{value:.8g}"
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)


def _levels(levels: list[dict], result: Result) -> str:
    """Table of the meshes, bounds rounded outwards; empty for a whole seal or a sealed film."""
    if not levels:
        return ""
    head = ("mesh", "unknowns", "at least", "at most", "half-width", "time [s]")
    rows = [_cells("th", head)]
    for k, level in enumerate(levels, 1):
        lower, upper = level["lower"], level["upper"]
        half_width = per_cent(relative_half_width(lower, upper))
        seconds = f"{sum(level['seconds'].values()):.2g}"
        bounds = rounded_down(lower), rounded_up(upper)
        texts = (str(k), str(level["unknowns"]), *bounds, half_width, seconds)
        rows.append(_cells("td", texts))
    table = '<div class="wide"><table class="levels">\n' + "\n".join(rows) + "\n</table></div>"
    title = f"How the bounds closed, mesh by mesh, in {unit_words('m^3/s', result.gas)}"
    return f"<details>\n<summary>{title}</summary>\n{table}\n</details>"


# For a result without a leak rate, or of a version that wrote no error budget.
NO_BUDGET = "<p>This result holds no error budget.</p>"


def _counted(result: Result) -> str:
    """Table of the entries of the error budget that have numbers."""
    if result.error_budget is None:
        return NO_BUDGET
    if result.state in ("sealed", "lifted off"):
        return _list_of((*(e for e in result.error_budget if e.counted), *_what_opens(result)))
    counted = [entry for entry in result.error_budget if entry.counted]
    if not counted:
        return "<p>This result has no numbers about its errors.</p>"
    rows = [_cells("th", ("", "", "times the value", ""))]
    for entry in counted:
        factors = factor_words(entry.lower, entry.upper)
        rows.append(_cells("td", (entry.name, entry.kind, factors, entry.sentence)))
    total = factor_words(*combined(counted))
    rows.append(_cells("td", ("together", "", total, "the products of the factors")))
    return '<div class="wide"><table>\n' + "\n".join(rows) + "\n</table></div>"


def _what_opens(result: Result) -> Iterator[Uncertainty]:
    """Conditions under which a sealed patch may leak; none for a whole seal."""
    one_patch = any(entry.key == ONE_PATCH for entry in result.error_budget or ())
    if result.state != "sealed" or not one_patch:
        return
    sentence = (
        "less load or more fluid pressure may open a path, and another piece of the face may have "
        "one"
    )
    if result.quantities is None or result.quantities.threshold is None:
        sentence += "; the product threshold computes the load at which this patch begins to leak"
    yield Uncertainty("what_would_open_it", "not covered", sentence)


def _not_covered(result: Result) -> str:
    """List of the entries of the error budget without a number on some side."""
    if result.error_budget is None:
        return NO_BUDGET
    entries = [e for e in result.error_budget if e.lower is None or e.upper is None]
    if not entries:
        return "<p>Nothing that the program knows of.</p>"
    return _list_of(entries)


def _list_of(entries: Iterable[Uncertainty]) -> str:
    return _items(f"<b>{html.escape(e.name)}</b>: {html.escape(e.sentence)}" for e in entries)


def _items(texts: Iterable[str]) -> str:
    """List of texts with their markup; empty without any."""
    lines = "\n".join(f"<li>{text}</li>" for text in texts)
    return f"<ul>\n{lines}\n</ul>" if lines else ""


def _cells(tag: str, texts: Iterable[str]) -> str:
    return "<tr>" + "".join(f"<{tag}>{html.escape(text)}</{tag}>" for text in texts) + "</tr>"


def _figures(folder: Path, result: Result) -> Iterator[str]:
    """The pictures of the folder and the plot of the bounds; those with captions come first."""
    images = {
        path.name: path.read_bytes()
        for path in folder.iterdir()
        if path.suffix in PICTURES and _is_picture(path)
    }
    from fem_seal.render.bounds import close_in

    if close_in(result.levels):
        images.setdefault("bounds.png", _bounds(result))
    if result.state == "lifted off":
        # Results of older versions have the dry contact, which is not the state.
        images = {
            name: image for name, image in images.items() if Path(name).stem not in OF_A_PATCH
        }
    # The picture of a seal comes before those of its first patch.
    names = sorted(CAPTIONS, key=lambda name: name != "seal")
    order = {name: k for k, name in enumerate(names)}
    for name in sorted(images, key=lambda name: (order.get(Path(name).stem, len(order)), name)):
        words = caption(Path(name).stem, result)
        yield _figure(Path(name).suffix, images[name], words)


def _no_pictures(result: Result) -> str:
    if result.state == "lifted off":
        return "<p>None: what is lifted off has neither contact nor gap to draw.</p>"
    return "<p>None. fem-seal render draws them.</p>"


def _is_picture(path: Path) -> bool:
    """Whether a path is a file of the folder itself; a link could point to any other file."""
    return path.is_file() and not path.is_symlink() and not path.name.startswith(".")


def _bounds(result: Result) -> bytes:
    from fem_seal.render.bounds import bounds_plot

    levels = result.levels
    with temporary_folder() as scratch:
        return bounds_plot(levels, scratch / "bounds.png").read_bytes()


def _figure(suffix: str, picture: bytes, words: str) -> str:
    data = base64.b64encode(picture).decode("ascii")
    text = html.escape(words)
    source = f"data:{PICTURES[suffix]};base64,{data}"
    return f'<figure><img src="{source}" alt="{text}"><figcaption>{text}</figcaption></figure>'
