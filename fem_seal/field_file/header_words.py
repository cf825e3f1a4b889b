"""Words of the headers of text files, in lower case, by what a key or a title with them is about.

German and French words are those of instruments sold with German or French software.
"""

STEPS = {"step", "spacing", "increment", "pitch", "cellsize", "sampling", "calibration", "dx", "dy"}
STEPS |= {"interval", "delta", "schritt", "schrittweite", "punktabstand"}
STEPS |= {"abstand", "pixelabstand", "pixelgröße", "justierung", "pas"}
STEP_PAIRS = [{"pixel", "size"}, {"pixel", "width"}, {"pixel", "height"}, {"point", "distance"}]
STEP_PAIRS += [{"lateral", "resolution"}, {"cell", "size"}, {"x", "resolution"}]
STEP_PAIRS += [{"y", "resolution"}, {"distance", "points"}, {"distance", "lines"}]
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
WITH_AXIS = [{"amplitude"}, {"calibration"}, {"justierung"}]
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
OF_THE_MAP = BESIDE | STEPS | LENGTHS | COUNTS | AXES | ALONG_LINE | ACROSS_LINES | LATERAL
# Words of a key that says the unit of heights and lengths; another is that of something else.
OF_UNITS = UNITS | VALUES | LATERAL | AXES | BESIDE | {"length", "lengths", "dimension", "höhe"}
OF_UNITS |= {"surface", "topography", "profile"}
