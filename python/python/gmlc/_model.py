"""Models: compiled scripts, their points and exact derivatives."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _gmlc, _html, _options

if TYPE_CHECKING:
    import types


@dataclass(frozen=True)
class ModelParameter:
    """A free parameter of a model: lengths in millimetres, angles in radians."""

    name: str
    #: ``"mm"``, ``"rad"`` or ``""``.
    unit: str
    default: float
    #: The least value; minus infinity if there is none.
    lower: float
    #: The greatest value.
    upper: float
    #: The comment in the script.
    doc: str


class Model:
    """A compiled script, M(x). Many threads may use one at once.

    Make one by :meth:`load` or :meth:`from_source`.
    """

    def __init__(self, program: _gmlc.Program, options: Sequence[str] = ()) -> None:
        if not isinstance(program, _gmlc.Program):
            raise TypeError("a model is made by Model.load(path) or Model.from_source(text)")
        self._program = program
        self._words = list(options)
        #: The parameters, by name, in the script's order.
        self.parameters: Mapping[str, ModelParameter] = {p[0]: ModelParameter(*p) for p in program.parameters()}
        self._units = {p.name: p.unit for p in self.parameters.values()}
        #: The names of the parts.
        self.parts: tuple[str, ...] = tuple(program.parts())
        #: The names of the measures, with their units.
        self.measures: Mapping[str, str] = dict(program.measures())

    @classmethod
    def load(
        cls,
        path: str | os.PathLike[str],
        *,
        inputs: Mapping[str, Any] | None = None,
        limits: Mapping[str, int] | None = None,
        allow_path: Sequence[str] = (),
    ) -> Model:
        """Compile a script.

        :param path: the script (.gml)
        :param inputs: values of its inputs, such as ``{"bolts": 6}``
        :param limits: limits on the work of the script, such as ``{"steps": 1_000_000}``
        :param allow_path: folders besides its own whose scripts it may use
        :raises ScriptError: with the diagnostics of the script
        """
        options = _words(inputs, limits, allow_path)
        return cls(_gmlc.Program.load(os.fspath(path), options), options)

    @classmethod
    def from_source(cls, text: str, *, name: str = "model.gml", inputs: Mapping[str, Any] | None = None) -> Model:
        """Compile a text.

        :param text: the script
        :param name: its name in messages
        :param inputs: values of its inputs
        :raises ScriptError: with the diagnostics of the script
        """
        return cls.from_texts([(name, text)], _words(inputs, None, ()))

    @classmethod
    def from_texts(cls, texts: Sequence[tuple[str, str]], options: Sequence[str] = ()) -> Model:
        """Compile the first of several named texts, which may use the others: what :meth:`texts` gives."""
        return cls(_gmlc.Program.from_texts(list(texts), list(options)), options)

    def texts(self) -> list[tuple[str, str]]:
        """Names and texts of the script and of what it uses: the model as plain data."""
        return self._program.texts()

    def __reduce__(self) -> tuple[Any, ...]:
        return (Model.from_texts, (self.texts(), self._words))

    @property
    def name(self) -> str:
        """The model's name."""
        return self._program.name

    @property
    def sha256(self) -> str:
        """SHA-256 of the script and of what it uses."""
        return self._program.sha256

    @property
    def warnings(self) -> str:
        """What the compiler warned of."""
        return self._program.warnings

    def __call__(self, x: ArrayLike | None = None, /, **values: Any) -> At:
        """The model at values of its parameters.

        :param x: all values in the order of :attr:`parameters`, shape (p,), in millimetres and radians
        :param values: single ones, as numbers (millimetres, radians) or texts with a unit (``r="42mm"``); the others
            have their defaults
        """
        if x is not None:
            if values:
                raise TypeError("give all values in one array, or single ones by name")
            return At(self, np.ascontiguousarray(x, dtype=np.float64).reshape(-1))
        return At(self, self._program.values(_options.pairs(values, self._units)))

    def __repr__(self) -> str:
        return f"<gmlc.Model {self.name}: {len(self.parameters)} parameters, {len(self.parts)} parts>"

    def _repr_html_(self) -> str:
        return _html.model(self)


