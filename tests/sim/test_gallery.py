"""The gallery's scenarios are what they say."""

import inspect

import numpy as np
import pytest
import shapely
from draws import draws
from galleries import FLEETS, NAMES, WITH_PYRVO, gallery_run, nudged

import slalom
from slalom.sim import gallery, metrics, simulate
from slalom.sim.gallery.worlds import start_positions, walking_positions
from slalom.sim.shape_distance import clearances


@pytest.mark.parametrize("name", [name for name in NAMES if name not in FLEETS or name in ("circle", "random_goals")])
def test_nao_crosses_every_scenario_without_a_collision(name):
    scenario = gallery.build(name)
    method = "nao_shared" if len(scenario.robots) > 1 else "nao"
    result = metrics.summary(gallery_run(name, method))
    assert result["arrived"] == len(scenario.robots)
    assert result["collisions"] == 0


@pytest.mark.parametrize("name", [name for name in FLEETS if name != "warehouse"])
def test_fleets_set_off_without_a_collision(name):
    """Well-posed: robots that start clear of each other and of walls stay clear and come nearer to their goals."""
    scenario = gallery.build(name, {"robots": 6.0, "duration": 2.0}, seed=1)
    run = simulate(scenario, slalom.METHODS["nao_shared"], seed=1)
    assert metrics.summary(run)["collisions"] == 0
    goals = np.array([robot.goal.position(0.0) for robot in scenario.robots])
    away = np.linalg.norm(run.positions[[0, -1]] - goals, axis=2)
    assert np.all(away[1] < away[0] - 0.25 * 2.0 * scenario.robot.limits.max_speed)


@pytest.mark.parametrize("entry", gallery.GALLERY.values(), ids=lambda entry: entry.name)
def test_every_scenario_fits_on_a_screen(entry):
    assert len(inspect.getsource(entry.build).splitlines()) <= 40


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("seed", range(3))
def test_starts_are_free_of_overlap(name, seed):
    scenario = gallery.build(name, seed=seed)
    for obstacle in scenario.obstacles:
        if obstacle.exists(scenario.start):
            for robot in scenario.robots:
                now, position = np.array([scenario.start]), robot.state.position[None]
                assert clearances(obstacle, robot.shape, now, position)[0] > 0.0


@pytest.mark.parametrize("name", NAMES)
def test_the_seed_is_all_that_is_drawn_with(name):
    """The same seed gives the same bits, another seed, where something is random, others."""
    one, same, other = (content(gallery.build(name, seed=seed)) for seed in (5, 5, 6))
    assert one == same
    assert (one == other) == (name in ("empty", "head_on", "curved_road", "recorded_roundabout"))


def content(scenario):
    """Positions and goals of all robots and obstacles over the first seconds, to the bit."""
    times = scenario.start + np.linspace(0.0, 5.0, 7)
    robots = [
        (robot.state.position.tobytes(), robot.state.velocity.tobytes(), robot.goal.position(times).tobytes())
        for robot in scenario.robots
    ]
    others = []
    for obstacle in scenario.obstacles:
        first, last = obstacle.trajectory.span
        others.append(obstacle.trajectory.position(np.clip(times, first, last)).tobytes())
    tasks = scenario.tasks.until(0.0, 60.0) if scenario.tasks else []
    return robots, others, tasks


def test_robots_of_the_warehouse_work_without_a_collision():
    """Six robots do tasks; all stations and waiting places are free of shelves and of each other."""
    scenario = gallery.build("warehouse", {"robots": 6.0, "rate": 30.0, "duration": 40.0}, seed=1)
    result = metrics.summary(simulate(scenario, slalom.METHODS["nao_shared"], seed=1))
    assert result["collisions"] == 0
    assert result["tasks"]["tasks_done"] >= 2
    found = scenario.places()
    every = np.concatenate([*found.at, found.waiting])
    assert apart(every) >= found.apart - 1e-6
    for obstacle in scenario.obstacles:
        assert clearances(obstacle, scenario.robot.shape, np.zeros(len(every)), every).min() >= scenario.margin - 1e-3


# Several robots.


def starts_and_goals(scenario):
    """Both (n, 2) [m]."""
    starts = np.array([robot.state.position for robot in scenario.robots])
    return starts, np.array([robot.goal.position(scenario.start) for robot in scenario.robots])


