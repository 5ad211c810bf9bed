"""The fit of examples/cup as one would write it in Python: SciPy's L-BFGS and then iteratively reweighted least squares, over
Open3D's distances to the cup as a mesh (benches/peers/cup.c for its points and derivatives), loss 1 - exp(-d^2 / sigma^2).

    python fit_scipy.py cup_scan.ply SIGMA < STARTS

A start is a line of 15 numbers, the script's parameters in millimetres and radians. For each it prints the seconds, the mean
loss and the 15 numbers found. `cargo bench --bench fit -- success` runs it where GMLC_PEER_PYTHON names a Python that has
numpy, scipy and open3d.
"""
import ctypes
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np
import open3d as o3d
from scipy.optimize import minimize

# Outer surface, inner surface, handle: vertices along u and v.
GRIDS = [(0, 64, 32), (1, 64, 32), (2, 32, 24)]
LOW = np.array([-np.inf] * 6 + [-1, 15, 30, 0.3, 1, 0, 1, -0.5, 0.3])
HIGH = np.array([np.inf] * 6 + [12, 80, 200, 1, 3, 1.5, 3, 1, 1])
# How far a unit of a parameter moves the cup, about: millimetres, and radians or shape numbers of a cup of this size.
SCALE = np.array([1.0] * 3 + [50.0] * 3 + [5, 1, 1] + [40.0] * 6)


def library(folder):
    source = pathlib.Path(__file__).parent / "cup.c"
    target = pathlib.Path(folder) / "cup.so"
    subprocess.run(["cc", "-O3", "-march=native", "-shared", "-fPIC", str(source), "-o", str(target), "-lm"], check=True)
    return ctypes.CDLL(str(target))


def pointer(array):
    return array.ctypes.data_as(ctypes.c_void_p)


class Cup:
    def __init__(self, points, sigma, folder):
        self.c, self.points, self.sigma = library(folder), points, sigma
        self.axes, triangles, first = [], [], 0
        for which, columns, rows in GRIDS:
            self.axes.append((which, np.linspace(0, 1, columns), np.linspace(0, 1, rows), first))
            i, j = np.meshgrid(np.arange(columns - 1), np.arange(rows - 1))
            a = (first + j * columns + i).ravel()
            triangles += [np.stack([a, a + 1, a + columns + 1], 1), np.stack([a, a + columns + 1, a + columns], 1)]
            first += columns * rows
        self.triangles, self.count = np.concatenate(triangles).astype(np.uint32), first
        self.query = o3d.core.Tensor(points.astype(np.float32))

    def grids(self, x, array):
        """Points of all parts on their grids."""
        for which, u, v, first in self.axes:
            part = array[first : first + len(u) * len(v)]
            self.c.cup_grid(pointer(x), which, pointer(u), len(u), pointer(v), len(v), pointer(part))

    def scattered(self, function, x, arrays, *more):
        """A function of scattered points, at the vertices of each part, with an array for each."""
        for (which, u, v, _), array in zip(self.axes, arrays):
            columns, rows = np.tile(u, len(v)), np.repeat(v, len(u))
            function(pointer(x), which, pointer(columns), pointer(rows), len(columns), pointer(array), *map(pointer, more))

    def by_part(self, array):
        ends = [first for *_, first in self.axes[1:]]
        return [np.ascontiguousarray(part) for part in np.split(array, ends)]

    def jacobian(self, x):
        """Derivatives of all vertices, (n, 3, 15): only the handle depends on the last six."""
        own = [np.zeros((len(u) * len(v), 15 if which == 2 else 9, 3)) for which, u, v, _ in self.axes]
        self.scattered(self.c.cup_jacobian, x, own)
        result = np.zeros((self.count, 3, 15))
        for (*_, first), part in zip(self.axes, own):
            result[first : first + len(part), :, : part.shape[1]] = part.transpose(0, 2, 1)
        return result

    def closest(self, x):
        """The cup's vertices, and where on its triangles the points are nearest."""
        x = np.ascontiguousarray(x)
        vertices = np.zeros((self.count, 3))
        self.grids(x, vertices)
        scene = o3d.t.geometry.RaycastingScene()
        scene.add_triangles(o3d.core.Tensor(vertices.astype(np.float32)), o3d.core.Tensor(self.triangles))
        return vertices, scene.compute_closest_points(self.query)

    def feet(self, x):
        """Vectors from the scan's points to their feet, and the feet as weights of vertices."""
        vertices, closest = self.closest(x)
        uv = closest["primitive_uvs"].numpy().astype(float)
        corners = self.triangles[closest["primitive_ids"].numpy()]
        weights = np.concatenate([1 - uv.sum(1, keepdims=True), uv], 1)
        return np.einsum("nk,nkc->nc", weights, vertices[corners]) - self.points, corners, weights

    def value_and_gradient(self, x):
        e, corners, weights = self.feet(x)
        loss = np.exp(-(e * e).sum(1) / self.sigma**2)
        force = e * (loss * 2 / self.sigma**2 / len(e))[:, None]
        w = np.stack(
            [np.bincount(corners.ravel(), (weights * force[:, k : k + 1]).ravel(), self.count) for k in range(3)], 1
        )
        gradient = np.zeros(15)
        self.scattered(self.c.cup_pullback, np.ascontiguousarray(x), self.by_part(w), gradient)
        return 1 - loss.mean(), gradient

    def residuals(self, x):
        """Distances, their Jacobian, and the weights of the loss."""
        e, corners, weights = self.feet(x)
        d = np.linalg.norm(e, axis=1)
        jacobian = self.jacobian(np.ascontiguousarray(x))
        n = e / np.maximum(d, 1e-12)[:, None]
        rows = np.zeros((len(d), 15))
        for k in range(3):
            rows += weights[:, k : k + 1] * np.einsum("nc,ncp->np", n, jacobian[corners[:, k]])
        return d, rows, np.exp(-(d * d) / self.sigma**2)


