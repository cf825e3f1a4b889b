"""Text files as instruments write them: the same map from all, whatever they look like."""

import re

import numpy as np
import pytest

from fem_seal.cli import main
from fem_seal.errors import InvalidInput
from fem_seal.field_file import HEIGHT_NAMES, Stated, read_map

# Heights [um] with three decimals, a missing point and an oblong grid of 0.5 by 0.25 um.
HEIGHTS = np.round(np.random.default_rng(3).normal(size=(6, 4)), 3)
HEIGHTS[2, 1] = np.nan
DX, DY = 0.5, 0.25
SAID = Stated(unit="um", size=(6 * DX * 1e-6, 4 * DY * 1e-6))


def matrix(separator=" ", decimal=".", missing="NaN", values=HEIGHTS, end=""):
    def cell(number):
        return missing if np.isnan(number) else f"{number:.3f}".replace(".", decimal)

    return "".join(separator.join(map(cell, row)) + end + "\n" for row in values)


def indented(text, blanks):
    return "".join(blanks + line for line in text.splitlines(keepends=True))


def points(separator=" ", decimal=".", missing="NaN", order=(0, 1, 2), unit=1):
    """List of x, y and height; coordinates in µm over a unit."""
    lines = (
        [f"{DX * unit * i:.6f}", f"{DY * unit * j:.6f}", missing if np.isnan(z) else f"{z:.3f}"]
        for (i, j), z in np.ndenumerate(HEIGHTS)
    )
    text = "".join(separator.join(line[k] for k in order) + "\n" for line in lines)
    return text.replace(".", decimal)


def around(corner="", head="", falling=False, missing=""):
    """Matrix in mm between its coordinates, with decimal commas."""
    rows = [[f"{DX * i / 1000:.6f}" for i in range(6)]]
    rows += [[f"{z / 1000:.6f}" for z in column] for column in HEIGHTS.T]
    first = [corner, *(f"{DY * j / 1000:.6f}" for j in range(4))]
    lines = ["\t".join([start, *row]) for start, row in zip(first, rows, strict=True)]
    lines = [lines[0], *(lines[:0:-1] if falling else lines[1:])]
    return head + "\n".join(lines).replace(".", ",").replace("nan", missing) + "\n"


