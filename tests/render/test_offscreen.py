"""Drawing without a screen: OpenGL is checked first; FEniCSx may run in the same process."""

import ctypes.util
import os
import sys
import types

import pytest

from fem_seal.errors import InvalidInput, MissingPackage
from fem_seal.render.offscreen import draw_layers, require_gl
from fem_seal.render.page import Window

pytestmark = pytest.mark.render
VARIABLE = "VTK_DEFAULT_OPENGL_WINDOW"
SQUARE = Window(0.0, 1.0, 0.0, 1.0)


def install(monkeypatch, *libraries):
    monkeypatch.setattr(
        ctypes.util, "find_library", lambda name: f"lib{name}.so" if name in libraries else None
    )


@pytest.fixture
def no_window_chosen(monkeypatch):
    # Set before deleted, so that what require_gl writes is undone after the test.
    monkeypatch.setenv(VARIABLE, "")
    monkeypatch.delenv(VARIABLE)


@pytest.mark.usefixtures("no_window_chosen")
def test_missing_opengl_names_the_package_to_install(monkeypatch):
    install(monkeypatch)
    with pytest.raises(MissingPackage, match=r"libEGL or libOSMesa.*apt-get install libegl1"):
        draw_layers([], SQUARE)


@pytest.mark.usefixtures("no_window_chosen")
@pytest.mark.parametrize(
    ("library", "window"), [("EGL", "vtkEGLRenderWindow"), ("OSMesa", "vtkOSOpenGLRenderWindow")]
)
def test_window_follows_the_library(monkeypatch, library, window):
    install(monkeypatch, library)
    require_gl()
    assert os.environ[VARIABLE] == window


def test_the_users_window_is_kept_and_checked(monkeypatch):
    monkeypatch.setenv(VARIABLE, "vtkOSOpenGLRenderWindow")
    install(monkeypatch, "EGL", "OSMesa")
    require_gl()
    assert os.environ[VARIABLE] == "vtkOSOpenGLRenderWindow"
    install(monkeypatch, "EGL")
    with pytest.raises(MissingPackage, match="libOSMesa"):
        require_gl()
    monkeypatch.setenv(VARIABLE, "vtkHolographicRenderWindow")
    with pytest.raises(InvalidInput, match="choose from vtkEGLRenderWindow"):
        require_gl()


def test_dolfinx_with_global_symbols_is_refused_before_vtk_dies(monkeypatch):
    monkeypatch.setitem(sys.modules, "dolfinx", types.ModuleType("dolfinx"))
    monkeypatch.setattr(sys, "getdlopenflags", lambda: os.RTLD_NOW | os.RTLD_GLOBAL)
    with pytest.raises(MissingPackage, match=r"import fem_seal\.fenicsx"):
        draw_layers([], SQUARE)
