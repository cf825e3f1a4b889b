"""fem-seal surface: a surface before it is pressed, of a scene or of a file of heights."""

import argparse
import shlex
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import astuple
from math import pi
from typing import TYPE_CHECKING

from fem_seal.cli.options import add_path, add_scene, add_statements, scene_of_heights
from fem_seal.cli.printing import say
from fem_seal.digits import length_text, with_error
from fem_seal.errors import InvalidInput
from fem_seal.files import write_text
from fem_seal.progress import Display, Report
from fem_seal.tables import aligned, csv_text

if TYPE_CHECKING:
    from fem_seal.grid import GridField
    from fem_seal.patch import Patch
    from fem_seal.scene import Scene
    from fem_seal.surface import IsotropicSpectrum, MapStatistics, PreparedSurface, SpectrumFit

Rows = Iterator[tuple[str, str]]  # names and texts
NO_POWER_LAW = 100  # misfit from which a fitted exponent means nothing


def add(command: argparse.ArgumentParser) -> None:
    """Add the options."""
    add_scene(command, "SCENE.toml, or a file of heights (docs/guide/surfaces.md)")
    add_statements(command)
    add_path(command, "--out", "FILE.png", "picture of heights and spectrum (none)")
    add_path(command, "--csv", "FILE.csv", "Sq, Sdq, Ssk and the spectrum C(q) (none)")
    command.set_defaults(command=_surface)


def _surface(options: argparse.Namespace) -> int:
    with Display() as report:
        text = _described(options, report)
    say(text)
    return 0


def _described(options: argparse.Namespace, report: Report) -> str:
    """Text about the surface; its picture and its table are written."""
    from fem_seal.patch import Patch
    from fem_seal.render.plot import FORMATS
    from fem_seal.scene import ProfileSurface, Scene
    from fem_seal.scene_steps import spectrum_of_profiles
    from fem_seal.surface import fit_spectrum

    if options.out is not None and options.out.suffix.lower() not in FORMATS:
        raise InvalidInput(f"--out {options.out} must end in {', '.join(FORMATS)}")
    if options.csv is not None and options.csv.suffix.lower() != ".csv":
        raise InvalidInput(f"--csv {options.csv} must end in .csv")
    is_scene = options.scene.suffix.lower() == ".toml"
    if not is_scene:
        scene = scene_of_heights(options.scene, options)
    elif options.length_unit is not None or options.size is not None:
        raise InvalidInput("--length-unit and --size are for a file of heights; use --set")
    else:
        scene = Scene.from_file(options.scene, options.overrides)
    patch = Patch(scene, report)
    prepared = _prepared(patch)
    report("spectrum and lay", "")
    spectrum = None
    if isinstance(scene.surface, ProfileSurface):
        spectrum = spectrum_of_profiles(scene.surface)
    try:
        fit, failure = fit_spectrum(prepared.measured), ""
    except InvalidInput as error:
        # A surface without a power law, such as a ground groove, is accepted too.
        fit, failure = None, str(error)
    if options.out is not None:
        from fem_seal.render.surface import surface_figure

        surface_figure(prepared, fit, options.out)
    if options.csv is not None:
        write_text(options.csv, _csv(prepared, spectrum))
    lines = _of_steps(prepared, patch, is_cell=is_scene)
    rows = [*_map_rows(prepared), *_longest(scene), *_fit_rows(fit, failure)]
    if spectrum is not None:
        rows += _profile_rows(spectrum, prepared.field)
    if written := [str(path) for path in (options.out, options.csv) if path is not None]:
        rows.append(("result", ", ".join(written)))
    lines += ["", *(f"{name:<19} {text}" for name, text in rows)]
    if not is_scene:
        words = ["fem-seal", "new", str(options.scene)]
        stated = {"--length-unit": options.length_unit, "--size": options.size}
        words += [word for pair in stated.items() if pair[1] for word in pair]
        lines.append(f"{shlex.join(words)} writes a scene that presses it")
    return "\n".join(lines)


def _of_steps(prepared: "PreparedSurface", patch: "Patch", *, is_cell: bool) -> list[str]:
    """Table of the steps of a preparation, what a contact would refuse in a cell, and cautions."""
    from fem_seal.quantities.cautions import cautions_of_map, steep

    head = ("step", "samples", "missing", "rms height", "rms slope", "seam", "skewness")
    lines = [aligned([head, *map(_cells, prepared.steps)])]
    if is_cell:
        try:
            prepared.require_cell("as it is")
        except InvalidInput as error:
            lines.append(str(error))
    slope = steep(prepared.steps[-1].rms_slope, "the surface")
    cautions = [*cautions_of_map(patch), *filter(None, (slope,))]
    return lines + [f"caution: {sentence}" for sentence in cautions]


