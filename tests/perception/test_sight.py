"""Limited sight: what is visible, by rays of an own derivation; what is known to be empty; robots that can stop."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from draws import draws

from slalom import (
    BoundedError,
    Capsule,
    ConstantVelocity,
    ControlObstacle,
    Disc,
    Goal,
    Limits,
    Navigator,
    Obstacle,
    ObstacleWindow,
    Outcome,
    Polygon,
    Risk,
    Sight,
    State,
    Stationary,
    method,
)
from slalom.perception.sight import FULL_TURN, OCCLUSIONS
from slalom.sim import Recording, gallery, read_scenario, simulate
from slalom.sim.files.scenario_writer import scenario_text
from slalom.sim.scenario import Scenario, numbers_of, sight_of
from slalom.sim.shape_distance import clearances

RAYS = 400
"""Points of a body at which the oracle aims."""


def crossed(start: np.ndarray, end: np.ndarray, corners: np.ndarray) -> bool:
    """Whether the segment from start to end crosses the convex polygon with these corners, counter-clockwise.

    The segment is clipped at the half-plane of each edge (Cyrus and Beck).
    """
    first, last = 0.0, 1.0
    for a, b in zip(corners, np.roll(corners, -1, axis=0)):
        inward = np.array([a[1] - b[1], b[0] - a[0]])
        height, slope = inward @ (start - a), inward @ (end - start)
        if slope == 0.0:
            if height <= 0.0:
                return False
        elif slope > 0.0:
            first = max(first, -height / slope)
        else:
            last = min(last, -height / slope)
    return first < last


def meets_disc(start: np.ndarray, end: np.ndarray, center: np.ndarray, radius: float) -> bool:
    """Whether the segment comes closer to the center than the radius."""
    along = end - start
    share = min(max((center - start) @ along / max(along @ along, 1e-300), 0.0), 1.0)
    return math.dist(start + share * along, center) < radius


class Room:
    """Random walls and discs around a sensor at the origin, with a field of view; the oracle of sight."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.walls, self.centers, self.radii = [], [], []
        while len(self.walls) < 4:
            box = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * rng.uniform(0.1, 1.5, 2)
            angle = rng.uniform(0.0, math.pi)
            c, s = math.cos(angle), math.sin(angle)
            corners = box @ np.array([[c, s], [-s, c]]) + rng.uniform(-5.0, 5.0, 2)
            if shapely.Polygon(corners).distance(shapely.Point(0, 0)) > 0.5:
                self.walls.append(corners)
        while len(self.centers) < 6:
            center = rng.uniform(-6.0, 6.0, 2)
            if np.linalg.norm(center) > 1.0 and all(math.dist(center, other) > 1.3 for other in self.centers):
                self.centers.append(center)
                self.radii.append(rng.uniform(0.1, 0.6))
        self.heading, self.turn = rng.uniform(-3.0, 3.0), rng.choice([2.0 * math.pi, rng.uniform(0.5, 6.0)])
        self.reach, self.occlusion = rng.uniform(3.0, 8.0), str(rng.choice(["none", "walls", "all"]))
        self.sight = Sight(self.reach, self.turn, occlusion=self.occlusion)
        self.state = State((0.0, 0.0), (0.0, 0.0), heading=self.heading)

    @property
    def obstacles(self) -> list[Obstacle]:
        fixed = [Obstacle(Polygon(corners), Stationary((0.0, 0.0)), "wall") for corners in self.walls]
        people = [
            Obstacle(Disc(radius), ConstantVelocity(center, (0.3, 0.1)), "person")
            for center, radius in zip(self.centers, self.radii)
        ]
        return [*fixed, *people]

    def sees(self, point: np.ndarray, slack: float, apart: int | None = None) -> bool:
        """Whether the sensor sees a point; with a `slack` above 0 more is hidden, below 0 less.

        Disc `apart` hides nothing.
        """
        origin, distance = np.zeros(2), float(np.linalg.norm(point))
        away = abs((math.atan2(point[1], point[0]) - self.heading + math.pi) % (2.0 * math.pi) - math.pi)
        if distance > self.reach * (1.0 - slack) or (self.turn < 6.28 and away > self.turn / 2.0 - slack):
            return False
        if self.occlusion == "none":
            return True
        for corners in self.walls:
            middle = corners.mean(axis=0)
            if crossed(origin, point, middle + (1.0 + slack) * (corners - middle)):
                return False
        hiding = range(len(self.centers) if self.occlusion == "all" else 0)
        return not any(
            k != apart and meets_disc(origin, point, self.centers[k], self.radii[k] * (1.0 + slack)) for k in hiding
        )

    def sees_disc(self, k: int, slack: float) -> bool:
        """Whether the sensor sees one of many points of disc k."""
        n = np.arange(RAYS)
        radius = self.radii[k] * (1.0 - slack) * np.sqrt((n + 0.5) / RAYS)
        angle = 2.39996323 * n
        points = self.centers[k] + np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
        return any(self.sees(point, slack, k) for point in points)


