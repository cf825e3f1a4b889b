"""A commented scene for a file of heights, with unit, size and other properties of the file."""

import json
import os
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fem_seal.digits import length_text, number_of, per_cent, rounded_down
from fem_seal.errors import InvalidInput, printable
from fem_seal.field_file.markers import suspected_mark, without_marked
from fem_seal.field_file.profiles import holds_profiles, read_profiles, says_step
from fem_seal.field_file.read import HEIGHT_NAMES, TEXT_ENDINGS, read_recorded
from fem_seal.field_file.recorded import FieldMap, Recorded, Stated, in_metres
from fem_seal.field_file.text_table import is_text
from fem_seal.scene import FileSurface, Scene
from fem_seal.surface import levelled_map, longest_wavelength, outliers
from fem_seal.surface.windows import WAVES

COMMENT_COLUMN = 32
MOST_FILLED = FileSurface.model_fields["max_missing"].default
LONGEST, MOST_LINES = 90, 20  # characters of a line, and lines, of the header that are quoted
FEW_SAMPLES = 512  # samples along a side of a map whose contact takes about a minute
EXAMPLE_STEP = 0.5e-6  # of samples of a profile whose file does not say it [m]
TEXT = (".txt", ".csv", *TEXT_ENDINGS)

OTHER_SECTIONS = """
[solid]
youngs_modulus = "10 MPa"       # yours: of the softer face; the other one is rigid
poisson_ratio = 0.5             # yours; or [E1, E2] and [ν1, ν2] of both

[contact]
pressure = "1 MPa"              # yours: load, carried by solid and fluid together

[fluid]
viscosity = "1 mPa s"           # yours: water

[flow]
pressure_drop = "1 bar"         # yours
# lift = "none"                 # the contact as if dry; docs/guide/lift.md
sides = "periodic"
rtol = 0.1                      # relative width of the bounds; not with [seal]

[output]
products = ["contact", "leak_rate", "pictures"]
# products = ["seal", "pictures"] # in its place, with [seal]
leak_rate_unit = "ml/h"

# For a verdict, take the first # out of the next two lines.
# [limit]
# leak_rate = "1 ml/h"          # yours

# For the whole seal, take the first # out of the lines below; docs/guide/ring.md explains them.
# surface.crop and flow.rtol must then be out, and the products be those of the second line above.
# [seal]
# leak_path = "0.5 mm"          # yours: width of the contact, from inlet to outlet
# circumference = "150 mm"      # yours
# pressure_profile = "hertz"    # or "uniform"; contact.pressure is the mean of either
## or line_load = "3 N/mm", cylinder_radius = "2 mm" in place of leak_path and contact.pressure
# patches = 8                   # {patches}
{window}# rtol = 0.5                    # relative width of the bounds for each patch: ±24 %
"""
WINDOWS = 3  # windows of a map in each direction, in the comment of [seal]
WINDOW_LINE = "# window ="
WINDOWS_OF_THE_MAP = "windows of the map, of which it holds nine"
TWINS = "the map and seven random twins with its spectrum"
SEEDS = "seeds of the random surface"


@dataclass(frozen=True)
class NewScene:
    """A new scene file, not written yet."""

    text: str  #: TOML, with comments
    facts: list[str]  #: properties of the file of heights, to be shown to the user
    needed: list[str]  #: fields that the user must still fill in


def new_scene(path: Path, folder: Path, stated: Stated) -> NewScene:
    """Scene that presses the heights of a file, a map or profiles, against a flat.

    The scene names the file relative to `folder`; `stated` is what the file does not contain.
    """
    if path.suffix.lower() == ".toml":
        raise InvalidInput(f"{path} is a scene already; name a file of heights")
    # TOML escapes what JSON does, and the control character DEL as well.
    name = json.dumps(os.path.relpath(path, folder), ensure_ascii=False).replace("\x7f", "\\u007f")
    of_profiles = path.suffix.lower() in TEXT and is_text(path) and holds_profiles(path)
    new = (_profiles if of_profiles else _map)(path, name, stated)
    if not new.needed:
        # Read the scene back: `fem-seal run` must not refuse it.
        Scene.from_mapping(tomllib.loads(new.text), folder=folder)
    return new


