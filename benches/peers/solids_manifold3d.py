"""Solids by gmlc and by manifold3d in one run: how long they take, and how much of the volume they have.

    python solids_manifold3d.py GMLC [--repeat N]

makes a plate with 100 holes, a bracket and a lens of two balls by `gmlc mesh` and by manifold3d, whose circles have as
many segments as make the same chord, and prints for each the best time of N and the volume of the triangles relative to
the exact one. The time of gmlc is that of the whole command: it reads the script, differentiates and compiles it, and
writes the mesh; that of manifold3d is that of its operations in a Python which already runs. Needs numpy, manifold3d and
trimesh.
"""

import argparse
import math
import pathlib
import subprocess
import tempfile
import time

import manifold3d
import numpy as np
import trimesh

CHORD = 0.01

PLATE = """model plate {
  param d: length = 6mm
  let bolt = capped_cylinder(radius: d / 2, height: 5mm)
  let holes = for k in 0..100 { bolt.translate(((floor(k / 10) - 4.5) * 18mm, (k % 10 - 4.5) * 18mm, 0mm)) }
  part plate = box(width: 200mm, depth: 200mm, height: 5mm) - {hole: separate(holes)}
}
"""

BRACKET = """model bracket {
  param d: length = 8mm
  let bolt = capped_cylinder(radius: d / 2, height: 6mm)
  part body = box(width: 60mm, depth: 40mm, height: 6mm)
    + {wall: box(width: 60mm, depth: 6mm, height: 40mm).translate((0mm, 17mm, 0mm))}
    - {hole: [bolt.translate((-18mm, -5mm, 0mm)), bolt.translate((18mm, -5mm, 0mm))]}
}
"""

LENS = """model lens {
  param r: length = 20mm
  part lens = ball(radius: r) & {other: ball(radius: r).translate((r, 0mm, 0mm))}
}
"""


def segments(radius):
    """How many segments a circle has whose chords are that far from it."""
    return math.ceil(math.pi / math.acos(1 - CHORD / radius))


def cylinder(radius, height, at=(0, 0, 0)):
    return manifold3d.Manifold.cylinder(height, radius, radius, segments(radius)).translate(at)


def box(width, depth, height, at=(0, 0, 0)):
    whole = manifold3d.Manifold.cube((width, depth, height))
    return whole.translate((at[0] - width / 2, at[1] - depth / 2, at[2]))


def plate():
    holes = [cylinder(3, 5, ((i - 4.5) * 18, (j - 4.5) * 18, 0)) for i in range(10) for j in range(10)]
    return box(200, 200, 5) - manifold3d.Manifold.batch_boolean(holes, manifold3d.OpType.Add)


def bracket():
    both = box(60, 40, 6) + box(60, 6, 40, (0, 17, 0))
    return both - cylinder(4, 6, (-18, -5, 0)) - cylinder(4, 6, (18, -5, 0))


def lens():
    ball = manifold3d.Manifold.sphere(20, segments(20))
    return ball ^ ball.translate((20, 0, 0))


CASES = {
    "plate with 100 holes": (PLATE, plate, 200 * 200 * 5 - 100 * math.pi * 9 * 5),
    "bracket": (BRACKET, bracket, 60 * 40 * 6 + 60 * 6 * 34 - 2 * math.pi * 16 * 6),
    # Two caps of the height r / 2: pi h^2 (3 r - h) / 3 each.
    "lens": (LENS, lens, 2 * math.pi * 100 * (60 - 10) / 3),
}


def by_command(gmlc, script, folder):
    source, mesh = folder / "model.gml", folder / "model.stl"
    source.write_text(script)
    start = time.perf_counter()
    subprocess.run([gmlc, "mesh", source, "--chord", f"{CHORD}mm", "-o", mesh], check=True, capture_output=True)
    seconds = time.perf_counter() - start
    made = trimesh.load(mesh)
    made.merge_vertices()
    return seconds, made.volume, len(made.faces), made.is_watertight


def by_manifold(make):
    start = time.perf_counter()
    mesh = make().to_mesh()
    seconds = time.perf_counter() - start
    made = trimesh.Trimesh(np.asarray(mesh.vert_properties)[:, :3], mesh.tri_verts)
    return seconds, made.volume, len(made.faces), made.is_watertight


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("gmlc")
    parser.add_argument("--repeat", type=int, default=5)
    args = parser.parse_args()
    print("| solid | by | best time, s | triangles | watertight | volume / exact - 1 |")
    print("|---|---|---:|---:|---|---:|")
    with tempfile.TemporaryDirectory() as folder:
        for name, (script, make, exact) in CASES.items():
            ways = {
                "gmlc": lambda: by_command(args.gmlc, script, pathlib.Path(folder)),
                "manifold3d": lambda: by_manifold(make),
            }
            for way, run in ways.items():
                runs = [run() for _ in range(args.repeat)]
                _, volume, triangles, closed = runs[0]
                best = min(seconds for seconds, *_ in runs)
                print(f"| {name} | {way} | {best:.4f} | {triangles:,} | {'yes' if closed else 'no'} | {volume / exact - 1:.1e} |")


main()