@pytest.mark.parametrize("seed", draws(range(40), first=8))
def test_a_body_is_visible_if_a_ray_reaches_it(seed):
    """Exactly as rays say, but where a body, a shadow or the range a few percent larger would change that."""
    room = Room(np.random.default_rng(seed))
    found = room.sight.look(room.state, room.obstacles)
    for k in range(len(room.centers)):
        certain, possible = room.sees_disc(k, 0.03), room.sees_disc(k, -0.03)
        visible = bool(found.visible[len(room.walls) + k])
        assert visible or not certain
        assert possible or not visible
    assert {o.name for o in found.seen} <= {"wall", "person"}
    assert len(found.seen) == len(room.walls) + np.count_nonzero(found.visible[len(room.walls) :])


@pytest.mark.parametrize("seed", draws(range(20), first=4))
def test_the_visible_region_is_what_rays_reach(seed):
    """Points of the region are visible; points that are well visible are in it."""
    rng = np.random.default_rng(100 + seed)
    room = Room(rng)
    region, both = room.sight.look(room.state, room.obstacles).region, [0, 0]
    for point in rng.uniform(-room.reach, room.reach, (400, 2)):
        inside = region.contains(shapely.Point(point))
        both[int(inside)] += 1
        assert room.sees(point, -1e-9) or not inside
        assert inside or not room.sees(point, 0.01)
    assert min(both) > 0


def test_what_is_seen_does_not_depend_on_what_is_hidden():
    """Other hidden people, and another future of all of them, change nothing that a look returns."""
    wall = Obstacle(Polygon([(2.0, -1.0), (3.0, -1.0), (3.0, 1.0), (2.0, 1.0)]), Stationary((0.0, 0.0)))
    sight, state = Sight(8.0, occlusion="all", hidden_speed=1.0), State((0.0, 0.0), (1.0, 0.0))
    behind = [Obstacle(Disc(0.2), ConstantVelocity((5.0, y), (0.0, 1.0)), "hidden") for y in (-0.5, 0.5)]
    for one, other in (((wall,), (wall, *behind)), ((wall, behind[0]), (wall, behind[1]))):
        first, second = (sight.look(state, obstacles) for obstacles in (one, other))
        assert first.region.equals(second.region)
        assert first.clear.equals(second.clear)
        assert first.seen == second.seen == (wall,)
        places = [[o.trajectory.initial_position.tolist() for o in each.hidden] for each in (first, second)]
        assert places[0] == places[1] != []


