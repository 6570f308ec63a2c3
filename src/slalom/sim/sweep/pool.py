"""Many independent pieces of work in processes, any of which may be killed."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from pathlib import Path
from tempfile import TemporaryDirectory, mkdtemp
from typing import Any, Final, TypeVar

from joblib import Parallel, delayed, parallel_config
from joblib.parallel import BACKENDS, get_active_backend

from slalom.errors import InvalidInput
from slalom.sim.sweep.case import Failure

Item = TypeVar("Item")
Result = TypeVar("Result")

KILLS: Final = 3
"""[1] How often the process may be killed that an item is worked on in; the last time nothing else is at work."""


@contextmanager
def working_with(backend: str | None) -> Iterator[None]:
    """What joblib works with inside; None for what it is set to already.

    Of dask, the client that this process has, or a new one, which goes by dask's own settings (DASK_SCHEDULER_ADDRESS;
    without them, a cluster on this machine). Ray goes by its own settings too (RAY_ADDRESS).

    Raises:
        InvalidInput: joblib knows no such backend, or it is not installed; or it is multiprocessing, which waits for
            ever for a process that was killed.
    """
    with ExitStack() as stack:
        if backend == "multiprocessing":
            raise InvalidInput("backend: expected one that notices when a process is killed, found 'multiprocessing'")
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
    """A client for as long as it is needed, or the one that is there."""
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
    """The name of every item and what `work` makes of it, in the order in which they are finished.

    When a process is killed, loky gives up all of them. What `recall` knows of the items that were not returned is
    taken, and the others are begun again in new processes. An item that was being worked on in two such cases is
    left for the end, when it has the processes for itself; if one is killed again, the item is a `Failure`. So are all
    that are left if, KILLS times in succession, a process is killed before anything was finished.
    """
    left, kills, barren = dict(items), Counter[str](), 0
    with TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        while left:
            # Of their own each time: a process that is about to end may still make one.
            marks = Path(mkdtemp(dir=folder)) if isinstance(get_active_backend()[0], BACKENDS["loky"]) else None
            together = {key: left[key] for key in left if kills[key] < KILLS - 1}
            turn = together or dict([next(iter(left.items()))])
            before, broken = len(left), False
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
                barren = 0 if len(left) < before else barren + bool(together)
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
    parallel = Parallel(n_jobs=jobs, return_as="generator_unordered" if unordered else "list")
    yield from parallel(delayed(_marked)(work, marks, key, item) for key, item in items.items())


def _marked(work: Callable[[Item], Result], marks: Path | None, key: str, item: Item) -> tuple[str, Result]:
    """Work with a file that says so: the files that are there when processes have been killed say at what they were."""
    if marks is None:
        return key, work(item)
    mark = marks / key
    mark.touch()
    try:
        return key, work(item)
    finally:
        mark.unlink()


def _taken(marks: Path | None) -> list[str]:
    """The items that were being worked on."""
    return sorted(mark.name for mark in marks.iterdir()) if marks is not None else []
