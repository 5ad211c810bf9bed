#!/usr/bin/env python3
"""Opens the files of `--export` and of `gmlc mesh` with the tools that they are for, and compares what these read.

Usage: tools.py GMLC FOLDER

GMLC is the built command. FOLDER is made, and gets a scan of a can, an inspection of it, and meshes. The status is 0 if
every tool read what was written. README.md says how to install the tools.
"""

import csv
import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pymeshlab
import pyvista
import trimesh

CAN = """use std.surface (cylinder, disc, flip)
model can {
  param r: length = 20mm
  param h: length = 50mm
  part side = cylinder(r, h)
  part lid = |u, v| disc(r)(u, v) + (0mm, 0mm, h)
  part base = flip(disc(r))
}
"""


def say(tool, text):
    print(f"{tool:12} {text}")


def made(gmlc, folder):
    """The variance report of a scan of a can whose radius is half a millimetre larger than the model's."""

    def run(*words):
        subprocess.run([gmlc, *words], cwd=folder, check=True, stdout=subprocess.DEVNULL)

    folder.mkdir(parents=True, exist_ok=True)
    (folder / "can.gml").write_text(CAN)
    run("scan", "can.gml", "-p", "r=20.5mm", "--noise", "0.05mm", "--spacing", "1mm", "--outliers", "0", "--no-pose",
        "-o", "scan.ply")
    run("variance", "can.gml", "scan.ply", "--max-distance", "3mm", "--resolution", "512", "--device", "cpu",
        "--export", "ply,vtp,glb,csv", "-o", "out")
    for ending in ("obj", "ply", "stl"):
        run("mesh", "can.gml", "-o", f"can.{ending}")
    return json.loads((folder / "out/variance.json").read_text())


def with_pyvista(out, report):
    """VTP: scalars at points, names of parts; returns the surface."""
    surface = pyvista.read(out / "deviations.vtp")
    names = [part["name"] for part in report["parts"]]
    assert list(surface.field_data["parts"]) == names, surface.field_data["parts"]
    assert surface.field_data["unit"][0] == "mm"
    scalars = surface.point_data
    distance, kind, part = scalars["distance"], scalars["class"], scalars["part"]
    assert np.array_equal(np.isnan(distance), kind != 1)
    side = distance[(part == names.index("side")) & (kind == 1)]
    assert abs(np.median(side) - 0.5) < 0.02, np.median(side)
    assert surface.is_all_triangles and set(surface.cell_data["part"]) == {0, 1, 2}
    assert abs(surface.area - report["area"]) < 0.002 * report["area"], surface.area
    # Normals point outwards: those of the lid upwards.
    assert np.allclose(scalars["Normals"][part == names.index("lid")], [0, 0, 1], atol=1e-6)
    points = pyvista.read(out / "points.vtp")
    figures = report["points"]
    assert points.n_points == figures["points"] == points.n_verts
    measured = points["distance"][points["class"] == 1]
    assert len(measured) == figures["measured"]
    assert np.isclose(measured.mean(), figures["signed"]["mean"], atol=1e-6)
    assert np.count_nonzero(points["class"] == 6) == figures["beyond"]
    assert np.count_nonzero(points["class"] == 7) == figures["facing_away"]
    say("PyVista", f"deviations.vtp: {surface.n_points} points, {surface.n_cells} triangles, {list(scalars.keys())}; "
        f"points.vtp: {points.n_points} points, mean {measured.mean():.4f} mm")
    return surface


def with_meshlab(out, surface):
    """PLY: the scalar that MeshLab knows, and colours; the same vertices as VTP."""
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(out / "deviations.ply"))
    mesh = meshes.current_mesh()
    assert (mesh.vertex_number(), mesh.face_number()) == (surface.n_points, surface.n_cells)
    assert mesh.has_vertex_scalar() and mesh.has_vertex_color()
    assert np.array_equal(mesh.vertex_scalar_array(), surface["distance"].astype(float), equal_nan=True)
    assert np.array_equal(mesh.vertex_matrix(), surface.points)
    colours = np.rint(255 * mesh.vertex_color_matrix()[:, :3])
    assert np.array_equal(colours, surface["colour"])
    meshes.load_new_mesh(str(out / "points.ply"))
    points = meshes.current_mesh()
    assert points.has_vertex_scalar() and points.face_number() == 0
    say("MeshLab", f"deviations.ply: {mesh.vertex_number()} vertices, {mesh.face_number()} faces, scalar and colours; "
        f"points.ply: {points.vertex_number()} points with a scalar")