@pytest.mark.parametrize("seed", draws(range(8), first=2))
@pytest.mark.parametrize("turn", [2.0 * math.pi, 2.0])
def test_nothing_hidden_is_where_the_robot_knows_it_is_empty(seed, turn):
    """Points that walk at up to the hidden speed, not through walls, are never in `clear` unless they are in sight."""
    rng = np.random.default_rng(seed)
    corners = [
        [(-9, 1), (-1, 1), (-1, 9), (-9, 9)],
        [(1, 1), (9, 1), (9, 9), (1, 9)],
        [(-9, -2), (9, -2), (9, -1), (-9, -1)],
    ]
    walls = [Obstacle(Polygon(np.array(each, dtype=float)), Stationary((0.0, 0.0))) for each in corners]
    solid = shapely.union_all([shapely.Polygon(each) for each in corners])
    sight, speed, last, step = Sight(6.0, turn, 0.5, hidden_speed=1.2), 1.2, None, 0.1
    walkers = rng.uniform((-9.0, -1.0), (9.0, 9.0), (600, 2))
    walkers = walkers[~shapely.contains_xy(solid, *walkers.T)]
    headings = rng.uniform(0.0, 6.28, len(walkers))
    for k in range(80):
        # Forth, then back, so that it knows more than it sees.
        x, direction = (-7.0 + 0.2 * k, 1.0) if k < 50 else (3.0 - 0.2 * (k - 50), -1.0)
        last = sight.look(State((x, 0.0), (2.0 * direction, 0.0)), walls, step * k, last)
        in_sight = shapely.intersects_xy(last.region, *walkers.T)
        assert last.clear.area >= last.region.area - 0.1
        # Those in sight are no hidden agents any more: they are followed as people.
        walkers, headings = walkers[~in_sight], headings[~in_sight]
        assert not shapely.contains_xy(last.clear, *walkers.T).any()
        # Half of them walk towards the robot, the others at random.
        headings += rng.normal(0.0, 0.4, len(headings))
        chase = np.arctan2(-walkers[:, 1], x - walkers[:, 0])
        angle = np.where(np.arange(len(walkers)) % 2 == 0, chase, headings)
        ahead = walkers + step * speed * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        free = ~shapely.intersects(shapely.linestrings(np.stack([walkers, ahead], axis=1)), solid)
        walkers = np.where(free[:, None], ahead, walkers)
    assert last is not None
    assert last.clear.area > last.region.area + 0.5


def test_hidden_people_are_in_shadows_that_were_entered():
    """A person that walks out of sight is not forgotten: no place that it can have reached is known to be empty."""
    wall = Obstacle(Polygon([(2.0, 0.5), (4.0, 0.5), (4.0, 3.0), (2.0, 3.0)]), Stationary((0.0, 0.0)))
    person = Obstacle(Disc(0.2), ConstantVelocity((4.6, 0.0), (0.0, 1.0)), "person")
    sight, last, hidden = Sight(9.0, hidden_speed=1.1), None, 0
    for now in np.arange(0.0, 2.5, 0.1):
        last = sight.look(State((0.0, 0.0), (0.0, 0.0)), [wall, person], float(now), last)
        body = shapely.Point(person.trajectory.position(now)).buffer(0.2)
        if not last.visible[1]:
            hidden += 1
            assert last.clear.intersection(body).area < 1e-9
    assert hidden > 5


def approaching(speed: float, place: float = 3.0) -> Obstacle:
    """A line across the way that comes nearer at that speed, and may touch a robot at rest."""
    line = Capsule((0.0, -3.0), (0.0, 3.0), 1e-3)
    growth = BoundedError(0.0, speed)
    return Obstacle(line, Stationary((place, 0.0)), "line", uncertainty=growth, contact_at_rest=False)


@pytest.mark.parametrize("seed", draws(range(12), first=4))
def test_a_chosen_manoeuvre_rests_before_contact(seed):
    """Sampled: until it rests, it is clear of a growing line; and no faster stop is asked for than that."""
    rng = np.random.default_rng(seed)
    robot = Navigator(method("nao").stopping(), Disc(0.3), Limits(1.5, 2.0))
    line, speed = approaching(rng.uniform(0.0, 1.5), rng.uniform(1.2, 4.0)), 0.0
    speed = line.uncertainty.velocity
    state = State((0.0, 0.0), (rng.uniform(0.0, 0.8), rng.uniform(-0.3, 0.3)))
    decision = robot.decide(state, [line], Goal(Stationary((8.0, 0.0))))
    x = float(line.trajectory.initial_position[0])
    times = np.linspace(0.0, robot.horizon, 6001)
    places = decision.manoeuvre.position(times)
    moves = np.linalg.norm(decision.manoeuvre.velocity(times), axis=1) > 1e-6
    gaps = x - places[:, 0] - 0.3 - 1e-3 - speed * times
    assert decision.outcome in (Outcome.CLEAR, Outcome.CONSTRAINED)
    assert gaps[moves].min() > 0.0
    assert np.linalg.norm(decision.manoeuvre.velocity(robot.horizon)) < 1e-9


