"""Scenes: values are read as they are meant; contradictions are refused in one sentence."""

import re
from dataclasses import fields
from typing import get_args

import numpy as np
import pytest
from project import ROOT, write_toml

from fem_seal.contact import CONTACT_METHODS
from fem_seal.contact.halfspace import BASES, PRECISIONS
from fem_seal.errors import InvalidInput, InvalidScene
from fem_seal.finite_difference.links import LINKS
from fem_seal.patch import SURFACES
from fem_seal.quantities.of_patch import QUANTITIES, Quantities
from fem_seal.quantities.uncertainties import ASSUMPTIONS
from fem_seal.scene import Contact, Flow, Scene, Solid
from fem_seal.scene.files import override
from fem_seal.scene.scene import KINDS
from fem_seal.scene.sections import PRODUCTS, Product
from fem_seal.scene_steps import CONTACTS, FLOWS
from fem_seal.threshold import THRESHOLDS
from fem_seal.units import RateUnit, to_si

DOCUMENT = (ROOT / "docs/reference/scene.md").read_text()


@pytest.mark.parametrize(
    ("text", "unit", "si"),
    [
        ("5 um", "m", 5e-6),
        ("5 µm", "m", 5e-6),
        ("0.8um", "m", 0.8e-6),
        ("1 inch", "m", 0.0254),
        ("2 MPa", "Pa", 2e6),
        ("1 bar", "Pa", 1e5),
        ("10 N/mm^2", "Pa", 1e7),
        ("1 mPa s", "Pa s", 1e-3),
        ("1 cP", "Pa s", 1e-3),
        ("10 min", "s", 600.0),
        ("2 GB", "byte", 2e9),
        ("-3 um", "m", -3e-6),
        (7, "m", 7.0),
        (np.int64(7), "m", 7.0),
        (np.float32(0.5), "m", 0.5),
        ("2 hours", "s", 7200.0),
        ("3 inches", "m", 0.0762),
    ],
)
def test_units_are_exact(text, unit, si):
    """To the last digit: a scene in units and one in SI numbers are the same scene."""
    assert to_si(text, unit) == si


def test_pound_per_square_inch():
    """1 lbf = 0.45359237 kg x 9.80665 m/s^2 by definition; two roundings."""
    assert to_si("1 psi", "Pa") == pytest.approx(0.45359237 * 9.80665 / 0.0254**2, rel=4e-16)


@pytest.mark.parametrize(
    ("value", "unit", "message"),
    [
        *((text, "m", "5 um") for text in ("5", "5 um um", "5 Pa", "five um", "um", "")),
        ("5,0 um", "m", "has a comma; write 0.5 for a half and 1000 for a thousand"),
        *((value, "m", "5 um") for value in ("5 um)", "@ m", "5 -", "5 m/0", True, None, [5])),
        # What has no dimension is not all one unit: 80 % of the memory is not 0.8 bytes.
        *((text, "rad", "is not in a unit of rad") for text in ("5 %", "1 GB")),
        ("80 %", "byte", "is not in a unit of byte"),
        # Symbols have no plural: MPas could be MPa or MPa s.
        *((f"1 {name}", "Pa", "has an unknown unit") for name in ("MPas", "mPas", "% Pa")),
        ("3 ss", "s", "has an unknown unit"),
        *((value, "m", "is larger than any number") for value in (10**400, "1e9999999 um")),
        # Pint's px is a 96th of an inch; of a map it would be the distance of the samples.
        *((text, "m", "is in pixels") for text in ("5 px", "5 um/px", "5 pixels", "5 points")),
    ],
)
def test_what_is_no_quantity(value, unit, message):
    with pytest.raises(ValueError, match=message):
        to_si(value, unit)


