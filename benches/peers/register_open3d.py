"""Two scans of one object that hardly overlap, registered by the model and by pairs of points.

    python register_open3d.py GMLC MODEL.gml [--front X,Y,Z] [--overlap DEGREES] [--noise MM] [--seed N] [--symmetry N]
                              [--work DIR]

makes two virtual scans of the whole object, each in a random pose (`gmlc scan`), keeps of the one what faces --front
in the model's frame (0,0,1 unless given) and of the other what faces the opposite direction, and registers the two in
one run: by `gmlc fit MODEL A B`, and by Open3D: features (FPFH) and RANSAC, then point-to-plane ICP; and ICP alone from
the truth, turned by five degrees, which is more help than a real pair of scans gets. With --overlap the halves reach so
many degrees beyond the silhouette. It prints for each the error of the pose of B in the frame of A: the angle, and how
far the model's points are off on the average. A registration counts as failed beyond 2 degrees or 2 % of the object's
size. Where turns by 1/N about the model's z axis do not change it (--symmetry N), the nearest of its poses counts. Needs
numpy and open3d.
"""

import argparse
import json
import pathlib
import subprocess
import tempfile
import time

import numpy as np
import open3d as o3d


def matrix(pose):
    """A pose of truth.json or fit.json as a 4 x 4 matrix."""
    m = np.eye(4)
    m[:3, :3], m[:3, 3] = pose["rotation"], pose["translation"]
    return m


def view(args, work, name, seed, direction):
    """A virtual scan of what faces `direction`; its path, its true pose and its mesh."""
    whole, truth = work / f"{name}_whole.ply", work / f"{name}_truth.json"
    scan = [args.gmlc, "scan", args.model, "-o", whole, "--truth", truth, "--seed", str(seed), "--noise", f"{args.noise}mm"]
    subprocess.run([str(a) for a in scan + (["--spacing", args.spacing] if args.spacing else [])], check=True)
    pose = matrix(json.loads(truth.read_text())["pose"])
    mesh = o3d.io.read_triangle_mesh(str(whole))
    mesh.compute_triangle_normals()
    least = -np.sin(np.radians(args.overlap))
    facing = np.asarray(mesh.triangle_normals) @ (pose[:3, :3] @ direction)
    mesh.remove_triangles_by_mask(facing <= least)
    mesh.remove_unreferenced_vertices()
    path = work / f"{name}.ply"
    o3d.io.write_triangle_mesh(str(path), mesh, write_vertex_normals=False)
    return path, pose, mesh


def by_pairs(a, b, size, initial):
    """The pose of B in A's frame by Open3D, from features or from `initial`."""
    voxel = size / 60
    clouds = []
    for mesh in (b, a):
        cloud = o3d.geometry.PointCloud(mesh.vertices).voxel_down_sample(voxel)
        cloud.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(2 * voxel, 30))
        # The scanner's side is known: normals are the mesh's.
        mesh.compute_vertex_normals()
        tree = o3d.geometry.KDTreeFlann(o3d.geometry.PointCloud(mesh.vertices))
        normals = np.asarray(mesh.vertex_normals)
        own = [normals[tree.search_knn_vector_3d(p, 1)[1][0]] for p in cloud.points]
        cloud.normals = o3d.utility.Vector3dVector(np.array(own))
        clouds.append(cloud)
    registration = o3d.pipelines.registration
    if initial is None:
        o3d.utility.random.seed(0)
        search = o3d.geometry.KDTreeSearchParamHybrid(5 * voxel, 100)
        features = [registration.compute_fpfh_feature(cloud, search) for cloud in clouds]
        found = registration.registration_ransac_based_on_feature_matching(
            *clouds, *features, True, 1.5 * voxel, registration.TransformationEstimationPointToPoint(False), 3,
            [registration.CorrespondenceCheckerBasedOnEdgeLength(0.9),
             registration.CorrespondenceCheckerBasedOnDistance(1.5 * voxel)],
            registration.RANSACConvergenceCriteria(400_000, 0.999))
        initial = found.transformation
    refined = registration.registration_icp(
        *clouds, voxel, initial, registration.TransformationEstimationPointToPlane(),
        registration.ICPConvergenceCriteria(max_iteration=200))
    return refined.transformation, refined.fitness


