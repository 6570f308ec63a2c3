"""Text, equality, copies and pickles of public values."""

import copy
import pickle

import numpy as np
import pytest

import slalom
from slalom import Disc, Goal, Limits, Obstacle, State, Stationary
from slalom.sim import Robot, Scenario, simulate

DISC, LIMITS, NAO = Disc(0.3), Limits(2.0, 2.0), slalom.method("nao")
STATE, GOAL = State((0.0, 0.0), (1.0, 0.0)), Goal(Stationary((8.0, 0.0)))
ROCK = Obstacle(DISC, slalom.ConstantVelocity((3.0, 0.0), (-1.0, 0.0)), "rock")
TRACKS = slalom.Tracks([(3.0, 1.0)], [(-1.0, 0.0)], 0.3)
ROBOT = slalom.Navigator(NAO, DISC, LIMITS)
SCENE = Scenario("one", (Robot(DISC, LIMITS, STATE, GOAL),), (ROCK,), duration=0.2)


def tracker() -> slalom.Tracker:
    """A tracker with a measurement."""
    found = slalom.Tracker()
    found.update(0.0, "a", (1.0, 2.0))
    return found


def observed(model: slalom.Reciprocity | slalom.AvoidingCrowd | slalom.Calibration) -> object:
    """A model after an observation."""
    if isinstance(model, slalom.Reciprocity):
        model.update(STATE, TRACKS)
    elif isinstance(model, slalom.AvoidingCrowd):
        model.predict(TRACKS)
    else:
        model.observe(TRACKS)
    return model


VALUES: dict[str, object] = {
    "Affine": slalom.Affine(np.zeros(2), np.array(1.0)),
    "State": STATE,
    "Obstacle": ROCK,
    "Goal": GOAL,
    "PathGoal": slalom.PathGoal([(0.0, 0.0), (3.0, 0.0), (3.0, 4.0)]),
    "Limits": LIMITS,
    "Method": NAO,
    "Navigator": ROBOT,
    "Decision": ROBOT.decide(STATE, [ROCK], GOAL),
    "SequenceDecision": slalom.LookAhead(ROBOT).decide(STATE, [ROCK], GOAL),
    "Tracks": TRACKS,
    "Tracker": tracker(),
    "Calibration": observed(slalom.Calibration()),
    "Reciprocity": observed(slalom.Reciprocity(0.3)),
    "AvoidingCrowd": observed(slalom.AvoidingCrowd(0.25)),
    "ObstacleTable": slalom.ObstacleTable([ROCK]),
    "ObstacleWindow": ROBOT.predict([ROCK], STATE, 0.0),
    "Fleet": slalom.Fleet(NAO, DISC, LIMITS, robots=2),
    "Scenario": SCENE,
    "Recording": simulate(SCENE, NAO),
}


@pytest.mark.parametrize("name", VALUES)
def test_texts_are_short_and_repeat(name: str) -> None:
    """They fit into a few lines of a terminal, and hold no address in memory."""
    text = repr(VALUES[name])
    assert name in text
    assert "0x" not in text
    assert len(text) <= 420
    assert text == repr(pickle.loads(pickle.dumps(VALUES[name]))) == repr(copy.deepcopy(VALUES[name]))


@pytest.mark.parametrize("name", VALUES)
def test_values_compare_and_hash(name: str) -> None:
    value, other = VALUES[name], copy.deepcopy(VALUES[name])
    assert value == value
    assert isinstance(value == other, bool)
    assert value != other or hash(value) == hash(other)
    assert len({value, copy.copy(value), value}) <= 2


def test_texts_state_the_content() -> None:
    assert repr(TRACKS) == "<Tracks at 0 s, number: 1, dimension: 2>"
    assert repr(VALUES["PathGoal"]) == "<PathGoal to [3.0, 4.0], points: 3, length: 7 m>"
    assert repr(VALUES["Fleet"]) == "<Fleet by nao, robots: 2>"
    assert repr(VALUES["Recording"]) == "<Recording of one by nao, seed: 0, robots: 1, steps: 2>"
    decision = VALUES["Decision"]
    assert isinstance(decision, slalom.Decision)
    numbers = np.array([float(x) for x in repr(decision).rpartition("(")[2].rstrip(")>").split(",")])
    np.testing.assert_allclose(numbers, decision.manoeuvre.control, rtol=1e-3)
    assert decision.outcome.name in repr(decision)