SDF = (
    "aBCR-1.0\nManufacID = ABC\nNumPoints = 6\nNumProfiles = 4\nXscale = 5.0E-07\n"
    "Yscale = 2.5E-07\nZscale = 1E-09\nZresolution = -1\nCheckType = 0\n*\n"
)
# Text, and the statements that it needs besides.
UNIT = Stated(unit="um")
FILES = {
    "tabs": (matrix("\t"), SAID),
    "tabs and nothing for a missing point": (matrix("\t", missing=""), SAID),
    "tabs before all lines": (indented(matrix("\t", missing=""), "\t\t"), SAID),
    "a list with blank and tab before": (indented(points("\t"), "  \t"), UNIT),
    "a list in mm without a unit": (points(unit=1e-3), SAID),
    "commas": (matrix(",", missing=""), SAID),
    "commas at the end of lines": (matrix(",", missing="BAD", end=","), SAID),
    "decimal commas": (matrix(";", ","), SAID),
    "decimal commas and tabs": (matrix("\t", ",", missing="***"), SAID),
    "decimal commas and blanks": (matrix("  ", ",", missing="--"), SAID),
    "quotes": (re.sub(r"([^,\n]+)", r'"\1"', matrix(",")), SAID),
    "words for missing points": (matrix(" ", missing="No Data"), SAID),
    "Windows": (matrix(missing="-nan(ind)").replace("\n", "\r\n"), SAID),
    "exponents": (
        "".join(" ".join(f"{z * 1e4:.4e}" for z in row) + "\n" for row in HEIGHTS),
        Stated(unit="angstrom", size=SAID.size),
    ),
    "a number for missing points": (
        matrix(missing="-9999"),
        Stated(unit="um", size=SAID.size, missing=-9999),
    ),
    "the same in the header": (f"NODATA_value -9999\n{matrix(missing='-9999')}", SAID),
    "points": (points(), UNIT),
    # Factors of other things.
    **{
        factor: (f"{factor}\n{matrix()}", SAID)
        for factor in ("Multiplier: 1", "Color scale: 256", "Q factor = 300", "X scale: 3")
    },
}
# Files that say unit and lengths themselves.
WHOLE = {
    "Gwyddion": (
        "# Channel: Topo\n# Width: 3.0 µm\n# Height: 1.0 µm\n# Value units: um\n"
        + matrix("\t", values=HEIGHTS.T)
    ),
    "steps and unit": (
        "Instrument;X-200\nDate;12.03.2024 10:15\nSchrittweite X [µm];0,5\n"
        "Schrittweite Y [µm];2.500e-1\nEinheit Z;µm\n\n"
        + matrix(";", ",", missing="", values=HEIGHTS.T)
    ),
    "counts that say which way x runs": (
        "x-pixels = 6\ny-pixels = 4\nx-length = 3000\ny-length = 1000\nx-unit = nm\nz-unit = um\n"
        + matrix(values=HEIGHTS.T)
    ),
    "counts that say that lines are columns": (
        "x-pixels = 6\ny-pixels = 4\nx-length = 3000\ny-length = 1000\nx-unit = nm\nz-unit = um\n"
        + matrix()
    ),
    "numbers of points with a word": (
        "Width: 6 points\nHeight: 4 points\nStep X / Y [um]: 0.5 / 0.25\nheights in um\n"
        + matrix(values=HEIGHTS.T)
    ),
    "a spreadsheet's header": (
        "Width,3 µm,,\nHeight,1 µm,,\nZ unit,um,,\n,,,\n"
        + matrix(",", missing="", values=HEIGHTS.T)
    ),
    "two steps in a cell": (
        "Instrument\tX-200\nStep X / Y [um]\t0.5 / 0.25\nUnit Z\tum\n"
        + matrix("\t", values=HEIGHTS.T)
    ),
    "two steps in a cell, their unit in the next": (
        "Step X/Y;0,5/0,25;µm\nZ;µm\n" + matrix(";", ",", values=HEIGHTS.T)
    ),
    "two steps, a comma between the axes": (
        "Spacing (X, Y): 0.5 µm, 0.25 µm\nHeights in µm\n" + matrix(values=HEIGHTS.T)
    ),
    "decimal commas behind blanks": (
        "x-pitch 0,5 µm\ny-pitch 0,25 µm\nheights in µm\n" + matrix(";", ",", values=HEIGHTS.T)
    ),
    "distances in words": (
        "Distance between points : 0.5 [um]\nDistance between lines : 0.25 [um]\nZ unit: um\n"
        + matrix(values=HEIGHTS.T)
    ),
    "field of view": ("Field of view [µm];3 x 1\nZ [µm]\n" + matrix(";", values=HEIGHTS.T)),
    "units for a pixel": (
        "X resolution: 0.5 um/pixel\nY resolution: 0.25 um/pixel\nheights in um\n"
        + matrix(values=HEIGHTS.T)
    ),
    "German words, and a unit of its own for the heights": (
        "Einheit: mm\nHöhenwerte in µm\nBildgröße: 3 µm x 1 µm\n" + matrix(values=HEIGHTS.T)
    ),
    "units of other things than heights": (
        "coordinates in units of mm\nZ resolution unit: nm\n"
        + f"x [um]; y [um]; z [um]\n{points(';', ',', '')}"
    ),
    "all in one line": ("# heights in um; pixel size 0.5 x 0.25 um\n" + matrix(values=HEIGHTS.T)),
    "points with titles": (f"x [um]; y [um]; z [um]\n{points(';', ',', '')}"),
    "titles of steps": ("dx dy z\num um um\n" + points()),
    "titles in another order": ("y,x,z\nmm,mm,um\n" + points(",", order=(1, 0, 2), unit=1e-3)),
    "a number for each point, and its brightness": (
        "Nr;X (um);Y (um);Höhe (um);I\n"
        + "".join(f"1;{line};9\n" for line in points(";").splitlines())
    ),
    "units in a line of their own": (
        "# z y x\n# units: um mm mm\n" + points(order=(2, 1, 0), unit=1e-3)
    ),
    "units behind slashes": ("x/mm, y/mm, Height/µm\n" + points(",", unit=1e-3)),
    "units behind underscores": ("x_mm\ty_mm\tz_um\n" + points("\t", unit=1e-3)),
    "savetxt": ("# x [mm], y [mm], z [um]\n" + points(" ", unit=1e-3)),
    "coordinates around a matrix": ("Einheit: mm\n" + around()),
    "a title between coordinates": (around("y\\x [mm]", "Z [mm]\n")),
    "coordinates that fall": (around("0", "Unit: mm\n", falling=True)),
    "coordinates without a corner": (
        "# Unit: mm\n" + around(missing="NaN").replace("\t", " ").replace(",", ".").lstrip()
    ),
    "SDF": (
        SDF
        + matrix(missing="BAD", values=1e3 * HEIGHTS.T).replace(" ", "\n")
        + "*\n<comment>12 34</comment>\n*\n"
    ),
    "points in other units": (
        "x [mm]\ty [mm]\tHeight [µm]\n"
        + "".join(
            f"{DX * i / 1000:.6f}\t{DY * j / 1000:.6f}\t{z:.3f}\n"
            for (i, j), z in np.ndenumerate(HEIGHTS)
            if not np.isnan(z)  # a point that is left out is missing
        )
    ),
}


