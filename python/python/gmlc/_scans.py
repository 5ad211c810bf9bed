"""Scans: from files, from arrays, from objects of other packages, and from the virtual scanner."""

from __future__ import annotations

import inspect
import json
import os
from typing import Any, Callable, Union

import numpy as np
from numpy.typing import NDArray

from . import _gmlc, _options
from ._model import Mesh, Model

#: Called with the stage of the work, its share from 0 to 1 (NaN where unknown), and a phrase of figures.
Progress = Callable[[str, float, str], Any]

#: What functions take for a scan: a path; points (n, 3) in mm; vertices and triangles, (n, 3) and (m, 3); a mesh or a
#: cloud of trimesh, Open3D or PyVista; a Scan.
ScanLike = Union[str, "os.PathLike[str]", NDArray[Any], "Scan", Any]

#: Millimetres in a unit.
_UNITS = {"um": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "ft": 304.8}


class Scan:
    """A scan, cleaned: a mesh, or a cloud of points."""

    def __init__(self, inner: _gmlc.Scan, truth: dict[str, Any] | None = None) -> None:
        self._inner = inner
        #: Of a virtual scan what it was made with.
        self.truth = truth

    @property
    def points(self) -> NDArray[np.float64]:
        """Points, shape (n, 3), in mm."""
        return self._inner.points

    @property
    def normals(self) -> NDArray[np.float64]:
        """Unit normals, shape (n, 3)."""
        return self._inner.normals

    @property
    def triangles(self) -> NDArray[np.uint32]:
        """Numbers of points, shape (m, 3); none of a cloud."""
        return self._inner.triangles

    @property
    def noise(self) -> float:
        """Standard deviation of the noise, in mm."""
        return self._inner.noise

    @property
    def path(self) -> str:
        """The file that it came from."""
        return self._inner.path

    @property
    def warnings(self) -> list[str]:
        """Faults of the file that were put up with."""
        return self._inner.warnings

    def __repr__(self) -> str:
        triangles = len(self.triangles)
        kind = f"{triangles} triangles" if triangles else "a cloud"
        return f"<gmlc.Scan {self.path}: {len(self.points)} points, {kind}>"


def read_scan(scan: ScanLike, *, progress: Progress | None = None, **options: Any) -> Scan:
    """Read and clean a scan.

    :param scan: a path; an array of points, shape (n, 3), of which those that are masked are left out; a pair of
        vertices and triangles (integers, (m, 3)); a ``trimesh.Trimesh``, ``PointCloud`` or ``Scene``, an Open3D
        ``TriangleMesh`` or ``PointCloud``, a ``pyvista.PolyData``, or the surface of another of its data sets; or a
        :class:`Scan`, which is returned
    :param options: those of reading: ``unit``, ``crop``, ``voxel``, ``drop_outliers`` and so on; of what is no file
        only ``unit``
    :raises FitError: the scan cannot be read
    """
    words = _options.words(options, _options.READING)[0]
    return taken(scan, words, options, progress)


def taken(scan: ScanLike, words: list[str], options: dict[str, Any], progress: Progress | None) -> Scan:
    """The scan that an argument means; ``words`` are the options of reading."""
    if isinstance(scan, Scan):
        _refuse(options, "a Scan, which was read already", set())
        return scan
    if isinstance(scan, (str, os.PathLike)):
        return Scan(_gmlc.Scan.read(os.fspath(scan), words, progress))
    _refuse(options, "no file", {"unit"})
    points, normals, triangles, name = _arrays(scan)
    unit = options.get("unit") or "mm"
    if unit not in _UNITS:
        raise _gmlc.UsageError(f"unit={unit!r} is none of {', '.join(_UNITS)}")
    points = _numbers(points, name) * _UNITS[unit]
    normals = None if normals is None or len(normals) != len(points) else np.ascontiguousarray(normals, dtype=np.float64)
    triangles = None if triangles is None or len(triangles) == 0 else np.ascontiguousarray(triangles, dtype=np.int64)
    return Scan(_gmlc.Scan.from_points(points, normals, triangles, name))


def _numbers(points: Any, name: str) -> NDArray[np.float64]:
    """Points, shape (n, 3)."""
    mask = np.ma.getmaskarray(points).any(axis=-1) if isinstance(points, np.ma.MaskedArray) else None
    array = np.asarray(points)
    if array.dtype.kind not in "iuf":
        raise TypeError(f"{name}: points are real numbers, not {array.dtype}")
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"the points have the shape {array.shape}; expected (n, 3)")
    if mask is not None:
        array = array[~mask]
    return np.ascontiguousarray(array, dtype=np.float64)


