"""Scenes with a [shape], from the file to the leak rate, against exact answers."""

import numpy as np
import pytest
from mesh_files import scene_of, write_msh
from project import ROOT, SMALL_PICTURES, leak_rate, printed_by, unwrapped, write_toml
from sample_gaps import FLUID
from scipy.integrate import trapezoid

from fem_seal import run
from fem_seal.cli import main
from fem_seal.errors import InvalidInput, MissingPackage
from fem_seal.film import GridFilm
from fem_seal.flow import Limits
from fem_seal.grid import GridField
from fem_seal.patch import Patch
from fem_seal.quantities.of_patch import quantities
from fem_seal.results import Result, read_flow
from fem_seal.results.words import contact_words
from fem_seal.scene import Scene
from fem_seal.shaped import shaped_film
from fem_seal.solved import solve
from fem_seal.theory.closed_forms import disc_array

RING = {"kind": "face-seal", "inner_radius": 1, "outer_radius": 2, "mesh_size": 0.25}
STRIP = {"kind": "strip", "length": 2, "width": 1, "mesh_size": 0.2}
PLATE = {"kind": "plate-with-holes", "holes": [1, 2], "radius": 0.3}


def scene(shape: dict, products=("leak_rate",), **flow: object) -> dict:
    """Scene in which K = g³ and Δp = 1."""
    return {
        "shape": shape,
        "fluid": {"viscosity": 1 / 12},
        "flow": {"pressure_drop": 1} | flow,
        "output": {"products": list(products)},
    }


def solved(shape: dict, *, trust: bool = False, **flow: object):
    return Patch(Scene.from_mapping(scene(shape, **flow)), trust=trust).leak_rate


def fewest_sides(gap) -> float:
    """Sides of a circle of radius 1 whose longest edge is that of the mesh's rim."""
    edges = np.concatenate([ends for _, ends in gap.mesh.groups()])
    ends = gap.mesh.xy[edges]
    on_circle = np.abs(np.hypot(*ends.mean(axis=1).T) - 1) < 0.05
    longest = np.linalg.norm(ends[on_circle, 0] - ends[on_circle, 1], axis=1).max()
    return np.pi / np.arcsin(longest / 2)


def ring_of(inner: float, outer: float) -> float:
    """Conductance of a film of K = 1 between two circles: rings in series, ∫ dr/(2π r)."""
    return 2 * np.pi / np.log(outer / inner)


def test_face_seal():
    """Edges are chords: each polygon lies between its circle and the one that touches its sides,
    and the leak rate grows with the hole and falls with the rim. Orders: flow/test_shapes.py."""
    shape = Scene.from_mapping(scene(RING | {"mesh_size": 0.125, "gap": 1})).shape
    gap = shaped_film(shape, None)
    flow = leak_rate(gap, method="uniform", limits=Limits(unknowns=1), rtol=1e-9, **FLUID)
    inside = np.cos(np.pi / fewest_sides(gap))
    assert flow.lower <= ring_of(1.0, 2.0 * inside)
    assert flow.upper >= ring_of(1.0 * inside, 2.0)
    # Of flow and polygon, each the square of an edge's angle, which is 0.125 at most.
    assert flow.upper / flow.lower < 1 + 2 * 0.125**2


def test_gap_of_a_sector_that_grows_with_the_angle():
    """The flow is radial if the gap depends on theta alone: Q = ∫ g³ dtheta / ln(r_out/r_in).

    Theta runs from 0 to the angle of the sector, beyond π as well.
    """
    angle = np.radians(300)
    shape = RING | {"kind": "sector", "angle": "300 deg", "mesh_size": 0.1}
    flow = solved({**shape, "gap_expression": "1 + theta"}, rtol=0.01)
    exact = ((1 + angle) ** 4 - 1) / 4 / np.log(2)
    # An edge of length h lies up to h²/8r inside its arc; δQ/Q = (δr/r)/ln 2 on either circle.
    # Theta bends by at most 1/r² <= 1, so that its interpolation is off by at most h²/8, and g³ by
    # three times that of g >= 1.
    slack = (0.1**2 / 8) * (1 + 1 / 4) / np.log(2) + 3 * 0.1**2 / 8
    assert flow.lower * (1 - slack) <= exact <= flow.upper * (1 + slack)