ZYGO = "\n".join(
    [
        "Zygo XYZ Data File - Format 1",
        '0 0 0 0 "Mon Jan  1"',
        "0 0 0 0 0 0",
        "0 0 6 4",
        *['"  "'] * 3,
        "0 0.5 6.328e-07 0 1 0 5e-07 1700000000",
        '6 4 0 0 0 0 "  "',
        "#\n",
    ]
)
WYKO = (
    "Wyko ASCII Data File Format 0\t1\t1\nX Size\t6\nY Size\t4\nBlock Name\tType\tLength\tValue\n"
    "Wavelength\t7\t4\t0.640\nAspect\t7\t4\t1.0\nPixel_size\t7\t4\t0.0005\nRAW_DATA\t3\t96\n"
)
KEYENCE = (
    '"Model","VK-X1000 Series"\n"XY Calibration","500.0","nm"\n"Output image data","Height"\n'
    '"Horizontal","6"\n"Vertical","4"\n"Minimum value","-3"\n"Unit","um"\n\n"Height"\n'
)
KEYENCE_DE = (
    '"XY-Justierung";"500,0";"nm"\n"Horizont.";"6"\n"Vertikal";"4"\n"Einheit";"um"\n\n"Höhe"\n'
)
SQUARE = {
    "one step for both": "Step X / Y [um]\t0.5\nZ unit\tum\n" + matrix("\t", values=HEIGHTS.T),
    "Keyence": KEYENCE + matrix(",", missing="", values=HEIGHTS.T),
    "Keyence in German": KEYENCE_DE + matrix(";", ",", missing="", values=HEIGHTS.T),
    "Zygo": ZYGO
    + "".join(
        f"{i} {j} {'No Data' if np.isnan(z) else z}\n" for (i, j), z in np.ndenumerate(HEIGHTS)
    )
    + "#\n",
    # Each line is one x, heights are in nm; a second map follows.
    "Wyko": WYKO
    + matrix("\t", missing="Bad", values=HEIGHTS * 1e3)
    + "Intensity\t3\t96\n"
    + matrix("\t", missing="Bad"),
}


ENCODINGS = ["utf-8-sig", "utf-16", "utf-16-le", "cp1252"]


@pytest.mark.parametrize(
    ("name", "encoding"),
    [
        *((name, "utf-8") for name in FILES | WHOLE | SQUARE),
        *(("steps and unit", coding) for coding in ENCODINGS),
    ],
)
def test_same_map(name, encoding, tmp_path):
    """One step is that of both axes; x runs as the header of the instrument says."""
    text, said = FILES[name] if name in FILES else ((WHOLE | SQUARE)[name], Stated())
    path = tmp_path / ("a.asc" if name in SQUARE else "a.txt")
    path.write_bytes(text.encode(encoding))
    field = read_map(path, HEIGHT_NAMES, said)
    # One rounding of the number and one of its unit; a spacing is a length over a count.
    np.testing.assert_allclose(field.values, HEIGHTS * 1e-6, rtol=1e-15)
    spacing = (DX * 1e-6, DX * 1e-6 if name in SQUARE else DY * 1e-6)
    np.testing.assert_allclose(field.spacing, spacing, rtol=1e-14)


@pytest.mark.parametrize(
    "lines",
    [
        ["Step width: see protocol"],
        ["Step X: 0.5", "Step Y: 0.25"],
        ["X axis;6 points;0.5 um", "Y axis;4 points;0.25 um"],
    ],
)
def test_lines_that_are_not_understood_are_quoted(lines, tmp_path):
    (tmp_path / "a.txt").write_text("\n".join(["Z unit: um", "Z step: 1 nm", *lines, matrix()]))
    with pytest.raises(InvalidInput, match="does not say its lengths") as refusal:
        read_map(tmp_path / "a.txt", HEIGHT_NAMES)
    assert all(repr(line) in str(refusal.value) for line in lines)
    assert "Z step" not in str(refusal.value)


