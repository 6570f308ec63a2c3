"""Worlds that repeat: what happens across the seam is what happens in the middle."""

from dataclasses import replace

import numpy as np
import pytest
from draws import draws
from fleets import guidance_in

from slalom import (
    METHODS,
    Circular,
    ConstantVelocity,
    Disc,
    Fleet,
    Goal,
    InvalidFile,
    Limits,
    Obstacle,
    Rectangle,
    State,
    Stationary,
    Tracks,
)
from slalom.kernels.guidance.grid import is_free
from slalom.model.path import Path
from slalom.obstacle.periodic import between, displaced, images_near, neighbours, to_nearest
from slalom.sim import Recording, Robot, Scenario, gallery, metrics, read_scenario, simulate
from slalom.sim.measure.closest_approach import METRIC, between_robots, closest_approaches, single_robot_view
from slalom.sim.measure.metrics import COLLISION, _clearances_at_steps, flips_between, side_flips

PERIOD = (24.0, np.inf)
LIMITS = Limits(1.0, 1.0)


def robot(k: int, start, goal, speed=(0.0, 0.0), shape=None) -> Robot:
    return Robot(shape or Disc(0.3), LIMITS, State(start, speed), Goal(Stationary(goal), 0.2), f"robot {k}")


def meeting(period=PERIOD, shifts=((0.0, 0.0),) * 3, **settings) -> Scenario:
    """Three robots that meet each other and a rock, or images of each other and of it."""
    ways = [((3.0, 0.1), (20.0, 0.1)), ((5.2, 0.0), (-20.0, 0.0)), ((4.2, -1.6), (4.2, 20.0))]
    robots = tuple(robot(k, np.add(a, by), np.add(b, by)) for k, ((a, b), by) in enumerate(zip(ways, shifts)))
    rock = Obstacle(Disc(0.4), Stationary((4.6, 1.2)), "rock")
    return Scenario(
        "meeting", robots, (rock,), duration=4.0, horizon=5.0, guided=False, holds=(0.5, 1.0), period=period, **settings
    )


SHIFTS = ((0.0, 0.0), (-24.0, 0.0), (48.0, 0.0))
"""Whole periods by which the robots of `meeting` are displaced: two of them start beyond a seam."""


# ---------------------------------------------------------------------------------------------------------------------
# Images.


def test_the_nearest_image_is_at_most_half_a_period_away():
    apart = np.random.default_rng(1).uniform(-50.0, 50.0, (200, 3))
    by = to_nearest(apart, (4.0, np.inf))
    assert np.all(np.abs((apart + by)[:, 0]) <= 2.0 + 1e-12)
    assert np.allclose(by[:, 0] / 4.0, np.round(by[:, 0] / 4.0))
    assert not by[:, 1:].any()


@pytest.mark.parametrize("period", [(3.0, 5.0), (3.0, np.inf), (np.inf, np.inf)])
def test_all_images_within_a_distance_are_found_and_few_others(period):
    rng = np.random.default_rng(2)
    positions, far = rng.uniform(-20.0, 20.0, (6, 2)), rng.uniform(1.0, 9.0, 6)
    lattice = [
        np.array([i * x if np.isfinite(x) else 0.0 for i, x in zip((a, b), period)])
        for a in range(-25, 26)
        for b in range(-25, 26)
    ]
    lattice = np.unique(lattice, axis=0)
    positions = positions + to_nearest(positions, period)
    for some in (np.arange(6), np.array([2]), np.array([4, 1])):
        owners, by = images_near(positions, far, some, period)
        assert np.any(by, axis=1).all()
        found = {(owner, *shift) for owner, shift in zip(owners.tolist(), np.round(by, 6).tolist())}
        assert len(found) == len(owners)
        for j in range(6):
            shifts = lattice[np.any(lattice, axis=1)]
            away = np.linalg.norm(positions[j] + shifts[:, None] - positions[some], axis=2)
            near = shifts[(away <= far[j] + far[some]).any(axis=1)]
            assert {(j, *shift) for shift in np.round(near, 6).tolist()} <= found
        # Few are among them that no robot is near to.
        low, high = positions[some].min(axis=0), positions[some].max(axis=0)
        outside = np.maximum(np.maximum(low - positions[owners] - by, positions[owners] + by - high), 0.0)
        assert np.all(np.linalg.norm(outside, axis=1) <= far[owners] + far[some].max() + 1e-12)


