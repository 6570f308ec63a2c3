"""`Fleet`: settings of single robots, worlds, and fleets in several processes."""

import pickle
from dataclasses import fields

import numpy as np
import pytest
from fleets import swap

from slalom import METHODS, Arrive, Disc, Fleet, Limits, Obstacle, Rectangle, Settings, Stationary, Tracks
from slalom.base.errors import InvalidInput
from slalom.decision.settings import FleetSettings, SharedSettings
from slalom.fleet.settings import PRIORITY_RATIO
from slalom.sim.measure.closest_approach import METRIC
from slalom.sim.run.states import integrate

DT = 0.1
LIMITS = Limits(1.5, 2.0)


def drive(fleet, positions, targets, steps, others=None):
    """Positions (steps + 1, n, 2) of robots that follow the accelerations exactly."""
    velocities, path = np.zeros_like(positions), [positions]
    for k in range(steps):
        around = () if others is None else others(k * DT)
        decided = fleet.step(k * DT, positions, velocities, targets, others=around)
        positions, velocities = integrate(positions, velocities, decided.accelerations, DT)
        path.append(positions)
    return np.array(path)


def closest(path):
    """Least distance of two centres at the steps (n, n)."""
    apart = np.linalg.norm(path[:, :, None] - path[:, None], axis=-1).min(axis=0)
    return apart + np.diag(np.full(len(apart), np.inf))


def walkers(t, worlds=None):
    """Two people who cross at y = 1 and y = -1."""
    places = np.array([(-5.0 + t, 1.0), (5.0 - t, -1.0)])
    return Tracks(places, [(1.0, 0.0), (-1.0, 0.0)], 0.3, t, worlds=worlds)


def test_worlds_are_fleets_of_their_own() -> None:
    """To the bit, with methods and shapes of their own, and with people in one of them."""
    starts, targets = swap(5)
    methods, shapes = [METHODS["nao"]] * 5 + [METHODS["rvo"]] * 5, [Disc(0.3)] * 5 + [Rectangle(0.6, 0.4)] * 5
    rock = Obstacle(Disc(0.5), Stationary((0.3, 0.1)), "rock")
    settings = {"obstacles": [rock], "threads": 2, "guided": False}
    both = Fleet(methods, shapes, LIMITS, worlds=[0] * 5 + [1] * 5, **settings)
    path = drive(both, np.tile(starts, (2, 1)), np.tile(targets, (2, 1)), 80, lambda t: walkers(t, [1, 1]))
    first = drive(Fleet(METHODS["nao"], Disc(0.3), LIMITS, robots=5, **settings), starts, targets, 80)
    second = drive(Fleet(METHODS["rvo"], shapes[5:], LIMITS, **settings), starts, targets, 80, walkers)
    np.testing.assert_array_equal(path[:, :5], first)
    np.testing.assert_array_equal(path[:, 5:], second)


def test_worlds_of_robots_that_publish_are_fleets_of_their_own() -> None:
    """To the bit, although robots decide one after the other, and worlds differ in size and are mixed in the rows."""
    starts, targets = swap(7)
    rows = [np.array([0, 2, 3, 5, 6]), np.array([1, 4])]
    worlds = np.zeros(7, int)
    worlds[rows[1]] = 3
    method, settings = METHODS["nao_shared"], {"horizon": 12.0, "guided": False}
    both = drive(Fleet(method, Disc(0.3), LIMITS, robots=7, worlds=worlds, **settings), starts, targets, 40)
    for own in rows:
        alone = drive(Fleet(method, Disc(0.3), LIMITS, robots=len(own), **settings), starts[own], targets[own], 40)
        np.testing.assert_array_equal(both[:, own], alone)


def test_robots_of_one_world_that_publish_avoid_each_other() -> None:
    """Robots of different worlds drive through each other."""
    starts, targets = swap(3)
    fleet = Fleet(METHODS["nao_shared"], Disc(0.4), LIMITS, robots=6, worlds=[0, 0, 0, 2, 2, 2])
    apart = closest(drive(fleet, np.tile(starts, (2, 1)), np.tile(targets, (2, 1)), 120))
    assert apart[:3, :3].min() >= 0.8 - METRIC
    assert apart[3:, 3:].min() >= 0.8 - METRIC
    assert apart[:3, 3:].min() < 0.4


