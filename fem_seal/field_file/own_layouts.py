"""Files of instruments with a layout of their own, which other readers misread or do not know."""

import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree
from zipfile import ZipFile

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.field_file.containers import whole
from fem_seal.field_file.instruments import read_instrument
from fem_seal.field_file.recorded import Recorded
from fem_seal.field_file.text_table import decoded

# First lines such as aBCR-1.0 (ISO 25178-71, EUR 15178 EN), aISO-1.0, aNPL-V1.0.
SDF = re.compile(r"a[A-Z][\w.]*-V?\d")
SDF_KEYS = "numpoints", "numprofiles", "xscale", "yscale", "zscale"
GSF = b"Gwyddion Simple Field"
WYKO, ZYGO_POINTS, ZYGO_PHASES = "Wyko ASCII Data", "Zygo XYZ Data", "Zygo ASCII Data"
# Data types of X3P. openGPS, the reference, has signed integers; some programs write others.
X3P_TYPES = {"I": ("<i2", "<u2"), "L": ("<i4", "<u4"), "F": ("<f4",), "D": ("<f8",)}
X3P_SCALE = ("Increment", 1.0), ("Offset", 0.0)  # of heights: what they are if left out
RESOLUTION = 7, 6  # line and word of the camera's resolution in a header of Zygo, from 0


def read_own_layout(path: Path) -> Recorded | None:
    """Read Wyko's (Bruker Vision's) ASCII or an ASCII SDF; None without their first line."""
    with whole(path, "text"), path.open("rb") as file:
        first = decoded(file.read(160), path)
    if first.startswith(ZYGO_PHASES):
        raise InvalidInput(
            f"{path} holds phases of Zygo's interferometer, not heights; save the map as .datx, "
            ".dat or .xyz"
        )
    if SDF.match(first):
        return _sdf(path)
    if not first.startswith(WYKO):
        return None
    # The second of three flags: whether heights are in nm.
    flags = first.split("Format")[-1].split()
    if flags[1:2] == ["0"]:
        raise InvalidInput(
            f"{path} holds heights in wavelengths; export it from Vision in units of length, or "
            "save the map as .opd"
        )
    # SurfaceTopography lays y, along the lines of the file, along the first axis.
    recorded = read_instrument(path, "RAW_DATA")
    spacing = None if recorded.spacing is None else recorded.spacing[::-1]
    return replace(recorded, values=recorded.values.T.copy(), spacing=spacing)


def _sdf(path: Path) -> Recorded:
    """Read a surface data file: keys, heights and a trailer, with an asterisk before the last two.

    All lengths are in metres. A file of one profile has one line along y, and its Yscale may be 0.
    """
    with whole(path, "SDF"):
        text = decoded(path.read_bytes(), path)
    head, *parts = re.split(r"^\s*\*\s*$", text, flags=re.MULTILINE)
    keys = dict(re.findall(r"^\s*(\w+)\s*=[ \t]*(\S*)", head.lower(), re.MULTILINE))
    try:
        points, profiles, dx, dy, dz = (float(keys.get(key, key)) for key in SDF_KEYS)
        values = np.array("".join(parts[:1]).upper().replace("BAD", "NAN").split(), dtype=float)
        if values.size != points * profiles or not values.size:
            raise ValueError(f"{values.size} heights for {points:g} x {profiles:g} points")
        heights = values.reshape(int(profiles), int(points)).T * dz
    except ValueError as error:
        raise InvalidInput(
            f"{path} begins as a surface data file (SDF), but is no whole one: {error}"
        ) from None
    header = tuple(head.splitlines())
    return Recorded(heights, "m", (dx, dy), "m", measured=True, header=header)


def read_gsf(path: Path) -> Recorded:
    """Read Gwyddion's simple field: keys, zero bytes to a multiple of four, heights in float32.

    Each line of heights runs along x.
    """
    with whole(path, "GSF"):
        data = path.read_bytes()
        head = data.partition(b"\0")[0]
        pairs = re.findall(r"^(\w+)[ \t]*=[ \t]*(.*?)\s*$", decoded(head, path), re.MULTILINE)
        keys, start = dict(pairs), len(head) + 4 - len(head) % 4
        nx, ny = int(keys["XRes"]), int(keys["YRes"])
        values = np.frombuffer(data, "<f4", nx * ny, start).reshape(ny, nx).T
        if not (data.startswith(GSF) and values.size):
            raise ValueError(path)
        spacing = None
        if {"XReal", "YReal"} <= keys.keys():
            spacing = float(keys["XReal"]) / nx, float(keys["YReal"]) / ny
    units = keys.get("ZUnits") or None, keys.get("XYUnits") or None
    return Recorded(values.astype(float), units[0], spacing, units[1], measured=True)


def read_x3p(path: Path) -> Recorded:
    """Read X3P (ISO 25178-72): heights in a binary file inside, in metres, x along its lines.

    A file of bits may say which points are valid: those that are not have heights of 0, or any
    others. Integers are taken for signed ones or not, whichever makes the smoother map: a wrong
    sign is a jump of the whole range.
    """
    with whole(path, "X3P"), ZipFile(path) as archive:
        try:
            root = ElementTree.fromstring(archive.read("main.xml"))
        except ElementTree.ParseError as error:
            raise ValueError(path) from error
        axes, data = "Record1/Axes/C", "Record3/DataLink"
        size = [root.findtext(f"Record3/MatrixDimension/Size{axis}", "") for axis in "XYZ"]
        nx, ny, layers = map(int, size)
        even = [root.findtext(f"{axes}{axis}/AxisType") for axis in "XYZ"] == ["I", "I", "A"]
        if not even or min(nx, ny) < 1 or layers != 1:
            raise ValueError(path)
        dx, dy = (float(root.findtext(f"{axes}{axis}/Increment", "")) for axis in "XY")
        step, start = (float(root.findtext(f"{axes}Z/{key}") or one) for key, one in X3P_SCALE)
        kinds = X3P_TYPES[root.findtext(f"{axes}Z/DataType", "")]
        with archive.open(root.findtext(f"{data}/PointDataLink", "")) as file:
            points = file.read(nx * ny * np.dtype(kinds[0]).itemsize)
        read = (np.frombuffer(points, kind).reshape(ny, nx).astype(float) for kind in kinds)
        values = step * min(read, key=lambda raw: np.abs(np.diff(raw)).sum()) + start
        if valid := root.findtext(f"{data}/ValidPointsLink"):
            bits = np.frombuffer(archive.read(valid), np.uint8)
            known = np.unpackbits(bits, count=nx * ny, bitorder="little")
            values[known.reshape(ny, nx) == 0] = np.nan
    return Recorded(values.T.copy(), "m", (dx, dy), "m", measured=True)


def zygo_resolution(header: tuple[str, ...], path: Path) -> float | None:
    """Distance of neighbouring points [m] of Zygo's list of x, y (in pixels) and height (in µm).

    None for any other list.
    """
    if not header or not header[0].startswith(ZYGO_POINTS):
        return None
    line, position = RESOLUTION
    try:
        return float(header[line].split()[position])
    except (IndexError, ValueError):
        raise InvalidInput(
            f"{path} begins as a file of Zygo, but line {line + 1} of its header does not hold the "
            "camera's resolution; save the map as .datx or .dat"
        ) from None
