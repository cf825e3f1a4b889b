"""Synthetic gaps and flows to draw, and the values that drawn colours stand for."""

import numpy as np
from matplotlib.figure import Figure

from fem_seal.grid import GridField
from fem_seal.leak_rate import FlowField, LeakRate
from fem_seal.render.colours import colour_map


def smooth_gap(shape, contact_area, seed=0, periodic=True, spacing=(1e-6, 1e-6)):
    """Gap of a smooth random surface cut so that a part `contact_area` of the samples is 0."""
    rng = np.random.default_rng(seed)
    qx, qy = np.fft.fftfreq(shape[0]), np.fft.rfftfreq(shape[1])
    low_pass = np.hypot(qx[:, None], qy) < 0.08
    height = np.fft.irfft2(low_pass * np.fft.rfft2(rng.standard_normal(shape)), s=shape)
    height -= np.quantile(height, contact_area)
    return GridField(np.maximum(height / height.max(), 0.0) * 1e-6, spacing, periodic)


def structured_flow(nx, ny, size, flux_of_x, pressure_of_x=lambda x: 1 - x):
    """Flow along x on an nx by ny grid of split squares; functions take x / Lx in [0, 1]."""
    i, j = (a.ravel() for a in np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij"))
    corner = i * (ny + 1) + j
    lower = np.stack([corner, corner + ny + 1, corner + ny + 2], axis=1)
    upper = np.stack([corner, corner + ny + 2, corner + 1], axis=1)
    cells = np.concatenate([lower, upper])
    x, y = np.meshgrid(np.linspace(0, 1, nx + 1), np.linspace(0, 1, ny + 1), indexing="ij")
    points = np.stack([x.ravel() * size[0], y.ravel() * size[1]], axis=1)
    # One value per column of squares, so that a column is one flat colour.
    flux = np.zeros((len(cells), 2))
    flux[:, 0] = flux_of_x((np.tile(i, 2) + 0.5) / nx)
    return FlowField(points, cells, np.ones(len(points)), pressure_of_x(x.ravel()), flux)


def leaking(field):
    return LeakRate(state="leaking", method="by hand", value=1.0, field=field)


def positions(pixels, colours):
    """Position (0..1) of each pixel on a colour map, and its distance from the nearest colour."""
    table = 255 * colour_map(colours)(np.linspace(0, 1, 256))[:, :3]
    flat = pixels.reshape(-1, 1, 3).astype(float)
    distance = np.abs(flat - table).max(axis=2)
    best = distance.argmin(axis=1)
    shape = pixels.shape[:-1]
    return (best / 255).reshape(shape), distance.min(axis=1).reshape(shape)


def colours_of(draw, *arguments, **options):
    """Colours (nx, ny, 4) of the samples that a function draws, one after the other, into axes."""
    axes = Figure().subplots()
    draw(axes, *arguments, **options)
    return axes, axes.images[-1].get_array().transpose(1, 0, 2)
