"""What a scan costs on a Dask cluster, with one worker and with two, and what the machine that hands out work spends.

    python benches/batch/cluster.py GMLC FOLDER [COUNT]

with a Python that has the package (`pip install '.[dask]'`), and GMLC for the virtual scans that it makes in FOLDER
(those of run.py). With two workers and then with one, all COUNT (500) scans are inspected, into a folder each time, by the
jobs of `gmlc batch --dask`; workers are processes of one thread on this machine. The phases of the handing machine are
taken apart:

- before: sums of all scans, the jobs;
- work: all jobs, by the clock and in processor seconds of the workers; their memory at each tenth;
- after: `gmlc batch`, which finds everything done, and writes tables, page and maps.

The last part is the scheduler alone: jobs of the same size that do nothing.
"""

from __future__ import annotations

import os
import shutil
import sys
import time
from pathlib import Path

import psutil
from distributed import Client, LocalCluster

import gmlc
from gmlc import _dask, _gmlc

sys.path.insert(0, str(Path(__file__).resolve().parent))
from run import CUP, listed, make  # noqa: E402


def resident() -> float:
    """MB of this process."""
    return psutil.Process().memory_info().rss / 1e6


def spent() -> float:
    """Processor seconds of this process until now."""
    used = os.times()
    return used.user + used.system


def cluster(workers: int) -> LocalCluster:
    return LocalCluster(
        n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None, memory_limit=0, silence_logs=40
    )


def measure(workers: int, scans: Path, output: Path, count: int) -> None:
    """`scans` is a list of them."""
    shutil.rmtree(output, ignore_errors=True)
    words = ["gmlc", "batch", str(CUP), "--list", str(scans), "-o", str(output), "--documents", "figures", "-q"]
    begun = time.monotonic()
    bundle, jobs, _, total = gmlc.batch_jobs(words)
    before = time.monotonic() - begun
    assert total == len(jobs) == count, (total, len(jobs), count)
    os.environ["RAYON_NUM_THREADS"] = "1"
    memory: list[str] = []
    with cluster(workers) as local, Client(local) as client:
        used = sum(client.run(spent).values())
        begun, finished = time.monotonic(), 0
        for names in _dask.run(client, bundle, jobs):
            finished += len(names)
            if finished * 10 >= (len(memory) + 1) * count:
                memory.append(f"{max(client.run(resident).values()):.0f}")
        work = time.monotonic() - begun
        used = sum(client.run(spent).values()) - used
    assert finished == count, finished
    begun = time.monotonic()
    status = _gmlc.command(words)
    after = time.monotonic() - begun
    rows = sum(1 for _ in open(output / "table.csv", encoding="utf-8")) - 1
    assert status in (0, 4) and rows == count, (status, rows)
    size = sum(file.stat().st_size for file in output.rglob("*") if file.is_file())
    print(
        f"{workers} workers: {count / work:.3f} scans a second, {used / count:.2f} processor seconds a scan; "
        f"before {1e3 * before / count:.1f} ms a scan, after {1e3 * after / count:.1f} ms a scan; "
        f"job {len(jobs[0])} bytes, bundle {len(bundle)} bytes, results {size / count / 1e3:.0f} kB a scan; "
        f"a worker's MB at tenths: {' '.join(memory)}",
        flush=True,
    )


def scheduler(jobs: int) -> None:
    """Jobs that do nothing, of the size of those that do."""
    from distributed import as_completed

    text = "x" * 600
    with cluster(1) as local, Client(local) as client:
        shared = client.scatter("y" * 20_000, broadcast=True, hash=False)
        begun, handed, done = time.monotonic(), 0, 0
        running = as_completed([])

        def submit() -> None:
            running.add(client.submit(lambda bundle, job, i: i, shared, text, handed, pure=False))

        while handed < min(8, jobs):
            submit()
            handed += 1
        for _ in running:
            done += 1
            if handed < jobs:
                submit()
                handed += 1
        print(f"the scheduler and one worker: {done / (time.monotonic() - begun):.0f} empty jobs a second")


def main() -> None:
    program, folder = sys.argv[1], Path(sys.argv[2])
    count = int(sys.argv[3]) if len(sys.argv) > 3 else 500
    scans = folder / "scans"
    make(program, scans, count)
    for workers in (2, 1):
        measure(workers, listed(folder, scans, count), folder / f"cluster-{workers}", count)
    scheduler(2000)


if __name__ == "__main__":
    main()