def test_plate_with_holes_is_the_array_of_discs():
    """Perrins, McKenzie and McPhedran (1979); polygons with n corners on a circle lie between it
    and the one of radius r cos(π/n). Holes beside each other have walls of their own."""
    length, width, size = 1.0, 2.0, 0.06
    plate = PLATE | {"length": length, "width": width, "mesh_size": size, "gap": 1}
    flow = solved(plate, rtol=0.01)
    inside = np.sqrt(1 - (size / 2 / 0.3) ** 2)
    full, less = (disc_array(np.pi * r**2) * width / length for r in (0.3, 0.3 * inside))
    assert flow.lower <= less
    assert flow.upper >= full
    assert flow.upper / flow.lower < 1.011
    assert less / full < 1.01


WEDGE = GridField(np.add.outer(1 + np.arange(9) / 4, np.arange(5) / 8), (0.25, 0.25))
ROUGH = GridField(np.maximum(0, np.random.default_rng(8).normal(0.7, 0.5, (17, 9))), (0.125, 0.125))


@pytest.mark.parametrize(("kind", "grid"), [("strip", WEDGE), ("rectangle", ROUGH)])
def test_gmsh_mesh_and_pixel_mesh_of_one_gap(kind, grid, tmp_path):
    """A plane gap is the same function on any triangles, a rough one on those of the pixels, which
    `rectangle` makes: both brackets hold one number."""
    np.savez(tmp_path / "gap.npz", gap=grid.values, spacing=grid.spacing)
    shape = STRIP | {"kind": kind, "mesh_size": grid.spacing[0]}
    data = scene(shape, rtol=0.02) | {"gap": {"path": str(tmp_path / "gap.npz")}}
    patch = Patch(Scene.from_mapping(data))
    if kind == "rectangle":
        steps = np.rint(patch.film.mesh.xy / grid.spacing).astype(int)
        # gmsh places its vertices to 1e-11 of the strip; contact must be exactly 0 all the same.
        found, expected = patch.film.values, grid.values[tuple(steps.T)]
        np.testing.assert_allclose(found, expected, atol=1e-9)
        np.testing.assert_array_equal(found == 0, expected == 0)
    on_mesh = patch.leak_rate
    on_grid = leak_rate(GridFilm(grid), rtol=0.02, **FLUID)
    assert on_mesh.lower <= on_grid.upper
    assert on_grid.lower <= on_mesh.upper
    assert on_mesh.converged


def test_grid_gap_in_polar_coordinates(tmp_path):
    """g = r on a face seal: Q = 2πΔp / ∫dr/(r g³) = 6π/(1 - 1/8); the mesh's error is h²."""
    n = 90
    gap = np.repeat((1 + np.arange(11) * 0.1)[:, None], n, axis=1)
    np.savez(tmp_path / "gap.npz", gap=gap, spacing=(0.1, 2 * np.pi / n))
    shape = RING | {"mesh_size": 0.08, "grid": "polar", "grid_origin": [1, 0]}
    data = scene(shape, rtol=0.01) | {"gap": {"path": str(tmp_path / "gap.npz")}}
    patch = Patch(Scene.from_mapping(data))
    np.testing.assert_allclose(patch.film.values, np.hypot(*patch.film.mesh.xy.T), rtol=1e-12)
    assert patch.leak_rate.value == pytest.approx(6 * np.pi / (1 - 1 / 8), rel=0.01)


def origin_of(**fields: object) -> tuple[float, float]:
    shape = Scene.from_mapping(scene(RING | fields) | {"gap": {"path": __file__}}).shape
    return shape.grid_origin