def test_neighbours_are_all_that_can_come_nearer():
    """Both may go up to `far`: with the nearest image in the first cell, none outside of the neighbours is nearer."""
    for far in (0.0, 1.0, 2.6, 9.0):
        most = np.abs(neighbours((2.0, np.inf), far)).max()
        assert most >= 2.0
        # The first that is left out, before and after.
        assert most + 2.0 - 1.0 - far >= 1.0 + far
    assert between(np.array([-3.0, -3.0]), np.array([3.0, 3.0]), (2.0, np.inf)).tolist() == [[-2, 0], [0, 0], [2, 0]]


def test_a_displaced_obstacle_is_the_same_elsewhere():
    by, times = np.array([8.0, -3.0]), np.linspace(0.0, 4.0, 9)
    car = Obstacle(Rectangle(2.0, 1.0), Circular((1.0, 2.0), 5.0, 2.0, 0.3), "car", "motion")
    image = displaced(car, by)
    there, here = image.trajectory, car.trajectory
    assert np.allclose(there.position(times), here.position(times) + by)
    for name in ("velocity", "acceleration"):
        assert np.array_equal(getattr(there, name)(times), getattr(here, name)(times))
    assert isinstance(there.path(0.0, 4.0), Path)
    assert np.allclose(there.path(0.0, 4.0).points, here.path(0.0, 4.0).points + by)
    assert np.array_equal(image.direction(times), car.direction(times))
    assert (there.dimension, there.span) == (here.dimension, here.span)
    assert there.speed_bound(0.0, 4.0) == here.speed_bound(0.0, 4.0)
    assert there.acceleration_bound(0.0, 4.0) == here.acceleration_bound(0.0, 4.0)
    assert there.breaks(0.0, 4.0).tolist() == here.breaks(0.0, 4.0).tolist()
    assert displaced(car, np.zeros(2)) is car
    assert displaced(car, by) is image


# ---------------------------------------------------------------------------------------------------------------------
# Runs.


@pytest.mark.parametrize("method", ["nao", "nao_shared", "vo"])
def test_a_run_shifted_by_periods_is_the_same_run(method):
    """And the same as in a world that does not repeat, where the others are too far away to be met again."""
    one = simulate(meeting(None), METHODS[method])
    assert np.abs(one.accelerations).max() > 0.5
    for shifts in (((0.0, 0.0),) * 3, SHIFTS):
        other = simulate(meeting(shifts=shifts), METHODS[method])
        assert other.outcomes == one.outcomes
        assert np.allclose(other.positions - np.array(shifts), one.positions, atol=1e-7)


@pytest.mark.parametrize("method", ["nao", "nao_shared"])
def test_so_is_one_whose_goals_move(method):
    """Each goal moves beside its robot's way, so that all of them change their manoeuvres."""

    def run(period, shifts):
        scenario = meeting(period, shifts)
        moving = (ConstantVelocity(r.goal.position(0.0), (0.5, -0.8)) for r in scenario.robots)
        robots = (replace(r, goal=replace(r.goal, trajectory=t)) for r, t in zip(scenario.robots, moving))
        return simulate(replace(scenario, robots=tuple(robots)), METHODS[method])

    one, other = run(None, ((0.0, 0.0),) * 3), run(PERIOD, SHIFTS)
    assert other.outcomes == one.outcomes
    assert np.allclose(other.positions - np.array(SHIFTS), one.positions, atol=1e-7)


@pytest.mark.parametrize(
    ("method", "settings"),
    [("nao", {"sight_delay": 0.2, "sight_noise": 0.01, "sight_loss": 0.2}), ("nao_shared", {"message_delay": 0.3})],
)
def test_so_is_one_with_late_sight_or_messages(method, settings):
    one, other = (
        simulate(meeting(p, s, **settings), METHODS[method], seed=3)
        for p, s in ((None, ((0, 0),) * 3), (PERIOD, SHIFTS))
    )
    assert other.outcomes == one.outcomes
    assert np.allclose(other.positions - np.array(SHIFTS), one.positions, atol=1e-7)