@pytest.mark.parametrize("ending", ["txt", "csv", "asc", "dat", "sdf", "xyz", "tsv", "prn"])
def test_endings_of_text(ending, tmp_path):
    (tmp_path / f"a.{ending}").write_text(matrix())
    assert read_map(tmp_path / f"a.{ending}", HEIGHT_NAMES, SAID).values.shape == (6, 4)


def test_points_in_any_order_and_rounded(tmp_path):
    """Thirds in three digits are within 0.2 % of a step of an even grid."""
    lines = [
        f"{i / 3:.3f} {j / 3:.3f} {z}" for (i, j), z in np.ndenumerate(HEIGHTS) if not np.isnan(z)
    ]
    order = np.random.default_rng(0).permutation(len(lines))
    (tmp_path / "a.txt").write_text("\n".join(lines[k] for k in order))
    field = read_map(tmp_path / "a.txt", HEIGHT_NAMES, UNIT)
    np.testing.assert_allclose(field.values, HEIGHTS * 1e-6, rtol=1e-15)
    np.testing.assert_allclose(field.spacing, (1e-6 / 3, 1e-6 / 3), rtol=1e-3)


@pytest.mark.parametrize("hole", [1, 8, 14, 29])
def test_a_list_with_a_hole_of_whole_columns(hole, tmp_path):
    """The largest rise of x is that over the hole, not the step; thirds are rounded."""
    heights = np.arange(40.0 * 3).reshape(40, 3)
    heights[5 : 5 + hole] = np.nan
    lines = [
        f"{i / 3:.3f} {j / 3:.3f} {z}" for (i, j), z in np.ndenumerate(heights) if not np.isnan(z)
    ]
    (tmp_path / "a.txt").write_text("\n".join(lines))
    field = read_map(tmp_path / "a.txt", HEIGHT_NAMES, UNIT)
    np.testing.assert_allclose(field.values, heights * 1e-6, rtol=1e-15)
    np.testing.assert_allclose(field.spacing, (1e-6 / 3, 1e-6 / 3), rtol=1e-3)


def without(where, shape=(6, 4)):
    values = np.random.default_rng(0).normal(size=shape).round(3)
    values[where] = np.nan
    return values


@pytest.mark.parametrize(
    "values",
    [
        # A row or column without any point is no header and no end of the lines.
        *map(without, (np.s_[0], np.s_[-1], np.s_[:, 0], np.s_[:, -1])),
        # The lines by which the layout is chosen do not hold the single point of a column.
        without((np.arange(1000) != 501, -1), (1000, 4)),
        # A plane is no line of coordinates, though its first line and column rise evenly.
        np.add.outer(0.25 * np.arange(6), np.arange(4)),
    ],
    ids=["first row", "last row", "first column", "last column", "single point", "plane"],
)
def test_the_map_keeps_its_shape(tmp_path, values):
    for missing, separator in ("***", " "), ("NaN", ","), ("NaN", "\t"), ("", ";"), ("", "\t"):
        if missing == "" and np.isnan(values[:, -1]).all():
            continue  # a separator at the end of every line begins no column
        if (missing, separator) == ("", "\t") and np.isnan(values[:, 0]).all():
            continue  # a tab at the beginning of every line is a blank before it
        (tmp_path / "a.txt").write_text(matrix(separator, missing=missing, values=values))
        field = read_map(tmp_path / "a.txt", HEIGHT_NAMES, SAID)
        np.testing.assert_allclose(field.values, values * 1e-6, rtol=1e-15)


