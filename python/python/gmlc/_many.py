"""Many scans, over any executor of ``concurrent.futures``: processes of this machine, Dask, and others."""

from __future__ import annotations

import functools
import os
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from typing import Any

from . import _options
from ._fit import Fit
from ._fit import fit as fit_one
from ._fit import inspect as inspect_one
from ._model import Model

#: Tasks that are handed to the executor before the first of them is done, for each of its workers: enough to keep it
#: busy, and few enough that a million paths take no memory.
_AHEAD = 4

#: Seconds between two looks at futures.
_LOOK = 1.0

#: How often work is handed out again whose worker was lost.
_ATTEMPTS = 3


@dataclass(frozen=True)
class Outcome:
    """What came out of one scan."""

    #: The scan's path.
    path: str
    #: fit.json as text; None where there is no fit.
    fit_json: str | None = None
    #: Why there is no fit.
    error: str | None = None
    #: The verdict on all tolerances, of an inspection.
    verdict: str | None = None
    #: The folder of the results, of an inspection.
    output: str | None = None

    @property
    def ok(self) -> bool:
        """Whether there is a fit. One that cannot be relied on is one: see :attr:`Fit.shortcoming`."""
        return self.fit_json is not None

    @property
    def fit(self) -> Fit:
        """The fit; a ValueError where there is none."""
        if self.fit_json is None:
            raise ValueError(f"{self.path}: {self.error}")
        return Fit(self.fit_json)


@functools.lru_cache(maxsize=8)
def _model(texts: tuple[tuple[str, str], ...], words: tuple[str, ...]) -> Model:
    """A model of this worker: compiled once, in some 10 to 30 ms."""
    return Model.from_texts(texts, words)


def _work(job: dict[str, Any]) -> dict[str, Any]:
    """The work on one scan, on plain data and without a state."""
    path = job["path"]
    try:
        model = _model(tuple(tuple(text) for text in job["texts"]), tuple(job["words"]))
        if job["output"] is None:
            return {"path": path, "fit_json": fit_one(model, path, **job["options"]).to_json()}
        done = inspect_one(model, path, job["output"], **job["options"])
        return {"path": path, "fit_json": done.fit.to_json(), "verdict": done.verdict, "output": job["output"]}
    except Exception as error:  # noqa: BLE001: one scan must not end the work on the others
        return {"path": path, "error": f"{type(error).__name__}: {error}"}


def _quiet() -> None:
    """A worker of this machine: one thread each, as there are as many workers as processors."""
    os.environ["RAYON_NUM_THREADS"] = "1"


def fit_many(
    model: Model,
    paths: Iterable[str | os.PathLike[str]],
    executor: Executor | None = None,
    *,
    inspect_to: str | os.PathLike[str] | None = None,
    workers: int | None = None,
    **options: Any,
) -> Iterator[Outcome]:
    """Fit a model to many scans, each of another object; yields outcomes as they come.

    :param model: the model, which travels as text
    :param paths: the scans, which travel as paths: workers must be able to read them. It may be a generator; only a few
        scans are handed out ahead
    :param executor: whose workers do it: ``dask.distributed.Client.get_executor()`` or any other executor of
        ``concurrent.futures``; by default processes of this machine, which end with the work. In a file that is run,
        the loop then stands under ``if __name__ == "__main__":``, since each of them reads the file once more
    :param inspect_to: a folder; then every scan is inspected, with its results in a folder of its own in there
    :param workers: workers of the executor, by which scans are handed out ahead; by default the processors here
    :param options: those of :func:`fit`, or of :func:`inspect`
    :return: outcomes in the order of completion, each path once. What fails is an outcome with an ``error``, and no
        exception
    """
    if isinstance(paths, (str, os.PathLike)):
        raise TypeError("paths are several: give a list or another iterable of paths")
    # A wrong option is an error at once, and not one of every scan.
    groups: list[_options.Options] = [_options.READING, _options.FITTING]
    groups += [] if inspect_to is None else [_options.MEASURING, _options.REPORT]
    _options.words(options, *groups)
    return _outcomes(model, paths, executor, inspect_to, workers, options)


def _outcomes(
    model: Model,
    paths: Iterable[str | os.PathLike[str]],
    executor: Executor | None,
    inspect_to: str | os.PathLike[str] | None,
    workers: int | None,
    options: dict[str, Any],
) -> Iterator[Outcome]:
    count = workers or os.cpu_count() or 1
    own = executor is None
    texts, words = model.texts(), model._words
    names: dict[str, int] = {}

    def job(path: str | os.PathLike[str]) -> dict[str, Any]:
        text = os.fspath(path)
        output = None
        if inspect_to is not None:
            stem = os.path.splitext(os.path.basename(text))[0] or "scan"
            names[stem] = names.get(stem, 0) + 1
            numbered = stem if names[stem] == 1 else f"{stem}~{names[stem]}"
            output = os.path.join(os.fspath(inspect_to), numbered)
        return {"path": text, "texts": texts, "words": words, "options": options, "output": output}

    def fresh() -> Executor:
        import multiprocessing

        context = multiprocessing.get_context("spawn")
        return ProcessPoolExecutor(count, mp_context=context, initializer=_quiet)

    pool = executor if executor is not None else fresh()
    running: dict[Future[dict[str, Any]], tuple[dict[str, Any], int]] = {}
    source = iter(paths)
    try:
        waiting: list[tuple[dict[str, Any], int]] = []
        exhausted = False
        refused: RuntimeError | None = None
        while True:
            while len(running) < _AHEAD * count:
                if waiting:
                    task, attempt = waiting.pop()
                elif exhausted:
                    break
                else:
                    try:
                        task, attempt = job(next(source)), 1
                    except StopIteration:
                        exhausted = True
                        break
                try:
                    running[pool.submit(_work, task)] = (task, attempt)
                except RuntimeError as refusal:
                    # An executor that was shut down, or is broken: what it has is waited for.
                    refused, exhausted = refusal, True
                    yield Outcome(task["path"], error=f"the executor takes no work: {refusal!r}")
            if not running:
                if refused is not None:
                    raise refused
                return
            wait(running, timeout=_LOOK, return_when=FIRST_COMPLETED)
            # Futures that a shutdown has cancelled wake nobody.
            for future in [future for future in running if future.done()]:
                task, attempt = running.pop(future)
                if future.cancelled():
                    yield Outcome(task["path"], error="the executor was shut down")
                    continue
                error = future.exception()
                if error is None:
                    yield Outcome(**future.result())
                elif attempt < _ATTEMPTS:
                    # The worker was lost, and perhaps by this very scan: others are tried before it.
                    waiting.insert(0, (task, attempt + 1))
                else:
                    yield Outcome(task["path"], error=f"the worker was lost {attempt} times: {error!r}")
                if own and isinstance(error, BrokenProcessPool):
                    # A pool that has lost a process takes no more work, and fails all that it has.
                    waiting.extend((t, a + 1 if a < _ATTEMPTS else a) for t, a in running.values())
                    running.clear()
                    pool.shutdown(wait=False, cancel_futures=True)
                    pool = fresh()
                    break
    finally:
        for future in running:
            future.cancel()
        if own:
            # Who leaves the loop early does not wait for what is worked on.
            pool.shutdown(wait=not running, cancel_futures=True)
