"""Whether gmlc's distances are those of other programs: `agreement.py (FOLDER MODEL.ply SCAN.ply)...`.

`cargo bench --bench variance -- --agreement` makes the meshes and the folders, whose files agreement.rs describes, and runs this script.
The others read the same two files. Three kinds of distances are compared, without the mutual test, which no other program has:

points   from the scan's points to the model's mesh. gmlc computes these in double precision, as libigl does: they may differ by 1e-6 mm, and
         signs (libigl's pseudonormals) may not differ where the model's mesh is closed.
closest  from texels of the model to the closest point of the scan (`--distance closest`), in single precision: they may differ from libigl's
         by 2^-20 of half the scan's longest side, the millionth part, up to which gmlc says zero. Where it does, libigl may find a quarter
         more: each coordinate of a texel and of a triangle is rounded by up to 2^-24 of half that side, a distance by less than 2^-22.
normal   from the texels along both directions of the normal. A ray that grazes a triangle multiplies rounding: where a distance differs by
         more than twice that bound, or one program hits and the other does not, both answers are judged triangle by triangle in double
         precision.

"area refused" is all that the mutual test refuses; the row above it has what is left of the places in the table.

gmlc counts only triangles that make less than a right angle with the point's or texel's normal, the others any. Open3D lists all hits of a
ray, of which those are taken that face so. Where the triangle nearest to a place faces away, the others answer another question: such places
are left out of the table, and gmlc's distances are compared with the nearest of all triangles that face so, one by one in double precision.
The script ends with 1 if a distance or sign of gmlc's is wrong. Open3D and CloudCompare are in single precision, and not held to a bound.
"""

import json
import pathlib
import sys

import numpy as np

import cloudcompare
from judge import ROUNDING, Judge
from triangles import Triangles

# Largest difference of distances in double precision. Millimetres.
DOUBLE = 1e-6

# How far beyond gmlc's bound a distance may be that it takes for zero, in units of the bound.
ZERO = 1.25

# One texel in so many is also cast with libigl, which tries all triangles.
RAY_STEP = 20

HEADING = "| mesh | distance | program | n | mean | sd | 5 % | median | 95 % | max | largest difference | area refused |"


def package(name):
    try:
        return __import__(name)
    except ImportError as error:
        print(f"{name} is left out: {error}")
        return None


open3d, igl = package("open3d"), package("igl")


def row(mesh, distance, program, values, difference=None, refused=None):
    values = np.abs(values)
    figures = " | ".join(f"{x:.7f}" for x in (values.mean(), values.std(), *np.percentile(values, [5, 50, 95]), values.max()))
    difference = "" if difference is None else f"{difference:.1e}"
    refused = "" if refused is None else f"{refused:.1f} mm2"
    return f"| {mesh} | {distance} | {program} | {len(values)} | {figures} | {difference} | {refused} |"


