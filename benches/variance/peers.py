"""The rays of benches/variance cast with Embree, through Open3D and embreex: `peers.py RAYS SCAN.ply [MAX_DISTANCE]`.

RAYS is what `cargo bench --bench variance -- --dump RAYS` writes; with GMLC_PEER_PYTHON the benchmark runs this script itself. `casting` is
the two casts alone; `all` is what a script has to do with them: build the scene, lay out the rays of both directions, cast, drop what lies
beyond the distance, take the nearer of both, code the texture's three bytes, and the statistics that gmlc has (mean, sd, rms, median,
percentiles, MAD, histogram; unsigned and signed). Each the least of three runs, in seconds of the wall and of all processors; rays a second
count two a texel. Then every ray about which gmlc and a peer disagree is judged in double precision, and distances to closest points
(RAYS.closest) are compared with Open3D, libigl and CloudCompare.
"""

import json
import pathlib
import sys
import time

import numpy as np

import cloudcompare
from judge import Judge


def statistics(signed, limit):
    signed = signed[np.isfinite(signed)]
    found = []
    for x in (np.abs(signed), signed):
        p = np.percentile(x, [1, 5, 25, 50, 75, 95, 99])
        found += [x.mean(), x.std(), x.min(), x.max(), *p, np.median(np.abs(x - p[3]))]
    return found + [np.sqrt((signed**2).mean()), np.histogram(signed, 64, (-limit, limit))]


def finish(outward, inward, limit):
    outward[outward > limit] = np.inf
    inward[inward > limit] = np.inf
    signed = np.where(outward <= inward, outward, -inward)
    codes = np.empty((len(signed), 3), np.uint8)
    for k, d in enumerate((outward, inward)):
        hit = np.isfinite(d)
        codes[:, k] = np.where(hit, d, 0) * (255 / limit) + 0.5
        codes[:, 2] = hit * (128 >> k) if k == 0 else codes[:, 2] | hit * 64
    return signed, statistics(signed, limit)


def clocks():
    return np.array([time.perf_counter(), time.process_time()])


def run(build, cast, rays, limit):
    times = []
    for _ in range(3):
        start = clocks()
        scene = build()
        forward = rays.copy()
        backward = rays.copy()
        backward[:, 3:] *= -1
        before = clocks()
        outward = cast(scene, forward)
        inward = cast(scene, backward)
        casting = clocks() - before
        signed, _ = finish(outward, inward, limit)
        times.append([casting, clocks() - start])
    return np.min(times, axis=0), signed, np.stack([outward, inward], axis=1)


def compare(name, judge, rays, theirs, ours):
    """Judges every ray for which the two differ: in whether something is hit, or by more than rounding."""
    theirs = np.where(theirs > judge.limit, np.inf, theirs).astype(np.float64)
    ours = np.where(np.isfinite(ours), ours, np.inf).astype(np.float64)
    hit, found = np.isfinite(theirs), np.isfinite(ours)
    with np.errstate(invalid="ignore"):
        differ = np.where(hit & found, np.abs(theirs - ours) > 2 * judge.blur, hit != found)
    disputed = np.argwhere(differ)
    wrong = {"gmlc": 0, name: 0}
    for i, side in disputed:
        ray = rays[i].astype(np.float64)
        hits = judge.hits(ray[:3], ray[3:] * (1, -1)[side])
        wrong["gmlc"] += not judge.agrees(hits, ours[i, side])
        wrong[name] += not judge.agrees(hits, theirs[i, side])
    agreed = hit & found & ~differ
    both = np.abs(theirs[agreed] - ours[agreed])
    print(f"{'':8} of {theirs.size} rays {len(disputed)} differ by more than {2 * judge.blur:.1g} mm or hit for one only ({(hit & ~found).sum()} for {name}, "
          f"{(found & ~hit).sum()} for gmlc); the others by at most {both.max(initial=0):.1g} mm")
    print(f"{'':8} in double precision, of these: {wrong['gmlc']} wrong of gmlc, {wrong[name]} of {name}")
    return wrong["gmlc"]


