"""What a scene may not say: one sentence for each, from the file to the message.

Ranges, choices and kinds of all fields: test_listings.py.
"""

import shutil

import numpy as np
import pytest
from lifted_scenes import scene as lifted_scene
from project import ROOT, leak_scene, write_toml

from fem_seal.errors import InvalidInput
from fem_seal.scene import Scene

RING = {"kind": "face-seal", "inner_radius": 1, "outer_radius": 2, "mesh_size": 0.25}
LEAK = "output.products=[leak_rate]"
STRAIGHT = "seal.leak_path=0.1 mm & seal.circumference=10 mm"
BY_AREA = "contact.pressure= & contact.area_fraction=0.1"
# Scenes that are right, to each of which something is done below: a file of demos/scenes, or the
# sections that are written into one, and what is set.
SCENES = {
    "contact": ("first", f"{BY_AREA} & flow.method=finite-difference & {LEAK}"),
    "map": ("blasted", "contact.pressure= & contact.model=bearing & contact.mean_gap=1 um"),
    "gas": ("helium", "fluid.slip=false"),
    "liquid": (leak_scene(gap={"path": "gap.npz"}), "limit.leak_rate=1 ml/h & limit.decide=false"),
    "lifted": (lifted_scene().to_mapping(), ""),
    "total": ("first", f"{BY_AREA} & flow.rtol= & accuracy.total=0.2"),
    "shape": (leak_scene(shape=RING), ""),
    "seal": ("leak-experiment", "seal.inlet_radius= & seal.outlet_radius= & " + STRAIGHT),
    "tensor": ("tensor", ""),
}
MODULI = "solid.contact_modulus= & solid.youngs_modulus="
LAYER = "solid.layer_thickness=1"
ENDS = "flow.pressure_drop= & flow.inlet_pressure={} & flow.outlet_pressure={}"
NO_RADII = "shape.inner_radius= & shape.outer_radius= & shape.length=2 & shape.width=1"
BOX = f"shape.kind=rectangle & {NO_RADII} & shape.mesh_size="
PLATE = f"shape.kind=plate-with-holes & {NO_RADII} & shape.holes=[2, 1] & shape.gap=1 & "
POLAR = "gap.path=gap.npz & shape.grid=polar & shape.grid_origin="
WITHOUT_LOAD = "output.products=['sensitivity'] & contact.pressure= & contact.area_fraction=0.2 & "
RADII = "seal.inlet_radius=2 mm & seal.outlet_radius=2.1 mm"
HERTZ = "contact.pressure= & seal.pressure_profile=hertz & "
CYLINDER = "seal.line_load=1 kN/m & seal.cylinder_radius=2 mm"
TABLE = "seal.leak_path= & seal.pressure_profile=profile.csv"
LEAK_UNIT = "output.leak_rate_unit="
# Assignments, with & between them, and what is said of them.
BAD = {
    "contact": {
        "flow.rtoll=1": "flow.rtoll is not a known key; did you mean rtol",
        "flows.rtol=1": "flows is not a known key; did you mean flow",
        "surface.hurts=1": "did you mean hurst",
        "contact.area=1": "did you mean area_fraction",
        "contact.gap=1": r"it belongs in \[shape\], or did you mean mean_gap",
        "surface.path=a.npz": "it belongs to surface.kind = 'file' or 'profiles'",
        "solid.xyz=1": "known are contact_modulus, youngs_modulus, poisson_ratio",
        "surface.hurst=": "surface.hurst is missing",
        "surface.kind=wavy": "surface.kind = 'wavy' is not allowed; choose from 'self-affine', 'fi",
        "surface.kind=": "surface.kind is missing",
        "surface.shape=[32]": r"surface.shape\[1\] is missing",
        "surface.shape=[32, 32, 32]": "surface.shape = .* at most 2",
        "surface.shape=[32, 0]": r"surface.shape\[1\] = 0 must be at least 1",
        "surface.shape=[32, 31.5]": r"surface.shape\[1\] = 31.5 must be a valid integer",
        "surface.shape=32": r"= 32 must be a list in square brackets \(samples \[nx, ny\]\)",
        "surface.size=[1e-5, '1 s']": r"surface.size\[1\] = '1 s' is not in a unit of m",
        "surface.short_wavelength=0.3 um": "short_wavelength = 300 nm is finer than the grid",
        "surface.rms_height=1 um": "exactly one of rms_height, rms_slope; got rms_height and rms_s",
        "surface.rms_slope=": "exactly one of rms_height, rms_slope; got none",
        "solid.contact_modulus=inf": "solid.contact_modulus = inf must be a finite number",
        "solid.contact_modulus=": "exactly one of contact_modulus, youngs_modulus; got none",
        "solid.poisson_ratio=[0.3, 0.3]": "belong together",
        "contact.area_fraction=1": "contact.area_fraction = 1 must be less than 1",
        "contact.pressure=1 MPa": "exactly one of pressure, area_fraction, mean_gap; got pressure",
        "contact.area_fraction=": "exactly one of pressure, area_fraction, mean_gap; got none",
        "contact.threads=5000": "contact.threads = 5000 must be at most 1024",
        "flow.pressure_drop=": "flow.pressure_drop is missing",
        "flow.sides=open": "flow.sides = 'open' is not allowed; choose from 'wall' or 'periodic'",
        "flow.rtol=1e-301": "flow.rtol = 1e-301 is closer to 0 than 1e-300",
        "solid.contact_modulus=1e-305 Pa": "solid.contact_modulus = '1e-305 Pa' is closer to 0",
        "output.products=['contact', 'contact']": "must name each product once",
        "flow.rtol=five": "flow.rtol = 'five' must be a number",
        "flow.max_seconds=5 s": "max_seconds ends a refinement, and flow.method = 'finite-di",
        "output.products=[]": r"output.products = \[\] is too short: give at least 1 value$",
        "output.products=['leak']": r"output.products\[0\] = 'leak' is not allowed",
        "output.products=['mesh']": "finite-difference",
        "tolerances.heights='5 %'": "tolerances. compares bounds",
        "gap.path=none.npz": "gap.path = 'none.npz' is not a file",
        "contact.pressure.unit=3": "contact.pressure = .*Pa",
        "solid.contact_modulus=0,2 GPa": "'0,2 GPa' has a comma; write 0.5",
        "rtol=3": "not of the form section.key=value",
        "flow.rtol": "not of the form section.key=value",
        "contact.model=bearing & contact.area_fraction= & contact.pressure=1 MPa": "no elasticity",
        "contact.model=bearing & contact.tolerance=1e-3": "tolerance is of the iteration",
        "contact.model=bearing & contact.solver=fista": "solver is of the iteration",
        "contact.model=bearing & contact.max_iterations=9": "max_iterations is of the iteration",
        "contact.model=bearing & contact.precision=double": "precision is of the iteration",
        "contact.model=bearing & contact.threads=2": "threads is of the iteration",
        "flow.method= & flow.links=harmonic": "flow: links = 'harmonic' is for method = 'finite-di",
        MODULI + "[1, 2] & solid.poisson_ratio=[0.5, 0.3] & " + LAYER: "is for one solid",
        MODULI + "1e7 & solid.poisson_ratio=[0.5, 0.3]": "is that of one solid, and",
        MODULI + "1 & solid.poisson_ratio=0.4 & " + LAYER + " & solid.layer_poisson_ratio=0.5": (
            "layer_poisson_ratio = 0.5 and poisson_ratio = 0.4 are those of one layer"
        ),
        "solid.layer_base=sliding": "give its layer_thickness",
        "solid.layer_poisson_ratio=0.4": "give its layer_thickness",
        "output.leak_rate=1 ml/h": r"output\.leak_rate is not .* belongs in \[limit\]",
        "output.products=['seal']": r"\[seal\] is missing",
        # There is nothing to show in the unit.
        "output.leak_rate_unit=ml/h & output.products=['contact']": "is about the leak rate, which",
    },
    "gas": {
        "flow.pressure_drop=1 bar": "does not fix the flow of a gas, which goes as p_in² - p_out²",
        "flow.inlet_pressure=": "flow.inlet_pressure is missing: fluid.kind = 'gas' needs both",
        "flow.outlet_pressure=3 bar": "must be above flow.outlet_pressure",
        "fluid.molar_mass=": "fluid: molar_mass is missing: kind = 'gas' needs it",
        "fluid.temperature=": "fluid: temperature is missing",
        "fluid.temperature=-300 degC": "fluid.temperature = '-300 degC' must be greater than 0",
        "fluid.accommodation=0.5": "fluid: accommodation is for a gas that slips: leave out slip",
        # The table would need more digits than it has.
        "fluid.slip=kinetic & fluid.accommodation=0.05": "accommodation = 0.05 is below 0.1",
        "flow.ambient_pressure=1 bar": "on the back of an elastic solid, and the scene has none",
        "fluid.kind=liquid": "fluid: molar_mass is for kind = 'gas' only; this is a liquid",
    },
    "liquid": {
        LEAK_UNIT + "m/s": "output.leak_rate_unit = 'm/s' does not measure a leak rate",
        LEAK_UNIT + "litre": "output.leak_rate_unit = 'litre' does not measure a leak ra",
        LEAK_UNIT + "1 ml/h": "output.leak_rate_unit = '1 ml/h' ",
        LEAK_UNIT + "mol/s": "output.leak_rate_unit = 'mol/s' is an amount per time, bu",
        LEAK_UNIT + "mbar l/s": "'mbar l/s' is a pressure times a volume per time, but a",
        # Pint gives a byte and an angle no dimension, and has no logarithm of a volume. Its slm is
        # 1.68875 Pa m³/s: with the pressure times volume of a gas of 20 degC, a mass flow of 1 slm
        # would count as 1.073.
        LEAK_UNIT + "dB ml/h": "unknown unit",
        **dict.fromkeys((f"{LEAK_UNIT}{word} ml/h" for word in ("byte", "deg")), "does not"),
        **{
            LEAK_UNIT + unit: r"fluid\.reference_temperature"
            for unit in ("slm", "slpm", "sccm", "Nl/min", "std cm^3/min")
        },
        "limit.leak_rate=1 g/h": "limit.leak_rate in 'g/h' is a mass per time, but a liquid leaks",
        "limit.leak_rate=1 m": "limit.leak_rate = '1 m' does not measure a leak rate",
        "limit.leak_rate=1e300 m^3/s": r"limit.leak_rate = 1e\+300 m\^3/s cannot be a leak rate; c",
        "limit.leak_rate=1": "limit.leak_rate = 1 has no unit; a leak rate is written such as '1 m",
        "limit.leak_rate=1e-200 ml/h": "limit.leak_rate = 1e-200 ml/h cannot be a leak rate; check",
        "limit.leak_rate=true": "limit.leak_rate = True must be a leak rate such as",
        "limit.leak_rate=0 ml/h": "limit.leak_rate = '0 ml/h' must be greater than 0",
        "limit.leak_rate=": "limit.leak_rate is missing",
        "limit.decide=true": "limit.decide needs flow.max_unknowns",
        "flow.method=finite-difference": r"\[limit\] is decided by bounds",
        "output.products=['contact']": r"\[limit\] is about the leak rate",
        "flow.inlet_pressure=2": "not both",
        "flow.pressure_drop= & flow.inlet_pressure=2": "flow.outlet_pressure is missing",
        "flow.pressure_drop=": "flow.pressure_drop is missing",
        "flow.lift=resolved": "nothing to lift",
        "accuracy.total=0.1": "set flow",
    },
    "map": {
        "surface.missing=some": "surface.missing = 'some' must be a number as it stands",
        "surface.missing=true": "surface.missing = True must be a number as it stands",
        "surface.missing=[1.0]": "must be a number as it stands",
        "surface.unit=kg": "surface.unit = 'kg' is no unit of length such as 'nm', 'um' or 'mm'",
        "surface.size=['1 mm']": r"surface.size\[1\] is missing",
        "surface.crop=[[0, 1e-6], ['2 um', '1 um']]": "crop in y ends at 1e-06 m, and must",
        "surface.fill= & surface.max_missing=0.2": "max_missing is the most that fill may fill",
        "surface.periodic=no": "surface.periodic = 'no' must be a valid boolean",
        "surface.periodic=true & surface.make_periodic=cut": "needs no make_periodic",
    },
    "lifted": {
        "flow.lift=range & solid.layer_thickness=1e-5": "half-space",
        "flow.lift=range & contact.pressure= & contact.area_fraction=0.1": "contact.area_fraction",
        "flow.lift=range & contact.pressure= & contact.mean_gap=1e-7": "contact.mean_gap",
        "contact.model=bearing & contact.pressure= & contact.area_fraction=0.1": "no elasticity",
        "output.products=['contact'] & flow.lift=range": "is of the leak rate, which",
        "output.products=['contact'] & flow.pressure_drop=": r"needs \[fluid\] and the pressures",
        "output.products=['contact'] & flow.pressure_drop= & flow.inlet_pressure=2e5": (
            "flow.outlet_pressure is missing"
        ),
        ENDS.format(2e5, 5e4): "ambient_pressure is missing",
        "flow.ambient_pressure=1e5": "leave it out",
        BOX + "0.1 & flow.sides=wall": "needs the grid of a contact",
        BOX + "0.1 & flow.sides=wall & flow.lift=range": "needs the grid of a contact",
        # No derivative of an area, nor of a face that is cut.
        WITHOUT_LOAD + "flow.lift=none": "names 'sensitivity'",
        WITHOUT_LOAD + "flow.lift=none & contact.model=bearing": "names 'sensitivity'",
        "tolerances.contact.pressure=0 %": "leave out what you know exactly",
        "tolerances.contact.pressure=100 %": "below 100 %",
        "tolerances.contact.pressure=0.2 MPa": "100 % of the value or more",
        "contact.pressure=0 & tolerances.contact.pressure=0.1 MPa": "beside a value of 0",
        ENDS.format(2e5, 1.9e5) + " & flow.lift=none & tolerances.flow.inlet_pressure=10 %": (
            "let flow.inlet_pressure fall to 180000 Pa"
        ),
        "tolerances.contact.area_fraction=1 %": "not a known key",
        "tolerances.contact.pressure=1 um": "not in a unit of Pa",
        "tolerances.contact.pressure=0.1": "'10 %'",
        "tolerances.flow.inlet_pressure=1 %": "the scene does not use",
        "tolerances.seal.line_load=1 %": "the scene does not use",
        "flow.lift= & contact.model=bearing & contact.pressure= & contact.mean_gap=3 um & "
        "tolerances.solid.contact_modulus=5 %": "the scene does not use",
        # Higher ridges across the flow close the film, along it they open it: K is the mean of g³.
        "flow.lift=none & contact.pressure= & contact.mean_gap=3 um & tolerances.heights=5 %": (
            "may open or close the film"
        ),
        # A higher outlet pressure lifts the solid and drives less.
        ENDS.format(2e5, 1e5) + " & tolerances.flow.outlet_pressure=5 %": "that the fluid lifts;",
        "contact.pressure= & contact.mean_gap=3 um & flow.lift=resolved & "
        "tolerances.solid.contact_modulus=5 %": "without contact.pressure",
        # The contact under the load less a pressure changes by another factor than the dry one.
        "flow.lift=range & tolerances.contact.pressure=5 %": "moves both ends",
    },
    "total": {
        "accuracy.totl=0.1": "did you mean total",
        "output.products=['contact']": "output.products does not name",
        "flow.rtol=0.05": "chooses flow.rtol itself",
        "flow.method=finite-difference": "needs bounds",
        "accuracy.contact_grid=false": "accuracy.contact_grid = false leaves it out",
        "accuracy.total= & accuracy.max_refinement=2": "limits the grids that accuracy.total",
        "limit.leak_rate=1 ml/h & limit.decide=true & flow.max_unknowns=9": "both say when to stop",
    },
    "seal": {
        "output.products=['contact']": "does not name 'seal'",
        "output.products=['seal', 'leak_rate']": "'leak_rate' beside 'seal'",
        "flow.lift=resolved": "flow.lift = 'resolved' is for a single patch",
        "flow.method=finite-difference": "needs bounds",
        "flow.sides=wall": "walls between them",
        "accuracy.total=0.1": r"\[accuracy\] does not go with \[seal\]",
        "limit.leak_rate=1 ml/h & limit.decide=true": "set seal.rtol",
        "seal.pressure_profile=parabola": "uniform",
        "seal.pressure_profile=missing.csv": "is not a file",
        "seal.leak_path=": "leak_path is missing",
        "contact.pressure= & contact.area_fraction=0.2": r"needs contact\.pressure",
        "contact.pressure=0": r"needs contact\.pressure above 0",
        "flow.rtol=0.05": "flow.rtol is of a single patch; leave it out with .seal., and set seal.",
        TABLE: r"seal\.pressure_profile gives the load, and so does contact\.pressure",
        TABLE + " & contact.pressure= & tolerances.contact.pressure='10 %'": (
            "leave it out, and compare seals with other tables"
        ),
        "seal.window=['10 um', '10 um']": "for a random surface leave it out",
        "seal.leak_path= & " + RADII: "circumference must be left out: the radii of the ring",
        "seal.circumference= & " + RADII: "leak_path must be left out",
        "seal.leak_path= & seal.circumference= & " + RADII.replace("2.1", "2"): "must differ",
        "seal.inlet_radius=2 mm": "outlet_radius is missing: inlet_radius needs it",
        "contact.pressure= & seal.maximum_pressure=1 MPa": "is of a cylinder",
        HERTZ + "seal.line_load=1 kN/m": "cylinder_radius is missing",
        HERTZ + CYLINDER: "line_load and cylinder_radius give",
        HERTZ + "seal.maximum_pressure=1 MPa & " + CYLINDER: "both give the pressure",
        HERTZ + "seal.maximum_pressure=1 MPa & contact.pressure=1e5": (
            r"seal\.maximum_pressure gives the load, and so does contact\.pressure"
        ),
        HERTZ + "seal.patches=3": "exactly one of pressure, area_fraction, mean_gap; got none",
    },
    "tensor": {
        "flow.sides=wall": "repeats along both axes",
        "flow.method=uniform": "does not compute; choose adaptive",
        "flow.method=finite-difference": "does not compute; choose adaptive",
        "fluid.kind=gas & fluid.molar_mass=29 g/mol & fluid.temperature=293": (
            "inlet_pressure is missing: the conductivity tensor"
        ),
    },
    "shape": {
        "flow.rtol=0.1": r"\[surface\] is missing; give \[surface\] and \[contact\], or \[gap\]",
        "shape.gap=1 & shape.gap_expression=x": "gap and gap_expression are both given",
        "shape.gap=1 & gap.path=gap.npz": r"gap and so does \[gap\]",
        "shape.gap=1 & shape.grid=polar": "grid and grid_origin belong to a gap on a grid",
        "shape.gap_expression=x +": "is not an expression",
        "shape.gap_expression=open(x)": r"'open\(x\)' in .* is not allowed",
        "shape.gap=1 & shape.outer_radius=0.5": "1 m must be below outer_radius = 0.5 m",
        "shape.gap=1 & shape.smallest_size=3": "must not exceed mesh_size = 0.25 m",
        "shape.gap=1 & flow.sides=periodic": "flow.sides = 'periodic' is for a gap on a grid",
        "shape.gap=1 & flow.representation=constant": "'constant' is for a gap",
        "shape.gap=1 & flow.method=finite-difference": "'finite-difference' needs a grid",
        "shape.gap=1 & output.products=['conductivity_tensor']": "needs the grid of a contact",
        "shape.kind= & shape.gap=1": "shape.kind is missing; choose from 'rectangle' or 'strip' or",
        BOX + "0.1 & shape.gap=1 & shape.smallest_size=0.1": "squares are equal",
        PLATE + "shape.radius=0.6": "radius = 0.6 m must be below",
        PLATE + "shape.radius=0.2": "mesh_size = 0.25 m is longer than radius = 0.2 m",
        "shape.kind=file & shape.inner_radius= & shape.outer_radius= & shape.mesh_size= & "
        "shape.path=gap.npz & shape.unit=m & shape.inlet=1 & shape.outlet=1": "are both 1; give",
        "shape.gap=1 & shape.mesh_size=1.5": "1.5 m is longer than inner_radius = 1 m",
        "shape.gap=1 & shape.mesh_size=1e-300": "would take about inf triangles",
        "shape.gap=1 & shape.smallest_size=1e-300": "smallest_size = 1e-300 m would take about",
        "shape.gap=1 & shape.outer_radius=1e30": r"would take about 1e\+62 triangles",
        POLAR + "[1, '17 mm']": r"\[1\] = '17 mm' is not in a unit of rad",
        POLAR + "['1 rad', 0]": r"\[0\] = '1 rad' is not in a unit of m",
        POLAR + "[-1, 0]": "starts at a radius of -1 m, below 0",
        POLAR + "[0, '17 deg'] & shape.grid=": r"\[1\] = '17 deg' is not in a unit of m",
    },
}


