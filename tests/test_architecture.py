"""The order of the package: imports point backwards; who may import heavy libraries."""

import ast
import re

import pytest
from project import PACKAGE, ROOT, imported, printed_by, trees

import fem_seal
from fem_seal.scene.scene import Surface
from fem_seal.scene.shape import AnyShape

# A module may import those before it, and its own folder.
LAYERS = """
errors installed interrupts files tables arguments digits graphs grid leak_rate error_budget memory
limits parallel worker progress units expression rarefied fluid flow_settings field_file gap_file
pressure_profile
surface contact
fenicsx mesh film theory finite_difference network
flow coupling
points scene new_scene shaped scene_steps lifting sensitivity patch threshold slip_error grid_series
area_error accuracy upscaling
prediction quantities results
render products solved sweep verification
drawing exchange cli __main__
"""
ORDER = LAYERS.split()

FINITE_ELEMENTS = {"fenicsx", "mesh", "flow"}
FENCES = {
    "dolfinx": FINITE_ELEMENTS,
    "ufl": FINITE_ELEMENTS,
    "basix": FINITE_ELEMENTS,
    "petsc4py": FINITE_ELEMENTS | {"parallel"},
    "pyvista": {"render", "exchange"},
    "vtk": {"render"},
    "pydantic": {"scene", "results", "points", "sweep"},
    "pint": {"units"},
}


def layer(path):
    """First component below the package: fem_seal/flow/linear.py is in flow."""
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def downstream(source, name):
    """Whether an import leaves the order or the fences."""
    top, *rest = name.split(".")
    if top == "fem_seal" and rest and rest[0] in ORDER:
        return ORDER.index(rest[0]) > ORDER.index(source)
    return source not in FENCES.get(top, {source})


def test_imports_point_backwards():
    """Of all modules but __init__.py, which names the public objects of all layers."""
    wrong = {}
    for path, tree in trees().items():
        source = layer(path)
        if source == "__init__":
            continue
        assert source in ORDER, f"{path} has no place in the order of the package"
        names = {name for name in imported(tree) if downstream(source, name)}
        wrong |= {str(path.relative_to(PACKAGE)): names} if names else {}
    assert not wrong


@pytest.mark.parametrize(
    ("recipe", "asks"),
    [
        ("A representation of the gap", r'representation [!=]= "|"(linear|constant)": '),
        ("A contact model", "gfmd"),
    ],
)
def test_a_recipe_names_all_modules_that_ask_for_a_name(recipe, asks):
    pages, asks = (ROOT / "docs" / "architecture.md").read_text(), re.compile(asks)
    recipe = pages.partition(f"* **{recipe}")[2].partition("\n* **")[0]
    names = {str(path.relative_to(PACKAGE)) for path in trees() if asks.search(path.read_text())}
    assert not {name for name in names if f"`{name}`" not in recipe}


# What finite differences and finite elements both use: the film, its law and its open clusters, and
# what carries numbers from one to the other. No equation of the flow and no solver is among them.
SHARED = """
arguments digits errors fluid graphs grid leak_rate rarefied
film.clusters film.constriction film.grid_film film.lattice film.law
"""


def home(name, modules):
    """Module that an imported name comes from, which a package may hand on."""
    package, _, own = name.rpartition(".")
    if name in modules or not package:
        return name
    names = imported(modules[package]) if package in modules else ()
    handed_on = (other for other in names if re.match(rf"fem_seal\..*\.{own}$", other))
    return home(next(handed_on, package), modules)


def used_by(package):
    """Modules of a package and all that they import, directly or through others."""
    modules = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): tree
        for path, tree in trees().items()
    }
    found, following = set(), {name for name in modules if name.split(".")[1:2] == [package]}
    while following:
        found |= following
        names = {name for module in following for name in imported(modules[module])}
        following = {home(name, modules) for name in names if name.startswith("fem_seal")} - found
    return {name.removeprefix("fem_seal.") for name in found}


def test_what_finite_differences_and_finite_elements_share():
    """Or their agreement would prove less; `network` is built on finite differences."""
    assert used_by("finite_difference") & used_by("flow") == set(SHARED.split())
    assert not {name for name in used_by("flow") if name.startswith("network")}


