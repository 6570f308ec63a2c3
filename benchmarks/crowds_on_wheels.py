"""A differential drive among people and walls: slalom, ORCA and a dynamic window in one loop, under the same faults.

usage: python benchmarks/crowds_on_wheels.py [--scenes hall door] [--rows slalom orca] [--seeds 20] [--first 0]

The scenes are a hall, a corridor, a door of 0.9 m, a corner and a chase. The body is a disc of 0.3 m, like the people.
Wheels follow their commands with a lag of 0.15 s, by at most 3 m/s^2, with 1 % of slip. People are seen at 12 Hz up to
9 m away, unless a wall is in between. Positions are noisy and 0.05 s to 0.2 s late; some are missed, identities swap,
and false ones appear. The path keeps only 0.22 m from walls, and is planned anew once a second. All rows get the same
tracks, of a `slalom.Tracker` with its defaults. `slalom` is the loop of docs/robots.md. `orca` is pyrvo, whose velocity
becomes a speed and a turn. `window` samples speeds and turns (Fox, Burgard and Thrun 1997), predicts with the lag, and
keeps clear of the forecasts. Its settings were the best ones on the seeds from 1000 on.

A contact counts once until the two are 5 cm apart. The robot moved into a person if its speed towards it was above
0.05 m/s and not below that of the person; both moved if it was above 0.05 m/s and below. Reversals are those of the
change of the commanded turn rate, both changes above 0.05 rad/s. Times of decisions are processor times with the
tracker, from the third decision on.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from time import process_time
from typing import Any, NamedTuple

import numpy as np
import shapely
from program import finish, options, table, target
from scipy.sparse.csgraph import dijkstra

import slalom
from slalom.vehicle import DifferentialDrive, Pose, VehicleNavigator

Array = np.ndarray
STEP, PERIOD, REPLANS = 0.025, 0.1, 1.0  # [s]
RADIUS, KEEPS = 0.3, 0.22  # [m] of the robot and of people; clearance of the path
TRACK, WHEEL_SPEED, WHEEL_ACCELERATION, SPEED = 0.4, 1.2, 3.0, 1.0
LAG, SLIP, MARGIN = 0.15, 0.01, 0.05
MOVES = 0.05  # [m/s]
SCENES = ("hall", "corridor", "door", "corner", "chase")
DRIVE = DifferentialDrive(TRACK, WHEEL_SPEED, WHEEL_ACCELERATION, max_speed=SPEED, period=PERIOD, lag=LAG, delay=STEP)


def heading_of(v: Array) -> float:
    """Direction [rad] of a vector (2,)."""
    return float(np.arctan2(v[1], v[0]))


def along(heading: float) -> Array:
    """Unit vector (2,) of a direction [rad]."""
    return np.array([np.cos(heading), np.sin(heading)])


def between(angle: float) -> float:
    """The same angle [rad] from -pi to pi."""
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)


@dataclass
class Person:
    """A person that walks straight, stops, turns, walks along a way, chases the robot, or follows it."""

    place: Array
    speed: float
    heading: float
    kind: str
    rng: np.random.Generator
    way: list[Array] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.place, self.velocity = np.array(self.place, float), self.speed * along(self.heading)
        self.until, self.stands, self.wanted, self.steps = self.rng.uniform(1.0, 5.0), False, self.heading, 0

    def step(self, now: float, robot: Array, walls: Any) -> None:
        """Walk for a step. People accelerate by 3 m/s^2 and turn about in front of walls."""
        speed, rate, away = self.speed, 2.5, robot - self.place
        if self.kind == "stop" and now > self.until:
            self.stands = not self.stands
            self.until = now + (self.rng.uniform(1.0, 3.0) if self.stands else self.rng.uniform(2.0, 5.0))
        elif self.kind == "turn" and now > self.until:
            self.wanted = self.heading + self.rng.choice([-1.0, 1.0]) * self.rng.uniform(0.5, 1.6)
            self.until = now + self.rng.uniform(2.0, 5.0)
        elif self.kind == "chase":
            self.wanted, rate = heading_of(away), 2.0
        elif self.kind == "follow":
            self.wanted, rate = heading_of(away), np.inf
            speed = float(np.clip(1.5 * (np.hypot(*away) - 1.6), 0.0, self.speed))
        elif self.kind == "way":
            while self.way and np.hypot(*(self.way[0] - self.place)) < 0.3:
                self.way = self.way[1:]
            speed, rate = (self.speed, 3.0) if self.way else (0.0, 3.0)
            self.wanted = heading_of(self.way[0] - self.place) if self.way else self.heading
        self.heading += float(np.clip(between(self.wanted - self.heading), -rate * STEP, rate * STEP))
        change = (0.0 if self.stands else speed) * along(self.heading) - self.velocity
        self.velocity = self.velocity + change * min(1.0, 3.0 * STEP / max(float(np.hypot(*change)), 1e-9))
        self.steps += 1
        ahead = shapely.Point(self.place + 0.1 * self.velocity)
        if self.kind != "way" and self.steps % 4 == 0 and walls.distance(ahead) < RADIUS + 0.02:
            self.heading += np.pi * (0.9 + 0.2 * self.rng.random())
            self.wanted, self.velocity = self.heading, -self.velocity
        self.place = self.place + STEP * self.velocity


class Scene(NamedTuple):
    """Walls as polylines, people, the start as a pose, the goal, and the duration [s]."""

    walls: list[Any]
    people: list[Person]
    place: Array
    heading: float
    goal: Array
    duration: float


def scene(name: str, rng: np.random.Generator) -> Scene:
    """One of the scenes."""
    room, draw, people = [(0, 0), (14, 0), (14, 10), (0, 10), (0, 0)], rng.uniform, []

    def add(place: Any, speed: float, heading: float, kind: str = "straight", way: Any = ()) -> None:
        people.append(Person(np.array(place), speed, heading, kind, rng, [np.array(one) for one in way]))

    if name == "hall":
        for kind in ("straight", "straight", "stop", "turn", "turn"):
            place = np.array([1.0, 5.0])
            while np.hypot(*(place - (1.0, 5.0))) < 2.5:
                place = draw((2.5, 0.6), (13.4, 9.4))
            add(place, draw(0.5, 1.4), draw(0.0, 2.0 * np.pi), kind)
        y = draw(3.0, 6.0)
        for beside in (-0.75, 0.0, 0.75):  # a group abreast comes towards the robot
            add((12.5, y + beside), 1.0, np.pi)
        return Scene([room], people, np.array([1.0, 5.0]), 0.0, np.array([13.0, 5.0]), 24.0)
    if name == "corridor":
        for k in range(4):
            heading = np.pi if rng.random() < 2.0 / 3.0 else 0.0
            place = (4.5 + 2.6 * k + draw(-0.5, 0.5), draw(-0.8, 0.8))
            add(place, draw(0.6, 1.4), heading, "stop" if rng.random() < 1.0 / 3.0 else "straight")
        walls = [[(-2, y), (13, y)] for y in (-1.2, 1.2)]
        return Scene(walls, people, np.zeros(2), 0.0, np.array([11.0, 0.0]), 26.0)
    if name == "door":
        if rng.random() < 0.6:
            add((9.0, draw(2.0, 4.0)), draw(0.6, 1.2), np.pi, "way", [(5.6, 3.0), (4.2, 3.0), (1.0, draw(1.0, 5.0))])
        add((7.5, 1.2), draw(0.4, 1.0), draw(-0.4, 0.4), "turn")
        walls = [[(0, 0), (10, 0), (10, 6), (0, 6), (0, 0)], [(5, 0), (5, 2.55)], [(5, 3.45), (5, 6)]]
        start, goal = np.array([1.2, draw(1.0, 5.0)]), np.array([8.8, draw(1.2, 4.8)])
        return Scene(walls, people, start, draw(-3.0, 3.0), goal, 25.0)
    if name == "corner":
        for k in range(rng.integers(1, 3)):
            way = [(7.75, 2.0), (6.5, draw(0.6, 1.5)), (-2.0, draw(0.6, 1.4))]
            add((draw(7.5, 8.5), 6.0 + 2.0 * k + draw(-2.0, 1.0)), draw(0.8, 1.4), -0.5 * np.pi, "way", way)
        walls = [[(0, 0), (9, 0), (9, 9)], [(0, 2), (7, 2), (7, 9)]]
        return Scene(walls, people, np.array([0.8, 1.0]), 0.0, np.array([8.0, 8.3]), 35.0)
    add((draw(9.0, 12.0), draw(3.0, 7.0)), draw(0.6, 1.1), np.pi, "chase")
    add((0.35, draw(3.0, 7.0)), 1.0, 0.0, "follow")
    return Scene([room], people, np.array([2.5, 5.0]), 0.0, np.array([13.0, 5.0]), 30.0)


class Planner:
    """Shortest paths that keep KEEPS from walls, on the visibility graph of the walls grown by as much."""

    def __init__(self, walls: Any) -> None:
        self.walls = walls
        self.corners = shapely.get_coordinates(walls.buffer(KEEPS + 0.01, quad_segs=2))
        n = len(self.corners)
        self.graph = self.lengths(np.repeat(self.corners, n, 0), np.tile(self.corners, (n, 1))).reshape(n, n)

    def lengths(self, a: Array, b: Array) -> Array:
        """Distances [m] of points (n, 2) that see each other, else inf."""
        far = shapely.distance(shapely.linestrings(np.stack([a, b], 1)), self.walls) >= KEEPS * np.cos(np.pi / 8.0)
        return np.where(far, np.linalg.norm(a - b, axis=1), np.inf)

    def path(self, start: Array, goal: Array) -> Array | None:
        """The path (n, 2) [m]; None: there is none."""
        points = np.vstack([self.corners, start, goal])
        n = len(self.corners)
        graph = np.full((n + 2, n + 2), np.inf)
        graph[:n, :n] = self.graph
        for k in (n, n + 1):
            graph[k] = graph[:, k] = self.lengths(points, np.broadcast_to(points[k], points.shape))
        graph[~np.isfinite(graph)] = 0.0  # no edge
        before = dijkstra(graph, indices=n, return_predecessors=True)[1]
        found = [n + 1]
        while found[-1] != n:
            if before[found[-1]] < 0:
                return None
            found.append(int(before[found[-1]]))
        path = points[found[::-1]]
        return path[np.r_[True, np.linalg.norm(np.diff(path, axis=0), axis=1) > 1e-6]]


class Perception:
    """Measurements (time, id, position) of people, late and with faults."""

    def __init__(self, rng: np.random.Generator, walls: Any, noise: float) -> None:
        self.rng, self.walls, self.noise = rng, walls, noise
        self.next, self.count, self.coming = 0.0, 0, []  # type: float, int, list[Any]
        self.hidden: dict[int, float] = {}
        self.ids: dict[int, int] = {}
        self.ghosts: list[tuple[int, Array, float]] = []

    def step(self, now: float, people: list[Person], robot: Array) -> None:
        """Measure, at 12 Hz."""
        if now + 1e-9 < self.next:
            return
        self.next, rng, seen = self.next + 1.0 / 12.0, self.rng, []
        for k, one in enumerate(people):
            sight = shapely.LineString([robot, one.place])
            if self.hidden.get(k, 0.0) > now or sight.length > 9.0 or sight.intersects(self.walls):
                continue
            if rng.random() < 0.01:
                self.hidden[k] = now + rng.uniform(0.3, 1.2)
            if rng.random() >= 0.1:
                self.count += k not in self.ids
                self.ids.setdefault(k, self.count)
                seen.append((k, one.place + rng.normal(0.0, self.noise, 2)))
        for i, (a, p) in enumerate(seen):
            for b, q in seen[:i]:
                if np.hypot(*(p - q)) < 1.0 and rng.random() < 0.02:
                    self.ids[a], self.ids[b] = self.ids[b], self.ids[a]
        if rng.random() < 0.1 / 12.0:
            self.count += 1
            self.ghosts.append((self.count, robot + rng.uniform(-4.0, 4.0, 2), now + 0.3))
        self.ghosts = [one for one in self.ghosts if one[2] > now]
        found = [(now, self.ids[k], p) for k, p in seen]
        found += [(now, id, p + rng.normal(0.0, self.noise, 2)) for id, p, _ in self.ghosts]
        self.coming.append((now + rng.uniform(0.05, 0.2), found))

    def arrived(self, now: float) -> list[tuple[float, int, Array]]:
        """What has arrived by now."""
        here = [one for due, found in self.coming if due <= now + 1e-9 for one in found]
        self.coming = [one for one in self.coming if one[0] > now + 1e-9]
        return here


class Drive:
    """Two wheels that follow their commands with a lag, a bound and slip, one step late."""

    def __init__(self, place: Array, heading: float) -> None:
        self.place, self.heading, self.wheels = place, heading, np.zeros(2)
        self.wanted = self.coming = np.zeros(2)

    def command(self, speed: float, turn: float) -> None:
        self.coming = np.clip(speed + 0.5 * TRACK * turn * np.array([-1.0, 1.0]), -WHEEL_SPEED, WHEEL_SPEED)

    def step(self) -> None:
        rate = np.clip((self.wanted - self.wheels) / LAG, -WHEEL_ACCELERATION, WHEEL_ACCELERATION)
        self.wheels, self.wanted = self.wheels + STEP * rate, self.coming
        speed, turn = (1.0 - SLIP) * self.wheels.mean(), (1.0 - 2.0 * SLIP) * self.turn
        self.place = self.place + STEP * speed * along(self.heading + 0.5 * STEP * turn)
        self.heading += STEP * turn

    @property
    def turn(self) -> float:
        return float(self.wheels[1] - self.wheels[0]) / TRACK

    @property
    def velocity(self) -> Array:
        return self.wheels.mean() * along(self.heading)


class Slalom:
    """The loop of docs/robots.md."""

    def __init__(self, lines: list[Any]) -> None:
        made = [slalom.Obstacle(slalom.Polyline(line), slalom.Stationary((0, 0))) for line in lines]
        self.walls, self.decision = slalom.ObstacleTable(made), None
        self.robot = VehicleNavigator(DRIVE, slalom.method("nao"), slalom.Disc(RADIUS), horizon=3.0, margin=MARGIN)

    def decide(self, now: float, pose: Pose, tracks: list[Any], path: Array) -> tuple[float, float]:
        goal = slalom.PathGoal(path, tolerance=0.2)
        self.decision = self.robot.decide(pose, [self.walls, *tracks], goal, now=now, previous=self.decision)
        return self.decision.command


def observed(tracks: list[Any], now: float) -> tuple[Array, Array, list[Any]]:
    """Positions and velocities (n, 2) and uncertainties of tracks."""
    if not tracks:
        return np.zeros((0, 2)), np.zeros((0, 2)), []
    (one,) = tracks
    return one.positions + (now - one.t) * one.velocities, one.velocities, list(one.uncertainties)


def ahead_on(path: Array, place: Array, ahead: float) -> tuple[Array, float]:
    """The point (2,) of a path so far [m] ahead of the place, and what is left of the path there [m]."""
    line = shapely.LineString(path)
    at = min(line.project(shapely.Point(place)) + ahead, line.length)
    return shapely.get_coordinates(line.interpolate(at))[0], line.length - at


class Orca:
    """ORCA among people that do not yield; its velocity becomes a speed and a turn towards it."""

    def __init__(self, lines: list[Any]) -> None:
        self.lines = [pair for line in lines for pair in pairwise(line)]

    def decide(self, now: float, pose: Pose, tracks: list[Any], path: Array) -> tuple[float, float]:
        from pyrvo import RVOSimulator

        places, velocities, _ = observed(tracks, now)
        target, left = ahead_on(path, pose.position, 1.0)
        way = target - pose.position
        simulator = RVOSimulator(PERIOD, 8.0, 15, 3.0, 1.5, RADIUS, SPEED)
        simulator.add_agent((0.0, 0.0), 8.0, 15, 3.0, 1.5, RADIUS + 0.1, SPEED)
        for _ in places:
            simulator.add_agent((0.0, 0.0), 0.0, 0, 3.0, 1.5, RADIUS, 0.0)
        for a, b in self.lines:
            simulator.add_obstacle([tuple(map(float, a)), tuple(map(float, b))])
        simulator.process_obstacles()
        for k, (p, v) in enumerate([(pose.position, pose.velocity), *zip(places, velocities)]):
            simulator.set_agent_position(k, tuple(map(float, p)))
            simulator.set_agent_velocity(k, tuple(map(float, v)))
        reach = float(np.hypot(*way))
        wanted = way / max(reach, 1e-9) * min(SPEED, max(0.15, left + reach))
        simulator.set_agent_pref_velocity(0, tuple(map(float, wanted)))
        simulator.do_step()
        velocity = np.array(simulator.get_agent_velocity(0).to_tuple())
        speed, off = float(np.hypot(*velocity)), between(heading_of(velocity) - pose.heading)
        return (0.0, 0.0) if speed < 0.02 else (speed * max(np.cos(off), 0.0), float(np.clip(3.0 * off, -2.0, 2.0)))


class Settings(NamedTuple):
    """Settings of the dynamic window: weights, shares, times [s] and lengths [m]."""

    horizon: float = 2.0
    reserve: float = 0.1  # time beyond that to stop for which a motion is clear
    ahead: float = 1.2  # target on the path
    grown: float = 1.0  # share of the uncertainty of tracks that counts
    clear: float = 0.1  # weight of 1 / clearance
    fast: float = 0.6  # weight of the speed
    change: float = 0.05  # weight of the change of the turn rate


BEST = Settings()


class Window:
    """A dynamic window: of speeds and turns that are held, the cheapest one that is clear long enough to stop."""

    def __init__(self, lines: list[Any], settings: Settings = BEST) -> None:
        pairs = np.array([pair for line in lines for pair in pairwise(line)], float)
        self.a, self.b, self.settings, self.last = pairs[:, 0], pairs[:, 1], settings, (0.0, 0.0)
        speeds, turns = np.linspace(-0.3, SPEED, 14), np.linspace(-2.4, 2.4, 25)
        self.held = np.array([(v, w) for v in speeds for w in turns if abs(v) + 0.5 * TRACK * abs(w) <= WHEEL_SPEED])

    def decide(self, now: float, pose: Pose, tracks: list[Any], path: Array) -> tuple[float, float]:
        s, held = self.settings, self.held
        places, velocities, errors = observed(tracks, now)
        target, _ = ahead_on(path, pose.position, s.ahead)
        sides, count = np.array([-0.5, 0.5]) * TRACK, round(s.horizon / PERIOD)
        wanted = held[:, :1] + held[:, 1:] * sides
        wheels = np.broadcast_to(pose.speed + pose.turn * sides, wanted.shape)
        place, heading, way = np.broadcast_to(pose.position, held.shape), np.full(len(held), pose.heading), []
        for _ in range(count):
            rate = np.clip((wanted - wheels) * (1.0 - np.exp(-PERIOD / LAG)), -0.1 * WHEEL_ACCELERATION, 0.3)
            middle, wheels = wheels + 0.5 * rate, wheels + rate
            turn = (middle[:, 1] - middle[:, 0]) / TRACK
            direction = heading + 0.5 * PERIOD * turn
            step = PERIOD * middle.mean(axis=1)[:, None] * np.stack([np.cos(direction), np.sin(direction)], 1)
            place, heading = place + step, heading + PERIOD * turn
            way.append(place)
        points, times = np.stack(way, 1), PERIOD * np.arange(1, count + 1)  # (held, times, 2)
        gap = np.full(points.shape[:2], np.inf)
        for p, v, error in zip(places, velocities, errors):
            radius = s.grown * (0.0 if error is None else error.radius(np.minimum(times, 0.5), 2))
            gap = np.minimum(gap, np.linalg.norm(points - p - times[:, None] * v, axis=2) - 2.0 * RADIUS - radius)
        for a, b in zip(self.a, self.b):
            share = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
            gap = np.minimum(gap, np.linalg.norm(points - a - share[..., None] * (b - a), axis=2) - RADIUS)
        hit = gap < MARGIN
        first = np.where(hit.any(axis=1), PERIOD * hit.argmax(axis=1), np.inf)
        stops = first > np.abs(held[:, 0]) / WHEEL_ACCELERATION + LAG + s.reserve
        if not stops.any():
            self.last = (0.0, 0.0)
            return self.last
        least = np.clip(gap.min(axis=1), 0.03, 1.0)
        cost = np.linalg.norm(points[:, min(count, 14) - 1] - target, axis=1) + s.clear / least
        cost += s.change * np.abs(held[:, 1] - self.last[1]) - s.fast * held[:, 0]
        self.last = tuple(held[np.argmin(np.where(stops, cost, np.inf))].tolist())
        return self.last


ROWS: dict[str, Callable[[list[Any]], Any]] = {"slalom": Slalom, "orca": Orca, "window": Window}


class Run(NamedTuple):
    """What happened in one run."""

    ratio: float  # [1] time over that along the first path at SPEED; nan: it did not arrive
    contacts: list[str]
    walls: int
    reversals: float  # [1/s]
    times: list[float]  # [s] of decisions


def contact_of(mine: float, others: float, moves: bool) -> str:
    """The kind of a contact by the speeds [m/s] of both towards the other."""
    if not moves or mine <= MOVES:
        return "person"
    return "robot" if mine >= others else "both"


def run(name: str, maker: Callable[[list[Any]], Any], seed: int, most: float = np.inf) -> Run:
    """One run of at most `most` [s]."""
    rng, noisy = np.random.default_rng(seed), np.random.default_rng(seed + 77)
    world = scene(name, rng)
    walls, people, drive = shapely.MultiLineString(world.walls), world.people, Drive(world.place, world.heading)
    perception = Perception(np.random.default_rng(seed + 999), walls, rng.uniform(0.03, 0.08))
    planner, tracker, controller = Planner(walls), slalom.Tracker(slalom.Disc(RADIUS)), maker(world.walls)
    path = planner.path(drive.place, world.goal)
    assert path is not None
    straight, ratio = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum()) / SPEED, np.nan
    contacts, touching, at_wall, hits = [], set(), False, 0  # type: list[str], set[int], bool, int
    turns, times = [], []  # type: list[float], list[float]
    for k in range(round(min(world.duration, most) / STEP)):
        now = k * STEP
        perception.step(now, people, drive.place)
        if k % round(PERIOD / STEP) == 0:
            if k and k % round(REPLANS / STEP) == 0:
                anew = planner.path(drive.place, world.goal)
                path = path if anew is None or len(anew) < 2 else anew
            noise = noisy.normal(0.0, 1.0, 5) * (0.005, 0.005, 0.003, 0.01, 0.02)
            speed, turn = float(drive.wheels.mean() + noise[3]), drive.turn + float(noise[4])
            pose = Pose(drive.place + noise[:2], drive.heading + float(noise[2]), speed, turn)
            measured, begin = perception.arrived(now), process_time()
            for one in measured:
                tracker.update(*one)
            command = controller.decide(now, pose, tracker.at(now), path)
            times.append(process_time() - begin)
            drive.command(*command)
            turns.append(command[1])
        drive.step()
        for j, one in enumerate(people):
            one.step(now, drive.place, walls)
            way = one.place - drive.place
            gap, e = float(np.hypot(*way)) - 2.0 * RADIUS, way / max(float(np.hypot(*way)), 1e-9)
            if gap < 0.0 and j not in touching:
                touching.add(j)
                moves = bool(np.hypot(*drive.velocity) >= MOVES)
                contacts.append(contact_of(float(drive.velocity @ e), float(-one.velocity @ e), moves))
            elif gap > 0.05:
                touching.discard(j)
        gap = walls.distance(shapely.Point(drive.place)) - RADIUS
        hits += gap < 0.0 and not at_wall
        at_wall = gap < 0.0 or (at_wall and gap <= 0.03)
        if np.hypot(*(drive.place - world.goal)) < 0.25 and np.hypot(*drive.velocity) < 0.3:
            ratio = (now + STEP) / straight
            break
    change = np.diff(turns)
    back = (change[1:] * change[:-1] < 0.0) & (np.minimum(np.abs(change[1:]), np.abs(change[:-1])) > 0.05)
    return Run(ratio, contacts, hits, float(back.sum()) / (PERIOD * len(turns)), times[2:])


def row(label: str, runs: list[Run]) -> list[Any]:
    """A row of the table."""
    ratios, times = np.array([one.ratio for one in runs]), 1e3 * np.concatenate([one.times for one in runs])
    kinds = [sum(kind in one.contacts for one in runs) for kind in ("robot", "both", "person")]
    arrived = np.isfinite(ratios)
    mean = float(ratios[arrived].mean()) if arrived.any() else np.nan
    figures = [sum(one.walls > 0 for one in runs), float(np.mean([one.reversals for one in runs]))]
    return [label, int(arrived.sum()), mean, *kinds, *figures, float(np.median(times)), float(times.max())]


HEADS = ["scene, row", "arrived", "of straight", "robot moved in", "both", "person", "walls", "reversals /s"]
HEADS += ["median ms", "longest ms"]
SLOWER = {"hall": 1.4, "corridor": 1.7, "door": 1.7}
"""[1] Largest time over the straight one that is required."""


def main() -> None:
    """Measure and write."""
    parser = options(__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--scenes", nargs="+", default=list(SCENES), choices=SCENES)
    parser.add_argument("--rows", nargs="+", default=list(ROWS), choices=ROWS)
    given = parser.parse_args()
    seeds, most = (1, 1.0) if given.quick else (given.seeds, np.inf)
    slalom.compile()
    rows, targets = [], []
    for name in given.scenes:
        for label in given.rows:
            runs = [run(name, ROWS[label], given.first + k, most) for k in range(seeds)]
            rows.append(row(f"{name}, {label}", runs))
            print(*rows[-1], file=sys.stderr, flush=True)
            if label == "slalom":
                _, arrived, ratio, robot, both, _, walls, back, _, longest = rows[-1]
                targets.append(target(f"{name}: runs with contacts of a moving robot", robot + both + walls, most=0.0))
                targets.append(target(f"{name}: turn reversals", back, most=0.8, unit="1/s"))
                targets.append(target(f"{name}: longest decision", longest, most=20.0, unit="ms"))
                if name in SLOWER:
                    targets.append(target(f"{name}: share of arrivals", arrived / seeds, least=0.95))
                    targets.append(target(f"{name}: time over the straight one", ratio, most=SLOWER[name]))
    result = {
        "question": "Does a drive among people and walls arrive, and what does it touch?",
        "parameters": {"seeds": seeds, "first": given.first},
        "tables": [table(f"{seeds} seeds from {given.first} on", HEADS, rows)],
        "targets": targets,
    }
    finish("crowds_on_wheels", result, given, ["slalom", "pyrvo"])


if __name__ == "__main__":
    main()
