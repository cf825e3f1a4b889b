"""Write one map in the layouts of other codes; these codes need not be installed.

The layouts were compared with files written by Tamaas 2.9.0 (NumpyDumper, H5Dumper, NetCDFDumper),
SurfaceTopography 1.27.1 (to_netcdf) and ContactMechanics 1.8.3 (ce_hard_wall --gap-fn).
"""

import json
from struct import pack
from zipfile import ZipFile

import h5py
import numpy as np
from scipy.io import netcdf_file

NAMELESS = "This is a netCDF dimension but not a netCDF variable.{:10d}"


def tamaas_attributes(shape, size):
    return {
        "model_type": "model_type.basic_2d",
        "system_size": list(size),
        "discretization": list(shape),
        "boundary_fields": ["gap", "displacement", "traction"],
        "program": "Tamaas 2.9.0, DOI:10.21105/joss.02121",
    }


def tamaas_npz(path, size, **fields):
    shape = next(iter(fields.values())).shape[:2]
    np.savez_compressed(path, attrs=json.dumps(tamaas_attributes(shape, size)), **fields)
    return path


def tamaas_h5(path, size, **fields):
    with h5py.File(path, "w") as file:
        for name, values in fields.items():
            file.create_dataset(name, data=values, compression="gzip", compression_opts=7)
        shape = next(iter(fields.values())).shape[:2]
        file.attrs.update(tamaas_attributes(shape, size))
    return path


def tamaas_nc(path, size, **frames):
    """Each field (frames, nx, ny), in a NetCDF 4 file as the C library lays it out in HDF5."""
    _, nx, ny = next(iter(frames.values())).shape
    with h5py.File(path, "w") as file:
        scales = [_dimension(file, "frame", 0)]
        for name, n, length in (("x", nx, size[0]), ("y", ny, size[1])):
            scales.append(file.create_dataset(name, data=np.linspace(0, length, n, False)))
            scales[-1].make_scale(name)
        _put(file, frames, scales, compression="gzip")
        file.attrs.update(tamaas_attributes((nx, ny), size))
    return path


def contact_mechanics_nc(path, **frames):
    """Frames of fields on dimensions nx and ny; no lengths."""
    _, nx, ny = next(iter(frames.values())).shape
    with h5py.File(path, "w") as file:
        scales = [_dimension(file, *d) for d in (("frame", 0), ("nx", nx), ("ny", ny))]
        _put(file, frames, scales)
    return path


def _put(file, frames, scales, **options):
    for name, values in frames.items():
        data = file.create_dataset(name, data=values, **options)
        for axis, scale in enumerate(scales):
            data.dims[axis].attach_scale(scale)


def _dimension(file, name, n):
    scale = file.create_dataset(name, shape=(n,), dtype=">f4")
    scale.make_scale(NAMELESS.format(n))
    return scale


def topography_nc(path, heights, size, unit=None, periodic=True, mask=None):
    """NetCDF 3 with coordinates, as SurfaceTopography and ContactMechanics exchange maps."""
    with netcdf_file(path, "w", version=2, maskandscale=True) as file:
        data = {"heights": heights} | ({} if mask is None else {"mask": mask})
        for name, n in zip("xy", heights.shape, strict=True):
            file.createDimension(name, n)
        for name, values in data.items():
            variable = file.createVariable(name, "b" if name == "mask" else "f8", ("x", "y"))
            variable.maskandscale = name != "mask"
            variable[...] = values
        if unit is not None:
            file.variables["heights"].unit = unit
        for name, n, length in zip("xy", heights.shape, size, strict=True):
            axis = file.createVariable(name, "f8", (name,))
            axis.length = length
            axis.periodic = int(periodic)
            if unit is not None:
                axis.unit = unit
            axis[...] = np.arange(n) / n * length
    return path


def netcdf(path, attributes, dimensions="xy", **arrays):
    """NetCDF 3 without coordinates; the first array has the attributes."""
    with netcdf_file(path, "w") as file:
        for axis, n in zip(dimensions, next(iter(arrays.values())).shape, strict=True):
            file.createDimension(axis, n)
        for name, values in arrays.items():
            file.createVariable(name, values.dtype, tuple(dimensions))[...] = values
        for name, value in attributes.items():
            setattr(file.variables[next(iter(arrays))], name, value)
    return path