def test_a_robot_alone_meets_images_of_bodies_that_turn():
    """A bar along its motion, three periods away."""
    bar = Obstacle(Rectangle(2.4, 0.4), Circular((4.0, 2.0), 2.0, 1.0, 3.0), "bar", "motion")
    plain = Scenario("alone", (robot(0, (0, 0), (9, 0)),), (bar,), duration=6.0, horizon=4.0)
    one = simulate(plain, METHODS["nao"])
    far = displaced(bar, np.array([48.0, 0.0]))
    other = simulate(replace(plain, obstacles=(far,), period=(16.0, np.inf)), METHODS["nao"])
    assert np.abs(one.positions[:, 0, 1]).max() > 0.01
    # Choices at the border of a body that turns are known to about CONTACT only.
    assert np.allclose(other.positions, one.positions, atol=1e-3)


@pytest.mark.parametrize("method", ["nao", "vo"])
def test_a_robot_alone_meets_images_of_obstacles(method):
    """A rock at rest a period away, and a car that drives three periods away."""
    rock, car = Obstacle(Disc(0.5), Stationary((4.5, 0.1))), Obstacle(Disc(0.5), Circular((4.0, 2.0), 2.0, 1.0, 3.0))
    plain = Scenario("alone", (robot(0, (0, 0), (9, 0)),), (rock, car), duration=6.0, horizon=4.0)
    one = simulate(plain, METHODS[method])
    moved = displaced(rock, np.array([-16.0, 0.0])), displaced(car, np.array([48.0, 0.0]))
    other = simulate(replace(plain, obstacles=moved, period=(16.0, np.inf)), METHODS[method])
    assert np.abs(one.positions[:, 0, 1]).max() > 0.1
    assert np.allclose(other.positions, one.positions, atol=1e-7)
    for a, b in zip(closest_approaches(other), closest_approaches(one), strict=True):
        assert a.clearance == pytest.approx(b.clearance, abs=1e-6)


@pytest.mark.parametrize("method", ["nao", "nao_shared"])
@pytest.mark.parametrize("period", [(1.9, 1.9), (2.4, 3.1)])
def test_robots_of_a_small_world_meet_several_images(method, period):
    """The horizon reaches through the world three times."""
    starts = [(0.0, 0.0), (0.9, 0.9)]
    ways = [(50.0, 0.0), (0.9, -50.0)]
    robots = tuple(robot(k, a, b) for k, (a, b) in enumerate(zip(starts, ways)))
    small = Scenario("small", robots, duration=8.0, horizon=5.0, guided=False, holds=(0.5, 1.0), period=period)
    run = simulate(small, METHODS[method])
    assert between_robots(run)[0, 1] > 0.0
    assert np.linalg.norm(run.velocities, axis=2).max() > 0.5
    assert brute_force(run, 0, 1) == pytest.approx(between_robots(run)[0, 1], abs=1e-3)


# ---------------------------------------------------------------------------------------------------------------------
# What is measured.


def brute_force(run: Recording, i: int, j: int) -> float:
    """The least clearance of two discs at 20 times in each step, over many images."""
    e = np.linspace(0.0, run.dt, 21)[:, None, None]
    motion = run.positions[:-1] + e[..., None] * (run.velocities[:-1] + 0.5 * e[..., None] * run.accelerations)
    apart = motion[:, :, i] - motion[:, :, j]
    lengths = [x if np.isfinite(x) else 0.0 for x in run.period or (0.0, 0.0)]
    least = min(
        np.linalg.norm(apart + np.multiply((a, b), lengths), axis=-1).min()
        for a in range(-12, 13)
        for b in range(-12, 13)
    )
    return least - run.shapes[i].radius - run.shapes[j].radius


def passing(shape=None) -> Recording:
    """Two robots that do not meet, 8 m apart and driving against each other."""
    robots = (robot(0, (0, 0), (9, 0), (1, 0), shape), robot(1, (8, 1.0), (-9, 1), (-1, 0)))
    return simulate(Scenario("passing", robots, duration=3.0, guided=False), METHODS["nao"])


@pytest.mark.parametrize("shape", [None, Rectangle(0.6, 0.4)], ids=["discs", "rectangle"])
@pytest.mark.parametrize("period", [(8.0, np.inf), (2.9, 0.9), (6.5, 1.0), (np.inf, 1.0), (5.0, 4.0)])
def test_a_contact_across_the_seam_counts(period, shape):
    run = passing(shape)
    assert metrics.summary(run)["collisions"] == 0
    there = replace(run, period=period)
    least = between_robots(there)[0, 1]
    if shape is None:
        assert least == pytest.approx(brute_force(there, 0, 1), abs=1e-3)
    collided = least < -COLLISION
    assert collided == (period in ((2.9, 0.9), (6.5, 1.0)))
    summary = metrics.summary(there)
    assert summary["collisions"] == int(collided)
    assert summary["min_clearance"] == pytest.approx(least)
    one = single_robot_view(there, 0)
    assert metrics.collisions(one) == float(collided)
    assert metrics.min_clearance(one) == pytest.approx(least, abs=METRIC if shape is None else 1e-3)
    assert np.min(_clearances_at_steps(one)) >= least - 1e-9
    assert metrics.min_time_to_collision(one) <= metrics.min_time_to_collision(single_robot_view(run, 0))