def apart(positions):
    """The least distance between two of the places (n, 2)."""
    return (np.linalg.norm(positions[:, None] - positions, axis=2) + 1e9 * np.eye(len(positions))).min()


@pytest.mark.parametrize("settings", [{}, {"robots": 13.0}, {"robot_radius": 0.05}, "nudged"], ids=str)
@pytest.mark.parametrize("name", FLEETS)
@pytest.mark.parametrize("seed", range(3))
def test_starts_and_goals_overlap_no_robot_and_no_wall(name, seed, settings):
    """And there is a way: start and goal are in the same part of what the walls leave free."""
    scenario = gallery.build(name, nudged(name) if settings == "nudged" else settings, seed=seed)
    radius = scenario.robot.shape.radius
    for positions in starts_and_goals(scenario):
        assert apart(positions) >= 2.0 * radius
    free = shapely.box(-99, -99, 99, 99)
    for wall in scenario.obstacles:
        for part in wall.shape.parts:
            free = free.difference(shapely.convex_hull(shapely.multipoints(part.corners)).buffer(part.radius + radius))
    regions = list(getattr(free, "geoms", [free]))
    for start, goal in zip(*starts_and_goals(scenario)):
        here, there = ([region.contains(shapely.Point(position)) for region in regions] for position in (start, goal))
        assert any(here)
        assert here == there


@pytest.mark.parametrize("name", FLEETS)
def test_robots_are_as_they_were_asked_for(name):
    """Count, size and limits; they rest at first, but on the ring they go at full speed."""
    asked = {"robots": 9.0, "robot_radius": 0.07, "max_speed": 0.9, "max_acceleration": 1.7}
    scenario = gallery.build(name, asked, seed=3)
    assert len({robot.name for robot in scenario.robots}) == 9
    for robot in scenario.robots:
        assert robot.shape.radius == 0.07
        assert robot.limits == slalom.Limits(0.9, 1.7)
        assert robot.goal.stop
        away = robot.goal.position(0.0) - robot.state.position
        wanted = 0.9 * away / np.linalg.norm(away) if name == "ring" else (0.0, 0.0)
        assert np.allclose(robot.state.velocity, wanted, atol=1e-12)


@pytest.mark.parametrize(("name", "radius"), [("circle", 20.0), ("circle_random", 20.0), ("ring", 25.0)])
def test_goals_on_a_circle_are_opposite_to_the_starts(name, radius):
    for wanted in (radius, 31.0):
        starts, goals = starts_and_goals(gallery.build(name, {"radius": wanted, "robots": 8.0}, seed=2))
        assert np.allclose(np.linalg.norm(goals, axis=1), wanted)
        assert np.allclose(starts, -goals, atol=0.1)


@pytest.mark.parametrize("name", ["circle", "ring", "navground_antipodal"])
def test_noise_moves_the_starts_alone(name):
    settings = {"robots": 40.0, "robot_radius": 0.01, "noise": 0.004}
    starts, goals = starts_and_goals(gallery.build(name, settings, seed=2))
    assert np.std(starts + goals) == pytest.approx(0.004, rel=0.2)
    exact, same = starts_and_goals(gallery.build(name, settings | {"noise": 0.0}, seed=2))
    assert np.array_equal(exact, -goals)
    assert np.array_equal(goals, same)


def test_a_circle_is_filled_to_the_last_place():
    """Robots 0.2 m apart all round, and not one more."""
    settings = {"radius": 1.0, "robot_radius": 0.2, "robots": 10.0}
    starts, _ = starts_and_goals(gallery.build("circle_random", settings, seed=4))
    assert apart(starts) >= 0.6 - 1e-9
    with pytest.raises(slalom.InvalidInput, match=r"robots: expected at most 10, which fill the circle; found 11"):
        gallery.build("circle_random", settings | {"robots": 11.0})