def test_origin_of_a_grid_has_the_units_of_its_axes():
    """A polar grid begins at a radius and an angle, a plane one at two lengths."""
    polar = origin_of(grid="polar", grid_origin=["20 mm", "17 deg"])
    # One rounding of pi, one of the product.
    assert polar == (0.02, pytest.approx(np.radians(17), rel=1e-15))
    assert origin_of(grid="polar", grid_origin=[0.02, -0.5]) == (0.02, -0.5)
    assert origin_of(grid_origin=["20 mm", "-3 mm"]) == (0.02, -0.003)


def test_contact_of_a_scene_in_another_shape(small_scene):
    """A contact solved on its square, of which the strip is a part."""
    strip = {"kind": "strip", "length": "31 um", "width": "15 um", "mesh_size": "1 um"}
    data = small_scene | {"shape": strip | {"smallest_size": "0.5 um"}}
    data["flow"] = {"pressure_drop": "1 bar", "rtol": 0.2}
    data["output"] = {"products": ["contact", "leak_rate"]}
    patch = Patch(Scene.from_mapping(data))
    assert patch.leak_rate.lower <= patch.leak_rate.upper
    assert 0 < patch.film.contact_area_fraction < 0.5
    # Linear between points up to a sample apart the gap errs by slope × wave number × sample²/8,
    # 12 % of its mean, of either sign in each of the strip's 29 squares of the shortest wavelength.
    mean = trapezoid(trapezoid(patch.grid_gap.values[:, :16])) / (31 * 15)
    assert patch.film.mean_gap == pytest.approx(mean, rel=0.12 / np.sqrt(29))


def test_constriction_and_verdict_of_a_shape():
    """A ring with contact all around but for a gate at theta = 0, half as high at r = 1.5, between
    banks at y = -0.2 and 0.2; most of the pressure is lost within its width."""
    gate = "max(0, 1 - (y / 0.2)**2) * (0.5 + 2 * (r - 1.5)**2) * max(0, tanh(1e9 * x))"
    size = 0.05
    data = scene(RING | {"mesh_size": size, "gap_expression": gate}, products=("constriction",))
    found = quantities(Patch(Scene.from_mapping(data))).constriction
    # Edges are up to 1.4 sizes long, and a vertex lies within half of one of the gate's middle:
    # 1 - (y / 0.2)² is 3 % lower there. The vertices in contact lie on its banks or an edge beyond.
    assert found.gap == pytest.approx(0.5, rel=(0.7 * size / 0.2) ** 2)
    assert (found.x, found.y) == pytest.approx((1.5, 0.0), abs=0.7 * size)
    assert 0.4 <= found.width <= 0.4 + 2 * size
    assert 0.5 < found.pressure_share < 1
    limited = scene(RING | {"gap": 1}) | {"limit": {"leak_rate": "100 m^3/s"}}
    solved = solve(Scene.from_mapping(limited))
    assert solved.verdict.decision == "within limit"
    assert solved.quantities.constriction.width is None  # no bank anywhere
    assert contact_words(solved.result()).startswith("0 % of the shape's area, mean gap 1 m")


@pytest.mark.parametrize(
    ("length", "width", "squares"), [(2, 1.49, 4), (3, 1, 8), (3 * 0.1, 0.1, 3)]
)
def test_no_side_of_a_square_is_longer_than_the_mesh_size(length, width, squares):
    """As few as are no longer, where sides of 1.49 were made for 1; 3 * 0.1 > 0.3 is rounding."""
    size = {2: 1, 3: 0.99, 3 * 0.1: 0.1}[length]
    shape = {"kind": "rectangle", "length": length, "width": width, "mesh_size": size, "gap": 1}
    film = shaped_film(Scene.from_mapping(scene(shape)).shape, None)
    assert len(film.mesh.cells) == 2 * squares


