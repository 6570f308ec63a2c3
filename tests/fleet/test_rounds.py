"""Robots that decide at the same time decide as they would one after the other."""

import time
from dataclasses import replace

import numpy as np
import pytest

from slalom import METHODS, State
from slalom.fleet import rounds
from slalom.fleet.rounds import map_in_threads
from slalom.sim import Scenario, gallery, simulate


def fleet(duration: float, overlapping: tuple[int, ...]) -> Scenario:
    """400 robots on 0.81 km^2, some of which begin in overlap with the next: navigators decide for these."""
    scenario = gallery.build("random_goals", {"robots": 400, "side": 900.0, "duration": duration})
    robots = list(scenario.robots)
    for k in overlapping:
        state = State(robots[k].state.position + np.array([0.1, 0.0]), robots[k].state.velocity)
        robots[k + 1] = replace(robots[k + 1], state=state)
    return replace(scenario, robots=tuple(robots))


@pytest.mark.parametrize(("duration", "overlapping"), [(2.0, ()), (0.1, (222,))], ids=["clear", "overlapping"])
def test_rounds_have_the_bits_of_one_after_the_other(
    duration: float, overlapping: tuple[int, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Robots that cannot meet decide in one round, in any number of threads; a round ends at a navigator's decision."""
    scenario, shared = fleet(duration, overlapping), METHODS["nao_shared"]
    runs = [simulate(scenario, shared, threads=threads) for threads in (1, 3)]
    monkeypatch.setattr(rounds, "ROBOTS_PER_THREAD", 10**6)
    expected = simulate(scenario, shared, threads=1)
    found = {outcome for row in expected.outcomes for outcome in row}
    assert ("ESCAPING" in found) == bool(overlapping)
    for run in runs:
        assert np.array_equal(run.positions, expected.positions)
        assert run.outcomes == expected.outcomes


def test_results_come_in_order_and_no_thread_is_left_running() -> None:
    """Also when the first part raises: the other parts work on arrays of the caller."""
    rows, done = np.arange(100), []
    assert map_in_threads(np.sum, rows, 4, 20) == [part.sum() for part in np.array_split(rows, 4)]
    assert map_in_threads(np.sum, rows, 4, 60) == [rows.sum()]

    def work(part: np.ndarray) -> None:
        if part[0] == 0:
            raise ArithmeticError
        time.sleep(0.05)
        done.append(part[0])

    with pytest.raises(ArithmeticError):
        map_in_threads(work, rows, 4, 20)
    assert sorted(done) == [25, 50, 75]
