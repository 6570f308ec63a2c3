"""The exact choice in space against the oracle of `spatial`: near axes of circles, at random, far from the origin."""

from dataclasses import replace

import numpy as np
import pytest
from draws import commit_number, draws
from spatial import FAR, Scene, faults, judged, scene, unit

import slalom

# How far the robot is from the origin, and how far aside an obstacle that it meets head-on [m].
NEAR = [(0.0, 1e-11), (0.0, 1e-10), (0.0, 1e-9), (1e5, 0.0), (FAR, 0.0)]
PLAIN = [(10.0**k, 0.0) for k in range(5)] + [(0.0, 10.0**k) for k in (-15, -14, -13, -12, -8, -6)]


def head_on(seed, away, aside):
    """A hovering robot's scene with one obstacle straight ahead, but `aside` [m], and a place so far `away` [m]."""
    rng = np.random.default_rng(seed)
    place = away * rng.uniform(-1.0, 1.0, 3)
    velocity = unit(rng) * rng.uniform(0.2, 2.0)
    ahead, most, nothing = velocity / np.linalg.norm(velocity), rng.uniform(0.2, 2.0), np.zeros((1, 3))
    radius = rng.uniform(0.3, 1.0)
    origin = ahead * rng.uniform(3.0, 10.0) + aside * unit(rng)
    speed = -ahead * rng.uniform(0.0, 2.0)
    return place, Scene(
        family="head-on",
        response=1,
        horizon=6.0,
        velocity=velocity,
        preferred=np.zeros(3),
        balls=np.array([[0.0, 0.0, 0.0, most]]),
        halves=np.empty((0, 4)),
        origin=origin[None],
        speed=speed[None],
        bend=nothing,
        axis=nothing,
        radius=np.array([radius]),
        robot=0.3,
    )


@pytest.mark.parametrize("seeds", draws([range(5), *(range(k, k + 15) for k in range(5, 200, 15))]), ids=str)
@pytest.mark.parametrize("row", draws([*NEAR, *PLAIN], len(NEAR)), ids=lambda row: "{:g}-{:g}".format(*row))
def test_an_obstacle_on_the_axis_blocks_no_free_control(row, seeds):
    """From the axis of a circle all its points are as near: rounding alone tells which one, and how far off it is."""
    for seed in seeds:
        place, s = head_on(seed, *row)
        choice = slalom.select(s.preferred, s.admissible, s.blocked(place))
        assert not faults(s, choice, seed), f"seed {seed}: {faults(s, choice, seed)}"


@pytest.mark.parametrize("chunk", draws(range(10)))
def test_no_choice_in_space_is_wrong(chunk):
    """Admissible, free, and nothing that the oracle finds is nearer; few are undecided. New scenes at each commit."""
    seeds = [[chunk, commit_number() if chunk else 0, k] for k in range(60 if chunk else 20)]
    undecided = 0
    for seed in seeds:
        s, found = judged(seed)
        for choice, _, fault in found:
            assert not fault, f"scene {seed}, {s.family}: {fault}"
            undecided += choice.status is slalom.Status.UNDECIDED
    assert undecided <= 2


def test_the_oracle_notices_what_is_wrong():
    """Choices that collide, that are not admissible, not nearest, and BLOCKED and INADMISSIBLE without a reason."""
    place, s = head_on(2, 0.0, 0.0)
    choice = slalom.select(s.preferred, s.admissible, s.blocked(place))
    assert choice.status is slalom.Status.CONSTRAINED
    assert not faults(s, choice, 1)

    def instead(control, status=slalom.Status.CONSTRAINED):
        distance = np.inf if control is None else float(np.linalg.norm(control - s.preferred))
        return faults(s, replace(choice, control=control, status=status, distance=distance), 1)

    assert "collides" in instead(0.5 * choice.control)
    assert "free at" in instead((1.0 + 1e-4) * choice.control)
    assert "not admissible" in instead(10.0 * choice.control)
    assert "BLOCKED" in instead(None, slalom.Status.BLOCKED)
    assert "INADMISSIBLE" in instead(None, slalom.Status.INADMISSIBLE)


def swarm(count):
    """A hovering robot in a shell of balls that close in on it and leave no gap: hundreds of elements block all."""
    k = np.arange(count) + 0.5
    z, angle = 1.0 - 2.0 * k / count, np.pi * (1.0 + np.sqrt(5.0)) * k
    around = np.column_stack([np.sqrt(1.0 - z * z) * np.cos(angle), np.sqrt(1.0 - z * z) * np.sin(angle), z])
    nothing = np.zeros((count, 3))
    return Scene(
        family="shell",
        response=0,
        horizon=4.0,
        velocity=np.zeros(3),
        preferred=np.zeros(3),
        balls=np.array([[0.0, 0.0, 0.0, 3.0]]),
        halves=np.empty((0, 4)),
        origin=4.0 * around,
        speed=-0.9 * around,
        bend=nothing,
        axis=nothing,
        radius=np.full(count, 9.0 / np.sqrt(count)),
        robot=0.3,
    )


def blocked_with(elements):
    """A scene that so many elements or more block, and its choice."""
    for seed in range(200):
        s = scene(seed)
        choice = slalom.select(s.preferred, s.admissible, s.blocked(np.zeros(3)))
        if choice.status is slalom.Status.BLOCKED and choice.elements >= elements:
            return s, choice
    raise AssertionError("expected a scene that is blocked")


@pytest.mark.parametrize("bound", ["elements", "candidates"])
def test_a_bound_on_the_work_is_never_blocked(bound):
    s, choice = blocked_with(4)
    fewer = {f"most_{bound}": getattr(choice, bound) - 1}
    cut = slalom.select(s.preferred, s.admissible, s.blocked(np.zeros(3)), **fewer)
    assert cut.status is slalom.Status.UNDECIDED
    assert cut.control is None


def test_a_choice_ends_undecided_before_it_takes_long():
    """Without a bound on its work this one would compare controls with boundaries some ten million times."""
    s = swarm(400)
    choice = slalom.select(s.preferred, s.admissible, s.blocked(np.zeros(3)))
    assert choice.status is slalom.Status.UNDECIDED
    assert 100 < choice.elements < 400