@pytest.mark.parametrize("angle", [20.0, 90.0, 135.0, 180.0])
@pytest.mark.parametrize("lanes", [1.0, 3.0])
def test_two_streams_cross_at_their_angle(angle, lanes):
    scenario = gallery.build("crossing_streams", {"angle": angle, "lanes": lanes, "robots": 15.0}, seed=1)
    starts, goals = starts_and_goals(scenario)
    ways = goals - starts
    turned = np.degrees(np.arccos(np.clip(ways[::2] @ ways[1] / np.linalg.norm(ways[0]) ** 2, -1.0, 1.0)))
    assert np.allclose(turned, angle, atol=1e-5)
    assert np.allclose(ways[::2], ways[0])
    assert np.allclose(ways[1::2], ways[1])
    across = (starts[::2] @ (-ways[0, 1], ways[0, 0])) / np.linalg.norm(ways[0])
    assert len(np.unique(np.round(across, 9))) == lanes
    # Clear of each other before and after, and each crosses the other's way.
    for positions in (starts, goals):
        assert min(np.linalg.norm(positions[::2, None] - positions[1::2], axis=2).ravel()) > 2.0
    if angle < 180.0:
        lines = shapely.linestrings(np.stack([starts, goals], axis=1))
        assert all(shapely.intersects(one, other) for one in lines[::2] for other in lines[1::2])