@pytest.mark.parametrize("kind", ["rectangle", "strip"])
def test_a_channel_tightest_in_the_corner_of_an_end_and_a_wall(kind):
    """Its other side is the other wall, exactly as far as the strip is wide, and not the next
    vertex of the same wall."""
    strip = {"kind": kind, "length": 4, "width": 1, "mesh_size": 0.1}
    data = scene(strip | {"gap_expression": "2 - x / 4 - y / 8"}, products=("constriction",))
    found = quantities(Patch(Scene.from_mapping(data))).constriction
    assert (found.x, found.y, found.gap) == (4, 0, 1)
    assert found.width == pytest.approx(1, rel=1e-6)


def test_bolts_of_the_flange_lower_its_leak_rate():
    """Six islands in a ring that is cut open: less than without bolts, and about what few discs
    of the same area do to a plane (Maxwell), for they are far from one another and the rims.

    Left out are the square of their share, 0.004, the images of each in both rims, (3.5/20)² of
    its effect of 0.12, which is 0.004 each, and half of the bracket, 0.01.
    """
    shape = {"kind": "file", "path": str(ROOT / "meshes" / "flange.geo"), "unit": "mm", "gap": 1}
    flow = solved(shape, rtol=0.02)
    ring = ring_of(20.0, 40.0)
    share = 6 * 3.5**2 / (40**2 - 20**2)
    assert flow.upper < ring
    assert flow.value == pytest.approx((1 - share) / (1 + share) * ring, rel=0.022)


GEO = """
Point(1) = {0, 0, 0, 300}; Point(2) = {2000, 0, 0, 300};
Point(3) = {2000, 1000, 0, 300}; Point(4) = {0, 1000, 0, 300};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};
Curve Loop(1) = {-4, -3, -2, -1}; Plane Surface(1) = {1};
Physical Curve("left") = {4}; Physical Curve("right") = {2}; Physical Curve("rest") = {1, 3};
Physical Surface("film") = {1};
"""
NAMES = {"inlet": "left", "outlet": "right", "wall": "rest"}


def test_own_geometry(tmp_path):
    """Other names of groups, capitals, millimetres, a clockwise curve loop; Q = K Δp W/L.

    The pressure is linear: what is left is the energy error of CG, 1e-8.
    """
    (tmp_path / "OWN.GEO").write_text(GEO)
    shape = {"kind": "file", "path": str(tmp_path / "OWN.GEO"), "unit": "mm", "gap": 1}
    flow = solved(shape | NAMES, rtol=1e-6, trust=True)
    assert flow.value == pytest.approx(0.5, rel=1e-8)
    finer = Scene.from_mapping(scene(shape | NAMES | {"mesh_size": "100 mm"})).shape
    assert len(shaped_film(finer, None, trust=True).mesh.cells) > 300


def test_own_geometry_with_sizes_that_follow_its_channels(tmp_path):
    """Fine beside the contact at y < 200 mm, coarse in the open."""
    (tmp_path / "own.geo").write_text(GEO)
    sizes = {"mesh_size": "300 mm", "smallest_size": "20 mm", "unit": "mm"}
    shape = {"kind": "file", "path": str(tmp_path / "own.geo")} | NAMES | sizes
    section = Scene.from_mapping(scene(shape | {"gap_expression": "max(0, y - 0.2)"})).shape
    mesh = shaped_film(section, None, trust=True).mesh
    middle, length = mesh.xy[mesh.cells].mean(axis=1), np.sqrt(mesh.doubled_areas())
    beside = np.abs(middle[:, 1] - 0.27) < 0.1  # a tenth of the mean gap lies at y = 0.23
    assert np.median(length[beside]) < 0.08
    assert np.median(length[middle[:, 1] > 0.8]) > 0.15


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("Point(1) = {0, 0, 0; ", "gmsh cannot mesh .*own.geo: .*syntax error"),
        (
            GEO.replace('"left"', '"lefty"'),
            "own.geo has no boundary edges in a group 'left'; it has lefty",
        ),
        ("Point(1) = {0, 0, 0};", "own.geo(: does it have a surface| has no triangles)"),
    ],
)
def test_bad_geometry(text, words, tmp_path):
    (tmp_path / "own.geo").write_text(text)
    data = scene_of(tmp_path / "own.geo", **NAMES)
    with pytest.raises(InvalidInput, match=words) as error:
        shaped_film(Scene.from_mapping(data).shape, None, trust=True)
    assert "\n" not in str(error.value)