class At:
    """A model at certain values of its parameters."""

    def __init__(self, model: Model, x: NDArray[np.float64]) -> None:
        #: The model.
        self.model = model
        #: The values, shape (p,), in millimetres and radians.
        self.x = x
        if len(x) != len(model.parameters):
            raise ValueError(f"{len(x)} values for the {len(model.parameters)} parameters of {model.name}")

    def _part(self, part: str | int) -> int:
        if isinstance(part, str):
            try:
                return self.model.parts.index(part)
            except ValueError:
                raise KeyError(f"{self.model.name} has no part {part!r}; it has {', '.join(self.model.parts)}") from None
        return int(part)

    @staticmethod
    def _sites(u: ArrayLike, v: ArrayLike) -> tuple[tuple[int, ...], NDArray[np.float64], NDArray[np.float64]]:
        a, b = np.broadcast_arrays(np.asarray(u, dtype=np.float64), np.asarray(v, dtype=np.float64))
        return a.shape, np.ascontiguousarray(a).reshape(-1), np.ascontiguousarray(b).reshape(-1)

    def points(self, part: str | int, u: ArrayLike, v: ArrayLike) -> NDArray[np.float64]:
        """Points of a part at surface parameters u and v between 0 and 1, which are broadcast: shape (..., 3), in mm."""
        shape, a, b = self._sites(u, v)
        return self.model._program.points(self.x, self._part(part), a, b).reshape(*shape, 3)

    def jacobian(self, part: str | int, u: ArrayLike, v: ArrayLike) -> NDArray[np.float64]:
        """Exact derivatives of the points by all parameters: shape (..., 3, p), in mm by the parameters' units."""
        shape, a, b = self._sites(u, v)
        return self.model._program.jacobian(self.x, self._part(part), a, b).reshape(*shape, 3, len(self.x))

    def pullback(self, part: str | int, u: ArrayLike, v: ArrayLike, cotangents: ArrayLike) -> NDArray[np.float64]:
        """The sum over points of cotangent times derivative: shape (p,).

        It is the gradient by the parameters of a function whose derivative by the points is ``cotangents``, shape
        (..., 3), and costs about as much as a few evaluations of the points, however many parameters there are.
        """
        _, a, b = self._sites(u, v)
        c = np.ascontiguousarray(cotangents, dtype=np.float64).reshape(-1, 3)
        return self.model._program.pullback(self.x, self._part(part), a, b, c)

    def mesh(self, chord: float | str | None = None) -> Mesh:
        """The surface as triangles, at most ``chord`` (millimetres, or a text such as ``"0.1mm"``) from it."""
        text = None if chord is None else _options.length(chord)
        return Mesh(*self.model._program.mesh(self.x, text), self.model.parts)


@dataclass(frozen=True)
class Mesh:
    """A triangle mesh."""

    #: Vertices, shape (n, 3), in mm.
    positions: NDArray[np.float64]
    #: Numbers of vertices, shape (m, 3).
    triangles: NDArray[np.uint32]
    #: The number of the part of each triangle, shape (m,).
    part: NDArray[np.uint32]
    #: The names of the parts.
    part_names: tuple[str, ...]

    def to_trimesh(self) -> Any:
        """As a ``trimesh.Trimesh``."""
        import trimesh

        return trimesh.Trimesh(self.positions, self.triangles, process=False)

    def to_pyvista(self) -> Any:
        """As a ``pyvista.PolyData`` with the cell array ``part``."""
        import pyvista

        faces = np.column_stack([np.full(len(self.triangles), 3, dtype=np.int64), self.triangles.astype(np.int64)])
        mesh = pyvista.PolyData(self.positions, faces.reshape(-1))
        mesh.cell_data["part"] = self.part
        return mesh


def _words(inputs: Mapping[str, Any] | None, limits: Mapping[str, int] | None, allow_path: Sequence[str]) -> list[str]:
    options = {"input": inputs or {}, "limit": limits or {}, "allow_path": [os.fspath(path) for path in allow_path]}
    return _options.words(options, _options.COMPILING)[0]
