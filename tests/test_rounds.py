"""Robots that decide at the same time decide what they would have one after the other."""

import time

import numpy as np
import pytest

from slalom import METHODS, kernels
from slalom.kernels.decision.tables import DecisionTables
from slalom.sim import gallery, simulate
from slalom.sim.run import rounds
from slalom.sim.run.fleet_decider import FleetDecider
from slalom.sim.run.guidance import Guidance
from slalom.sim.run.robot_states import RobotStates
from slalom.sim.run.rounds import one_by_one
from slalom.sim.run.threads import map_in_threads


class Looking(FleetDecider):
    """A crew that keeps what it decides from."""

    def _turns(self, due, terms):
        for some, usual in super()._turns(due, terms):
            self.tables = DecisionTables(self.fleet, self._passive(0.0), self.responses, usual)
            yield some, usual


def tables(robots: int, side: float) -> DecisionTables:
    """What robots at their starts decide from."""
    built = gallery.build("random_goals", {"robots": robots, "side": side})
    crew = Looking(METHODS["nao_shared"], Guidance(RobotStates(built)), threads=1)
    crew.sense(0.0)
    crew.decide(range(robots), 0.0)
    return crew.tables


def near(order, seen, fleet):
    """Which robots of an order are in neighbouring cells of the survey: all pairs."""
    cell = np.floor((fleet.position[order, : len(seen.counts)] - seen.low) / seen.width).astype(int)
    cell = np.clip(cell, 0, seen.counts - 1)
    return (abs(cell[:, None] - cell[None]) <= 1).all(axis=2)


@pytest.mark.parametrize(("robots", "side"), [(400, 900.0), (150, 60.0), (30, 10.0)])
def test_rounds_keep_the_order_of_those_that_could_meet(robots, side):
    found, order = tables(robots, side), np.random.default_rng(1).permutation(robots)
    seen = kernels.build_cell_list(order, found.robots, found.responses, found.settings)
    turn = kernels.independent_rounds(order, seen, found.robots)
    earlier = np.tri(robots, k=-1, dtype=bool)
    before = np.where(near(order, seen, found.robots) & earlier, turn[None], -1).max(axis=1)
    np.testing.assert_array_equal(turn, before + 1)


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("share", [0.0, 0.02, 1.0])
def test_who_has_to_ask_is_waited_for(share, threads, monkeypatch):
    """Everybody decides or asks, once, and after all those before it in the order that it could meet."""
    found, rng, made = tables(400, 900.0), np.random.default_rng(2), []
    order, lost = rng.permutation(400), rng.random(400) < share

    def decide_all(part, *_):
        for n, k in enumerate(part):
            if lost[k]:
                return n
            made.append(int(k))
        return len(part)

    monkeypatch.setattr(kernels, "decide_all", decide_all)
    asked = one_by_one(order, found, lambda k: made.append(k) or f"asked {k}", threads)
    assert sorted(made) == list(range(400))
    assert asked == {k: f"asked {k}" for k in np.flatnonzero(lost).tolist()}
    seen = kernels.build_cell_list(order, found.robots, found.responses, found.settings)
    when = np.argsort(made)[order]
    earlier = np.tri(400, k=-1, dtype=bool)
    first, second = np.nonzero(near(order, seen, found.robots) & earlier)
    assert np.all(when[first] > when[second])


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_rounds_have_the_bits_of_one_after_the_other(threads, monkeypatch):
    built = gallery.build("random_goals", {"robots": 400, "side": 900.0, "duration": 4.0})
    counted = []
    original = rounds._in_rounds

    def in_rounds(*arguments):
        counted.append(1)
        return original(*arguments)

    monkeypatch.setattr(rounds, "_in_rounds", in_rounds)
    together = simulate(built, METHODS["nao_shared"], threads=threads)
    assert len(counted) >= 40
    monkeypatch.setattr(rounds, "ROBOTS_PER_THREAD", 10**6)
    alone = simulate(built, METHODS["nao_shared"], threads=1)
    assert np.array_equal(together.positions, alone.positions)
    assert together.outcomes == alone.outcomes


def test_parts_come_back_in_order_and_none_is_left_running():
    """Whatever happens to the first: the others work on arrays that whoever called owns."""
    rows, done = np.arange(100), []
    assert map_in_threads(np.sum, rows, 4, 20) == [part.sum() for part in np.array_split(rows, 4)]
    assert map_in_threads(np.sum, rows, 4, 60) == [rows.sum()]

    def work(part):
        if part[0] == 0:
            raise ArithmeticError
        time.sleep(0.05)
        done.append(part[0])

    with pytest.raises(ArithmeticError):
        map_in_threads(work, rows, 4, 20)
    assert sorted(done) == [25, 50, 75]