def test_gmsh_is_missed_before_the_work(monkeypatch, tmp_path):
    found = {"gmsh": None}
    monkeypatch.setattr("fem_seal.products.find_spec", lambda name: found.get(name, name))
    with pytest.raises(MissingPackage, match=r"meshing a \[shape\] needs gmsh"):
        run(Scene.from_mapping(scene(RING | {"gap": 1})), tmp_path / "out")


def test_meshes_that_nobody_could_make(tmp_path):
    """A strip of 2 by 1 takes 4.6/h² triangles and some along its rim: 1e8 at h = 2.15e-4."""
    strip = STRIP | {"gap": 1}
    assert Scene.from_mapping(scene(strip | {"mesh_size": 2.2e-4}))
    (tmp_path / "own.geo").write_text(GEO)
    with pytest.raises(InvalidInput, match=r"mesh_size = 0.00021 m would take about 1e\+08 tri"):
        Scene.from_mapping(scene(strip | {"mesh_size": 2.1e-4}))
    own = scene_of(tmp_path / "own.geo", mesh_size=1e-30, unit="mm")["shape"]
    with pytest.raises(InvalidInput, match=r"5e-31 of the extent of .*own.geo; choose"):
        shaped_film(Scene.from_mapping(scene(own)).shape, None, trust=True)
    with pytest.raises(InvalidInput, match="is meshed already"):
        Scene.from_mapping(scene_of(write_msh(tmp_path / "a.msh"), mesh_size=1))


@pytest.mark.render
def test_run_and_render(tmp_path):
    """run writes what its result says; render draws."""
    path = write_toml(tmp_path / "ring.toml", scene(RING | {"gap": "5 um"}, ("leak_rate", "mesh")))
    assert main(["run", str(path), "--out", str(tmp_path / "a")]) == 0
    result = Result.from_folder(tmp_path / "a")
    drawn = {"flow.png", "gap.png", "shape.png"}
    assert set(result.files) == {"flow.vtu", "mesh.vtu"}
    field = read_flow(tmp_path / "a")
    outwards = (field.flux * field.points[field.cells].mean(axis=1)).sum(axis=1)
    assert (outwards > 0).all()
    # j = Q/(2π r), as far as edges of h = 0.25 resolve 1/r: to h².
    assert outwards.mean() == pytest.approx((5e-6) ** 3 / np.log(2), rel=0.25**2)
    assert main(["render", str(tmp_path / "a")]) == 0
    assert drawn <= {p.name for p in (tmp_path / "a").iterdir()}


@pytest.mark.render
def test_meshing_needs_no_finite_elements(tmp_path):
    """A mesh is made, drawn and described where FEniCSx is not installed."""
    path = write_toml(tmp_path / "ring.toml", scene(RING | {"gap": "5 um"}))
    code = (
        "import sys; sys.modules |= dict.fromkeys(('dolfinx', 'ufl', 'petsc4py'))\n"
        f"{SMALL_PICTURES}\n"
        "from fem_seal.cli import main; sys.exit(main(sys.argv[1:]))"
    )
    said = unwrapped(printed_by("-c", code, "mesh", path, "--out", tmp_path / "out"))
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"gap.png", "mesh.vtu", "shape.png"}
    # Lengths with the prefix that suits them, as everywhere.
    words = dict(line.split(maxsplit=1) for line in said.splitlines())
    assert "triangles" in words["mesh"]
    assert words["extent"] == "-2 m to 2 m by -2 m to 2 m"
    assert words["gap"] == "5 um to 5 um, mean 5 um"
    assert words["tightest"].startswith("5 um high, at x = ")