def with_trimesh(out, surface, report):
    """PLY with all scalars; GLB in metres, with a geometry for every part, where it belongs."""
    ply = trimesh.load(out / "deviations.ply", process=False)
    raw = ply.metadata["_ply_raw"]["vertex"]["data"]
    for name in ("distance", "detection", "part", "class"):
        assert np.array_equal(raw[f"scalar_{name}"].squeeze(), surface.point_data[name], equal_nan=True), name
    scene = trimesh.load(out / "deviations.glb")
    names = [part["name"] for part in report["parts"]]
    assert sorted(scene.graph.nodes_geometry) == sorted(names), scene.graph.nodes_geometry
    low, high = scene.bounds
    x0, x1, y0, y1, z0, z1 = np.array(surface.bounds) / 1000
    # z of the scan is y of glTF, and y is -z.
    assert np.allclose([low, high], [[x0, z0, -y1], [x1, z1, -y0]], atol=1e-7), scene.bounds
    lid = scene.geometry["lid"]
    assert lid.visual.kind == "vertex" or lid.visual.vertex_attributes, "colours"
    say("trimesh", f"deviations.ply: {sorted(raw.keys() if hasattr(raw, 'keys') else raw.dtype.names)}; "
        f"deviations.glb: {sorted(scene.graph.nodes_geometry)}, {np.round(high - low, 4)} m")


def with_cloudcompare(out, surface):
    """PLY: the scalars of the surface and of the points, as CloudCompare writes them out again."""
    command = [name for name in ("CloudCompare", "cloudcompare.CloudCompare") if shutil.which(name)]
    if not command:
        say("CloudCompare", "is not installed")
        return
    screen = ["xvfb-run", "-a"] if shutil.which("xvfb-run") else []

    def loaded(name, *more):
        text = out / "cloudcompare.txt"
        options = ["-SILENT", "-AUTO_SAVE", "OFF", "-O", str(out / name), "-C_EXPORT_FMT", "ASC", "-ADD_HEADER", *more]
        subprocess.run([*screen, *command[:1], *options, "-SAVE_CLOUDS", "FILE", str(text)], check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        head = text.open().readline().lstrip("/").split()
        return head, np.loadtxt(text, skiprows=1)

    head, rows = loaded("deviations.ply", "-EXTRACT_VERTICES")
    for name in ("distance", "detection", "part", "class"):
        assert np.allclose(rows[:, head.index(name)], surface.point_data[name], atol=1e-6, equal_nan=True), name
    say("CloudCompare", f"deviations.ply: {len(rows)} vertices with {head}")
    head, rows = loaded("points.ply")
    assert {"distance", "part", "class"} <= set(head), head
    say("CloudCompare", f"points.ply: {len(rows)} points with {head}")


def with_csv(out, report):
    with open(out / "parts.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file, strict=True))
    assert [row["part"] for row in rows] == [part["name"] for part in report["parts"]]
    for row, part in zip(rows, report["parts"]):
        assert float(row["area_mm2"]) == part["area"] and float(row["rms_mm"]) == part["rms"]
    with open(out / "parameters.csv", newline="", encoding="utf-8") as file:
        parameters = {row["parameter"]: float(row["value"]) for row in csv.DictReader(file, strict=True)}
    assert parameters == {"r": 20.0, "h": 50.0}
    say("csv", f"parts.csv: {len(rows)} rows, {len(rows[0])} columns; parameters.csv: {parameters}")


def welded(folder):
    """The meshes of a closed model are closed in every tool that does not cut at texture coordinates or normals."""
    for ending in ("obj", "ply", "stl"):
        path = str(folder / f"can.{ending}")
        meshes = pymeshlab.MeshSet()
        meshes.load_new_mesh(path)
        found = meshes.get_topological_measures()
        assert found["boundary_edges"] == 0 and found["non_two_manifold_edges"] == 0, (ending, found)
        assert found["connected_components_number"] == 1, (ending, found)
        say("MeshLab", f"can.{ending}: no open edges, 1 component")
        if ending == "obj":
            # PyVista and trimesh give every corner of an edge or a seam a vertex of its own.
            continue
        mesh = pyvista.read(path)
        assert mesh.n_open_edges == 0 and mesh.is_manifold, ending
        solid = trimesh.load(path)
        assert solid.is_watertight and solid.is_winding_consistent and solid.body_count == 1, ending
        expected = np.pi * 20**2 * 50
        assert abs(solid.volume - expected) < 0.005 * expected, solid.volume
        say("both", f"can.{ending}: manifold in PyVista; watertight in trimesh, {solid.volume:.0f} mm3")


def main():
    gmlc, folder = str(Path(sys.argv[1]).resolve()), Path(sys.argv[2])
    report = made(gmlc, folder)
    out = folder / "out"
    surface = with_pyvista(out, report)
    with_meshlab(out, surface)
    with_trimesh(out, surface, report)
    with_cloudcompare(out, surface)
    with_csv(out, report)
    welded(folder)


main()
