"""The jobs of a batch on Ray, a worker of which is killed in the middle: the table is that of the command alone.

    python benches/batch/ray_jobs.py

with a Python that has the package and Ray.
"""

from __future__ import annotations

import csv
import os
import signal
import subprocess
import sysconfig
import tempfile
from pathlib import Path

import ray

import gmlc

CUP = Path(__file__).resolve().parents[2] / "examples" / "cup" / "cup.gml"


def table(folder: Path) -> list[dict[str, str]]:
    with open(folder / "table.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return [{name: cell for name, cell in row.items() if name not in ("seconds", "time")} for row in rows]


@ray.remote(max_retries=3)
def work(bundle: str, job: str, killed: str) -> tuple[int, list[tuple[str, bool]]]:
    """A job; the first worker that comes here is killed."""
    try:
        os.close(os.open(killed, os.O_CREAT | os.O_EXCL))
    except FileExistsError:
        return os.getpid(), gmlc.batch_work(bundle, job)
    os.kill(os.getpid(), signal.SIGKILL)
    raise AssertionError


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "scans").mkdir()
        model = gmlc.Model.load(CUP)
        for i in range(6):
            gmlc.scan(model, folder / "scans" / f"cup_{i}.ply", r=f"{41 + 0.2 * i}mm", spacing="3mm", seed=i)
        program = str(Path(sysconfig.get_path("scripts")) / "gmlc")
        words = [program, "batch", str(CUP), str(folder / "scans"), "--documents", "figures", "-q", "-o"]
        on_ray, alone = folder / "ray", folder / "alone"
        bundle, jobs, _, total = gmlc.batch_jobs([*words, str(on_ray)])
        ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
        done = ray.get([work.remote(bundle, job, str(folder / "killed")) for job in jobs])
        workers = {pid for pid, _ in done}
        assert sum(len(names) for _, names in done) == total == 6, done
        # 4 is the status of a batch with fits that cannot be relied on.
        for output in (on_ray, alone):
            assert subprocess.run([*words, str(output)], check=False).returncode in (0, 4)
        assert table(on_ray) == table(alone), "the tables differ"
        print(f"six scans by {len(workers)} workers, one killed before: the table is that of the command alone")


if __name__ == "__main__":
    main()
