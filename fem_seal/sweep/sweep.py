"""The points of a sweep, one after the other."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from fem_seal import parallel
from fem_seal.errors import InvalidInput, NotConverged
from fem_seal.progress import Report, silent
from fem_seal.results.result import Provenance, summarise
from fem_seal.scene import Scene
from fem_seal.seal import Seal
from fem_seal.sweep.axis import Axis
from fem_seal.sweep.contact_path import ContactPath
from fem_seal.sweep.table import COLUMNS, Row, Table


@dataclass(frozen=True)
class Tally:
    """How many points there are, were computed now, and did not converge now or before."""

    points: int
    computed: int
    not_converged: int


def sweep(
    path: Path,
    axes: Sequence[Axis],
    out: Path,
    *,
    overrides: Sequence[str] = (),
    overwrite: bool = False,
    report: Report = silent,
    trust: bool = False,
) -> Tally:
    """Compute the points of a sweep that its folder does not hold yet.

    Parameters
    ----------
    path : scene file
    axes : fields and their values; all combinations are computed
    out : folder of sweep.csv, with a column for each axis and those of `Row`
    overrides : of the scene, for all points
    overwrite : whether another sweep may be replaced
    report : called with the point and its latest news
    trust : whether gmsh may run a .geo file that is not the package's own

    Returns
    -------
    Tally. A point that does not converge has a row that says so, and the sweep goes on.

    Raises
    ------
    InvalidInput
        If any point is no scene, which is found before the first one is computed, or the folder
        holds another sweep or cannot be written.
    """
    keys = tuple(axis.key for axis in axes)
    if not keys or len(set(keys)) < len(keys):
        raise InvalidInput(f"a sweep needs fields to vary, each once; got {', '.join(keys)}")
    points = {
        values: Scene.from_file(path, [*overrides, *map("{}={}".format, keys, values)])
        for values in product(*(axis.values for axis in axes))
    }
    origin = _origin(next(iter(points.values())), keys)
    table = parallel.on_root(lambda: Table.opened(out, keys, origin, overwrite))
    path_of_contacts = ContactPath()
    missing = [values for values in points if values not in table.rows]
    for number, values in enumerate(missing, start=1):
        name = f"{number}/{len(missing)} {', '.join(map('{}={}'.format, keys, values))}"
        table.rows[values] = _compute(points[values], name, report, path_of_contacts, trust).cells()
        parallel.on_root(table.write)
    converged = COLUMNS.index("converged")
    failed = sum(table.rows[values][converged] != "True" for values in points)
    return Tally(len(points), len(missing), failed)


def _origin(scene: Scene, keys: tuple[str, ...]) -> Provenance:
    """What all points share: the scene without the fields that vary."""
    origin = Provenance.of(scene)
    shared = {
        section: {name: value for name, value in given.items() if f"{section}.{name}" not in keys}
        for section, given in origin.scene.items()
    }
    return origin.model_copy(update={"scene": shared, "seed": None})


def _compute(scene: Scene, name: str, report: Report, contacts: ContactPath, trust: bool) -> Row:
    """Numbers of one point; pictures and meshes are for single runs."""

    def news(stage: str, detail: str) -> None:
        report(f"{name}: {stage}", detail)

    numbers = scene.output.model_copy(update={"products": _numbers(scene)})
    seal = Seal(scene.model_copy(update={"output": numbers}), news, trust=trust)
    contacts.lead(seal)
    try:
        row = Row.of(summarise(seal))
        contacts.follow(seal)
        return row
    except NotConverged as error:
        return Row(converged=False, reason=str(error))


def _numbers(scene: Scene) -> tuple[str, ...]:
    return ("contact", "leak_rate") if scene.needs_flow else ("contact",)