def _text(path: Path, surface: list[str], patches: str, window: str = "") -> str:
    """Text of a scene: lines of [surface], what the patches of a [seal] are, and their window."""
    lines = [
        f"# Scene of {printable(path.name)}, by fem-seal new; docs/reference/scene.md names every",
        '# field. Values marked "yours" are examples.',
        "",
        *surface,
    ]
    return "\n".join(lines) + "\n" + OTHER_SECTIONS.format(patches=patches, window=window)


def _map(path: Path, name: str, stated: Stated) -> NewScene:
    recorded = read_recorded(path, HEIGHT_NAMES)
    values = recorded.values
    mark = suspected_mark(values)
    if mark is not None:
        values = without_marked(values, mark[0])
    missing, (nx, ny) = int(np.count_nonzero(np.isnan(values))), values.shape
    if missing == values.size:
        raise InvalidInput(f"all {values.size} points of {path} are missing")
    facts = [f"{nx} x {ny} samples, {missing} missing ({per_cent(missing / values.size)})"]
    spikes = np.count_nonzero(outliers(FieldMap(values, (1, 1), recorded.periodic)))
    lines = [*_quoted_header(recorded), "[surface]", 'kind = "file"', f"path = {name}"]
    more, needed = _unit_and_size(recorded, stated)
    lines += more
    if mark is not None:
        lines.append(_line("missing", f"{mark[0]!r}", f"stands {mark[1]} times: no height"))
    if spikes:
        facts.append(f"{spikes} of them spikes")
    lines += _preparation(recorded, missing, spikes)
    if needed:
        return NewScene(_text(path, lines, TWINS), facts, needed)
    heights = in_metres(recorded, stated, path)
    (dx, dy), lengths = heights.spacing, heights.covered
    facts.append(f"{length_text(dx, 6)} by {length_text(dy, 6)} apart")
    if max(nx, ny) > FEW_SAMPLES:
        ends = ", ".join(f'["0 um", "{1e6 * length / 2:.6g} um"]' for length in lengths)
        lines.append(f"# crop = [{ends}]   # a part of the map; a large contact takes long")
    lines.append("# transpose = true              # the flow runs along x; this sends it along y")
    window = "" if recorded.periodic else _window(heights)
    patches = WINDOWS_OF_THE_MAP if window.startswith(WINDOW_LINE) else TWINS
    return NewScene(_text(path, lines, patches, window), facts, [])


def _preparation(recorded: Recorded, missing: int, spikes: int) -> Iterator[str]:
    """Lines of [surface] that prepare a map of which so many points are missing, or are spikes."""
    if spikes:
        comment = f"{number_of(spikes, 'point')} far from all neighbours; out if real"
        yield _line("outliers", '"missing"', comment)
    if recorded.periodic:
        yield _line("detrend", '"mean"', "the map repeats, says the file")
    else:
        yield _line("detrend", '"plane"', 'the tilt; "quadratic" takes a bow away as well')
    if missing + spikes:
        yield _line("fill", '"harmonic"', f"{number_of(missing + spikes, 'missing point')}")
    part = (missing + spikes) / recorded.values.size
    if part > MOST_FILLED:
        comment = f"more than the usual {MOST_FILLED:g}; would a crop do?"
        # Scenes take max_missing below 1 alone: not a part rounded up to 1, but half-way there.
        most = min(np.ceil(20 * part) / 20, (1 + part) / 2)
        yield _line("max_missing", f"{most:g}", comment)
    if not recorded.periodic:
        comment = "a measured map does not repeat; the contact needs a cell that does"
        yield _line("make_periodic", '"mirror"', comment)