def test_a_public_name_is_that_of_one_function_or_class():
    """But `add` of each command, and the type variables `T` and `Item`."""
    homes = {}
    for path, tree in trees().items():
        for node in tree.body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                names = [node.name]
            elif isinstance(node, ast.Assign):
                # Names of types, such as `Report = Callable[...]`, are in mixed case.
                assigned = [target.id for target in node.targets if isinstance(target, ast.Name)]
                names = [name for name in assigned if not (name.isupper() or name.islower())]
            else:
                continue
            for name in names:
                if name[0] != "_" and name not in ("T", "Item"):
                    homes.setdefault(name, set()).add(str(path.relative_to(PACKAGE)))
    twice = {name: places for name, places in homes.items() if len(places) > 1}
    assert set(twice) == {"add"}, twice


def test_no_name_of_a_package_hides_a_module():
    """Else who asks for the module gets a function; the commands are never asked for so."""
    hidden = {
        f"{path.parent.name}.{name.rpartition('.')[2]}"
        for path, tree in trees().items()
        if path.name == "__init__.py" and path.parent.name != "cli"
        for name in imported(tree)
        if (path.parent / f"{name.rpartition('.')[2]}.py").exists()
    }
    assert not hidden


def test_the_page_lists_the_packages_in_their_order():
    page = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
    section = page.partition("## Packages\n")[2].partition("\n## ")[0]
    heads = re.findall(r"^\* ([^:]+):", section, re.MULTILINE)
    assert [name for head in heads for name in re.findall(r"`(\w+)/?`", head)] == ORDER


def test_no_keywords_are_handed_through():
    """No **kwargs of a function go on as **kwargs, but to the method that a method replaces."""
    assert not [
        f"{path}:{call.lineno}"
        for path, tree in trees().items()
        for function in ast.walk(tree)
        if isinstance(function, ast.FunctionDef) and function.args.kwarg
        for call in ast.walk(function)
        if isinstance(call, ast.Call) and not ast.unparse(call.func).startswith("super().")
        for keyword in call.keywords
        if keyword.arg is None
        and function.args.kwarg.arg in re.findall(r"\w+", ast.unparse(keyword))
    ]


def test_public_names():
    assert fem_seal.__all__ == sorted(fem_seal.__all__)
    for name in fem_seal.__all__:
        assert getattr(fem_seal, name).__doc__, name
    sections = {
        kind.__name__ for union in (AnyShape, Surface) for kind in union.__args__[0].__args__
    }
    assert sections <= set(fem_seal.__all__)
    for_types = set(imported(trees()[PACKAGE / "__init__.py"]))
    assert {f"{home}.{name}" for name, home in fem_seal._HOMES.items()} <= for_types
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        fem_seal.nothing  # noqa: B018


HEAVY = {"numpy", "scipy", "dolfinx", "petsc4py", "mpi4py", "pyvista", "vtkmodules", "matplotlib"}
HEAVY |= {"pydantic", "pint", "meshio", "pyfftw"}


def test_heavy_packages_are_loaded_where_they_are_used():
    """None by `import fem_seal` or the help; by layers none that draws, plots or solves for them.

    Their own layers load finite elements.
    """
    help_ = "import fem_seal.cli\ntry: fem_seal.cli.main(['--help'])\nexcept SystemExit: pass"
    plain = [name for name in ORDER if name not in FINITE_ELEMENTS]
    layers = [f"import {', '.join(f'fem_seal.{n}' for n in part)}" for part in (plain, ORDER)]
    report = "import sys; print(*{name.partition('.')[0] for name in sys.modules})"
    printed = printed_by("-c", "\n".join(f"{one}\n{report}" for one in (help_, *layers)))
    start, before, after = (set(line.split()) for line in printed.splitlines()[-3:])
    assert not start & HEAVY
    assert not before & {"dolfinx", "petsc4py", "mpi4py"}
    assert not after & {"pyvista", "vtkmodules", "matplotlib", "pint", "pyfftw"}


def test_names_of_shared_test_modules_occur_once():
    """All folders of tests are on the path: of two modules of one name, one hides the other."""
    names = [
        path.stem
        for path in (ROOT / "tests").rglob("*.py")
        if not path.stem.startswith("test_") and path.stem != "conftest"
    ]
    assert sorted(names) == sorted(set(names))
