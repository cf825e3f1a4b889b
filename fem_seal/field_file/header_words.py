"""Words of the headers of text files, in lower case, by what a key or a title with them is about.

German and French words are those of instruments sold with German or French software.
"""

import re
from typing import Literal

# The words of "pixel size", "PixelSize", "XYScale" and "xstep".
_WORD = re.compile(
    r"\b[xyzXYZ](?=(?i:step|scale|factor|resolution|size|length|range|unit|spacing))"
    r"|[A-ZÄÖÜ]?[a-zäöüßé]+|[A-ZÄÖÜÉ]+(?![a-zäöüßé])"
)

OF_STEPS = {"step", "spacing", "increment", "pitch", "cellsize", "sampling", "calibration"}
OF_STEPS |= {"dx", "dy", "interval", "delta", "schritt", "schrittweite", "punktabstand"}
OF_STEPS |= {"abstand", "pixelabstand", "pixelgröße", "justierung", "pas"}
STEPS = [{word} for word in OF_STEPS]
STEPS += [{"pixel", "size"}, {"pixel", "width"}, {"pixel", "height"}, {"point", "distance"}]
STEPS += [{"lateral", "resolution"}, {"cell", "size"}, {"x", "resolution"}]
STEPS += [{"y", "resolution"}, {"distance", "points"}, {"distance", "lines"}]
LENGTHS = {"width", "height", "length", "range", "size", "extent", "breite", "höhe", "länge"}
LENGTHS |= {"bildgröße", "fov", "view", "amplitude"}
COUNTS = {"pixels", "points", "samples", "columns", "rows", "lines", "cols", "ncols", "nrows"}
COUNTS |= {"spalten", "zeilen", "punkte"}
AXES = {"axis", "achse", "axe"}
# These are numbers of points only if they are the whole key, as in files of Keyence.
DIRECTIONS = {"horizontal", "vertical", "horizont", "vertikal"}
UNITS = {"unit", "units", "einheit", "unité"}
ALONG_LINE = {"x", "dx", "width", "breite", "horizontal", "columns", "cols", "ncols"}
ALONG_LINE |= {"spalten", "horizont"}
ACROSS_LINES = {"y", "dy", "height", "höhe", "vertical", "rows", "nrows", "lines"}
ACROSS_LINES |= {"zeilen", "vertikal"}
LATERAL = {"xy", "lateral", "horizontal", "x", "y"}
VALUES = {"z", "value", "values", "height", "heights", "data", "gap", "wert"}
# Lengths of anything but a side of the map.
NO_LENGTHS = {"z", "wave", "wavelength", "focal", "cut", "file", "tip"}
# Words that stand beside those of a step or a length of the map. With any other word a key is about
# something else: "camera pixel size", "mean spacing RSm", "thread pitch", "kernel size".
BESIDE = {"scan", "image", "map", "lateral", "pixel", "point", "cell", "field", "grid", "data"}
BESIDE |= {"sample", "measured", "measurement", "measuring", "physical", "real", "distance"}
BESIDE |= {"line", "resolution", "of", "in", "and", "between", "the", "m", "um", "nm", "mm"}
BESIDE |= {"bild", "der", "richtung", "en", "entre", "de"}
# Lengths that are none of a side, and steps that are none of the map, although all words are known.
OTHERS = [{"sampling", "length"}, {"scan", "length"}, {"scan", "height"}, {"measurement", "length"}]
OTHERS += [{"measuring", "length"}, {"sample", "size"}, {"sample", "length"}, {"sample", "width"}]
OTHERS += [{"sample", "height"}, {"step", "height"}, {"height", "range"}, {"calibration", "step"}]
OTHERS += [{"calibration", "height"}, {"grid", "pitch"}, {"vertical"}, {"vertikal"}]
# These need the name of an axis: "X amplitude", "XY calibration".
WITH_AXIS = {"amplitude", "calibration", "justierung"}
SCALES = {"scale", "scaling", "skala", "skalierung", "multiplier", "multiplikator"}
SCALES |= {"höhenfaktor", "überhöhung"}
FACTORS = {"factor", "faktor"}
NO_FACTOR = {"x", "y", "xy", "lateral", "color", "colour", "bar"}
PRESSURES = {"p", "pressure", "cpress", "druck", "kontaktdruck", "pression"}
# Keys of the number that marks missing points; with another word, as in "missing points: 3", or
# alone, the number may be that of the points.
MARKS = [{"nodata"}, {"no", "data"}, {"missing"}, {"bad"}, {"invalid"}, {"undefined"}]
OF_MARKS = VALUES - {"data"} | {"mark", "marker", "code", "pixel", "point"}
# Words of the title of a column: x, y, heights and pressures.
TITLES = {"x": {"x", "dx"}, "y": {"y", "dy"}, "z": VALUES | {"höhe"}, "p": PRESSURES}
OF_THE_MAP = BESIDE | OF_STEPS | LENGTHS | COUNTS | AXES | ALONG_LINE | ACROSS_LINES | LATERAL
# Words of a key that says the unit of heights and lengths; another is that of something else.
OF_UNITS = UNITS | VALUES | LATERAL | AXES | BESIDE | {"length", "lengths", "dimension", "höhe"}
OF_UNITS |= {"surface", "topography", "profile"}


def words_of(text: str) -> set[str]:
    """Words of a text in lower case."""
    return {word.lower() for word in _WORD.findall(text)}


def axes_of(words: set[str]) -> str:
    """Axes that a key names: "x", "y", both as "xy", or none as ""."""
    if words >= {"distance", "points"}:
        return "x"
    # "Field width X" and "pixel height Y" are about one axis each.
    along, across = words & {"x", "dx"}, words & {"y", "dy"}
    if not along and not across:
        along, across = words & ALONG_LINE, words & ACROSS_LINES
    return "x" * bool(along) + "y" * bool(across)


def about(words: set[str]) -> Literal["step", "length", "count", "mark", ""]:
    """What the number of a key is: of the map a step, or the length or points of a side.

    Or the number that marks missing points; "" if it is anything else.
    """
    if marks := [mark for mark in MARKS if mark <= words]:
        of_value = words & OF_MARKS or words <= {"nodata", "no", "data"}
        named = any(words <= {"data", *mark, *OF_MARKS} for mark in marks)
        return "mark" if of_value and named else ""
    if any(step <= words for step in STEPS):
        # A key such as "Z step" is about the heights.
        return "step" if "z" not in words and _of_the_map(words) else ""
    if words & COUNTS or words <= DIRECTIONS:
        return "count" if len(axes_of(words)) == 1 else ""
    of_a_side = words & LENGTHS and not words & NO_LENGTHS
    return "length" if of_a_side and _of_the_map(words) else ""


def about_lengths(line: str) -> bool:
    """Whether a line may be about steps or lengths, and not those of the heights."""
    words = words_of(line)
    lengths = words & (LENGTHS | AXES | SCALES) or any(step <= words for step in STEPS)
    # Numbers alone before the others may be counts and lengths.
    return bool(lengths if words else re.search(r"\d", line)) and not words & NO_LENGTHS


def _of_the_map(words: set[str]) -> bool:
    """Whether a key that names a step or a length is about the map."""
    with_axis = bool(words & LATERAL) or not words & WITH_AXIS
    others = any(other <= words for other in OTHERS)
    return with_axis and not others and words <= OF_THE_MAP