@pytest.mark.parametrize("settings", [{}, {"width": 4.0}, {"length": 33.0, "robots": 7.0}], ids=str)
def test_two_groups_change_the_ends_of_a_corridor(settings):
    scenario = gallery.build("corridor_swap", settings, seed=2)
    width, length = ({"width": 6.0, "length": 20.0} | settings)["width"], settings.get("length", 20.0)
    starts, goals = starts_and_goals(scenario)
    assert np.all(starts[:, 0] * goals[:, 0] < 0.0)
    assert (starts[:, 0] < 0.0).sum() == (len(starts) + 1) // 2
    for positions in (starts, goals):
        assert np.all(np.abs(positions[:, 1]) <= 0.5 * width - 0.3)
        assert np.all(np.abs(positions[:, 0]) >= length / 6.0 - 1e-9)
        assert np.all(np.abs(positions[:, 0]) <= 0.5 * length)
    between = clearances(scenario.obstacles[0], slalom.Disc(0.5 * width), np.zeros(1), np.zeros((1, 2)))
    assert between[0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("both", [0.0, 1.0])
def test_robots_go_through_the_doorway(both):
    scenario = gallery.build("doorway", {"both": both, "robots": 21.0, "door": 1.1}, seed=2)
    starts, goals = starts_and_goals(scenario)
    assert np.all(starts[:, 0] * goals[:, 0] < 0.0)
    assert (starts[:, 0] > 0.0).sum() == (10 if both else 0)
    walls, origin = scenario.obstacles[0], np.zeros((1, 2))
    assert clearances(walls, slalom.Disc(0.55), np.zeros(1), origin)[0] == pytest.approx(0.0, abs=1e-12)
    for x in (-8.0, 8.0):
        room = np.array([[0.5 * x, 0.0]])
        assert clearances(walls, slalom.Disc(4.0), np.zeros(1), room)[0] == pytest.approx(0.0, abs=0.051)
    # No robot stands in front of it.
    assert np.all(np.abs(np.concatenate([starts, goals])[:, 0]) >= 1.1 + 0.3)


def test_the_experiments_of_navground():
    """Twenty robots of 0.1 m on a circle of 2 m, and of 0.08 m in a square of 4 m, 1000 steps of 0.1 s."""
    antipodal, cross = gallery.build("navground_antipodal"), gallery.build("navground_cross", seed=7)
    starts, goals = starts_and_goals(antipodal)
    assert np.allclose(np.linalg.norm(goals, axis=1), 2.0)
    assert {(r.shape.radius, r.limits.max_speed, r.goal.tolerance) for r in antipodal.robots} == {(0.1, 0.08, 0.2)}
    assert {(r.shape.radius, r.limits.max_speed, r.goal.tolerance) for r in cross.robots} == {(0.08, 0.12, 0.2)}
    assert {(s.duration, s.dt, len(s.robots)) for s in (antipodal, cross)} == {(100.0, 0.1, 20)}
    starts, goals = starts_and_goals(cross)
    ways = np.round(goals - starts, 9)
    assert {tuple(way) for way in ways.tolist()} == {(3.2, 0.0), (0.0, 3.2), (-3.2, 0.0), (0.0, -3.2)}
    assert np.all(np.abs(starts).max(axis=1) <= 2.0)
    assert apart(starts) >= 0.16


@pytest.mark.parametrize("seed", range(20))
def test_cars_of_the_roundabout_keep_their_distance(seed):
    """Thirty cars in three lanes, each lane's cars at least 4.5 m of arc apart."""
    cars = gallery.build("roundabout_crossing", seed=seed).obstacles
    assert len(cars) == 30
    for lane, speed in ((12.0, 5.0), (16.0, 6.5), (20.0, 8.0)):
        paths = [car.trajectory for car in cars if car.trajectory.radius == lane]
        assert [path.speed for path in paths] == [speed] * 10
        phases = np.sort([path.phase % (2 * np.pi) for path in paths])
        assert np.diff([*phases, phases[0] + 2 * np.pi]).min() * lane >= 4.5 - 1e-9


@pytest.mark.parametrize("seed", draws([7, *(k for k in range(20) if k != 7)]))
def test_a_robot_merges_into_a_gap_and_leaves_at_its_exit(seed):
    """Between the same two cars all the way, in the lane, from the entry on the left to the exit on the right."""
    scenario = gallery.build("merging", seed=seed)
    run = simulate(scenario, slalom.METHODS["nao"], seed=seed)
    row = metrics.summary(run)
    assert (row["arrived"], row["collisions"]) == (1, 0), row
    position, times = run.positions[:, 0], run.times
    radius, angle = (
        np.linalg.norm(position, axis=1),
        np.unwrap(np.arctan2(position[:, 1], position[:, 0]) % (2.0 * np.pi)),
    )
    assert np.all(radius[times < times[0] + 2.0] > 23.0)
    inside = (angle > np.pi + np.radians(45.0)) & (angle < 2.0 * np.pi - np.radians(15.0))
    assert inside.sum() > 40
    assert np.all(np.abs(radius[inside] - 20.0) < 1.0)
    cars = [car.trajectory for car in scenario.obstacles if car.trajectory.radius == 20.0]
    ahead = np.array([(car.phase + car.rate * times[inside] - angle[inside]) % (2.0 * np.pi) for car in cars])
    assert len(np.unique(ahead.argmin(axis=0))) == len(np.unique(ahead.argmax(axis=0))) == 1
    assert 20.0 * (ahead.min(axis=0) + 2.0 * np.pi - ahead.max(axis=0)).min() >= 6.0
    assert radius[-1] > 25.0


def test_merging_is_as_it_was_asked_for():
    """When the gap comes, how wide it is, and how far round the exit is."""
    for settings in ({}, {"wait": 1.5}, {"gap": 11.0}, {"exit": 250.0}):
        wait, gap, turn = (settings.get(*pair) for pair in (("wait", 3.0), ("gap", 6.0), ("exit", 180.0)))
        scenario = gallery.build("merging", settings, seed=3)
        now, path = scenario.start + wait, scenario.robot.goal.trajectory
        assert np.allclose(path.position(now), (-20.0, 0.0))
        cars = [car.trajectory.position(now) for car in scenario.obstacles if car.trajectory.radius == 20.0]
        nearest = np.sort([abs(np.arctan2(y, -x)) for x, y in cars])[:2]
        assert nearest[0] == pytest.approx(nearest[1])
        assert 40.0 * nearest[0] >= gap
        leaves = path.switches[0]
        assert np.linalg.norm(path.velocity(leaves - 1e-6)) == pytest.approx(8.4)
        assert np.degrees((leaves - now) * 0.42) == pytest.approx(turn)
        assert np.allclose(path.velocity(path.span[1]), 0.0, atol=1e-9)


@WITH_PYRVO
@pytest.mark.parametrize("case", [0, 1, 499])
def test_people_of_crowdnav_start_as_there(case):
    """Draw by draw as its code does: an angle and two offsets at a time, kept if clear of all starts and goals."""
    random = np.random.RandomState(1000 + case)
    agents = [(0.0, -4.0, 0.0, 4.0)]
    while len(agents) < 6:
        angle = random.random_sample() * np.pi * 2
        px_noise, py_noise = random.random_sample() - 0.5, random.random_sample() - 0.5
        px, py = 4 * np.cos(angle) + px_noise, 4 * np.sin(angle) + py_noise
        positions = [position for x, y, gx, gy in agents for position in ((x, y), (gx, gy))]
        if all(np.hypot(px - x, py - y) >= 0.8 for x, y in positions):
            agents.append((px, py, -px, -py))
    scenario = gallery.build("crowdnav", seed=case)
    starts = [person.trajectory.position(0.0) for person in scenario.obstacles]
    assert np.array_equal(starts, np.array(agents)[1:, :2])
    assert [person.name for person in scenario.obstacles] == [f"person {k}" for k in range(1, 6)]


@WITH_PYRVO
@pytest.mark.parametrize("people", [1, 5, 8])
def test_people_of_crowdnav_walk_past_each_other(people):
    """No faster than 1 m/s, apart, to the opposite place; there for as long as a run looks ahead."""
    scenario = gallery.build("crowdnav", {"people": people}, seed=4)
    assert len(scenario.obstacles) == people
    times = np.arange(0.0, 30.0, 0.25)
    walks = np.array([person.trajectory.position(times) for person in scenario.obstacles])
    assert np.linalg.norm(np.diff(walks, axis=1), axis=2).max() <= 0.25 * (1.0 + 1e-6)
    assert np.allclose(walks[:, -1], -walks[:, 0], atol=0.05)
    for k in range(len(times)):
        assert people == 1 or apart(walks[:, k]) > 0.6


@WITH_PYRVO
@pytest.mark.draw(0)
def test_orca_among_these_people_does_as_published():
    """The published row of ORCA: 43 % success, 57 % collisions, 10.86 s; collisions and times as counted there."""
    ends = [crossing_by_orca(case) for case in range(500)]
    success = [time for outcome, time in ends if outcome == "success"]
    assert len(success) / 500 == pytest.approx(0.43, abs=0.01)
    assert sum(outcome == "collision" for outcome, _ in ends) / 500 == pytest.approx(0.57, abs=0.01)
    assert np.mean(success) == pytest.approx(10.86, abs=0.02)


def crossing_by_orca(case):
    """How and when ORCA's robot, unobserved by the people, ends; as in CrowdNav, with their former velocities."""
    from pyrvo import RVOSimulator

    walks = walking_positions(start_positions(5, case), 97)
    velocities = np.diff(walks, axis=0, prepend=walks[:1]) / 0.25
    position, velocity, goal = np.array([0.0, -4.0]), np.zeros(2), np.array([0.0, 4.0])
    simulator = RVOSimulator(0.25, 10.0, 10, 5.0, 5.0, 0.31, 1.0)
    for k in range(6):
        simulator.add_agent((float(k), 0.0))
    for k in range(97):
        for agent, (where, speed) in enumerate([(position, velocity), *zip(walks[k], velocities[k])]):
            simulator.set_agent_position(agent, tuple(where))
            simulator.set_agent_velocity(agent, tuple(speed))
            simulator.set_agent_pref_velocity(agent, (0.0, 0.0))
        away = goal - position
        simulator.set_agent_pref_velocity(0, tuple(away / max(1.0, np.linalg.norm(away))))
        simulator.do_step()
        chosen = simulator.get_agent_velocity(0)
        velocity = np.array([chosen.x, chosen.y])
        gap, closing = walks[k] - position, velocities[k] - velocity
        share = np.clip(-np.sum(gap * closing, axis=1) / np.maximum(0.25 * np.sum(closing**2, axis=1), 1e-12), 0, 1)
        position = position + 0.25 * velocity
        if 0.25 * k >= 24.0:
            return "timeout", 0.25 * k
        if np.linalg.norm(gap + 0.25 * share[:, None] * closing, axis=1).min() < 0.6:
            return "collision", 0.25 * k
        if np.linalg.norm(goal - position) < 0.3:
            return "success", 0.25 * (k + 1)
    return "timeout", 24.25


def test_on_the_curved_road_vo_flags_a_car_that_nlvo_does_not():
    scenario = gallery.build("curved_road")
    straight_on = scenario.robot.state.velocity
    flagged = {}
    for name in ("vo", "nlvo"):
        navigator = scenario.navigator(slalom.method(name))
        traffic = navigator.predict(scenario.obstacles, scenario.robot.state, scenario.start)
        blocked = slalom.ControlObstacle(slalom.Velocity(), scenario.robot.state, traffic, scenario.robot.shape)
        flagged[name] = bool(blocked.contains(straight_on))
    assert flagged == {"vo": True, "nlvo": False}


def test_recorded_cars_are_the_recording():
    cars = gallery.build("recorded_roundabout").obstacles
    assert len(cars) == 30
    assert all(car.trajectory.span == (0.0, 119.9) for car in cars)
    assert np.allclose(cars[0].trajectory.position(0.0), (-41.938, 11.278))
