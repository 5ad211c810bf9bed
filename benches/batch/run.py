"""Scans a second: `gmlc batch` beside one process a scan, and beside SciPy with Open3D, in one run.

    python benches/batch/run.py GMLC FOLDER [COUNT] [PEERS]

makes COUNT (1,000) virtual cups of some 20,000 points in FOLDER, each with other parameters, and then takes the times of

- `gmlc batch --start-from previous` for all of them, and from the defaults for a fifth;
- `gmlc inspect`'s work, one process a scan (`gmlc fit` and `gmlc variance` cannot share what they read; a batch of one scan
  writes the same files), two processes at once, for a tenth of them;
- SciPy and Open3D (benches/peers/fit_scipy.py: fit only, from the truth moved by 2 %), one process, for ten of them, if PEERS
  is a Python that has numpy, scipy and open3d.

Memory is the largest resident set of the batch, sampled at each tenth of its scans.
"""

from __future__ import annotations

import json
import os
import random
import resource
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

CUP = Path(__file__).resolve().parents[2] / "examples" / "cup" / "cup.gml"
FAST = ["--documents", "figures", "-q"]


def values(i: int) -> dict[str, str]:
    draw = random.Random(i)
    r = 42 + draw.gauss(0, 0.3)
    return {"r": f"{r}mm", "h": f"{90 + 0.8 * (r - 42) + draw.gauss(0, 0.2)}mm", "shape": f"{1 + draw.gauss(0, 0.02)}"}


def make(gmlc: str, folder: Path, count: int) -> None:
    folder.mkdir(parents=True, exist_ok=True)

    def one(i: int) -> None:
        path = folder / f"cup_{i}.ply"
        if path.exists():
            return
        given = [word for name, value in values(i).items() for word in ("-p", f"{name}={value}")]
        args = ["scan", str(CUP), *given, "--spacing", "1.45mm", "--noise", "0.1mm", "--seed", str(i), "-q"]
        truth = ["--truth", str(folder / f"cup_{i}.json")] if i < 10 else []
        subprocess.run([gmlc, *args, *truth, "-o", str(path)], check=True, stdout=subprocess.DEVNULL)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(one, range(count)))


def resident(pid: int) -> float:
    """The largest resident set until now, in MB; 0 where the system does not tell."""
    try:
        status = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return 0.0
    lines = [line for line in status.splitlines() if line.startswith("VmHWM:")]
    return int(lines[0].split()[1]) / 1024 if lines else 0.0


def listed(folder: Path, scans: Path, count: int) -> Path:
    """A list of the first of the scans."""
    path = folder / f"first-{count}.txt"
    path.write_text("".join(f"{(scans / f'cup_{i}.ply').resolve()}\n" for i in range(count)), encoding="utf-8")
    return path


def spent() -> float:
    """Processor seconds of the children that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def batch(gmlc: str, scans: Path, output: Path, count: int, more: list[str]) -> tuple[float, float, list[float]]:
    """Seconds by the clock and of processors, and the memory at each tenth."""
    shutil.rmtree(output, ignore_errors=True)
    begun, used = time.monotonic(), spent()
    running = subprocess.Popen([gmlc, "batch", str(CUP), "--list", str(scans), "-o", str(output), *FAST, *more], stdout=subprocess.DEVNULL)
    memory: list[float] = []
    while running.poll() is None:
        time.sleep(0.2)
        try:
            done = sum(1 for _ in os.scandir(output / "scans"))
        except OSError:
            done = 0
        if done * 10 >= (len(memory) + 1) * count:
            memory.append(resident(running.pid))
    assert running.returncode in (0, 4), running.returncode
    return time.monotonic() - begun, spent() - used, memory


def one_by_one(gmlc: str, scans: Path, output: Path, count: int) -> tuple[float, float]:
    shutil.rmtree(output, ignore_errors=True)
    begun, used = time.monotonic(), spent()

    def one(i: int) -> None:
        scan, folder = scans / f"cup_{i}.ply", output / str(i)
        environment = os.environ | {"RAYON_NUM_THREADS": "1"}
        args = [gmlc, "batch", str(CUP), str(scan), "-o", str(folder), "-j", "1", *FAST]
        subprocess.run(args, stdout=subprocess.DEVNULL, env=environment, check=False)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(one, range(count)))
    return time.monotonic() - begun, spent() - used


def peer(python: str, scans: Path, count: int) -> float:
    """Seconds a scan of the fits alone."""
    script = Path(__file__).resolve().parents[1] / "peers" / "fit_scipy.py"
    total = 0.0
    names = ["x", "y", "z", "alpha", "beta", "gamma", "shape", "r", "h", "h1", "h2a", "h2b", "h3a", "h3b", "h4"]
    for i in range(count):
        made = json.loads((scans / f"cup_{i}.json").read_text())
        # The scanner has moved the object.
        placed = dict(zip(names, [*made["pose"]["translation"], *made["euler"]]))
        truth = made["parameters"] | placed
        draw = random.Random(i)
        start = [truth[name] * (1 + 0.02 * draw.uniform(-1, 1)) for name in names]
        done = subprocess.run(
            [python, str(script), str(scans / f"cup_{i}.ply"), "0.5"],
            input=" ".join(map(str, start)),
            capture_output=True,
            text=True,
            check=True,
        )
        total += float(done.stdout.split()[0])
    return total / count


def main() -> None:
    gmlc, folder = sys.argv[1], Path(sys.argv[2])
    count = int(sys.argv[3]) if len(sys.argv) > 3 else 1000
    scans = folder / "scans"
    make(gmlc, scans, count)
    runs = [("batch --start-from previous", ["--start-from", "previous"], count), ("batch", [], max(10, count // 5))]
    for name, more, of in runs:
        clock, processor, memory = batch(gmlc, listed(folder, scans, of), folder / "out", of, more)
        shown = " ".join(f"{m:.0f}" for m in memory)
        rates = f"{of / clock:.2f} scans a second, {processor / of:.2f} processor seconds a scan"
        print(f"{name}, {of} scans: {rates}; MB at tenths: {shown}", flush=True)
    few = max(10, count // 10)
    clock, processor = one_by_one(gmlc, scans, folder / "single", few)
    print(f"one process a scan, {few} scans: {few / clock:.2f} scans a second, {processor / few:.2f} processor seconds a scan")
    if len(sys.argv) > 4:
        print(f"SciPy and Open3D, the fit alone: {peer(sys.argv[4], scans, 10):.2f} s a scan")


if __name__ == "__main__":
    main()