@pytest.mark.parametrize(
    ("unit", "kind", "size"),
    [
        ("ml/h", "volume", 1e-6 / 3600),
        ("l/min", "volume", 1e-3 / 60),
        ("mbar l/s", "throughput", 0.1),
        ("Pa m^3/s", "throughput", 1.0),
        ("W", "throughput", 1.0),
        ("umol/h", "amount", 1e-6 / 3600),
        ("g/year", "mass", 1e-3 / (365.25 * 86400)),
    ],
)
def test_units_of_leak_rates(unit, kind, size):
    """Tolerance: two roundings, of pint's decimal quotient and of the expected value."""
    rate_unit = RateUnit.parse(unit)
    assert (rate_unit.name, rate_unit.kind) == (unit, kind)
    assert rate_unit.size == pytest.approx(size, rel=4e-16)


def test_contradictions_of_several_sections(small_scene):
    small_scene["limit"] = {"leak_rate": "1 g/h"}
    small_scene["flow"] |= {"method": "finite-difference"}
    small_scene["output"] = {"products": ["leak_rate", "mesh"]}
    del small_scene["solid"]
    with pytest.raises(InvalidScene) as caught:
        Scene.from_mapping(small_scene)
    assert len(caught.value.errors) == 3
    assert caught.value.lines[0] == "the scene has 3 errors:"


def test_file_with_a_byte_order_mark(small_scene, tmp_path):
    path = write_toml(tmp_path / "scene.toml", small_scene)
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    assert Scene.from_file(path) == Scene.from_mapping(small_scene)


def test_contact_modulus_of_one_and_two_solids(small_scene):
    """Johnson, Contact Mechanics (1985), eq. 4.24: equal solids halve, a stiff one drops out.

    One solid meets a rigid face: E* = E/(1 - ν²).
    """
    equal = Solid(youngs_modulus=(3.0, 3.0), poisson_ratio=(0.5, 0.5))
    assert equal.E_star == pytest.approx(2.0, rel=1e-15)
    alone = Solid(youngs_modulus="3 Pa", poisson_ratio=0.3)
    against = Solid(youngs_modulus=(3.0, 3e20), poisson_ratio=(0.3, 0.5))
    assert [alone.E_star, against.E_star] == pytest.approx([3 / 0.91] * 2, rel=1e-15)
    assert alone == Solid(youngs_modulus=[3.0], poisson_ratio=[0.3])
    scene = Scene.from_mapping(small_scene | {"solid": alone.model_dump(exclude_none=True)})
    assert Scene.from_mapping(scene.to_mapping()) == scene


def test_layer_of_one_solid():
    """E* and ν of the layer are those of its solid; without a solid ν is 0.5."""
    layer = Solid(youngs_modulus=1e7, poisson_ratio=0.4, layer_thickness=1e-3).elastic
    assert layer.contact_modulus == pytest.approx(1e7 / 0.84, rel=1e-15)
    assert layer.layer.poisson_ratio == 0.4
    assert Solid(contact_modulus=1e7, layer_thickness=1e-3).elastic.layer.poisson_ratio == 0.5


def test_numbers_of_numpy(small_scene):
    scene = Scene.from_mapping(small_scene)
    changes = {"surface.seed": 3, "surface.hurst": 0.5, "surface.shape": (64, 64)}
    kinds = {"surface.seed": np.int64, "surface.hurst": np.float32, "surface.shape": np.uint8}
    of_numpy = {name: kinds[name](value) for name, value in changes.items()}
    of_numpy["surface.shape"] = tuple(of_numpy["surface.shape"])
    assert scene.with_(of_numpy) == scene.with_(changes)


def test_override(small_scene, tmp_path):
    path = write_toml(tmp_path / "scene.toml", small_scene)
    changed = Scene.from_file(
        path,
        ["flow.rtol=0.02", "surface.rms_slope=", "surface.rms_height=0.3 um", "flow.sides=wall"],
    )
    assert changed.flow.rtol == 0.02
    assert changed.flow.sides == "wall"
    assert (changed.surface.rms_slope, changed.surface.rms_height) == (None, 0.3e-6)
    assert changed.solid == Scene.from_file(path).solid


