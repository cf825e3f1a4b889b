"""Text files of instruments with their own layout, which a general reader would misread."""

from dataclasses import replace
from pathlib import Path

from fem_seal.errors import InvalidInput
from fem_seal.field_file.containers import whole
from fem_seal.field_file.instruments import read_instrument
from fem_seal.field_file.recorded import Recorded

WYKO, ZYGO_POINTS, ZYGO_PHASES = "Wyko ASCII Data", "Zygo XYZ Data", "Zygo ASCII Data"
RESOLUTION = 7, 6  # line and word of the camera's resolution in a header of Zygo, from 0


def read_own_layout(path: Path) -> Recorded | None:
    """Read a file of Wyko (Bruker Vision); None for a file without its first line.

    Raises
    ------
    InvalidInput
        If the file cannot be read, or its heights are phases or parts of a wavelength.
    """
    with whole(path, "text"), path.open("rb") as file:
        first = file.readline(80).decode("latin-1")
    if first.startswith(ZYGO_PHASES):
        raise InvalidInput(
            f"{path} holds phases of Zygo's interferometer, not heights; save the map as .datx, "
            ".dat or .xyz"
        )
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


def zygo_resolution(header: tuple[str, ...], path: Path) -> float | None:
    """Distance of neighbouring points [m] of Zygo's list of x, y (in pixels) and height (in µm).

    None for any other list.

    Raises
    ------
    InvalidInput
        If the header is cut off.
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