def test_metrics_of_a_shifted_run_are_the_same():
    """Of images as of the bodies themselves: clearances, times to collision, sides."""
    one, other = simulate(meeting(None), METHODS["nao"]), simulate(meeting(shifts=SHIFTS), METHODS["nao"])
    assert np.allclose(between_robots(one), between_robots(other), atol=1e-6)
    assert [f.tolist() for f in flips_between(one)] == [f.tolist() for f in flips_between(other)]
    for k in range(3):
        a, b = single_robot_view(one, k), single_robot_view(other, k)
        for name in ("collisions", "min_clearance", "min_time_to_collision", "space_compliance", "clearing_distance"):
            found = metrics.METRICS[name]
            assert found(a) == pytest.approx(found(b), abs=1e-5), name
        assert side_flips(a) == side_flips(b)
        assert metrics.efficacy(one, k) == pytest.approx(metrics.efficacy(other, k))


# ---------------------------------------------------------------------------------------------------------------------
# Files, and the experiments of navground.


def test_a_recording_keeps_the_period(tmp_path):
    run = replace(passing(), period=(8.0, np.inf))
    run.save(tmp_path / "run.h5")
    again = Recording.load(tmp_path / "run.h5")
    assert again.period == (8.0, np.inf)
    assert again.digest() == run.digest() != passing().digest()
    passing().save(tmp_path / "plain.h5")
    assert Recording.load(tmp_path / "plain.h5").period is None


SCENE = """\
duration: 4
period: {period}
robot: {{position: [0, 0], radius: 0.3, max_speed: 1, max_acceleration: 1, goal: {{position: [9, 0]}}}}
obstacles:
  - {{radius: 0.4, trajectory: {{kind: stationary, position: [-6, 0.1]}}}}
"""


def test_a_scenario_file_says_the_period(tmp_path):
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE.format(period="[8, .inf]"))
    scenario = read_scenario(path)
    assert scenario.period == (8.0, np.inf)
    assert metrics.min_clearance(simulate(scenario, METHODS["nao"])) == pytest.approx(0.05, abs=0.04)
    for period, message in (
        ("[8, 0]", "period.1: expected a number above 0, found 0"),
        ("[8, 8, 8]", "period: expected 2 numbers above 0, inf along an axis that does not repeat; found 8, 8, 8"),
        ("8", "period: expected a list, found 8"),
    ):
        path.write_text(SCENE.format(period=period))
        with pytest.raises(InvalidFile) as caught:
            read_scenario(path)
        assert message in str(caught.value)


@pytest.mark.parametrize("method", ["nao", "nao_shared"])
@pytest.mark.parametrize("name", ["navground_cross_torus", "navground_corridor"])
@pytest.mark.parametrize("duration", draws([4.0, 40.0]))
def test_no_collision_in_the_experiments_of_navground(name, method, duration):
    # Robots that only see each other block each other in the corridor with other seeds (docs/fleets.md).
    run = simulate(gallery.build(name, {"duration": duration}, seed=8), METHODS[method], seed=8)
    row = metrics.summary(run)
    assert (row["collisions"], row["arrived"]) == (0, 0)
    assert row["efficacy"] > 0.5


# ---------------------------------------------------------------------------------------------------------------------
# Guidance.


def heads(first: float, period=PERIOD) -> np.ndarray:
    """Where robots head for that come towards each other along x, the first from `first` to the right."""
    robots = (robot(0, (first, 0.0), (first + 100.0, 0.0), (1.0, 0.0)), robot(1, (5.0, 0.0), (-95.0, 0.0), (-1.0, 0.0)))
    guidance = guidance_in(Scenario("towards", robots, period=period))
    guidance.update(0.0, 0.1)
    return guidance.guide.target[:, :2] - guidance.guide.position[:, :2]