def error(found, truths, points):
    """The angle (degrees) and the mean distance (mm) between a pose of B in A's frame and the nearest of the true ones,
    at points of B."""
    return min((error_of_one(found, truth, points) for truth in truths), key=lambda error: error[1])


def error_of_one(found, truth, points):
    off = np.linalg.inv(truth) @ found
    angle = np.degrees(np.arccos(np.clip((np.trace(off[:3, :3]) - 1) / 2, -1, 1)))
    moved = points @ (off[:3, :3].T - np.eye(3)) + off[:3, 3]
    return angle, np.linalg.norm(moved, axis=1).mean()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("gmlc")
    parser.add_argument("model")
    parser.add_argument("--front", default="0,0,1")
    parser.add_argument("--overlap", type=float, default=0.0)
    parser.add_argument("--noise", type=float, default=0.1)
    parser.add_argument("--symmetry", type=int, default=1)
    parser.add_argument("--spacing")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--work", type=pathlib.Path)
    args = parser.parse_args()
    work = args.work or pathlib.Path(tempfile.mkdtemp(prefix="register-"))
    work.mkdir(parents=True, exist_ok=True)
    front = np.array([float(c) for c in args.front.split(",")])
    front /= np.linalg.norm(front)
    path_a, pose_a, a = view(args, work, "a", args.seed, front)
    path_b, pose_b, b = view(args, work, "b", args.seed + 1, -front)
    truth = pose_a @ np.linalg.inv(pose_b)
    turn = np.eye(4)
    truths = []
    for k in range(args.symmetry):
        turn[:3, :3] = o3d.geometry.get_rotation_matrix_from_axis_angle([0.0, 0.0, 2 * np.pi * k / args.symmetry])
        truths.append(pose_a @ turn @ np.linalg.inv(pose_b))
    points = np.asarray(b.vertices)
    size = np.linalg.norm(a.get_oriented_bounding_box().extent)
    print(f"{args.model}: {len(a.vertices)} and {len(points)} points, {size:.0f} mm, overlap {args.overlap:g} degrees")
    rows = []
    fit = work / "fit.json"
    begin = time.perf_counter()
    subprocess.run([args.gmlc, "fit", args.model, path_a, path_b, "-o", fit], check=False, stdout=subprocess.DEVNULL)
    seconds = time.perf_counter() - begin
    if fit.exists():
        pose = [matrix(scan["pose"]) for scan in json.loads(fit.read_text())["scans"]]
        rows.append(("gmlc, by the model", *error(pose[0] @ np.linalg.inv(pose[1]), truths, points), seconds))
    turned = np.eye(4)
    turned[:3, :3] = o3d.geometry.get_rotation_matrix_from_axis_angle(np.radians(5) * np.array([0.6, 0.0, 0.8]))
    middle = points.mean(axis=0)
    turned[:3, 3] = middle - turned[:3, :3] @ middle
    for name, initial in [("Open3D, FPFH + RANSAC + ICP", None), ("Open3D, ICP from the truth + 5 deg", truth @ turned)]:
        begin = time.perf_counter()
        found, fitness = by_pairs(a, b, size, initial)
        seconds = time.perf_counter() - begin
        rows.append((f"{name} (fitness {fitness:.2f})", *error(found, truths, points), seconds))
    for name, angle, off, seconds in rows:
        verdict = "failed" if angle > 2 or off > 0.02 * size else "registered"
        print(f"  {name:52} {angle:8.3f} deg {off:9.3f} mm {seconds:7.1f} s  {verdict}")


if __name__ == "__main__":
    main()