def compare_closest(path, mesh_path):
    """Distances to closest points against Open3D (single precision) and, where they are installed, libigl (double) and CloudCompare (single)."""
    import open3d as o3d

    found = np.fromfile(path, np.float64).reshape(-1, 4)
    points, ours = found[:, :3], found[:, 3]
    mesh = o3d.io.read_triangle_mesh(mesh_path)
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.triangles)
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.t.geometry.TriangleMesh.from_legacy(mesh))
    theirs = {"open3d": scene.compute_distance(o3d.core.Tensor.from_numpy(points.astype(np.float32))).numpy()}
    try:
        import igl

        theirs["libigl"] = np.sqrt(igl.point_mesh_squared_distance(points, vertices, faces.astype(np.int64))[0])
    except ImportError:
        print("libigl   is not installed")
    with_cloudcompare = cloudcompare.distances(points, mesh_path)
    if with_cloudcompare is not None:
        theirs["CloudCompare"] = with_cloudcompare
    figures = lambda d: "  ".join(f"{x:.7f}" for x in (d.mean(), d.std(), *np.percentile(d, [5, 50, 95]), d.max()))
    print(f"{len(ours)} closest points: mean, standard deviation, percentiles 5, 50, 95, maximum; largest difference; mm")
    print(f"{'gmlc':13} {figures(ours)}")
    for name, distances in theirs.items():
        distances = distances.astype(np.float64)
        print(f"{name:13} {figures(distances)}  {np.abs(distances - ours).max():.2g}")


def open3d_scene(path):
    import open3d as o3d

    mesh = o3d.t.geometry.TriangleMesh.from_legacy(o3d.io.read_triangle_mesh(path))

    def build():
        scene = o3d.t.geometry.RaycastingScene()
        scene.add_triangles(mesh)
        # Embree builds its tree when the first ray is cast.
        scene.cast_rays(o3d.core.Tensor(np.zeros((1, 6), np.float32)))
        return scene

    return build, lambda scene, rays: scene.cast_rays(o3d.core.Tensor.from_numpy(rays))["t_hit"].numpy()


def embreex_scene(path):
    import open3d as o3d
    from embreex import rtcore_scene
    from embreex.mesh_construction import TriangleMesh

    mesh = o3d.io.read_triangle_mesh(path)
    corners = np.asarray(mesh.vertices, np.float32)[np.asarray(mesh.triangles)]

    def build():
        scene = rtcore_scene.EmbreeScene()
        TriangleMesh(scene, corners)
        return scene

    def cast(scene, rays):
        origins, directions = np.ascontiguousarray(rays[:, :3]), np.ascontiguousarray(rays[:, 3:])
        found = scene.run(origins, directions, query="DISTANCE").astype(np.float32)
        # What hits nothing is very far away.
        found[found > 1e30] = np.inf
        return found

    return build, cast


def main():
    import open3d as o3d

    rays = np.fromfile(sys.argv[1], np.float32).reshape(-1, 6)
    limit = float(sys.argv[3]) if len(sys.argv) > 3 else 10.0
    ours = np.fromfile(sys.argv[1] + ".found", np.float32).reshape(-1, 2)
    times = pathlib.Path(sys.argv[1] + ".times")
    times = json.loads(times.read_text()) if times.exists() else None
    mesh = o3d.io.read_triangle_mesh(sys.argv[2])
    judge = Judge(mesh.vertices, np.asarray(mesh.triangles), limit)
    wrong = 0
    for name, scene in (("open3d", open3d_scene), ("embreex", embreex_scene)):
        try:
            scene = scene(sys.argv[2])
        except ImportError:
            print(f"{name:8} is not installed")
            continue
        (casting, everything), signed, both = run(*scene, rays, limit)
        hit = np.isfinite(signed)
        print(f"{name:8} {len(signed)} texels, coverage {hit.mean():.4f}, rms {np.sqrt((signed[hit] ** 2).mean()):.4f} mm")
        print(f"{'':8} casting {casting[0]:.3f} s, processor {casting[1]:.3f} s", end="; ")
        print(f"{2e-6 * len(rays) / casting[0]:.1f} M rays/s, {2e-6 * len(rays) / casting[1]:.1f} a processor")
        print(f"{'':8} all     {everything[0]:.3f} s, processor {everything[1]:.3f} s")
        if times:
            share = [np.array(times[key]) / peer for key, peer in (("casting", casting), ("all", everything))]
            print(f"{'':8} gmlc's share: casting {share[0][0]:.2f}, processor {share[0][1]:.2f}; all {share[1][0]:.2f}, processor {share[1][1]:.2f}")
        wrong += compare(name, judge, rays, both, ours)
    compare_closest(sys.argv[1] + ".closest", sys.argv[2])
    sys.exit(wrong > 0)


main()
