"""Independent work items in processes, any of which may be killed."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from pathlib import Path
from tempfile import TemporaryDirectory, mkdtemp
from typing import Any, Final, TypeVar

from joblib import Parallel, delayed, parallel_config
from joblib.parallel import BACKENDS, get_active_backend

from slalom.base.errors import InvalidInput
from slalom.sim.sweep.case import Failure

Item = TypeVar("Item")
Result = TypeVar("Result")

KILLS: Final = 3
"""[1] Kills after which an item fails; at the last attempt it is the only item in progress."""


@contextmanager
def working_with(backend: str | None) -> Iterator[None]:
    """Set the backend of joblib within the context; None leaves the present one.

    dask uses the client of this process, or a new one by dask's own settings (DASK_SCHEDULER_ADDRESS; by default a
    cluster on this machine). ray uses its own settings too (RAY_ADDRESS).

    Raises:
        InvalidInput: a backend that joblib does not have or that is not installed; or multiprocessing, which never
            returns after a kill.
    """
    with ExitStack() as stack:
        if backend == "multiprocessing":
            raise InvalidInput("backend: expected one that reports killed processes, found 'multiprocessing'")
        try:
            if backend == "ray":
                from ray.util.joblib import register_ray

                register_ray()
            if backend == "dask":
                stack.enter_context(_dask())
            if backend is not None:
                stack.enter_context(parallel_config(backend=backend))
        except (ImportError, ValueError) as error:
            raise InvalidInput(
                f"backend: expected loky, threading or sequential, or dask or ray where they are installed; found "
                f"{backend!r}: {' '.join(str(error).split())}"
            ) from None
        yield


def _dask() -> AbstractContextManager[Any]:
    """Return the client of this process, or a new one that is closed with the context."""
    from distributed import Client, get_client

    try:
        return nullcontext(get_client())
    except ValueError:
        client: AbstractContextManager[Any] = Client()
        return client


def map_surviving_kills(
    work: Callable[[Item], Result],
    items: Mapping[str, Item],
    *,
    jobs: int,
    recall: Callable[[Iterable[Item]], Mapping[str, Result]],
) -> Iterator[tuple[str, Result | Failure]]:
    """Yield the name and the result of every item, in the order in which they finish.

    When a process is killed, loky ends all others. `recall` returns the stored results of unfinished items, and the
    rest starts again in new processes. An item in progress at KILLS - 1 kills runs alone at the end; if its process is
    killed again, the item is a `Failure`. All remaining items fail after KILLS kills in succession without a finished
    item.
    """
    left = dict(items)
    kills = Counter[str]()
    barren = 0
    with TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        while left:
            # A new folder for each attempt: a process that is about to end may still write a mark.
            marks = Path(mkdtemp(dir=folder)) if isinstance(get_active_backend()[0], BACKENDS["loky"]) else None
            together = {key: left[key] for key in left if kills[key] < KILLS - 1}
            turn = together or dict([next(iter(left.items()))])
            count, broken = len(left), False
            try:
                for key, result in _results(work, turn, jobs, marks):
                    del left[key]
                    yield key, result
            except BrokenProcessPool:
                broken = True
            if broken:
                for key, result in recall([left[key] for key in turn if key in left]).items():
                    del left[key]
                    yield key, result
                barren = 0 if len(left) < count else barren + bool(together)
                for key in _taken(marks) if together else turn:
                    kills[key] += 1
                    if kills[key] == KILLS and left.pop(key, None) is not None:
                        yield key, Failure(f"its process was killed {KILLS} times, at last with no other run", True)
            if barren == KILLS:
                reason = f"processes were killed {KILLS} times in succession before a run was finished"
                yield from ((key, Failure(reason, True)) for key in left)
                return


def _results(
    work: Callable[[Item], Result], items: Mapping[str, Item], jobs: int, marks: Path | None
) -> Iterator[tuple[str, Result]]:
    unordered = get_active_backend()[0].supports_return_generator
    # joblib starts all processes at once, also those for which there is no item. With one it works in this process,
    # which a kill would end.
    processes = min(jobs, max(len(items), 2)) if jobs > 1 else jobs
    parallel = Parallel(n_jobs=processes, return_as="generator_unordered" if unordered else "list")
    yield from parallel(delayed(_marked)(work, marks, key, item) for key, item in items.items())


def _marked(work: Callable[[Item], Result], marks: Path | None, key: str, item: Item) -> tuple[str, Result]:
    """Work on an item while a mark file exists: the files left after a kill name the items in progress."""
    if marks is None:
        return key, work(item)
    mark = marks / key
    mark.touch()
    try:
        return key, work(item)
    finally:
        mark.unlink()


def _taken(marks: Path | None) -> list[str]:
    """Return the items in progress."""
    return sorted(mark.name for mark in marks.iterdir()) if marks is not None else []