LENGTHS = "Unit: um\nHeight: 1 um\n"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (WYKO.replace("0\t1\t1", "0\t0\t1", 1) + matrix("\t"), "in wavelengths"),
        ("Zygo ASCII Data File - Format 2\n1 2 3 4\n", "phases"),
        (ZYGO.replace("5e-07", "0") + points(), "it was not calibrated"),
        ("Zygo XYZ Data File - Format 1\n#\n" + points(), "camera's resolution"),
        # One number or two, about one or a thousand, or two things: quoted, and not guessed.
        *(
            (f"Width: {width} um\n" + LENGTHS + matrix(), "give its size.* header says 'Width: 1")
            for width in ("1,024", "1 250", "1’250.5", "1.250,0", "1.250.000", "1,024 x 768")
        ),
        (
            "Width: 10 um (256 px)\n" + LENGTHS + matrix(),
            r"'Width: 10 um \(256 px\)', which is not",
        ),
        ("Breite: 1.024 um\n" + LENGTHS + matrix(";", ","), "its header says 'Breite"),
        # What to write follows from what the line is about.
        ("Width: about 10 um\n" + matrix(), "write one number with its unit there, .* 'Width: 10"),
        ("Pixel size: ~1 um\n" + matrix(), "one number with its unit there, .* 'Pixel size: 0.5"),
        ("Columns: 6 of 8\n" + matrix(), "write one whole number there, as in 'Columns: 256', or"),
        ("NODATA_value = minus 9\n" + matrix(), "write one number there, as in 'NODATA_value: -9"),
        ("DSAA\n4 6\n0 1\n0 3\n" + matrix(), "do.* not say its lengths.*says '4 6' and '0 1'"),
        # A factor may be applied already or not.
        ("Z Scale: 0.001\n" + matrix(), "says 'Z Scale: 0.001', a factor"),
        ("Höhenfaktor: 2,5\n" + matrix(";", ","), "a factor"),
        ("Z-Skala: 0.1\n" + matrix(), "'Z-Skala: 0.1', a factor"),
        ("# heights in nm\n# z-unit: um\n" + matrix(), "its heights are in nm and in um; correct"),
        ("# by hand\n1.000,5;2.000,5\n", "no line of numbers; line 2 is '1.000,5;2"),
        ("Multiplier;0,001\n" + matrix(";", ","), "a factor"),
        ("Multiplier: 1'000\n" + matrix(), "a factor"),
        ("Zscale = 1e-6\nXscale = 5e-7\n" + matrix(), "'Zscale = 1e-6', a factor"),
        # Coordinates, or columns of a list, must not become heights.
        (
            "".join(f"{k / 4} {line}\n" for k, line in enumerate(matrix().splitlines())),
            "first column of .* rises evenly",
        ),
        (around("y").replace("0,000500", "0,000700"), "column 1 of .* is 'y', which is no number"),
        ("".join(f"{line} 7\n" for line in points().splitlines()), "x and y of a grid"),
        ("x [mm], y, z [um]\n" + points(","), "only one has a unit"),
        ("x [mm], y [mm], z [kg]\n" + points(","), "'kg', which is no unit of length"),
        ("x [px], y [px], z [um]\n" + points(","), "'px', which is no unit of length"),
        ("x [mm], y [mm], I, Q\n" + points(",").replace("\n", ",1\n"), "not one column as height"),
        # SDF: a profile is no map, and one without its scales is not whole.
        (SDF.replace("= 4", "= 1") + "1 2 3 4 5 6\n*\n", "line scan"),
        (SDF.replace("= 6", "= -6").replace("= 4", "= -4") + matrix(), "no whole one"),
        (SDF.replace("= 6", "= 0") + "*\n", "0 heights for 0 x 4 points"),
        (SDF + "1 2 3\n*\n", "3 heights for 6 x 4 points"),
        (SDF.replace("Zscale", "Zsc") + matrix(), "no whole one"),
    ],
)
def test_numbers_that_may_mean_another_thing(text, reason, tmp_path):
    """Each was read, with unit and size of the scene or without, as a map that it is not."""
    (tmp_path / "a.txt").write_text(text, encoding="utf-8")
    with pytest.raises(InvalidInput, match=reason) as refusal:
        read_map(tmp_path / "a.txt", HEIGHT_NAMES, UNIT if "Unit" not in text else None)
    assert "\n" not in str(refusal.value)


BY_SIZE = Stated(unit="um", size=(6e-6, 4e-6))


