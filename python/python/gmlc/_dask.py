"""``gmlc batch --dask ADDRESS``: the scans of a batch on the workers of a Dask cluster."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from typing import Any

from . import _gmlc

#: Jobs that are handed to the scheduler before the first of them is done, for each of its workers' threads.
_AHEAD = 4

#: Seconds between two lines of progress.
_BETWEEN = 10.0


def batch_jobs(words: list[str]) -> tuple[str, list[str], int, int]:
    """The jobs of a command line of ``gmlc batch``, for any scheduler: ``["gmlc", "batch", "cup.gml", "scans", ...]``.

    :return: what all jobs share, and the jobs, both texts that travel to workers; the numbers of scans that are done and
        of all
    """
    return _gmlc.batch_jobs(words)


def batch_work(bundle: str, job: str) -> list[tuple[str, bool]]:
    """Do a job of :func:`batch_jobs` in this process, with results in the batch's folder; what is done already is not
    done again.

    :return: the names of its scans, and whether each has a result
    """
    return _gmlc.batch_work(bundle, job)


def without_option(words: list[str], option: str) -> tuple[list[str], str]:
    """The words without an option, and the option's value."""
    rest: list[str] = []
    value = ""
    source = iter(words)
    for word in source:
        if word == option:
            value = next(source, "")
        elif word.startswith(f"{option}="):
            value = word.split("=", 1)[1]
        else:
            rest.append(word)
    return rest, value


def run(client: Any, bundle: str, jobs: list[str]) -> Iterator[list[tuple[str, bool]]]:
    """Does jobs on the workers of a client; yields the results as they come, and nothing of what fails."""
    from distributed import as_completed

    shared = client.scatter(bundle, broadcast=True, hash=False)
    threads = max(1, sum(client.nthreads().values()))
    source = iter(jobs)

    def submitted() -> Iterator[Any]:
        for job in source:
            # Dask itself does work again whose worker is lost.
            yield client.submit(batch_work, shared, job, pure=False)
            return

    running = as_completed([future for _ in range(_AHEAD * threads) for future in submitted()])
    for future in running:
        if future.status == "finished":
            yield future.result()
        else:
            print(f"warning: a job failed on its worker: {future.exception()!r}", file=sys.stderr)
        for more in submitted():
            running.add(more)


def main(words: list[str]) -> int:
    """Do what the command line says; returns the exit status."""
    local, address = without_option(words, "--dask")
    try:
        from distributed import Client
    except ImportError:
        print("error: --dask needs the package distributed: pip install 'gmlc[dask]'", file=sys.stderr)
        return 2
    try:
        bundle, jobs, done, total = batch_jobs(local)
    except _gmlc.Error as error:
        print(f"error: {error}", file=sys.stderr)
        return 2 if isinstance(error, _gmlc.UsageError) else 1
    quiet = "-q" in local or "--quiet" in local
    if done and not quiet:
        print(f"{done} of {total} scans are done", file=sys.stderr)
    if jobs:
        try:
            client = Client(address, timeout=10)
        except Exception as error:  # noqa: BLE001: whatever the address leads to
            print(f"error: --dask {address}: {error}", file=sys.stderr)
            return 1
        begun = said = time.monotonic()
        pending, finished, failed = total - done, 0, 0
        with client:
            for names in run(client, bundle, jobs):
                finished += len(names)
                failed += sum(not ok for _, ok in names)
                now = time.monotonic()
                if not quiet and now - said >= _BETWEEN:
                    said = now
                    left = (now - begun) / finished * max(0, pending - finished)
                    print(f"inspecting, {finished} of {pending}, {failed} without a result, about {left:.0f} s left", file=sys.stderr)
    # Everything is in its folder: tables and page are written here, and what no worker could do is done here.
    return _gmlc.command(local)
