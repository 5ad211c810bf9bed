"""Distances by CloudCompare's command line."""

import os
import pathlib
import shutil
import subprocess
import tempfile

import numpy as np


def distances(points, mesh_path):
    """From points to the mesh of a file, by triangles; none where there is no command of that name."""
    command = shutil.which("CloudCompare")
    if command is None:
        print("CloudCompare is not installed")
        return None
    with tempfile.TemporaryDirectory() as folder:
        cloud, result = pathlib.Path(folder, "points.asc"), pathlib.Path(folder, "distances.asc")
        np.savetxt(cloud, points, fmt="%.9f")
        options = ["-SILENT", "-AUTO_SAVE", "OFF", "-C_EXPORT_FMT", "ASC", "-PREC", "9", "-O", str(cloud), "-O", mesh_path]
        words = [command, *options, "-C2M_DIST", "-SAVE_CLOUDS", "FILE", str(result)]
        said = subprocess.run(words, capture_output=True, text=True, env={**os.environ, "QT_QPA_PLATFORM": "offscreen"})
        if said.returncode != 0 or not result.exists():
            raise SystemExit(f"{' '.join(words)}: {said.stdout[-2000:]}{said.stderr[-2000:]}")
        # Signed by the nearest triangle's side.
        return np.abs(np.loadtxt(result)[:, 3])
