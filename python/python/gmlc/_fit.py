"""Fits, deviations and inspections."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _gmlc, _html, _options
from ._model import Model
from ._scans import Progress, Scan, ScanLike, is_mesh, taken


@dataclass(frozen=True)
class Parameter:
    """A fitted parameter: lengths in millimetres, angles in radians."""

    name: str
    value: float
    #: Standard deviation; None where there is none, which :attr:`without_sd` explains.
    sd: float | None
    #: ``"mm"``, ``"rad"`` or ``""``.
    unit: str
    #: Why there is no standard deviation.
    without_sd: str | None = None
    #: Whether it was held at its value.
    fixed: bool = False
    #: Whether it ended at one of its bounds.
    at_bound: bool = False


class Fit(Mapping[str, Parameter]):
    """The result of a fit: a mapping from names of parameters to :class:`Parameter`."""

    def __init__(self, text: str, model: Model | None = None) -> None:
        self._text = text
        #: All of fit.json.
        self.data: dict[str, Any] = json.loads(text)
        #: The model that was fitted; None of one that was loaded from a file.
        self.model = model
        #: Why the fit cannot be relied on; None if it can.
        self.shortcoming: str | None = _gmlc.shortcoming(text)
        self._parameters = {
            p["name"]: Parameter(
                p["name"],
                p["value"],
                p.get("sd"),
                p["unit"],
                p.get("without_sd"),
                p.get("fixed", False),
                p.get("at_bound", False),
            )
            for p in self.data["parameters"]
        }

    @classmethod
    def load(cls, path: str | os.PathLike[str], model: Model | None = None) -> Fit:
        """Read fit.json; ``model`` is that of the fit, for :func:`deviations`."""
        return cls(Path(path).read_text(encoding="utf-8"), model)

    def to_json(self) -> str:
        """fit.json as text."""
        return self._text

    def __getitem__(self, name: str) -> Parameter:
        return self._parameters[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._parameters)

    def __len__(self) -> int:
        return len(self._parameters)

    def __reduce__(self) -> tuple[Any, ...]:
        return (Fit, (self._text, self.model))

    @property
    def x(self) -> NDArray[np.float64]:
        """The values of all parameters, shape (p,)."""
        return np.array([p.value for p in self._parameters.values()])

    @property
    def covariance(self) -> NDArray[np.float64]:
        """The covariance of the parameters, shape (p, p): NaN for those without a standard deviation."""
        known = self.data.get("covariance")
        return self._square(known["parameters"], known["matrix"]) if known else self._square([], [])

    def _square(self, names: Sequence[str], matrix: Sequence[Sequence[float]]) -> NDArray[np.float64]:
        order = list(self._parameters)
        result = np.full((len(order), len(order)), np.nan)
        places = [order.index(name) for name in names]
        if places:
            result[np.ix_(places, places)] = matrix
        return result

    @property
    def pose(self) -> NDArray[np.float64]:
        """The motion from the model's points to the scan's frame, shape (4, 4); the identity where the script has it."""
        result = np.eye(4)
        pose = self.data.get("pose")
        if pose:
            result[:3, :3] = pose["rotation"]
            result[:3, 3] = pose["translation"]
        return result

    @property
    def measures(self) -> dict[str, Parameter]:
        """The script's measures, with their standard deviations."""
        return {
            m["name"]: Parameter(m["name"], m.get("value", np.nan), m.get("sd"), m["unit"], m.get("without_sd"))
            for m in self.data.get("measures", [])
        }

    @property
    def warnings(self) -> list[str]:
        """Sentences on what is not to be relied on."""
        return list(self.data["warnings"])

    @property
    def converged(self) -> bool:
        """Whether the last stage met its criterion."""
        return bool(self.data["converged"])

    @property
    def inliers(self) -> float:
        """The share of the points near the model."""
        return float(self.data["inliers"])

    @property
    def noise(self) -> float:
        """Standard deviation of the scan's noise, in mm."""
        return float(self.data["noise"])

    def __repr__(self) -> str:
        doubt = f"; not to be relied on: {self.shortcoming}" if self.shortcoming else ""
        values = ", ".join(f"{p.name}={p.value:.6g}" for p in self._parameters.values())
        return f"<gmlc.Fit {self.data['model']}: {values}{doubt}>"

    def _repr_html_(self) -> str:
        return _html.fit(self)