def _csv(prepared: "PreparedSurface", spectrum: "IsotropicSpectrum | None") -> str:
    """Statistics and spectrum of a map, or the spectrum of profiles with its errors, as a table.

    The names of the statistics are those of ISO 25178-2: Sq rms height, Sdq rms slope, Ssk
    skewness. Those of profiles are of the isotropic surface with their spectrum.
    """
    from fem_seal.surface import MapStatistics, map_spectrum

    columns: tuple[Iterable[float], ...] = ()
    if spectrum is not None:
        head = [f"# Sq = {spectrum.rms_height!r} m", f"# Sdq = {spectrum.rms_slope!r}"]
        names = ["q from [1/m]", "q to [1/m]", "C [m^4]", "standard deviation [m^4]"]
        columns = spectrum.edges[:-1], spectrum.edges[1:], spectrum.values, spectrum.error
    else:
        statistics = MapStatistics.of(prepared.measured)
        head = [
            f"# Sq = {statistics.rms_height!r} m",
            f"# Sdq = {statistics.rms_slope!r}",
            f"# Ssk = {statistics.skewness!r}",
        ]
        names = ["q [1/m]", "C [m^4]", "modes"]
        with suppress(InvalidInput):  # a flat map has no spectrum, and a row of the text says so
            columns = astuple(map_spectrum(prepared.measured))
    return "\n".join((*head, csv_text(names, [*zip(*map(list, columns), strict=True)])))


def _profile_rows(spectrum: "IsotropicSpectrum", heights: "GridField") -> Rows:
    """Spectrum of the isotropic surface of profiles, and the wavelengths that its grid holds."""
    ends = [length_text(2 * pi / q) for q in (spectrum.edges[0], spectrum.edges[-1])]
    height, slope = length_text(spectrum.rms_height), f"{spectrum.rms_slope:.4g}"
    waves = f"wavelengths {ends[0]} to {ends[1]}"
    yield "profiles", f"rms height {height}, rms slope {slope}, {waves}"
    longest, finest = max(heights.size), 2 * max(heights.spacing)
    yield "this grid", f"wavelengths {length_text(longest)} to {length_text(finest)}"
    yield "assumed", "the surface is isotropic and Gaussian; its other waves are left out"


def _prepared(patch: "Patch") -> "PreparedSurface":
    from fem_seal.surface import MapStatistics, PreparedSurface

    if patch.prepared is not None:
        return patch.prepared
    field = patch.surface
    if field is None:
        raise InvalidInput("the scene has a gap in place of a surface; there is nothing to press")
    return PreparedSurface(field, field, (MapStatistics.of(field, "made"),))


def _map_rows(prepared: "PreparedSurface") -> Rows:
    """Rows on the sides, the slopes and the lay of the map before it was made periodic."""
    from fem_seal.quantities.cautions import LAY_RATIO

    yield "sides", " by ".join(map(length_text, prepared.measured.covered))  # as in surface.size
    without = " (without the spikes)" if prepared.outliers.any() else ""
    lay, (dx, dy) = prepared.lay, prepared.measured.spacing
    x, y, both = "x", "y", ""
    if max(lay.lags) > 1:  # the lay is that of longer differences
        x, y = f"x over {length_text(dx)}", f"y over {length_text(dy)}"
        both = f" over {length_text(max(dx, dy))}"
    yield "slopes", f"{lay.slopes[0]:.3g} along {x}, {lay.slopes[1]:.3g} along {y}{without}"
    angle = f"{lay.angle:.0f} degrees from x{'' if lay.ratio > LAY_RATIO else ', not clear'}"
    yield "lay", f"{angle}: slopes{both} across it are {lay.ratio:.3g} times those along it"


def _cells(statistics: "MapStatistics") -> tuple[str, ...]:
    return (
        statistics.name,
        f"{statistics.samples[0]} x {statistics.samples[1]}",
        str(statistics.missing),
        length_text(statistics.rms_height),
        f"{statistics.rms_slope:.4g}",
        f"{statistics.seam:.3g}",
        f"{statistics.skewness:.3g}",
    )


def _longest(scene: "Scene") -> Rows:
    """Row on the longest wavelength of a map; none of a surface that no file holds."""
    from fem_seal.scene_steps import whole_map
    from fem_seal.surface import longest_wavelength

    if scene.measured_map is None:
        return
    try:
        longest = longest_wavelength(whole_map(scene.measured_map))
        seen = "longer than the map" if longest is None else length_text(longest)
    except InvalidInput as error:
        seen = str(error)
    yield "longest wavelength", seen


def _fit_rows(fit: "SpectrumFit | None", failure: str) -> Rows:
    """Rows on a fitted spectrum, or on the failure of the fit."""
    if fit is None or fit.misfit > NO_POWER_LAW:
        misfit = "" if fit is None else f"{fit.misfit:.2g}"
        yield "spectrum", failure or f"no power law: the best one has a misfit of {misfit}"
        return
    hurst = f"{with_error(fit.hurst, fit.hurst_error)} (misfit {fit.misfit:.2g})"
    if not 0 <= fit.hurst <= 1:
        hurst += "; beyond 0 to 1: not self-affine, or too few waves"
    yield "hurst", hurst
    yield "long cut-off", _seen(fit.long_wavelength)
    rolloff = _seen(fit.rolloff_wavelength)
    if fit.rolloff_wavelength is not None:
        rolloff += f" ± {_seen(fit.rolloff_error)}"
    yield "roll-off", rolloff
    yield "short cut-off", _seen(fit.short_wavelength)


def _seen(metres: float | None) -> str:
    return "none seen" if metres is None else length_text(metres)
