"""Reads a file as Open3D and trimesh read it, for benches/read: `peers.py FILE`.

Prints a line for each in the benchmark's form: wall and processor seconds, the least of five runs, and megabytes of the file a second.
trimesh reads with and without its `process`, which merges equal vertices; of STL only the former is what the others have.
"""

import os
import sys
import time

path = sys.argv[1]
megabytes = os.path.getsize(path) / 1e6


def run(name, read):
    wall, processor = [], []
    for _ in range(5):
        start, used = time.perf_counter(), time.process_time()
        try:
            found = read()
        except Exception as error:
            print(f"  {name:16}{type(error).__name__}")
            return
        wall.append(time.perf_counter() - start)
        processor.append(time.process_time() - used)
        if not found:
            print(f"  {name:16}reads nothing")
            return
    wall, processor = min(wall), min(processor)
    print(f"  {name:16}{megabytes:9.1f}{wall:10.3f}{processor:13.3f}{megabytes / wall:9.0f}", flush=True)


try:
    import open3d

    open3d.utility.set_verbosity_level(open3d.utility.VerbosityLevel.Error)
    run("Open3D", lambda: len(open3d.io.read_triangle_mesh(path).triangles))
except ImportError:
    print("  Open3D is not installed")
try:
    import trimesh

    def whole(process):
        mesh = trimesh.load(path, process=process)
        return len(getattr(mesh, "vertices", [1]))

    run("trimesh, merged", lambda: whole(True))
    run("trimesh, as it is", lambda: whole(False))
except ImportError:
    print("  trimesh is not installed")
