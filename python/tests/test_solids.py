"""Random trees of solids against manifold3d, which knows nothing of gmlc's surfaces: it combines triangles.

`GMLC_THOROUGH=1` compares 200 of them instead of 12.
"""

import os
import random

import numpy as np
import pytest

import gmlc

manifold3d = pytest.importorskip("manifold3d")

#: Facets around a cylinder, and around a ball.
SEGMENTS = 360
#: Chord of gmlc's triangles. Millimetres.
CHORD = 0.02


def leaf(rng: random.Random) -> tuple[str, "manifold3d.Manifold"]:
    """A primitive as gmlc and manifold3d have it, with coordinates on a grid, so that many faces coincide."""
    kind = rng.choice(["box", "box", "cylinder", "cylinder", "ball"])
    place = [rng.choice([-10, -5, 0, 5, 10]) for _ in range(3)]
    if rng.random() < 0.3:
        place = [c + round(rng.uniform(-3, 3), 2) for c in place]
    if kind == "box":
        width, depth, height = (rng.choice([10, 15, 20]) for _ in range(3))
        text = f"box(width: {width}mm, depth: {depth}mm, height: {height}mm)"
        body = manifold3d.Manifold.cube([width, depth, height]).translate([-width / 2, -depth / 2, 0])
    elif kind == "cylinder":
        radius, height = rng.choice([3, 4, 5, 7.5]), rng.choice([10, 15, 20])
        text = f"capped_cylinder(radius: {radius}mm, height: {height}mm)"
        body = manifold3d.Manifold.cylinder(height, radius, radius, SEGMENTS)
    else:
        radius = rng.choice([5, 6, 8])
        text, body = f"ball(radius: {radius}mm)", manifold3d.Manifold.sphere(radius, SEGMENTS // 2)
    axis = rng.choice([None, None, 0, 1])
    if axis is not None and kind != "ball":
        text += f".rotate(90deg, {(1, 0, 0) if axis == 0 else (0, 1, 0)})"
        body = body.rotate([90 if axis == k else 0 for k in range(3)])
    text += ".translate(({}mm, {}mm, {}mm))".format(*place)
    return text, body.translate(place)


def tree(rng: random.Random, depth: int, names: list[str]) -> tuple[str, "manifold3d.Manifold"]:
    if depth == 0 or rng.random() < 0.2:
        return leaf(rng)
    (a, first), (b, second) = tree(rng, depth - 1, names), tree(rng, depth - 1, names)
    sign = rng.choice("++-&")
    names.append(f"s{len(names)}")
    both = {"+": first + second, "-": first - second, "&": first ^ second}[sign]
    return f"({a} {sign} {{{names[-1]}: {b}}})", both


def manifold(mesh: gmlc.Mesh) -> "manifold3d.Manifold":
    """The triangles of a mesh; vertices of several parts at one place are one."""
    _, first, number = np.unique(np.round(mesh.positions / 1e-6), axis=0, return_index=True, return_inverse=True)
    triangles = number.reshape(-1)[mesh.triangles]
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    positions = mesh.positions[first]
    return manifold3d.Manifold(manifold3d.Mesh64(positions, triangles.astype(np.uint64)))


SEEDS = range(200 if os.environ.get("GMLC_THOROUGH") else 12)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_random_tree_of_solids_is_what_manifold3d_makes_of_it(seed):
    rng = random.Random(seed)
    text, expected = tree(rng, rng.choice([1, 2, 3, 3, 4]), [])
    script = f"model m {{\n  param x: length in 1mm..2mm = 1mm\n  part p = {text}.translate((x, 0mm, 0mm))\n}}\n"
    mesh = gmlc.Model.from_source(script, name="m.gml")().mesh(chord=CHORD)
    if expected.volume() < 1e-6:
        assert len(mesh.triangles) == 0
        return
    body = manifold(mesh)
    assert body.status() == manifold3d.Error.NoError, text
    expected = expected.translate([1, 0, 0])
    # Both lie within their chords of the exact surface.
    apart = (body - expected).volume() + (expected - body).volume()
    within = (CHORD + 8 * (1 - np.cos(np.pi / SEGMENTS * 2))) * expected.surface_area()
    assert apart < within, f"{apart} mm^3 of {expected.volume()}: {text}"
    # Where bodies touch along faces manifold3d may leave a sheet between them.
    assert body.surface_area() < 1.005 * expected.surface_area(), text