def test_contact_at_rest_counts_only_where_it_is_said():
    """The same line blocks a robot at rest if contacts at rest count, and does not if they do not."""
    response = method("nao").stopping().responses(Limits(1.5, 2.0), 0.1, (0.5,))[-1]
    state = State((0.0, 0.0), (0.0, 0.0))
    for counts in (True, False):
        line = replace(approaching(1.0), contact_at_rest=counts)
        blocked = ControlObstacle(response, state, ObstacleWindow([line], 0.0, 6.0), Disc(0.3))
        assert blocked.contains((0.0, 0.0)) == counts
        assert blocked.contains((2.0, 0.0)) or not counts


def test_a_robot_at_rest_stays_when_something_comes():
    """It is touched at rest, stays so, and goes on when nothing is there any more."""
    robot, state = Navigator(method("nao").stopping(), Disc(0.3), Limits(1.5, 2.0)), State((0.0, 0.0), (0.0, 0.0))
    goal, decision = Goal(Stationary((8.0, 0.0))), None
    for k in range(12):
        decision = robot.decide(state, [approaching(1.0, 0.4 - 0.05 * k)], goal, now=0.1 * k, previous=decision)
        assert not np.any(decision.manoeuvre.mean_acceleration(0.1 * k, 0.1))
    assert decision is not None
    assert robot.decide(state, [], goal, now=1.2, previous=decision).manoeuvre.velocity(1.4)[0] > 0.3


def test_the_compiled_choice_is_that_of_control_obstacles():
    """With an obstacle that may touch a robot at rest: the chosen control is not blocked, by both."""
    robot = Navigator(method("nao").stopping(), Disc(0.3), Limits(1.5, 2.0))
    for place in np.linspace(1.0, 4.0, 7):
        line, state = approaching(1.2, float(place)), State((0.0, 0.0), (0.4, 0.0))
        decision = robot.decide(state, [line], Goal(Stationary((8.0, 0.0))))
        blocked = ControlObstacle(decision.manoeuvre.response, state, ObstacleWindow([line], 0.0, 6.0), Disc(0.3))
        assert decision.safe == (not blocked.contains(decision.manoeuvre.control))


@pytest.mark.parametrize(("hidden", "braking", "reach"), [(1.4, 1.0, 2.0), (0.8, 2.0, 3.0), (0.0, 1.0, 1.0)])
def test_a_robot_at_the_edge_of_its_sight_is_no_faster_than_it_can_rest_in_time(hidden, braking, reach):
    """With the period e, the braking b, the hidden speed V and the distance d: v e + v^2 / 2 b + V (e + v / b) <= d."""
    robot, period = Navigator(method("nao").stopping(), Disc(0.3), Limits(3.0, braking)), 0.1
    sight, state, seen, decision = Sight(reach, hidden_speed=hidden), State((0.0, 0.0), (0.0, 0.0)), None, None
    fastest, sure = 0.0, hidden + braking * period
    for k in range(40):
        seen = sight.look(state, [], period * k, seen)
        goal = Goal(Stationary((40.0, 0.0)))
        decision = robot.decide(state, seen.obstacles, goal, now=period * k, previous=decision)
        state = decision.manoeuvre.advance(period * (k + 1) - decision.manoeuvre.start)
        fastest = max(fastest, math.hypot(*state.velocity))
    allowed = -sure + math.sqrt(sure**2 + 2.0 * braking * (reach - 0.3 - hidden * period))
    assert 0.4 * allowed < fastest <= allowed