def netcdf_4(path, attributes, dimensions="xy", **arrays):
    """The same as HDF5."""
    with h5py.File(path, "w") as file:
        for name, values in arrays.items():
            file[name] = values
            for axis, label in zip(file[name].dims, dimensions, strict=True):
                axis.label = label
        file[next(iter(arrays))].attrs.update(attributes)
    return path


def hard_wall_text(path, gap, unit):
    """A gap of ce_hard_wall: comments, of which the last line ends with the unit."""
    head = "ContactMechanics version: 1.8.3\nfractional area = 0.04"
    np.savetxt(path, gap, header=f"{head}Gap values follow, they are reported in units of {unit}.")
    return path


def plain_h5(path, name, values, spacing=None, unit=None, spacing_unit=None):
    with h5py.File(path, "w") as file:
        file[name] = values
        if unit is not None:
            file[name].attrs["unit"] = unit
        if spacing is not None:
            file["spacing"] = spacing
            if spacing_unit is not None:
                file["spacing"].attrs["unit"] = spacing_unit
    return path


X3P = """<?xml version="1.0" encoding="UTF-8"?>
<p:ISO5436_2 xmlns:p="http://www.opengps.eu/2008/ISO5436_2">
<Record1><Revision>ISO5436 - 2000</Revision><FeatureType>SUR</FeatureType><Axes>
<CX><AxisType>I</AxisType><DataType>D</DataType><Increment>{dx!r}</Increment></CX>
<CY><AxisType>I</AxisType><DataType>D</DataType><Increment>{dy!r}</Increment></CY>
<CZ><AxisType>A</AxisType><DataType>{kind}</DataType>{scale}</CZ></Axes></Record1>
<Record3><MatrixDimension><SizeX>{nx}</SizeX><SizeY>{ny}</SizeY><SizeZ>1</SizeZ></MatrixDimension>
<DataLink><PointDataLink>bindata/data.bin</PointDataLink>{valid}</DataLink></Record3>
</p:ISO5436_2>"""


def x3p(path, points, spacing, kind="D", dtype="<f8", step=None, start=None, valid=None):
    """X3P of openGPS: points (nx, ny) of a data type, those along x next to each other."""
    (nx, ny), (dx, dy) = np.shape(points), spacing
    scale = "" if step is None else f"<Increment>{step!r}</Increment>"
    scale += "" if start is None else f"<Offset>{start!r}</Offset>"
    link = "" if valid is None else "<ValidPointsLink>bindata/valid.bin</ValidPointsLink>"
    text = X3P.format(dx=dx, dy=dy, kind=kind, scale=scale, nx=nx, ny=ny, valid=link)
    with ZipFile(path, "w") as archive:
        archive.writestr("main.xml", text)
        archive.writestr("bindata/data.bin", np.asarray(points).T.astype(dtype).tobytes())
        if valid is not None:
            bits = np.packbits(np.asarray(valid).T.ravel(), bitorder="little")
            archive.writestr("bindata/valid.bin", bits.tobytes())


def sur(path, points, spacing, step, special=0):
    """SUR of Digital Surf: 16-bit points (nx, ny) in steps [m] behind a header of 512 bytes."""
    (nx, ny), known = np.shape(points), points[points > points.min()] if special else points
    ends = int(known.min()), int(known.max())
    head = b"DIGITAL SURF" + pack("<4H60x5H8xH", 0, 1, 1, 2, 0, 0, 0, special, 1, 16)
    head += pack("<5i3f", *ends, nx, ny, nx * ny, *spacing, step)
    head += b"".join(text.ljust(16) for text in [b"X", b"Y", b"Z", *6 * [b"m"]])
    head += pack("<3f", 1, 1, 1)
    path.write_bytes(head.ljust(512, b"\0") + points.T.astype("<i2").tobytes())
