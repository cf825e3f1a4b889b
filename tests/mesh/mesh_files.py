"""Small mesh files, whole and broken, and the scenes that name them."""

from pathlib import Path

import numpy as np
from project import leak_scene

CORNERS = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.5]], dtype=float)
CELLS = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
EDGES = {"inlet": [[3, 0]], "outlet": [[1, 2]], "wall": [[0, 1], [2, 3]]}


def write_msh(
    path: Path, points=CORNERS, cells=CELLS, edges=EDGES, heights=0.0, kind="triangle", line="line"
) -> Path:
    """MSH 2.2, by hand: what meshio would refuse to write can be written as well."""
    types = {"line": 1, "triangle": 2, "line3": 8, "triangle6": 9, "quad": 3}
    points = np.column_stack([points, np.broadcast_to(heights, len(points))])
    rows = [
        [types[line], k + 1, *np.add(edge, 1)]
        for k, group in enumerate(edges.values())
        for edge in group
    ] + [[types[kind], 9, *np.add(cell, 1)] for cell in cells]
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(edges) + 1)]
    lines += [f'1 {k + 1} "{name}"' for k, name in enumerate(edges)] + ['2 9 "film"']
    lines += ["$EndPhysicalNames", "$Nodes", str(len(points))]
    lines += [f"{k + 1} {x!r} {y!r} {z!r}" for k, (x, y, z) in enumerate(points.tolist())]
    lines += ["$EndNodes", "$Elements", str(len(rows))]
    lines += [
        f"{k + 1} {element} 2 {tag} {tag} {' '.join(map(str, nodes))}"
        for k, (element, tag, *nodes) in enumerate(rows)
    ]
    path.write_text("\n".join([*lines, "$EndElements"]) + "\n")
    return path


def scene_of(path: Path, **fields: object) -> dict:
    """Scene of a mesh file in metres with a uniform gap."""
    shape = {"kind": "file", "path": str(path), "unit": "m", "gap": 1e-6}
    return leak_scene(shape=shape | fields)
