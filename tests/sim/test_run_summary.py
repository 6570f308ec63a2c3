"""Runs that are not recorded: they end as the recorded ones do, and memory does not grow with their time."""

import gc
import pickle
import tracemalloc
from dataclasses import fields

import numpy as np
import pytest
from draws import draws

from slalom import METHODS, InvalidInput
from slalom.peers import PEERS
from slalom.sim import Recording, RunSummary, load, metrics, simulate

RUNS = {
    "one robot that arrives": ("roundabout_crossing", "nao", {}),
    "one robot that does not": ("roundabout_crossing", "nao", {"duration": 1.3}),
    "one robot for no time": ("roundabout_crossing", "nao", {"duration": 0.01}),
    "all decide at once": ("circle", "nao", {"robots": 6, "duration": 4.0}),
    "one after the other": ("random_goals", "nao_shared", {"robots": 8, "side": 20.0, "duration": 20.0}),
    "each by its navigator": ("doorway", "avo", {"duration": 0.5}),
    "a peer": ("circle", "orca", {"robots": 5, "duration": 40.0}),
}
"""Scenario, method, settings: every loop over time."""


@pytest.mark.parametrize("name", RUNS)
def test_a_run_ends_as_when_it_is_recorded(name: str) -> None:
    """To the bit."""
    which, method, settings = RUNS[name]
    scenario, chosen = load(which, settings), METHODS.get(method) or PEERS[method]
    run, end = (simulate(scenario, chosen, seed=3, record=record) for record in (True, False))
    assert (type(run), type(end)) == (Recording, RunSummary)
    assert end.steps == len(run.accelerations)
    assert end.times.tolist() == [run.times[0], run.times[-1]]
    assert np.array_equal(end.position, run.positions[-1])
    assert np.array_equal(end.velocity, run.velocities[-1])
    assert np.array_equal(end.arrived, run.arrived)
    assert end.statuses == metrics.summary(run)["statuses"]
    for same in ("scenario", "method", "seed", "dt", "parameters", "foresight"):
        assert getattr(end, same) == getattr(run, same)
    assert metrics.arrived(end) == metrics.arrived(run)
    assert metrics.time(end) == metrics.time(run)


@pytest.fixture(scope="module")
def end() -> RunSummary:
    return simulate(load("circle", {"robots": 3, "duration": 100.0}), METHODS["nao"], record=False)


def test_metrics_of_what_happened_in_between_are_refused(end: RunSummary) -> None:
    """All but two; none takes an end for a run in which nothing happened."""
    assert np.isfinite(end.arrived).all()
    for name in set(metrics.METRICS) - {"arrived", "time"}:
        with pytest.raises(InvalidInput, match=r"^\w+: expected a recorded run, found one with record=False$"):
            metrics.METRICS[name](end)
    with pytest.raises(InvalidInput, match="expected a recorded run"):
        metrics.summary(end)


def test_a_summary_has_its_fields_and_no_others(end: RunSummary) -> None:
    """Other fields of recordings are refused, unknown ones are an AttributeError, copies are possible."""
    both = {field.name for field in fields(Recording)} & {field.name for field in fields(RunSummary)}
    for name in {field.name for field in fields(Recording)} - both | {"save", "digest", "dimension"}:
        with pytest.raises(InvalidInput, match=f"^{name}: expected a recorded run"):
            getattr(end, name)
    assert not hasattr(end, "nothing")
    assert np.array_equal(pickle.loads(pickle.dumps(end)).position, end.position)


@pytest.mark.parametrize("method", draws(["nao", "nao_shared"], 0))
def test_memory_does_not_grow_with_time(method: str) -> None:
    """Over the second half of a run that is not recorded; of one that is, by what it records.

    numba itself keeps some hundred bytes for each call of a kernel, whatever the number of robots.
    """
    robots, count = 100, 30
    scenario = load("random_goals", {"duration": 0.1 * count, "dt": 0.1, "robots": robots, "side": 300.0})

    def growth(record: bool) -> float:
        """[bytes] for each robot and step, that Python's and numpy's allocators know of."""
        held, done = dict.fromkeys((count // 2, count), 0), 0

        def note(_: float) -> None:
            nonlocal done
            done += 1
            if done in held:
                gc.collect()
                held[done] = tracemalloc.get_traced_memory()[0]

        tracemalloc.start()
        try:
            simulate(scenario, METHODS[method], progress=note, record=record)
        finally:
            tracemalloc.stop()
        assert done == count
        return (held[count] - held[count // 2]) / (count - count // 2) / robots

    simulate(scenario, METHODS[method], record=False)
    recorded = growth(True)
    assert recorded > 80.0
    assert abs(growth(False)) < 0.2 * recorded