def _window(heights: FieldMap) -> str:
    """Line of [seal] with the window, or on why there is none."""
    try:
        longest = longest_wavelength(levelled_map(heights))
    except InvalidInput as error:
        return f"## no window: {error}\n"
    if longest is None:
        return "## no window: the longest wavelength is longer than the map; they would lose it\n"
    part = [rounded_down(1e6 * length / WINDOWS, 3) for length in heights.covered]
    ratio = min(heights.covered) / WINDOWS / longest
    waves = f"{ratio:.2g} of the longest wavelengths, {length_text(longest, 3)}, wide"
    if ratio < WAVES:
        return f"## no window: a third of the map is {waves}; at least {WAVES:g} are needed\n"
    lengths = ", ".join(f'"{length} um"' for length in part)
    return _line(WINDOW_LINE.removesuffix(" ="), f"[{lengths}]", waves) + "\n"


def _unit_and_size(recorded: Recorded, stated: Stated) -> tuple[list[str], list[str]]:
    """Lines of [surface] with unit and size, and those of the two that are still to fill in."""
    lines, needed = [], []
    if recorded.unit is not None:
        lines.append(f"# unit: heights in {printable(recorded.unit)}, says the file")
    elif stated.unit is not None:
        lines.append(_line("unit", f'"{stated.unit}"', "of the heights"))
    else:
        needed.append("unit")
        lines.append(_line("# unit", '"um"', "needed: the file does not say it"))
    if recorded.spacing is not None:
        lines.append("# size: the file says the steps")
    elif stated.size is not None:
        lengths = ", ".join(f'"{1e6 * length:.9g} um"' for length in stated.size)
        lines.append(_line("size", f"[{lengths}]", "nx dx and ny dy"))
    else:
        needed.append("size")
        lines.append(_line("# size", '["1 mm", "1 mm"]', "needed: nx dx and ny dy"))
    return lines, needed


def _profiles(path: Path, name: str, stated: Stated) -> NewScene:
    if stated.size is not None:
        raise InvalidInput(
            f"--size is of a map, and {path} holds profiles; surface.size is that of a random "
            "surface with their spectrum"
        )
    needed = [] if says_step(path) else ["step"]
    profiles = read_profiles([path], unit=stated.unit, step=EXAMPLE_STEP if needed else None)
    (count, samples), length = profiles.heights.shape, profiles.heights.shape[1] * profiles.step
    side = 256 * profiles.step
    unit = [_line("unit", f'"{stated.unit}"', "of heights and x")] if stated.unit else []
    lines = [
        "[surface]",
        'kind = "profiles"',
        f"path = {name}",
        *unit,
        *(
            _line("# step", f'"{1e6 * EXAMPLE_STEP:g} um"', "needed: the file does not say it")
            for _ in needed
        ),
        _line("detrend", '"line"', 'the tilt; or "mean", "quadratic"'),
        _line("shape", "[256, 256]", "of a random surface with the spectrum of the profiles"),
        _line("size", f'["{1e6 * side:.6g} um", "{1e6 * side:.6g} um"]', "yours: of its cell"),
        "seed = 1",
    ]
    fact = f"{number_of(count, 'profile')} of {samples} samples"
    if not needed:
        fact += f", {length_text(profiles.step, 6)} apart, {length_text(length)} long"
    return NewScene(_text(path, lines, SEEDS), [fact], needed)


def _line(key: str, value: str, comment: str) -> str:
    return f"{key} = {value}".ljust(COMMENT_COLUMN) + f"# {comment}"


def _quoted_header(recorded: Recorded) -> list[str]:
    """Header of a text file as comments of the scene."""
    lines = [line.strip() for line in recorded.header if line.strip()]
    quoted = [f"#   {printable(line)[:LONGEST]}" for line in lines[:MOST_LINES]]
    return ["# The header of the file:", *quoted, ""] if quoted else []