def fit(cup, start):
    box = list(zip(LOW * SCALE, HIGH * SCALE))
    scaled = lambda y: (lambda f, g: (f, g / SCALE))(*cup.value_and_gradient(y / SCALE))
    x = minimize(scaled, start * SCALE, jac=True, method="L-BFGS-B", bounds=box, options={"maxiter": 60}).x / SCALE
    value = cup.value_and_gradient(x)[0]
    for _ in range(10):
        d, rows, w = cup.residuals(x)
        rows = rows / SCALE
        step = np.linalg.solve(rows.T @ (rows * w[:, None]) + 1e-9 * np.eye(15), -rows.T @ (w * d)) / SCALE
        next_x = np.clip(x + step, LOW, HIGH)
        next_value = cup.value_and_gradient(next_x)[0]
        if not next_value < value:
            break
        done = value - next_value < 1e-9
        x, value = next_x, next_value
        if done:
            break
    return x, value


def timed(function, x):
    clock = time.perf_counter()
    function(x)
    return time.perf_counter() - clock


def main():
    mesh = o3d.io.read_triangle_mesh(sys.argv[1])
    starts = [np.array(line.split(), dtype=float) for line in sys.stdin if line.strip()]
    with tempfile.TemporaryDirectory() as folder:
        cup = Cup(np.asarray(mesh.vertices), float(sys.argv[2]), folder)
        cup.value_and_gradient(starts[0])
        alone, whole = (min(timed(f, starts[0]) for _ in range(5)) for f in (cup.closest, cup.value_and_gradient))
        print(f"Open3D's distances alone {alone * 1e3:.0f} ms, objective and gradient {whole * 1e3:.0f} ms", file=sys.stderr)
        for start in starts:
            clock = time.perf_counter()
            x, value = fit(cup, np.clip(start, LOW, HIGH))
            print(time.perf_counter() - clock, value, *x)


main()