def test_robots_that_come_towards_each_other_pass_on_the_right_across_the_seam():
    """As in the middle of the world; those that are not met within 8 s head straight on."""
    found = heads(0.0)
    assert found[0, 1] < 0.0 < found[1, 1]
    assert heads(24.0) == pytest.approx(found)
    assert heads(-240.0) == pytest.approx(found)
    assert heads(-7.0 - 4.5)[:, 1] == pytest.approx(0.0)


def test_those_that_cross_head_straight_on():
    robots = (robot(0, (0.0, 0.0), (100.0, 0.0), (1.0, 0.0)), robot(1, (3.0, -3.0), (3.0, 97.0), (0.0, 1.0)))
    guidance = guidance_in(Scenario("crossing", robots, period=PERIOD))
    guidance.update(0.0, 0.1)
    assert np.array_equal(guidance.guide.target, guidance.guide.goal)


def test_what_rests_is_there_in_every_image():
    """A wall in the middle of a period blocks the way aside in all images of its place."""
    wall = Obstacle(Rectangle(2.0, 2.0), Stationary((12.0, 0.0)), "wall")
    robots = tuple(robot(k, (4.0 + k, 4.0), (400.0, 4.0)) for k in range(2))
    guidance = guidance_in(Scenario("walled", robots, (wall,), period=PERIOD))
    guidance.update(0.0, 0.1)
    for by in (-48.0, -24.0, 0.0, 24.0, 480.0):
        for x, y, free in ((12.0, 0.0, False), (12.0, 2.5, True), (9.5, 0.0, True), (13.0, 0.5, False)):
            found = is_free(x + by, y, 0.3, guidance.guide.period, guidance.grid)
            assert found == free, (x, y, by)


@pytest.mark.parametrize("method", ["nao", "nlvo", "avo", "rvo"])
@pytest.mark.parametrize("period", [(7.0, 8.0), (9.0, np.inf)])
@pytest.mark.parametrize("seed", draws(range(5)))
def test_robots_decide_as_in_a_world_with_all_images_as_robots(method, period, seed):
    """Tiles of a world that does not repeat hold the same robots, more of them than any robot can meet."""
    rng, n = np.random.default_rng(seed), 5
    places = np.array([(3.0 * k % 7.0, 1.6 * k) for k in range(n)]) + rng.uniform(0.0, 0.6, (n, 2))
    whole_periods = np.where(np.isfinite(period), period, 0.0) * rng.integers(-3, 4, (n, 2))
    velocities, targets = rng.uniform(-1.0, 1.0, (n, 2)), places + rng.uniform(-30.0, 30.0, (n, 2))
    around = between(np.full(2, -30.0), np.full(2, 30.0), period)
    tiles = np.concatenate([np.zeros((1, 2)), around[np.any(around, axis=1)]])
    shapes = [Rectangle(0.8, 0.4) if k == 2 else Disc(0.3) for k in range(n)]
    # No robot can meet its own images, which it avoids in tiles only.
    settings = {"horizon": 2.5, "limits": Limits(1.2, 1.5), "guided": False}
    repeating = Fleet(METHODS[method], shapes, world_period=period, **settings)
    tiled = Fleet(METHODS[method], shapes * len(tiles), **settings)
    for step in range(3):
        now = 0.1 * step
        one = repeating.step(now, places + whole_periods, velocities, targets + whole_periods)
        every = (tiles[:, None] + places).reshape(-1, 2), np.tile(velocities, (len(tiles), 1))
        other = tiled.step(now, *every, (tiles[:, None] + targets).reshape(-1, 2))
        np.testing.assert_allclose(one.accelerations, other.accelerations[:n], atol=1e-7)
        assert one.outcomes == other.outcomes[:n]
        places, velocities = one.positions - whole_periods, one.velocities


def test_a_robot_of_a_repeating_world_does_not_meet_tracks_of_another_one():
    """It decides as with no track; with a track of its world it does not."""

    def accelerations(*worlds: int) -> np.ndarray:
        fleet = Fleet(METHODS["nao"], Disc(0.3), Limits(1.5, 2.0), robots=1, world_period=(30.0, np.inf))
        others = [Tracks([(3.0, 0.05)], [(-1.5, 0.0)], 0.3, worlds=[world]) for world in worlds]
        return fleet.step(0.0, [(0.0, 0.0)], [(1.4, 0.0)], [(8.0, 0.0)], others=others).accelerations

    np.testing.assert_array_equal(accelerations(1), accelerations())
    assert (accelerations(0) != accelerations()).any()
