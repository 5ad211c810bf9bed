"""The rays of benches/variance cast with Embree, through Open3D and embreex: `peers.py RAYS SCAN.ply [MAX_DISTANCE]`.

RAYS is what `cargo bench --bench variance -- --dump RAYS` writes. `casting` is the two casts alone; `all` is what a script has
to do with them: build the scene, lay out the rays of both directions, cast, drop what lies beyond the distance, take the
nearer of both, code the texture's three bytes, and the statistics that gmlc has (mean, sd, rms, median, percentiles, MAD,
histogram; unsigned and signed). Each the least of three runs, in seconds of the wall and of all processors; rays a second
count two a texel. Then distances to closest points (RAYS.closest), against Open3D and libigl.
"""

import sys
import time

import numpy as np


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


def compare(theirs, ours, limit):
    """Hits on one side only, but for those at the very ends of the rays, and the largest difference of the others."""
    hit, found = np.isfinite(theirs), np.isfinite(ours)
    # A texel on the scan itself is at distance zero in both directions for gmlc; a ray from it may miss behind its origin.
    at_an_end = (np.nan_to_num(theirs, posinf=0) > limit - 1e-3) | (np.nan_to_num(ours) > limit - 1e-3) | (ours < 1e-3)
    lost, extra = hit & ~found & ~at_an_end, found & ~hit & ~at_an_end
    late = np.abs(theirs - ours)[hit & found]
    print(f"{'':8} {lost.sum()} hits that gmlc has not, {extra.sum()} that only gmlc has; "
          f"differences of the other {len(late)}: {(late > 1e-3).sum()} above 1e-3 mm, largest {late.max():.2g} mm")


def compare_closest(path, mesh_path):
    """Distances to closest points against Open3D (single precision) and, where it is installed, libigl (double)."""
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
    for name, distances in theirs.items():
        late = np.abs(distances - ours)
        print(f"{name:8} {len(ours)} closest points, largest difference {late.max():.2g} mm; mean {ours.mean():.7f} and "
              f"{distances.mean(dtype=np.float64):.7f}, sd {ours.std():.7f} and {distances.std(dtype=np.float64):.7f} mm")


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
        return scene.run(origins, directions, query="DISTANCE").astype(np.float32)

    return build, cast


def main():
    rays = np.fromfile(sys.argv[1], np.float32).reshape(-1, 6)
    limit = float(sys.argv[3]) if len(sys.argv) > 3 else 10.0
    for name, scene in (("open3d", open3d_scene), ("embreex", embreex_scene)):
        (casting, everything), signed, both = run(*scene(sys.argv[2]), rays, limit)
        hit = np.isfinite(signed)
        print(f"{name:8} {len(signed)} texels, coverage {hit.mean():.4f}, rms {np.sqrt((signed[hit] ** 2).mean()):.4f} mm")
        print(f"{'':8} casting {casting[0]:.3f} s, processor {casting[1]:.3f} s", end="; ")
        print(f"{2e-6 * len(rays) / casting[0]:.1f} M rays/s, {2e-6 * len(rays) / casting[1]:.1f} a processor")
        print(f"{'':8} all     {everything[0]:.3f} s, processor {everything[1]:.3f} s")
        compare(both, np.fromfile(sys.argv[1] + ".found", np.float32).reshape(-1, 2), limit)
    compare_closest(sys.argv[1] + ".closest", sys.argv[2])


main()