CORNER = [
    Obstacle(Polygon([(x, y), (x + 12.8, y), (x + 12.8, y + h), (x, y + h)]), Stationary((0.0, 0.0)))
    for x, y, h in ((-14.0, 1.2, 12.8), (1.2, 1.2, 12.8), (-14.0, -3.0, 1.8), (1.2, -3.0, 1.8), (-2.0, -3.0, 1.8))
]


@pytest.mark.parametrize("broken", [False, True])
def test_entries_are_counted_once_and_state_how_probable_the_next_one_is(broken):
    """Of agents that cross the way at random times; also where the name of a track changes in sight."""
    rng, sight, seen, length = np.random.default_rng(3), Sight(6.0, hidden_speed=1.5, entry_time=2.0), None, 0.0
    starts = np.cumsum(rng.uniform(1.0, 4.0, 12))
    state, watched = State((-3.0, 0.0), (0.0, 0.0)), 0.0
    for now in np.arange(0.0, 40.0, 0.2):
        watched += 0.2 * length
        people = [
            Obstacle(
                Disc(0.3), ConstantVelocity((0.0, 6.0), (0.0, -1.0), start), f"{k} {broken and int(now - start) // 2}"
            )
            for k, start in enumerate(starts.tolist())
            if 0.0 <= now - start < 12.0
        ]
        seen = sight.look(state, [*CORNER[:4], *people], float(now), seen)
        length = seen.frontier.length
    assert seen.entries == len(starts)
    assert seen.watched == pytest.approx(watched)
    for one in seen.hidden:
        edge = shapely.LineString(one.shape.points).length
        assert one.probability == pytest.approx(1.0 - math.exp(-2.0 * 13.0 / watched * edge))


def test_a_robot_that_accepts_a_risk_passes_a_quiet_corner_sooner_than_a_busy_one():
    def passed(entry_time: float | None, every: float) -> float:
        sight, robot = Sight(8.0, hidden_speed=1.5, entry_time=entry_time), method("nao").stopping()
        navigator = Navigator(robot, Disc(0.3), Limits(1.5, 1.0), risk=Risk(0.5, 0.3))
        state, seen, decision, k = State((-9.0, 0.0), (0.0, 0.0)), None, None, 0
        people = [
            Obstacle(Disc(0.3), ConstantVelocity((0.6, 3.0 + every * n), (0.0, -1.2)), f"person {n}")
            for n in range(1, 12 if every < np.inf else 1)
        ]
        while state.position[0] < 0.0 and k < 200:
            seen = sight.look(state, [*CORNER, *people], 0.1 * k, seen)
            goal = Goal(Stationary((9.0, 0.0)))
            decision = navigator.decide(state, seen.obstacles, goal, now=0.1 * k, previous=decision)
            k += 1
            state = decision.manoeuvre.advance(0.1 * k - decision.manoeuvre.start)
        return 0.1 * k

    quiet, certain, busy = passed(2.0, np.inf), passed(None, np.inf), passed(2.0, 2.4)
    assert quiet + 1.0 < certain
    assert quiet + 1.0 < busy


def contact_speeds(run: Recording, scenario: Scenario) -> list[float]:
    """Speed [m/s] of the robot at its first contact with each obstacle that it touches, sampled ten times a step."""
    found, times = [], run.times
    fine = np.linspace(times[0], times[-1], 10 * (len(times) - 1) + 1)
    k = np.clip(np.searchsorted(times, fine, side="right") - 1, 0, len(times) - 2)
    after, d = (fine - times[k])[:, None], np.diff(run.velocities[:, 0], axis=0) / np.diff(times)[:, None]
    velocity = run.velocities[k, 0] + after * d[k]
    position = run.positions[k, 0] + after * (run.velocities[k, 0] + 0.5 * after * d[k])
    for obstacle in run.obstacles:
        first, last = obstacle.trajectory.span
        there = (fine >= first) & (fine <= last)
        gaps = np.full(len(fine), np.inf)
        gaps[there] = clearances(obstacle, scenario.robot.shape, fine[there], position[there]) if there.any() else 0.0
        if gaps.min() < 0.0:
            found.append(float(np.linalg.norm(velocity[int(np.argmax(gaps < 0.0))])))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("seed", draws(range(20), first=2))
