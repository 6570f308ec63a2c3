"""Work in processes that are killed: finished results stay, the rest is done, repeated killers are named."""

from pathlib import Path

import pytest
from joblib import Parallel, parallel_config
from killers import Job, begun, kept, recalled, work

from slalom.sim.sweep import pool
from slalom.sim.sweep.case import Failure
from slalom.sim.sweep.pool import KILLS, map_surviving_kills, working_with


def jobs(folder: Path, count: int, **killers: tuple[int, float]) -> dict[str, Job]:
    """Jobs a, b, ... of which some kill: how often, and after how long."""
    names = [chr(ord("a") + k) for k in range(count)]
    return {name: Job(name, str(folder), *killers.get(name, ())) for name in names}


def nothing(items) -> dict[str, str]:
    """Nothing is recalled."""
    return {}


@pytest.mark.parametrize("count", [1, 2])
def test_every_item_is_worked_on_once(count: int, tmp_path: Path) -> None:
    items = jobs(tmp_path, 20)
    results = list(map_surviving_kills(work, items, jobs=count, recall=nothing))
    assert dict(results) == {name: 2 * name for name in items}
    assert len(results) == 20
    assert all(begun(job) == 1 for job in items.values())


@pytest.mark.slow
@pytest.mark.parametrize(("count", "items", "processes"), [(64, 3, 3), (64, 1, 2), (2, 8, 2), (1, 8, 1), (-1, 3, -1)])
def test_no_more_processes_start_than_there_are_items(
    count: int, items: int, processes: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """But two for one item, which would end this process when it is killed."""
    started = []

    class Noted(Parallel):
        def __init__(self, n_jobs: int, **settings: object) -> None:
            started.append(n_jobs)
            super().__init__(n_jobs=1, **settings)

    monkeypatch.setattr(pool, "Parallel", Noted)
    assert len(list(map_surviving_kills(work, jobs(tmp_path, items), jobs=count, recall=nothing))) == items
    assert started == [processes]


@pytest.mark.draw(0)
def test_a_killed_process_costs_what_it_was_at(tmp_path: Path) -> None:
    """Other items at work are begun again too, as loky ends all processes; kept results are not made again."""
    items = jobs(tmp_path, 12, e=(1, 0.0))
    results = list(map_surviving_kills(kept, items, jobs=2, recall=recalled))
    assert dict(results) == {name: 2 * name for name in items}
    assert len(results) == 12
    assert begun(items["e"]) == 2
    assert sum(begun(job) - 1 for job in items.values()) <= 2


@pytest.mark.slow
def test_an_item_that_kills_again_and_again_is_named(tmp_path: Path) -> None:
    """And no other item, although the long one was at work each time that the others were together."""
    items = jobs(tmp_path, 8, a=(99, 0.2), b=(0, 0.6))
    results = dict(map_surviving_kills(kept, items, jobs=2, recall=recalled))
    failure = results.pop("a")
    assert isinstance(failure, Failure)
    assert failure.killed
    assert f"killed {KILLS} times" in failure.reason
    assert begun(items["a"]) == KILLS
    assert results == {name: 2 * name for name in items if name != "a"}


@pytest.mark.slow
def test_it_ends_when_everything_kills(tmp_path: Path) -> None:
    items = {name: job._replace(kills=99) for name, job in jobs(tmp_path, 20).items()}
    results = dict(map_surviving_kills(work, items, jobs=2, recall=nothing))
    assert set(results) == set(items)
    assert all(isinstance(result, Failure) and result.killed for result in results.values())
    assert {result.reason for result in results.values()} == {
        f"processes were killed {KILLS} times in succession before a run was finished"
    }
    assert sum(begun(job) for job in items.values()) <= 2 * KILLS


def test_a_mistake_in_the_work_is_raised(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        list(map_surviving_kills(work, {"a": Job("a", str(tmp_path / "none"))}, jobs=2, recall=nothing))


@pytest.mark.parametrize("backend", ["threading", "sequential", "loky", None])
def test_backends_of_joblib(backend: str | None, tmp_path: Path) -> None:
    items = jobs(tmp_path, 6)
    with working_with(backend):
        assert dict(map_surviving_kills(work, items, jobs=2, recall=nothing)) == {name: 2 * name for name in items}


def test_what_joblib_is_set_to_is_used(tmp_path: Path) -> None:
    """Threads are in this process: no marks are made for it."""
    items = jobs(tmp_path, 3)
    with parallel_config(backend="threading"), working_with(None):
        assert dict(map_surviving_kills(work, items, jobs=2, recall=nothing)) == {name: 2 * name for name in items}


def test_what_is_raised_inside_is_left_as_it_is() -> None:
    with pytest.raises(ValueError, match="mine"), working_with("threading"):
        raise ValueError("mine")
