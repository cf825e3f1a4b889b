"""One self-contained HTML page of a result folder: the verdict, the pictures, all the numbers."""

import base64
import html
import json
from collections.abc import Iterator, Mapping
from pathlib import Path

from fem_seal.errors import InvalidInput
from fem_seal.quantities.constriction import Constriction
from fem_seal.quantities.threshold import Threshold
from fem_seal.render.aside import written_aside
from fem_seal.render.report_page import PAGE
from fem_seal.results.words import constriction_words, threshold_words

CAPTIONS = {
    "contact": "Contact and open domains; the largest connected one of each is coloured.",
    "gap": "Gap; contact is grey.",
    "shape": "Mesh of the film before refinement, with its inlet, outlet and walls.",
    "flow": "Flow density on a logarithmic scale; weaker flow takes the colour of the lower end.",
    "pressure": "Pressure in the part of the gap that carries flow.",
    "mesh": "Mesh of the last solve, and its surroundings of strongest flow.",
    "bounds": "Bounds of the leak rate and half-width of the bracket against unknowns.",
}
PICTURES = {".png": "image/png", ".gif": "image/gif", ".svg": "image/svg+xml"}


def report(folder: str | Path) -> Path:
    """Gather a result folder in report.html, pictures embedded.

    Parameters
    ----------
    folder : holds result.json and any pictures (.png, .gif, .svg)

    Returns
    -------
    Path of report.html in that folder.

    Raises
    ------
    InvalidInput
        If result.json is missing, is not JSON or does not hold a leak rate or a contact; or if
        the folder cannot be written to.
    """
    folder = Path(folder)
    result = _read_result(folder / "result.json")
    text = PAGE.substitute(
        title=html.escape(folder.resolve().name),
        verdict=html.escape(verdict(result)),
        pictures="\n".join(_figure(path) for path in _pictures(folder)),
        rows="\n".join(_row(name, value) for name, value in flat(result)),
    )
    path = folder / "report.html"
    with written_aside(path) as aside:
        aside.write_text(text, encoding="utf-8")
    return path


def verdict(result: Mapping) -> str:
    """Say in words what the numbers of a result mean.

    Parameters
    ----------
    result : contents of result.json; "state" and "leak_rate" where there was a flow, and
        "contact_area_fraction" where there was a contact
    """
    sentences = []
    leak = result.get("leak_rate")
    if result.get("state") == "sealed":
        sentences.append("Sealed: no open path joins inlet and outlet, the leak rate is zero.")
    elif leak and leak.get("lower") is not None:
        lower, upper, unit = leak["lower"], leak["upper"], leak["unit"]
        half = 100 * (upper - lower) / (upper + lower) if upper > 0 else 0.0
        sentences.append(
            f"Leaking: the leak rate is {leak['value']:.4g} {unit}, surely between {lower:.4g} and "
            f"{upper:.4g} {unit} (±{half:.2g} %)."
        )
    elif leak:
        sentences.append(
            f"Leaking: the leak rate is {leak['value']:.4g} {leak['unit']}, no bounds."
        )
    shown = result.get("leak_rate_shown")
    if shown and shown.get("lower") is not None:
        sentences.append(
            f"In {shown['unit']}: {shown['value']:.4g}, between {shown['lower']:.4g} and "
            f"{shown['upper']:.4g}."
        )
    decided = result.get("verdict") or {}
    if decided.get("limit"):
        sentences.append(f"Verdict: {decided['sentence']}.")
    found = result.get("quantities") or {}
    if found.get("constriction"):
        words = constriction_words(Constriction(**found["constriction"]))
        sentences.append(f"Tightest place: {words}.")
    if found.get("threshold"):
        sentences.append(f"Threshold: {threshold_words(Threshold(**found['threshold']))}.")
    if result.get("contact_area_fraction") is not None:
        share = 100 * result["contact_area_fraction"]
        sentences.append(f"{share:.3g} % of the nominal area is in contact.")
    if result.get("converged") is False:
        sentences.append("The tolerance asked for was not reached.")
    return " ".join(sentences)


def flat(value: object, name: str = "") -> Iterator[tuple[str, object]]:
    """Name every number of nested results by its path, "leak_rate.lower".

    Parameters
    ----------
    value : nested dicts and lists of JSON; name : path so far
    """
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from flat(inner, f"{name}.{key}" if name else str(key))
    elif isinstance(value, list) and any(isinstance(inner, dict | list) for inner in value):
        for k, inner in enumerate(value):
            yield from flat(inner, f"{name}[{k}]")
    else:
        yield name, value


def _read_result(path: Path) -> dict:
    if not path.is_file():
        raise InvalidInput(f"{path.parent} holds no result.json: a report needs a result folder")
    try:
        result = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:  # not UTF-8 or not JSON
        raise InvalidInput(f"{path} is not readable JSON: {error}") from error
    if not isinstance(result, dict) or not {"leak_rate", "contact_area_fraction"} & set(result):
        raise InvalidInput(f"{path} holds neither leak_rate nor contact_area_fraction")
    leak = result.get("leak_rate")
    if leak is not None and not (isinstance(leak, dict) and {"value", "unit"} <= set(leak)):
        raise InvalidInput(f"{path}: leak_rate needs value and unit, got {leak!r}")
    return result


def _pictures(folder: Path) -> list[Path]:
    """Pictures of the folder, those with captions first and in their order."""
    order = {name: k for k, name in enumerate(CAPTIONS)}
    found = [
        path
        for path in folder.iterdir()
        if path.suffix in PICTURES and path.is_file() and not path.name.startswith(".")
    ]
    return sorted(found, key=lambda path: (order.get(path.stem, len(order)), path.name))


def _figure(path: Path) -> str:
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    caption = html.escape(CAPTIONS.get(path.stem, path.stem))
    source = f"data:{PICTURES[path.suffix]};base64,{data}"
    return (
        f'<figure><img src="{source}" alt="{caption}"><figcaption>{caption}</figcaption></figure>'
    )


def _row(name: str, value: object) -> str:
    # Eight digits: more than any of these numbers is sure of, fewer than float noise shows.
    shown = f"{value:.8g}" if isinstance(value, float) else json.dumps(value, ensure_ascii=False)
    shown = value if isinstance(value, str) else shown
    return f"<tr><th>{html.escape(name)}</th><td>{html.escape(shown)}</td></tr>"