@pytest.mark.parametrize(
    ("header", "along_x"),
    [
        *(
            (line, False)
            for line in (
                "Width: 10 um (256 px)",
                "X Range: 0 to 8 um",
                "Height: 1.5 um at 20 degC",
                "Pixel size: ~1 um",
                "Scan size: 1,024 um",
                "Columns: 6 of 8",
                # Beside size even clear lines count no more.
                "Pixel size: 1 um\nWidth: 6 um (6 px)",
            )
        ),
        # Keys name the axes, whatever their values are.
        ("Width: 10 um (256 px)\nHeight: 8 um (200 px)", True),
        ("X Range: 0 to 6 um\nY Range: 0 to 4 um", True),
        ("Width: 6 um\nHeight: 4 um (nominal)", True),
        ("x-pixels: {0}\ny-pixels: {1}\nSize: ~6 um x ~4 um", True),
    ],
)
def test_size_stands_for_unclear_lengths(header, along_x, tmp_path):
    """Of a matrix with x along its lines or not, as a clear header says it."""
    for heights in (HEIGHTS, HEIGHTS[:4]):
        n, m = heights.shape
        rows = matrix(values=heights)
        (tmp_path / "a.txt").write_text(f"{header.format(m, n)}\n{rows}")
        field = read_map(tmp_path / "a.txt", HEIGHT_NAMES, BY_SIZE)
        expected = (heights.T if along_x else heights) * 1e-6
        np.testing.assert_allclose(field.values, expected, rtol=1e-15)
        assert field.covered == pytest.approx(BY_SIZE.size, rel=1e-14)
        with pytest.raises(InvalidInput, match=r"give its size.* its header says .*not understood"):
            read_map(tmp_path / "a.txt", HEIGHT_NAMES, UNIT)


@pytest.mark.parametrize(
    "header",
    [
        "Columns: 4 Rows: 6",
        "Columns: 6 of 8\nRows: 4",
        "Width: 6 um Height: 4 um",
        "Width: 6 um\nHeight: 4 um\nColumns: 6 of 8",
        "Size: ~6 um x ~4 um",
        "Size: 6 um (6 px) x 4 um (4 px)",
    ],
)
def test_an_unclear_line_that_may_turn_the_map_is_refused(header, tmp_path):
    """Also beside size: written clearly, it may name both axes, or exchange them."""
    (tmp_path / "a.txt").write_text(f"{header}\n{matrix()}")
    with pytest.raises(InvalidInput, match=r"not understood.* that x runs along the lines"):
        read_map(tmp_path / "a.txt", HEIGHT_NAMES, BY_SIZE)


def test_lines_that_count_are_no_lengths(tmp_path):
    """A spreadsheet writes 0, 1, 2 … above and beside a matrix."""
    lines = matrix(",").splitlines()
    text = ",0,1,2,3\n" + "".join(f"{k},{line}\n" for k, line in enumerate(lines))
    (tmp_path / "a.csv").write_text(text)
    field = read_map(tmp_path / "a.csv", HEIGHT_NAMES, SAID)
    np.testing.assert_allclose(field.values, HEIGHTS * 1e-6, rtol=1e-15)
    with pytest.raises(InvalidInput, match="count points, without a unit, and say no lengths"):
        read_map(tmp_path / "a.csv", HEIGHT_NAMES, UNIT)


BODY = "\n".join(" ".join(str(6 * i + j) for j in range(6)) for i in range(6))


@pytest.mark.parametrize(
    "line",
    [
        *("Sampling length: 0.8 mm", "Mean spacing RSm = 40 um", "Camera pixel size: 5.5 um"),
        *("Scan length: 40 um", "Kernel size: 3 um", "Calibration step: 180 nm"),
        *("Sensor width: 8 mm, height: 6 mm", "Modulation amplitude: 10 nm", "Vertical step: 1 um"),
    ],
)
def test_lengths_of_something_else(tmp_path, line):
    """Neither alone, where the message quotes the line, nor before the true step."""
    path = tmp_path / "a.txt"
    path.write_text(f"# {line}\n# heights in um\n{BODY}\n", encoding="utf-8")
    with pytest.raises(InvalidInput, match="does not say its lengths"):
        read_map(path, HEIGHT_NAMES)
    path.write_text(f"# {line}\n# pixel size: 2 um\n# heights in um\n{BODY}\n", encoding="utf-8")
    assert read_map(path, HEIGHT_NAMES).spacing == pytest.approx((2e-6, 2e-6))


@pytest.mark.parametrize(
    ("line", "missing"),
    [
        *(("Missing points: 3", 0), ("Invalid pixels = 0", 0), ("Bad points removed: 3", 0)),
        *(
            ("Missing data: 3", 0),
            ("NODATA_value 3", 1),
            ("Invalid value: 3", 1),
            ("no data: 3", 1),
        ),
    ],
)
def test_number_of_missing_points_is_no_mark(tmp_path, line, missing):
    path = tmp_path / "a.txt"
    path.write_text(f"# {line}\n# pixel size: 2 um\n# heights in um\n{BODY}\n", encoding="utf-8")
    assert read_map(path, HEIGHT_NAMES).missing == missing