def test_two_equal_robots_pass_each_other() -> None:
    """Head-on and nearly so: both would avoid towards one side, so they agree on one."""
    rng = np.random.default_rng(3)
    for shape, radius in ((Disc(0.4), 0.4), (Rectangle(0.8, 0.5), 0.25)):
        beside = np.concatenate([[0.0, 1e-9], rng.uniform(-0.6, 0.6, 18)])
        starts = np.stack([[(-4.0, 0.0), (4.0, y)] for y in beside]).reshape(-1, 2)
        fleet = Fleet(METHODS["nao"], shape, LIMITS, robots=40, worlds=np.arange(40) // 2)
        path = drive(fleet, starts, -starts, 120)
        apart = np.linalg.norm(path[:, ::2] - path[:, 1::2], axis=-1).min(axis=0)
        assert apart.min() >= 2.0 * radius
        assert np.linalg.norm(path[-1] + starts, axis=1).max() < 0.3
        # Exactly head-on, both pass on the right.
        assert path[:, 0, 1].min() < -0.2
        assert path[:, 1, 1].max() > 0.2


@pytest.mark.slow
def test_random_fleets_that_observe_each_other() -> None:
    """Radii, speeds and accelerations that differ by up to four; the full figure is that of a benchmark."""
    rng, starts, targets, radii, worlds = np.random.default_rng(11), [], [], [], []
    for world in range(12):
        n = int(rng.integers(3, 13))
        grid = np.array([(x, y) for x in range(5) for y in range(5)], dtype=float) * 2.2
        starts.append(grid[rng.permutation(25)[:n]] + rng.uniform(-0.2, 0.2, (n, 2)))
        targets.append(grid[rng.permutation(25)[:n]])
        radii += rng.uniform(0.2, 0.8, n).tolist()
        worlds += [world] * n
    most = zip(rng.uniform(0.5, 2.0, len(radii)), rng.uniform(1.0, 4.0, len(radii)))
    limits = [Limits(float(speed), float(acceleration)) for speed, acceleration in most]
    fleet = Fleet(METHODS["nao"], [Disc(r) for r in radii], limits, worlds=worlds)
    path = drive(fleet, np.concatenate(starts), np.concatenate(targets), 300)
    together = np.equal.outer(worlds, worlds)
    assert (closest(path) - np.add.outer(radii, radii))[together].min() >= -1e-3
    assert (np.linalg.norm(path[-1] - np.concatenate(targets), axis=1) < 0.25).mean() >= 0.95


def off_line(path):
    """How far each of two robots leaves the line y = 0 (2,) [m]."""
    return np.abs(path[..., 1]).max(axis=0)


def test_the_robot_of_lower_priority_avoids() -> None:
    """Of the change that both make together each does its part, and most is done by the one with less priority."""
    starts = np.array([(-4.0, 0.0), (4.0, 0.05)])
    aside = []
    for priority in ([1.0, PRIORITY_RATIO], [PRIORITY_RATIO, 1.0]):
        fleet = Fleet(METHODS["nao"], Disc(0.4), LIMITS, robots=2, priority=priority, guided=False)
        path = drive(fleet, starts, -starts, 120)
        assert closest(path).min() >= 0.8
        assert np.linalg.norm(path[-1] + starts, axis=1).max() < 0.3
        aside.append(off_line(path))
    second, first = aside
    assert second[0] > 2.0 * second[1]
    assert first[1] > 2.0 * first[0]


def test_with_published_manoeuvres_the_first_priority_decides_first() -> None:
    """It drives as if it were alone as far as the others can get out of its way."""
    starts = np.array([(-4.0, 0.0), (4.0, 0.05)])
    for priority in ([1.0, 2.0], [2.0, 1.0]):
        fleet = Fleet(METHODS["nao_shared"], Disc(0.4), LIMITS, robots=2, priority=priority, guided=False)
        path = drive(fleet, starts, -starts, 120)
        low, high = np.argsort(priority)
        assert closest(path).min() >= 0.8 - METRIC
        assert off_line(path)[low] > 1.2 * off_line(path)[high]


@pytest.mark.parametrize("name", ["nao", "nao_shared"])
def test_the_margin_from_obstacles_is_that_which_was_given(name: str) -> None:
    """Between robots that only observe each other it is larger, here by 0.16 m; from walls it is not."""
    walls = [Obstacle(Rectangle(1.0, 3.0), Stationary((0.0, y))) for y in (1.9, -1.9)]
    fleet = Fleet(METHODS[name], Disc(0.3), Limits(1.5, 8.0), robots=1, margin=0.05, obstacles=walls)
    places, velocities, least = np.array([(-2.0, 0.02)]), np.zeros((1, 2)), np.inf
    for k in range(80):
        step = fleet.step(0.1 * k, places, velocities, [(2.0, 0.0)])
        places, velocities = step.positions, step.velocities
        if abs(places[0, 0]) < 0.5:
            least = min(least, 0.1 - abs(places[0, 1]))
    assert np.linalg.norm(places - (2.0, 0.0)) < 0.2
    assert least > 0.05 - 1e-6


def test_each_robot_keeps_its_own_margin() -> None:
    wall = Obstacle(Rectangle(8.0, 0.2), Stationary((0.0, 0.0)), "wall")
    starts = np.array([(-8.0, 0.5), (-8.0, -0.5)])
    settings = {"margin": [0.02, 0.6], "obstacles": [wall], "guided": False}
    fleet = Fleet(METHODS["nao_shared"], Disc(0.3), LIMITS, robots=2, **settings)
    path = drive(fleet, starts, starts + np.array([16.0, 0.0]), 160)
    beside = np.abs(path[..., 0]) < 3.5
    gaps = [float(np.abs(path[beside[:, k], k, 1]).min()) - 0.4 for k in range(2)]
    assert 0.02 - METRIC <= gaps[0] < 0.15
    assert gaps[1] >= 0.6 - METRIC


MIXED = ["nao", "nao_shared", "rvo", "nao_shared", "nao", "rvo"]


def test_robots_of_several_methods_swap_places() -> None:
    """All arrive; robots that publish keep their margin from each other, and no two collide."""
    starts, targets = swap(6, 6.0)
    fleet = Fleet([METHODS[name] for name in MIXED], Disc(0.3), LIMITS)
    path = drive(fleet, starts, targets, 200)
    assert closest(path).min() >= 0.6
    assert np.linalg.norm(path[-1] - targets, axis=1).max() < 0.5
    copy = Fleet([METHODS[name] for name in MIXED], Disc(0.3), LIMITS, threads=1)
    np.testing.assert_array_equal(drive(copy, starts, targets, 60), path[:61])


def test_fleets_of_two_processes_avoid_what_they_publish() -> None:
    """They take turns, and send each other manoeuvres as bytes."""
    starts = np.array([(-5.0, -1.5), (-1.5, 5.0), (-5.0, 0.0), (0.0, 5.0), (-5.0, 1.5), (1.5, 5.0)])
    targets = starts * (-1.0, 1.0) * (np.abs(starts[:, :1]) > 4.0) + starts * (1.0, -1.0) * (starts[:, 1:] > 4.0)
    fleets = [Fleet(METHODS["nao_shared"], Disc(0.4), LIMITS, robots=3) for _ in range(2)]
    positions, velocities, sent, path = starts, np.zeros_like(starts), [b"", b""], [starts]
    for k in range(150):
        applied = np.zeros_like(starts)
        for one, other in ((0, 1), (1, 0)):
            rows = slice(one, None, 2)
            published = pickle.loads(sent[other]) if sent[other] else ()
            decided = fleets[one].step(k * DT, positions[rows], velocities[rows], targets[rows], others=published)
            applied[rows], sent[one] = decided.accelerations, pickle.dumps(fleets[one].manoeuvres())
        positions, velocities = integrate(positions, velocities, applied, DT)
        path.append(positions)
    assert closest(np.array(path)).min() >= 0.8 - METRIC
    assert np.linalg.norm(positions - targets, axis=1).max() < 0.3


# Settings that fleets, scenarios and vehicles share with a navigator.


def test_shared_settings_are_those_of_a_navigator() -> None:
    """With their types and defaults; a fleet refuses those that it does not have."""
    known = {each.name: each for each in fields(Settings)}
    for each in fields(SharedSettings):
        assert (each.type, each.default) == (known[each.name].type, known[each.name].default)
    assert FleetSettings.__annotations__.keys() <= known.keys()
    assert {each.name for each in fields(SharedSettings)} - {"margin"} <= FleetSettings.__annotations__.keys()
    with pytest.raises(InvalidInput, match=r"setting: expected one of period, .*; found 'objective'"):
        Fleet(METHODS["nao"], Disc(0.3), LIMITS, robots=2, objective=Arrive())  # type: ignore[call-arg]