def _scans(scan: ScanLike | Sequence[ScanLike], words: list[str], options: dict[str, Any], progress: Progress | None) -> list[Scan]:
    several = scan if isinstance(scan, (list, tuple)) and not (_is_points(scan) or is_mesh(scan)) else [scan]
    if len(several) == 0:
        raise ValueError("no scan is given")
    return [taken(one, words, options, progress) for one in several]


def _is_points(scan: Sequence[Any]) -> bool:
    """Whether a list is one of points, and not of scans."""
    first = scan[0] if len(scan) else None
    return isinstance(first, (list, tuple, np.ndarray)) and np.shape(first) == (3,)


def fit(
    model: Model,
    scan: ScanLike | Sequence[ScanLike],
    *,
    start: Fit | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> Fit:
    """Fit the parameters and the pose of a model to a scan, or to several of one object.

    :param model: the model
    :param scan: see :func:`read_scan`; a list of scans is of one object
    :param start: a fit to go on from
    :param progress: called with the stage, its share and a phrase
    :param options: those of ``gmlc fit``: ``param={"r": "42mm"}``, ``fix=["wall=2mm"]``, ``loss="huber"``, ``unit="m"``,
        ``seed=1`` and so on
    :raises FitError: there is no fit; one that cannot be relied on is no error: see :attr:`Fit.shortcoming`
    """
    reading, fitting = _options.words(options, _options.READING, _options.FITTING, units=model._units)
    scans = _scans(scan, reading, options, progress)
    earlier = None if start is None else start.to_json()
    return Fit(_gmlc.fit(model._program, [one._inner for one in scans], fitting, earlier, progress), model)


class Deviations:
    """Signed distances between a fitted model and a scan, at the texels of the model's surface.

    The arrays have one length n and are those that were computed, without a copy.
    """

    def __init__(self, inner: _gmlc.Deviations) -> None:
        #: Signed distances along the normals, shape (n,), in mm: positive where the scan lies outside, NaN without data.
        self.distance: NDArray[np.float32] = inner.distance
        #: How far the scan's flat triangles lie off the surface between their corners, shape (n,), in mm, NaN where that
        #: is not known: ``distance - sag`` is what the scanned points deviate by.
        self.sag: NDArray[np.float32] = inner.sag
        #: Numbers of parts, shape (n,).
        self.part: NDArray[np.uint32] = inner.part
        #: Surface parameters, shape (n, 2).
        self.uv: NDArray[np.float64] = inner.uv
        #: Points of the fitted model, shape (n, 3), in mm.
        self.position: NDArray[np.float64] = inner.position
        #: Unit normals there, shape (n, 3).
        self.normal: NDArray[np.float32] = inner.normal
        #: Areas that the texels stand for, shape (n,), in square millimetres.
        self.area: NDArray[np.float32] = inner.area
        #: Places of the texels on the texture: row * width + column, shape (n,).
        self.index: NDArray[np.uint32] = inner.index
        #: Width and height of the texture.
        self.resolution: tuple[int, int] = inner.resolution
        #: The names of the parts.
        self.part_names: tuple[str, ...] = tuple(inner.part_names)
        #: All of variance.json: statistics, verdicts, deviations of form.
        self.report: dict[str, Any] = json.loads(inner.report)

    @property
    def verdict(self) -> str | None:
        """``"conforms"``, ``"does not conform"`` or ``"undecided"``; None without tolerances."""
        verdict = self.report.get("verdict")
        return verdict["outcome"] if verdict else None

    @property
    def warnings(self) -> list[str]:
        """Sentences on what is not to be relied on."""
        return list(self.report["warnings"])

    def image(self) -> NDArray[np.float32]:
        """The distances as a texture, shape (height, width), NaN where there is none."""
        width, height = self.resolution
        result = np.full(width * height, np.nan, dtype=np.float32)
        result[self.index] = self.distance
        return result.reshape(height, width)

    def to_pandas(self) -> Any:
        """A ``pandas.DataFrame`` with a row a texel."""
        import pandas

        frame = {"part": pandas.Categorical.from_codes(self.part.astype(np.int64), list(self.part_names))}
        columns = dict(zip("xyz", self.position.T)) | {"u": self.uv[:, 0], "v": self.uv[:, 1]}
        return pandas.DataFrame(frame | columns | {"distance": self.distance, "area": self.area})

    def to_pyvista(self) -> Any:
        """A ``pyvista.PolyData`` of the texels with the point arrays ``distance``, ``part`` and ``normal``."""
        import pyvista

        cloud = pyvista.PolyData(self.position)
        cloud.point_data["distance"] = self.distance
        cloud.point_data["part"] = self.part
        cloud.point_data["normal"] = self.normal
        return cloud

    def __len__(self) -> int:
        return len(self.distance)

    def __repr__(self) -> str:
        measured = int(np.isfinite(self.distance).sum())
        return f"<gmlc.Deviations: {measured} of {len(self)} texels measured, verdict {self.verdict}>"

    def _repr_html_(self) -> str:
        return _html.deviations(self)


def deviations(
    fit: Fit,
    scan: ScanLike,
    *,
    model: Model | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> Deviations:
    """Measure the deviations of a scan from a fitted model.

    :param fit: the fit
    :param scan: the scan, see :func:`read_scan`
    :param model: the model; by default that of the fit
    :param options: those of ``gmlc variance``: ``tolerance="0.2mm"``, ``resolution=512``, ``distance="closest"`` and so on,
        and those of reading the scan
    """
    model = model or fit.model
    if model is None:
        raise ValueError("the fit was loaded from a file: name its model (model=...)")
    reading, measuring = _options.words(options, _options.READING, _options.MEASURING)
    [one] = _scans([scan], reading, options, progress)
    return Deviations(_gmlc.measure(model._program, fit.to_json(), one._inner, measuring, progress))


class Inspection:
    """What :func:`inspect` has written into a folder."""

    def __init__(self, output: Path, fit: Fit, report: dict[str, Any]) -> None:
        #: The folder of the results.
        self.output = output
        #: The fit.
        self.fit = fit
        #: All of variance.json.
        self.report = report

    @property
    def verdict(self) -> str | None:
        """``"conforms"``, ``"does not conform"`` or ``"undecided"``; None without tolerances."""
        verdict = self.report.get("verdict")
        return verdict["outcome"] if verdict else None

    @property
    def page(self) -> Path:
        """The report."""
        return self.output / "report.html"

    def __repr__(self) -> str:
        return f"<gmlc.Inspection in {self.output}, verdict {self.verdict}>"

    def _repr_html_(self) -> str:
        return _html.inspection(self)


def inspect(
    model: Model,
    scan: ScanLike | Sequence[ScanLike],
    output: str | os.PathLike[str],
    *,
    progress: Progress | None = None,
    **options: Any,
) -> Inspection:
    """Fit, measure and document everything into a folder, as ``gmlc inspect`` does.

    :param output: the folder
    :param options: those of ``gmlc inspect``
    """
    groups = (_options.READING, _options.FITTING, _options.MEASURING, _options.REPORT)
    reading, fitting, measuring, reporting = _options.words(options, *groups, units=model._units)
    scans = [one._inner for one in _scans(scan, reading, options, progress)]
    text, report = _gmlc.inspect(model._program, scans, fitting, measuring, reporting, os.fspath(output), progress)
    return Inspection(Path(output), Fit(text, model), json.loads(report))
