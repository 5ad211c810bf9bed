import csv
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import gmlc
from conftest import TIN


def truth(path):
    return 20 + 0.1 * int(path.rsplit("_", 1)[1].split(".")[0])


def test_every_scan_is_an_outcome_and_what_fails_is_one_too(tin, files, tmp_path):
    bad = tmp_path / "bad.ply"
    bad.write_text("ply\nnothing")
    given = [*files, str(bad), str(tmp_path / "absent.ply")]
    outcomes = {o.path: o for o in gmlc.fit_many(tin, iter(given), workers=2, loss="huber")}
    assert set(outcomes) == set(given)
    for path in files:
        assert abs(outcomes[path].fit["r"].value - truth(path)) < 0.05
    for path in given[-2:]:
        assert not outcomes[path].ok and outcomes[path].error
        with pytest.raises(ValueError):
            outcomes[path].fit


def test_inspections_of_many(tin, files, tmp_path):
    outcomes = list(gmlc.fit_many(tin, files[:2], inspect_to=tmp_path / "out", workers=2, resolution=64))
    assert all((Path(o.output) / "report.html").is_file() for o in outcomes), outcomes


def test_threads_are_an_executor_too(tin, files):
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(2) as pool:
        outcomes = list(gmlc.fit_many(tin, files, pool))
    assert sorted(o.path for o in outcomes) == sorted(files) and all(o.ok for o in outcomes)


@pytest.fixture
def cluster():
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, processes=True) as cluster:
        yield cluster


def kill_one(client):
    """Kills a worker of the cluster as a crash would."""
    pids = client.run(os.getpid)
    os.kill(next(iter(pids.values())), signal.SIGKILL)


def test_dask_with_a_worker_that_is_killed(tin, files, cluster):
    from distributed import Client

    with Client(cluster) as client:
        outcomes = []
        for outcome in gmlc.fit_many(tin, files * 3, client.get_executor(), workers=2):
            outcomes.append(outcome)
            if len(outcomes) == 2:
                kill_one(client)
        assert len(outcomes) == 18
        assert all(abs(o.fit["r"].value - truth(o.path)) < 0.05 for o in outcomes)


def rows(folder):
    with open(folder / "table.csv", newline="") as file:
        return list(csv.DictReader(file))


def test_the_command_with_dask_gives_the_table_of_the_command_without(files, cluster, tmp_path):
    from distributed import Client

    (tmp_path / "tin.gml").write_text(TIN)
    command = os.path.join(os.path.dirname(sys.executable), "gmlc")
    scans = os.path.dirname(files[0])
    fast = ["--documents", "figures", "--resolution", "64", "-q"]
    args = [command, "batch", "tin.gml", scans, *fast]
    running = subprocess.Popen(
        [*args, "-o", "dask", "--dask", cluster.scheduler_address], cwd=tmp_path, stderr=subprocess.PIPE, text=True
    )
    with Client(cluster) as client:
        begun = time.monotonic()
        while not list((tmp_path / "dask").glob("scans/*/row.json")) and time.monotonic() - begun < 60:
            time.sleep(0.02)
        kill_one(client)
        _, said = running.communicate(timeout=120)
    assert running.returncode in (0, 3, 4), said
    subprocess.run([*args, "-o", "alone"], cwd=tmp_path, check=False)
    by_dask, alone = rows(tmp_path / "dask"), rows(tmp_path / "alone")
    assert len(by_dask) == len(files)
    besides = ("seconds", "time")
    for a, b in zip(by_dask, alone):
        assert {k: v for k, v in a.items() if k not in besides} == {k: v for k, v in b.items() if k not in besides}


def test_parquet_is_read_by_others(files, tmp_path):
    pyarrow = pytest.importorskip("pyarrow.parquet")
    (tmp_path / "tin.gml").write_text(TIN)
    command = os.path.join(os.path.dirname(sys.executable), "gmlc")
    args = ["batch", "tin.gml", *files[:3], "-o", "out", "--documents", "figures", "--resolution", "64", "-q"]
    subprocess.run([command, *args], cwd=tmp_path, check=False, stdout=subprocess.DEVNULL)
    table = pyarrow.read_table(tmp_path / "out" / "table.parquet")
    expected = rows(tmp_path / "out")
    assert table.column("param.r").to_pylist() == [float(row["param.r"]) for row in expected]
    assert table.column("status").to_pylist() == ["inspected"] * 3
    assert table.schema.metadata[b"gmlc.schema"] == b"1"


def test_what_is_wrong_for_all_is_an_error_at_once(tin, files):
    with pytest.raises(TypeError, match="did you mean"):
        gmlc.fit_many(tin, files, los="huber")
    with pytest.raises(TypeError, match="several"):
        gmlc.fit_many(tin, files[0])


def test_an_executor_that_is_shut_down_ends_the_loop(tin, files):
    from concurrent.futures import ThreadPoolExecutor

    pool = ThreadPoolExecutor(1)
    outcomes = []
    with pytest.raises(RuntimeError):
        for outcome in gmlc.fit_many(tin, files * 3, pool, workers=1):
            outcomes.append(outcome)
            pool.shutdown(wait=False, cancel_futures=True)
    assert outcomes[0].ok and any("executor" in (o.error or "") for o in outcomes)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
def test_forked_workers_have_threads(tin, files):
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor

    # A fit of this process has started the threads that a child does not have.
    gmlc.fit(tin, files[0])
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("fork")) as pool:
        outcomes = list(gmlc.fit_many(tin, files[:2], pool))
    assert all(o.ok for o in outcomes), outcomes