def test_a_mark_that_is_not_clear(tmp_path):
    """Also in a list, which needs no other line of the header."""
    (tmp_path / "a.txt").write_text("Invalid value: 0.5 or less\n" + points())
    with pytest.raises(InvalidInput, match=r"says 'Invalid value: 0.5 or less', which is not"):
        read_map(tmp_path / "a.txt", HEIGHT_NAMES, UNIT)
    (tmp_path / "a.txt").write_text("Width: 10 um (nominal)\n" + points())
    assert read_map(tmp_path / "a.txt", HEIGHT_NAMES, UNIT).values.shape == HEIGHTS.shape


@pytest.mark.parametrize("line", ["Wavelength unit: nm", "Unit of filter = mm", "Noise height: nm"])
def test_units_of_something_else(tmp_path, line):
    path = tmp_path / "a.txt"
    path.write_text(f"# {line}\n# pixel size: 2 um\n{BODY}\n", encoding="utf-8")
    with pytest.raises(InvalidInput, match="have no unit"):
        read_map(path, HEIGHT_NAMES)


@pytest.mark.parametrize("command", ["new", "surface"])
def test_a_height_whose_square_overflows(tmp_path, monkeypatch, capsys, command):
    """One sentence, and no warning of numpy."""
    monkeypatch.chdir(tmp_path)
    values = np.random.default_rng(1).normal(size=(6, 4))
    values[2, 1] = 1e208
    head = "# pixel size: 1 um\n# heights in um"
    np.savetxt("a.txt", values, header=head, comments="")
    assert main([command, "a.txt"]) == 2
    assert re.fullmatch("fem-seal: .* is beyond 1e[+]100 m; .*\n", capsys.readouterr().err)


@pytest.mark.parametrize("step", ["Lateral resolution: 0.7 um", "Pitch: 3 um"])
def test_steps_and_lengths_that_contradict_each_other(tmp_path, step):
    """Six points of 0.5 um are 3 um long, or 2.5 um from the first to the last."""
    path = tmp_path / "a.txt"
    sides = "Width: 3 um\n# Height: 3 um"
    path.write_text(f"# {sides}\n# {step}\n# heights in um\n{BODY}\n", encoding="utf-8")
    with pytest.raises(InvalidInput, match=f"contradict each other: .*{step}"):
        read_map(path, HEIGHT_NAMES)
    said = Stated(size=(3e-6, 3e-6))
    assert read_map(path, HEIGHT_NAMES, said).spacing == pytest.approx((5e-7, 5e-7))
    for side in (3, 2.5):
        sides = f"Width: {side} um\n# Height: {side} um\n# pixel size: 0.5 um"
        path.write_text(f"# {sides}\n# heights in um\n{BODY}\n", encoding="utf-8")
        assert read_map(path, HEIGHT_NAMES).spacing == pytest.approx((5e-7, 5e-7))


@pytest.mark.parametrize(
    "lines",
    [
        ("Lateral resolution: 0.7 um", "Pixel size: 2 um"),
        ("Height: 3.2 um", "Width: 12 um", "Height: 12 um"),
        ("Scan size: 12 um x 12 um", "Field of view: 1 mm x 0.8 mm"),
        ("Pixel size: 1 um", "x step: 2 um", "y step: 2 um"),
        ("Scan size: 10 um", "Width: 20 um", "Height: 20 um"),
    ],
)
def test_two_lengths_of_one_side_that_differ(tmp_path, lines):
    """Which is true nobody knows; the same twice in other units is one."""
    path = tmp_path / "a.txt"
    for order in (lines, lines[::-1]):
        head = "\n# ".join(order)
        path.write_text(f"# {head}\n# heights in um\n{BODY}\n", encoding="utf-8")
        with pytest.raises(InvalidInput, match="does not say its lengths.*" + order[0]):
            read_map(path, HEIGHT_NAMES)
    head = "Pixel size: 2 um\n# Spacing: 0.002 mm"
    path.write_text(f"# {head}\n# heights in um\n{BODY}\n", encoding="utf-8")
    assert read_map(path, HEIGHT_NAMES).spacing == pytest.approx((2e-6, 2e-6))