def is_mesh(scan: Any) -> bool:
    """Whether a pair is one of vertices and triangles, and not of scans."""
    if not isinstance(scan, (list, tuple)) or len(scan) != 2 or any(isinstance(one, (str, os.PathLike, Scan)) for one in scan):
        return False
    shapes = [np.shape(one) for one in scan]
    return all(len(s) == 2 and s[1] == 3 for s in shapes) and np.asarray(scan[1]).dtype.kind in "iu"


def _refuse(options: dict[str, Any], what: str, taken: set[str]) -> None:
    given = [name for name, value in options.items() if name.replace("_", "-") in _options.READING and value is not None]
    for name in given:
        if name not in taken:
            raise _gmlc.UsageError(f"{name}: is an option of reading files, and the scan is {what}")


def _arrays(scan: Any) -> tuple[Any, Any, Any, str]:
    """Points, normals, triangles and a name, of whatever other packages have."""
    if isinstance(scan, np.ndarray):
        return scan, None, None, "array"
    if is_mesh(scan):
        return np.asarray(scan[0]), None, np.asarray(scan[1]), "vertices and triangles"
    name = f"{type(scan).__module__.split('.')[0]}.{type(scan).__name__}"
    # trimesh: normals of vertices are computed by it from the triangles, as gmlc does itself.
    if hasattr(scan, "faces") and hasattr(scan, "vertices"):
        return scan.vertices, None, scan.faces, name
    if isinstance(scan, Mesh):
        return scan.positions, None, scan.triangles, name
    if hasattr(scan, "vertices") and hasattr(scan, "triangles"):
        return np.asarray(scan.vertices), None, np.asarray(scan.triangles), name
    if name == "trimesh.Scene":
        return _arrays(scan.to_mesh() if hasattr(scan, "to_mesh") else scan.dump(concatenate=True))
    if hasattr(scan, "points") and hasattr(scan, "extract_surface"):
        return _of_pyvista(scan, name)
    if hasattr(scan, "points"):
        own = getattr(scan, "normals", None)
        has_normals = getattr(scan, "has_normals", None)
        normals = np.asarray(own) if callable(has_normals) and has_normals() else None
        return np.asarray(scan.points), normals, None, name
    if hasattr(scan, "vertices"):
        return scan.vertices, None, None, name
    if isinstance(scan, (list, tuple)):
        return np.asarray(scan), None, None, "array"
    raise TypeError(f"a scan is a path, an array of points, or a mesh or cloud of trimesh, Open3D or PyVista, not {name}")


def _of_pyvista(scan: Any, name: str) -> tuple[Any, Any, Any, str]:
    """The surface of a data set of PyVista; its points where it has none."""
    # Where the algorithm may be named, its default is about to change.
    named = "algorithm" in inspect.signature(scan.extract_surface).parameters
    known = {"algorithm": "dataset_surface"} if named else {}
    surface = scan if hasattr(scan, "regular_faces") else scan.extract_surface(**known)
    if surface.n_cells == surface.n_verts:
        return scan.points, None, None, name
    triangulated = surface if surface.is_all_triangles else surface.triangulate()
    return triangulated.points, None, triangulated.faces.reshape(-1, 4)[:, 1:], name


def scan(
    model: Model,
    output: str | os.PathLike[str] | None = None,
    *,
    param: dict[str, Any] | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> Scan:
    """Scan a model with the virtual scanner.

    :param model: the model
    :param output: a file to write the scan to, which is then read; the ending says the format
    :param param: values of parameters; keywords that are names of parameters mean the same
    :param options: those of the scanner: ``spacing="1mm"``, ``noise="0.1mm"``, ``scanner="hand-held"``, ``seed=3``
        and so on
    :return: the scan, whose ``truth`` has the scanner and the pose that it added
    """
    values = dict(param or {})
    for name in [name for name in options if name in model.parameters]:
        values[name] = options.pop(name)
    words = _options.words(options, _options.SCANNING)[0]
    x = model(**values).x
    path = None if output is None else os.fspath(output)
    inner, truth = _gmlc.virtual_scan(model._program, x, words, path, progress)
    made: dict[str, Any] = json.loads(truth)
    made["parameters"] = dict(zip(model.parameters, x.tolist()))
    return Scan(inner, made)