def test_no_robot_with_passive_safety_moves_into_contact(seed):
    """In a corridor with a blind corner the robot is at rest at every contact, and arrives."""
    scenario = gallery.build("blind_corner", {"passive_safety": 2.0}, seed=seed)
    run = simulate(scenario, "nao@observed", seed=seed)
    assert all(speed < 1e-6 for speed in contact_speeds(run, scenario))
    assert np.linalg.norm(run.positions[-1, 0] - (9.0, 0.0)) < 0.4


@pytest.mark.slow
def test_without_passive_safety_robots_move_into_contact():
    """The test before can fail: some of these seeds collide in motion without it."""
    moving = 0
    for seed in range(6):
        scenario = gallery.build("blind_corner", seed=seed)
        moving += any(speed > 0.1 for speed in contact_speeds(simulate(scenario, "nao@observed"), scenario))
    assert moving >= 1


def test_sight_that_reaches_everything_changes_nothing():
    """The run is the same, to the bit for several robots, and up to rounding of tables for one."""
    for name, settings in (("corridor", {}), ("circle", {"robots": 4.0, "radius": 5.0, "robot_radius": 0.5})):
        plain = gallery.build(name, {**settings, "duration": 1.5}, seed=1)
        runs = [simulate(replace(plain, sight=sight), "nao") for sight in (None, Sight(1e4, occlusion="none"))]
        assert np.allclose(runs[0].positions, runs[1].positions, rtol=0.0, atol=1e-6)
    assert runs[0].digest() == runs[1].digest()
    short = simulate(replace(plain, sight=Sight(1.5, occlusion="none")), "nao")
    assert short.digest() != runs[0].digest()


def test_scenario_files_hold_sight(tmp_path):
    """Written and read back, the settings are the same, and give the same sight."""
    scenario = gallery.build("blind_corner", {"passive_safety": 2.0, "field_of_view": 2.5, "sight_near": 0.7})
    path = tmp_path / "corner.yaml"
    path.write_text(scenario_text(scenario))
    found = read_scenario(path)
    assert found.sight == scenario.sight == Sight(8.0, 2.5, 0.7, "walls", 1.5, True)
    assert found.settings == scenario.settings


@pytest.mark.parametrize("reach", [3.0, math.inf])
@pytest.mark.parametrize("turn", [2.0, FULL_TURN])
@pytest.mark.parametrize("occlusion", OCCLUSIONS)
@pytest.mark.parametrize(
    "passive", [{}, {"hidden_speed": 1.2, "entry_time": 2.0}, {"hidden_speed": 0.0, "any_motion": True}]
)
def test_settings_stand_for_a_sight(reach, turn, occlusion, passive):
    """Numbers give the sight of which they are; without a limit there is none."""
    if reach == math.inf and passive:
        return
    sight = Sight(reach, turn, 0.3, occlusion, **passive)
    limits = reach < math.inf or turn < FULL_TURN or occlusion != "none"
    assert sight_of(numbers_of(sight)) == (sight if limits else None)
    scenario = replace(gallery.build("head_on"), sight=sight)
    assert scenario.with_settings({"margin": 0.1}).sight == sight
    assert scenario.with_settings({"sight_near": 0.5, "sight_range": 4.0}).sight == replace(sight, range=4.0, near=0.5)
    assert scenario.with_settings({"passive_safety": 0.0, "sight_range": 4.0}).sight.hidden_speed is None


def test_a_robot_that_looks_ahead_sees_no_farther():
    """A car beyond the range does not change what it does; the same car without limits does."""
    scenario = replace(gallery.build("head_on"), duration=0.5)
    empty = simulate(replace(scenario, obstacles=()), "nao_ahead")
    limited = simulate(replace(scenario, sight=Sight(5.0, occlusion="none")), "nao_ahead")
    assert np.array_equal(limited.positions, empty.positions)
    assert not np.array_equal(simulate(scenario, "nao_ahead").positions, empty.positions)