@pytest.mark.parametrize(
    ("base", "change"), [(base, change) for base in BAD for change in BAD[base]]
)
def test_one_sentence(base, change, tmp_path):
    np.savez(tmp_path / "gap.npz", gap=np.ones((3, 3)), spacing=(1e-6, 1e-6))
    for name in ("blasted.nc", "profile.csv"):
        (tmp_path / name).touch()
    sections, settings = SCENES[base]
    path = tmp_path / "scene.toml"
    if isinstance(sections, str):
        shutil.copy(ROOT / "demos" / "scenes" / f"{sections}.toml", path)
    else:
        write_toml(path, sections)
    changes = [*filter(None, settings.split(" & "))]
    assert base == "shape" or Scene.from_file(path, changes)
    with pytest.raises(InvalidInput, match=BAD[base][change]) as caught:
        Scene.from_file(path, [*changes, *change.split(" & ")])
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("hurst = 0,8", "write a decimal point in place of a comma"),
        (r'path = "C:\Users\map.npz"', "write a path with / in place of"),
        ('"contact.pressure" = 1', "a dot in quotes is part of the key, write it without quotes"),
    ],
)
def test_lines_that_are_no_toml_or_other_toml(line, words, tmp_path):
    path = write_toml(tmp_path / "scene.toml", {})
    path.write_text(f"{line}\n")
    with pytest.raises(InvalidInput, match=words):
        Scene.from_file(path)