class Case:
    """The files of one case, and what was found wrong with it."""

    def __init__(self, folder, model, scan):
        folder = pathlib.Path(folder)
        self.name, self.model_path, self.scan_path = folder.name, model, scan
        self.about = json.loads((folder / "case.json").read_text())
        self.model, self.scan = Triangles.read(model), Triangles.read(scan)
        read = lambda name, width: np.fromfile(folder / name, np.float64).reshape(-1, width)
        self.points, self.texels = read("points.bin", 7), read("texels.bin", 7)
        self.closest, self.normal = read("closest.bin", 3), read("normal.bin", 3)
        self.rows, self.notes, self.faults = [], [], []

    def fault(self, count, text):
        if count:
            self.faults.append(f"{self.name}: {count} {text}")

    def compare(self):
        if not self.about["oriented"]:
            raise SystemExit(f"{self.scan_path}: the sides of the scan are not known")
        # What cleaning drops would be another mesh.
        if self.about["triangles"] != len(self.scan.triangles):
            self.notes.append(f"{self.name}: of {len(self.scan.triangles)} triangles of the scan gmlc keeps {self.about['triangles']}")
        self.from_points()
        self.to_closest()
        self.along_normals()

    def answers(self, kind, target, path, places, normals, ours, bound):
        """Adds the distances by the others to the table. Returns libigl's triangles and closest points, as nearest_by_libigl has them, and
        which of the places ask all programs the same. `ours` has distances of any sign, which may be off by the bound."""
        found = {}
        if igl is not None:
            found["libigl"] = target.nearest_by_libigl(igl, places)
        if open3d is not None:
            found["Open3D"] = target.nearest_by_open3d(open3d, places)
        # A place whose nearest triangle faces the same way asks the same of a program that counts all.
        facing = {name: np.einsum("ij,ij->i", target.normals[index], normals) > ROUNDING for name, (_, index, _) in found.items()}
        same = facing.get("libigl", facing.get("Open3D", np.ones(len(places), bool)))
        others = {name: distance for name, (distance, _, _) in found.items()}
        with_cloudcompare = cloudcompare.distances(places, path)
        if with_cloudcompare is not None:
            others["CloudCompare"] = with_cloudcompare
        bounds = np.where(ours == 0, ZERO * bound, bound)
        self.rows.append(row(self.name, kind, "gmlc, mutual test off", ours[same]))
        for name, distance in others.items():
            difference = np.abs(np.abs(ours) - distance)
            self.rows.append(row(self.name, kind, name, distance[same], difference[same].max(initial=0)))
            if name == "libigl":
                self.fault((difference > bounds)[same].sum(), f"distances ({kind}) differ from libigl's by more than {bound:.2g} mm")
                told = difference[same & (ours != 0)].max(initial=0)
                self.notes.append(f"{self.name}, {kind}: bound {bound:.1e} mm; where gmlc does not say zero it differs by {told:.1e} mm from libigl")
        # The others are judged one by one.
        away = np.flatnonzero(~same)
        off = [abs(abs(ours[i]) - target.nearest_facing(places[i], normals[i], abs(ours[i]) + 1)) for i in away]
        off = np.array(off)
        self.fault((off > bounds[away]).sum(), f"distances ({kind}) are not those of the nearest triangle that faces the same way")
        self.notes.append(f"{self.name}, {kind}: at {len(off)} places the nearest triangle faces away; gmlc differs by {off.max(initial=0):.1e} mm "
                          "from the nearest of the others, one by one")
        return found.get("libigl"), same

    def from_points(self):
        measured = self.points[np.isfinite(self.points[:, 6])]
        places, normals, ours = measured[:, :3], measured[:, 3:6], measured[:, 6]
        _, same = self.answers("points", self.model, self.model_path, places, normals, ours, DOUBLE)
        if igl is None:
            return
        holes = self.model.open_edges()
        if holes:
            self.notes.append(f"{self.name}: signs are not compared: {holes} edges of the model's mesh have a single triangle")
            return
        kind = igl.SignedDistanceType.SIGNED_DISTANCE_TYPE_PSEUDONORMAL
        theirs = igl.signed_distance(places, self.model.vertices, self.model.triangles, kind)[0]
        told = same & (np.abs(ours) > DOUBLE)
        wrong = told & (np.sign(theirs) != np.sign(ours))
        self.fault(wrong.sum(), "signs (points) differ from libigl's")
        self.notes.append(f"{self.name}: {wrong.sum()} of {told.sum()} signs differ from libigl's pseudonormals")

    def texels_with(self, ours):
        return self.texels[:, :3], self.texels[:, 3:6], np.where(np.isfinite(ours[:, 0]), ours[:, 0], -ours[:, 1])

    def to_closest(self):
        places, normals, ours = self.texels_with(self.closest)
        measured = np.isfinite(ours)
        places, normals, ours, mutual = places[measured], normals[measured], ours[measured], self.closest[measured, 2]
        bound = self.about["precision"]
        theirs, same = self.answers("closest", self.scan, self.scan_path, places, normals, ours, bound)
        kept = mutual[same & np.isfinite(mutual)]
        self.rows.append(row(self.name, "closest", "gmlc, mutual test on", kept, None, self.about["refused"][0]))
        if theirs is None:
            return
        height = np.einsum("ij,ij->i", theirs[2] - places, normals)
        told = same & (np.abs(height) > bound) & (ours != 0)
        wrong = told & (np.sign(height) != np.sign(ours))
        self.fault(wrong.sum(), "signs (closest) differ from libigl's")
        self.notes.append(f"{self.name}: {wrong.sum()} of {told.sum()} signs differ from the side of libigl's closest points")

    def along_normals(self):
        """Distances outwards and inwards, infinite where nothing is hit."""
        limit, blur = self.about["max_distance"], self.about["precision"]
        usable = np.ones(len(self.texels), bool)
        usable[self.about["buried"]] = False
        places, normals, _ = self.texels_with(self.normal)
        # What is buried has no distance, whatever is there.
        ours = np.where(np.isfinite(self.normal[:, :2]), self.normal[:, :2], np.inf)
        judge = Judge(self.scan.vertices, self.scan.triangles, limit)
        signed = lambda both: np.where(both[:, 0] <= both[:, 1], both[:, 0], -both[:, 1])
        finite = lambda both: both[np.isfinite(both).any(axis=1)]
        self.rows.append(row(self.name, "normal", "gmlc, mutual test off", signed(finite(ours[usable]))))
        for name, hits, step in (("Open3D", self.scan.hits_by_open3d, 1), ("libigl", self.scan.hits_by_libigl, RAY_STEP)):
            module = open3d if name == "Open3D" else igl
            if module is None:
                continue
            some = np.flatnonzero(usable)[::step]
            theirs = hits(module, places[some], normals[some], blur)
            theirs[theirs > limit] = np.inf
            mine = ours[some]
            hit, found = np.isfinite(theirs), np.isfinite(mine)
            with np.errstate(invalid="ignore"):
                difference = np.where(hit & found, np.abs(theirs - mine), 0)
            disputed = np.argwhere((hit != found) | (difference > 2 * blur))
            wrong = {"gmlc": 0, name: 0}
            for i, side in disputed:
                at, normal = places[some[i]], normals[some[i]]
                possible = judge.hits(at, normal * (1, -1)[side], normal)
                wrong["gmlc"] += not judge.agrees(possible, mine[i, side])
                wrong[name] += not judge.agrees(possible, theirs[i, side])
            agreed = np.ones(difference.shape, bool)
            agreed[tuple(disputed.T)] = False
            suffix = "" if step == 1 else f", every {step}th"
            self.rows.append(row(self.name, "normal", name + suffix, signed(finite(theirs)), difference[agreed].max(initial=0)))
            self.fault(wrong["gmlc"], f"distances along normals are wrong where {name} has another")
            self.notes.append(f"{self.name}, normal: {len(disputed)} of {2 * len(some)} rays differ from {name}'s by more than {2 * blur:.1e} mm "
                              f"or hit for one only; wrong of gmlc {wrong['gmlc']}, of {name} {wrong[name]}")
        mutual = self.normal[:, 2]
        self.rows.append(row(self.name, "normal", "gmlc, mutual test on", mutual[np.isfinite(mutual)], None, self.about["refused"][1]))


def main():
    words = sys.argv[1:]
    cases = [Case(*words[i : i + 3]) for i in range(0, len(words), 3)]
    for case in cases:
        case.compare()
    print(HEADING)
    print("|---" * HEADING.count(" |") + "|")
    for line in [row for case in cases for row in case.rows]:
        print(line)
    print()
    for line in [note for case in cases for note in case.notes]:
        print(line)
    faults = [fault for case in cases for fault in case.faults]
    for line in faults:
        print(f"WRONG: {line}")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