def test_a_list_without_the_quotes_the_shell_has_eaten(small_scene, tmp_path):
    path = write_toml(tmp_path / "scene.toml", small_scene)
    changed = Scene.from_file(path, ["output.products=[leak_rate, contact]"])
    assert (
        changed.output.products
        == Scene.from_file(path, ['output.products=["leak_rate","contact"]']).output.products
    )
    crop = override({}, "surface.crop=[[0 um,20 um], [0 um,3]]")["surface"]["crop"]
    assert crop == [["0 um", "20 um"], ["0 um", 3]]


def test_paths_count_from_the_scene_file(small_scene, tmp_path, here):
    (tmp_path / "data").mkdir()
    np.savez(tmp_path / "data" / "gap.npz", gap=np.ones((3, 3)), spacing=[1, 1])
    scene = {"gap": {"path": "gap.npz"}, "output": {"products": ["contact"]}}
    path = write_toml(tmp_path / "data" / "scene.toml", scene)
    assert Scene.from_file("data/scene.toml").gap.path == path.parent / "gap.npz"


def test_short_cut_off_of_one_sample_is_allowed(small_scene):
    """The letter's own choice, λ_s = 1 pixel; one part in a million below it is not."""
    small_scene["surface"]["short_wavelength"] = "1 um"
    assert Scene.from_mapping(small_scene).surface.short_wavelength == 1e-6
    small_scene["surface"]["short_wavelength"] = "0.999999 um"
    with pytest.raises(InvalidInput, match="finer than the grid"):
        Scene.from_mapping(small_scene)


@pytest.mark.parametrize("section", ["surface", "solid", "fluid"])
def test_missing_section(small_scene, section):
    del small_scene[section]
    with pytest.raises(InvalidInput, match=rf"\[{section}\] is missing"):
        Scene.from_mapping(small_scene)


@pytest.mark.parametrize("section", ["surface", "solid", "contact"])
def test_gap_stands_in_place_of_the_contact(small_scene, section, scene_of_gap):
    scene = scene_of_gap(np.ones((3, 3)), **{section: small_scene[section]})
    with pytest.raises(InvalidInput, match=rf"stands in place of \[{section}\]"):
        Scene.from_mapping(scene)


def test_choices_are_those_that_exist():
    """The scene names the choices without importing what is chosen; here they are compared."""

    def choices(section, field):
        return set(get_args(section.model_fields[field].annotation))

    assert {name for kind in KINDS for name in choices(kind, "kind")} == set(SURFACES)
    assert choices(Contact, "solver") == set(CONTACT_METHODS)
    assert choices(Contact, "model") == set(CONTACTS)
    assert set(CONTACTS) == set(ASSUMPTIONS) == set(THRESHOLDS) - {"gap"}
    assert choices(Contact, "precision") == set(PRECISIONS)
    assert choices(Solid, "layer_base") == set(BASES)
    assert choices(Flow, "links") == set(LINKS)
    assert choices(Flow, "method") == set(FLOWS)


@pytest.mark.parametrize("kind", KINDS)
def test_fields_by_which_a_surface_is_scaled_and_drawn_again(kind):
    """Each kind names fields of its own: [tolerances] scales the heights, [seal] draws patches."""
    named = {*kind.proportional, kind.seed_field}
    assert kind.proportional
    assert named <= set(kind.model_fields)


def test_quantities_are_products_of_the_page():
    products = set(get_args(Product))
    assert products == set(PRODUCTS)
    assert {field.name for field in fields(Quantities)} == set(QUANTITIES) <= products
    assert products <= set(re.findall(r"^\| `(\w+)` \|", DOCUMENT, re.MULTILINE))


def test_links_in_a_circle(tmp_path, small_scene):
    """Files that lead back to themselves are named, as any other input that is no file."""
    (tmp_path / "one").symlink_to("two")
    (tmp_path / "two").symlink_to("one")
    small_scene["surface"] = {"kind": "file", "path": "one"}
    with pytest.raises(InvalidScene, match=r"surface\.path = 'one' is not a file"):
        Scene.from_mapping(small_scene, folder=tmp_path)
