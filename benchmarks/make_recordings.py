"""Recordings of further kinds of motion, with crossing tasks that have a known solution.

usage: python benchmarks/make_recordings.py FOLDER [--only NAME ...] [--tasks 6] [--seed 100]

needs: pip install jupedsim==1.4.2 eclipse-sumo==1.28.0 numpy scipy. It needs no slalom.

Pedestrians are simulated by JuPedSim (models of anticipated velocities and of collision-free speed), cars and bicycles
by Eclipse SUMO. Flocks follow the published rules of Reynolds (SIGGRAPH 1987), Vicsek et al. (Physical Review Letters
75, 1995) and Couzin et al. (Journal of Theoretical Biology 218, 2002). Seeds, densities and speeds stand in RECORDINGS.

The program writes a CSV file (`t,id,x,y[,z][,radius]`) for each recording, and `tasks.json`: tasks of each for
`benchmarks/crossings.py`, drawn from a seed. Of four straight ways at constant speeds at least three collide in each
task. Each has a witness: a search in breadth over accelerations that are constant for a while, with full knowledge of
all motions.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import savgol_filter
from scipy.spatial import cKDTree

TRIES, RATE, SEED = 400, 10, 100
"""Draws for the tasks of a recording, samples a second of the recordings, seed of the tasks of the first one."""
BEAM, SUBSTEPS = 800, 5
"""States that the search for a witness keeps at each step, and instants of each step that it tests."""


@dataclass(frozen=True)
class Crossing:
    """The robot and its ways: from `length`/2 before `center` to as far behind, along one of `angles`."""

    center: tuple[float, ...]
    length: float
    robot: float  # [m] radius
    agent: float | str  # [m] radius, or the column
    vmax: float
    amax: float
    tolerance: float
    angles: tuple[float, ...]
    spread: float  # [m] by which the centre of a way varies
    turn: float = 0.2  # [rad] by which its direction varies


Frames = list[tuple[float, int, tuple[float, ...], float]]  # time [s], agent, position [m], radius [m]
HALF = float(np.pi / 2)

# People, by JuPedSim.


def boxed(x0: float, y0: float, x1: float, y1: float) -> list[tuple[float, float]]:
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


def streams(
    seed: int,
    area: list[tuple[float, float]],
    ways: list[tuple[tuple[float, float, float, float], tuple[float, float, float, float]]],
    count: int,
    seconds: float,
    first: list[tuple[float, float, float, float]],
) -> Frames:
    """People that walk from the boxes of `ways` to others, always about `count`; `first` boxes are filled at first."""
    import jupedsim as jps

    rng = np.random.default_rng(seed)
    sim = jps.Simulation(model=jps.AnticipationVelocityModel(rng_seed=seed), geometry=area, dt=0.02)
    exits = [sim.add_exit_stage(boxed(*end)) for _, end in ways]
    journeys = [sim.add_journey(jps.JourneyDescription([stage])) for stage in exits]

    def enter(box: tuple[float, float, float, float], way: int) -> None:
        place = (float(rng.uniform(box[0], box[2])), float(rng.uniform(box[1], box[3])))
        speed = float(np.clip(rng.normal(1.3, 0.2), 0.8, 1.8))
        who = jps.AnticipationVelocityModelAgentParameters(
            position=place, desired_speed=speed, radius=0.18, journey_id=journeys[way], stage_id=exits[way]
        )
        try:
            sim.add_agent(who)
        except RuntimeError:
            return  # The place is taken.

    for _ in range(20 * count):
        if sim.agent_count() < count:
            enter(first[int(rng.integers(len(first)))], int(rng.integers(len(ways))))
    found: Frames = []
    for k in range(int(seconds * RATE)):
        for _ in range(6):
            way = int(rng.integers(len(ways)))
            if sim.agent_count() < count:
                enter(ways[way][0], way)
        found += [(k / RATE, int(a.id), tuple(map(float, a.position)), 0.2) for a in sim.agents()]
        sim.iterate(5)
    return found


def corridor(seed: int, density: float) -> Frames:
    """A corridor of 40 m x 5 m with people in both directions."""
    ends = (0.3, 0.4, 3.0, 4.6), (37.0, 0.4, 39.7, 4.6)
    out = (38.5, 0.1, 39.9, 4.9), (0.1, 0.1, 1.5, 4.9)
    ways = [(ends[0], out[0]), (ends[1], out[1])]
    found = streams(seed, boxed(0, 0, 40, 5), ways, round(200 * density), 90.0, [(1.6, 0.4, 38.4, 4.6)])
    return [row for row in found if row[0] > 20.0 and 9.0 < row[2][0] < 31.0]


def two_streams(seed: int, density: float) -> Frames:
    """Streams that cross at right angles, in arms of 5 m."""
    area = [(0, 12), (12, 12), (12, 0), (17, 0), (17, 12), (29, 12), (29, 17), (17, 17), (17, 29), (12, 29), (12, 17)]
    area = [(float(x), float(y)) for x, y in [*area, (0, 17)]]
    ways = [
        ((0.3, 12.4, 3.0, 16.6), (27.5, 12.1, 28.9, 16.9)),
        ((12.4, 0.3, 16.6, 3.0), (12.1, 27.5, 16.9, 28.9)),
    ]
    found = streams(seed, area, ways, round(265 * density), 90.0, [(3.0, 12.5, 12.0, 16.5), (12.5, 3.0, 16.5, 12.0)])
    return [row for row in found if row[0] > 20.0]


def bottleneck(seed: int, count: int) -> Frames:
    """A room of 8 m that narrows to 1.6 m, with people that keep coming."""
    area = [(0, 0), (14, 0), (14, 3.2), (16, 3.2), (16, 0), (28, 0), (28, 8), (16, 8), (16, 4.8), (14, 4.8), (14, 8)]
    area = [(float(x), float(y)) for x, y in [*area, (0, 8)]]
    found = streams(seed, area, [((0.3, 0.4, 3.0, 7.6), (26.0, 0.2, 27.8, 7.8))], count, 90.0, [(1.0, 0.5, 12.0, 7.5)])
    return [row for row in found if row[0] > 15.0]


def square(seed: int, people: int, cars: int, speed: float) -> Frames:
    """A shared square of 36 m: people that walk across it, and cars that turn among them."""
    import jupedsim as jps

    rng, size = np.random.default_rng(seed), 36.0
    sim = jps.Simulation(model=jps.CollisionFreeSpeedModelV2(), geometry=boxed(0, 0, size, size), dt=0.02)
    sides = [boxed(0.1, 0.1, 1, size - 0.1), boxed(size - 1, 0.1, size - 0.1, size - 0.1)]
    sides += [boxed(1.1, 0.1, size - 1.1, 1), boxed(1.1, size - 1, size - 1.1, size - 0.1)]
    exits = [sim.add_exit_stage(side) for side in sides]
    journeys = [sim.add_journey(jps.JourneyDescription([stage])) for stage in exits]
    steering = sim.add_direct_steering_stage()
    driven = sim.add_journey(jps.JourneyDescription([steering]))
    routes: dict[int, tuple[np.ndarray, int]] = {}

    def enter(place: np.ndarray, journey: int, stage: int, radius: float, pace: float, push: float, gap: float) -> int:
        who = jps.CollisionFreeSpeedModelV2AgentParameters(
            position=(float(place[0]), float(place[1])), journey_id=journey, stage_id=stage, radius=radius,
            desired_speed=pace, strength_neighbor_repulsion=push, time_gap=gap,
        )  # fmt: skip
        try:
            return int(sim.add_agent(who))
        except RuntimeError:
            return -1  # The place is taken.

    found: Frames = []
    for k in range(int(90.0 * RATE)):
        walkers = sim.agent_count() - len(routes)
        for _ in range(3 if walkers < people else 0):
            side, where = int(rng.integers(4)), rng.uniform(3.0, size - 3.0)
            place = np.array([(1.5, where), (size - 1.5, where), (where, 1.5), (where, size - 1.5)][side])
            to = int(rng.choice([j for j in range(4) if j != side]))
            enter(place if k else rng.uniform(3.0, size - 3.0, 2), journeys[to], exits[to], 0.25,
                  float(rng.uniform(0.9, 1.6)), 8.0, 1.0)  # fmt: skip
        if len(routes) < cars and k % 20 == 0:
            way = driven_way(rng, size)
            car = enter(way[0], driven, steering, 1.5, speed * float(rng.uniform(0.8, 1.2)), 0.0, 0.6)
            if car >= 0:
                routes[car] = way, 0
        for car in list(routes):
            way, at = routes[car]
            agent = sim.agent(car)
            at += int(np.argmin(np.linalg.norm(way[at : at + 40] - np.array(agent.position), axis=1)))
            if at >= len(way) - 8:
                sim.mark_agent_for_removal(car)
                del routes[car]
                continue
            routes[car] = way, at
            agent.target = tuple(map(float, way[min(at + 6, len(way) - 1)]))
        for a in sim.agents():
            radius = 1.5 if int(a.id) in routes else 0.25
            if k >= 10 * RATE:
                found.append((k / RATE, int(a.id), tuple(map(float, a.position)), radius))
        sim.iterate(5)
    return found


def driven_way(rng: np.random.Generator, size: float) -> np.ndarray:
    """Points (n, 2) [m], 0.25 m apart, of a way that turns once or twice on arcs of 4 to 8 m."""
    heading, across = int(rng.integers(4)), rng.uniform(0.3, 0.7) * size
    place = np.array([(2.5, across), (across, 2.5), (size - 2.5, across), (across, size - 2.5)][heading])
    angle, points = HALF * heading, [place]
    legs = [rng.uniform(0.25, 0.45) * size, rng.uniform(0.2, 0.4) * size, size]
    for leg, sense in zip(legs, rng.choice([-1.0, 1.0], 3), strict=True):
        for _ in range(int(leg / 0.25)):
            points.append(points[-1] + 0.25 * np.array([np.cos(angle), np.sin(angle)]))
        radius = rng.uniform(4.0, 8.0)
        for _ in range(int(HALF * radius / 0.25)):
            angle += sense * 0.25 / radius
            points.append(points[-1] + 0.25 * np.array([np.cos(angle), np.sin(angle)]))
    way = np.array(points)
    inside = ((way > 2.0) & (way < size - 2.0)).all(axis=1)
    return way[: len(way) if inside.all() else int(np.argmin(inside))]


# Cars and bicycles, by Eclipse SUMO.


def tags(kind: str, rows: list[dict[str, Any]]) -> str:
    def one(row: dict[str, Any]) -> str:
        return f"<{kind} " + " ".join(f'{key}="{value}"' for key, value in row.items()) + "/>"

    return "\n".join(map(one, rows))


def driven(seed: int, nodes: list[dict[str, Any]], edges: list[dict[str, Any]], demand: str, options: list[str],
           seconds: tuple[float, float], reach: float, radii: dict[str, float]) -> Frames:  # fmt: skip
    """Vehicles on a network; centres, within `reach` [m] of the origin, smoothed by 1.7 s."""
    import sumo

    tools = Path(sumo.SUMO_HOME) / "bin"
    with tempfile.TemporaryDirectory() as name:
        at = Path(name)
        (at / "n.nod.xml").write_text(f"<nodes>{tags('node', nodes)}</nodes>")
        (at / "e.edg.xml").write_text(f"<edges>{tags('edge', edges)}</edges>")
        (at / "r.rou.xml").write_text(f"<routes>{demand}</routes>")
        made = [tools / "netconvert", "-n", at / "n.nod.xml", "-e", at / "e.edg.xml", "-o", at / "net.xml"]
        subprocess.run([*map(str, made), "--no-turnarounds", "true", "--offset.disable-normalization", "true"],
                       check=True, stdout=subprocess.DEVNULL)  # fmt: skip
        run = [tools / "sumo", "-n", at / "net.xml", "-r", at / "r.rou.xml", "--fcd-output", at / "fcd.xml"]
        run += ["--step-length", "0.1", "--seed", seed, "--end", seconds[1], "--no-warnings", "true", *options]
        subprocess.run([*map(str, run)], check=True, stdout=subprocess.DEVNULL)
        return list(centres(at / "fcd.xml", seconds[0], reach, radii))


def centres(file: Path, begin: float, reach: float, radii: dict[str, float]) -> Iterator[Any]:
    import xml.etree.ElementTree as ElementTree

    numbers: dict[str, int] = {}
    for _, step in ElementTree.iterparse(file):
        if step.tag != "timestep":
            continue
        now = float(step.attrib["time"])
        for v in step if now >= begin else []:
            row = v.attrib
            length = 1.6 if row["type"] == "bicycle" else 4.6
            angle = HALF - np.radians(float(row["angle"]))
            x = float(row["x"]) - 0.5 * length * np.cos(angle)
            y = float(row["y"]) - 0.5 * length * np.sin(angle)
            if np.hypot(x, y) < reach:
                yield now, numbers.setdefault(row["id"], len(numbers)), (float(x), float(y)), radii[row["type"]]
        step.clear()


CARS = '<vType id="car" accel="2.6" decel="4.5" sigma="0.5" speedDev="0.15" maxSpeed="14"/>\n'
BICYCLES = '<vType id="bicycle" vClass="bicycle" accel="1.2" decel="3" sigma="0.5" speedDev="0.2" maxSpeed="5.5"/>\n'


def arms(radius: float, length: float, lanes: int, speed: float) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Nodes 0 to 3 at the ends of four arms, and edges between them and the nodes a0 to a3."""
    nodes, edges = [], []
    for k in range(4):
        x, y = np.cos(k * HALF), np.sin(k * HALF)
        nodes.append({"id": k, "x": round(length * x, 2), "y": round(length * y, 2)})
        if radius:
            nodes.append({"id": f"a{k}", "x": round(radius * x, 2), "y": round(radius * y, 2)})
        inner = f"a{k}" if radius else "center"
        edges.append({"id": f"in{k}", "from": k, "to": inner, "numLanes": lanes, "speed": speed, "priority": 1})
        edges.append({"id": f"out{k}", "from": inner, "to": k, "numLanes": lanes, "speed": speed, "priority": 1})
    return nodes, edges


def flows(rates: dict[tuple[str, str, str], float]) -> str:
    """Flows (kind, from, to) of so many vehicles an hour."""
    return tags("flow", [
        {"id": f"f{k}", "type": kind, "from": begin, "to": end, "begin": 0, "end": 300, "departLane": "best",
         "departSpeed": "max", "vehsPerHour": rate}
        for k, ((kind, begin, end), rate) in enumerate(rates.items())
    ])  # fmt: skip


def signals(seed: int, controlled: str, rate: float) -> Frames:
    """A crossing of two streets with two lanes each way, 30 % of the cars turn left, 20 % right."""
    nodes, edges = arms(0.0, 150.0, 2, 13.9)
    nodes.append({"id": "center", "x": 0, "y": 0, "type": controlled})
    shares = {1: 0.2, 2: 0.5, 3: 0.3}
    rates = {
        ("car", f"in{k}", f"out{(k + turn) % 4}"): rate * share for k in range(4) for turn, share in shares.items()
    }
    return driven(seed, nodes, edges, CARS + flows(rates), [], (40.0, 130.0), 75.0, {"car": 2.4})


def bicycles(seed: int, rate: float) -> Frames:
    """A roundabout of 14 m radius with as many bicycles as cars."""
    nodes, edges = arms(14.0, 120.0, 1, 8.3)
    for k in range(4):
        angles = HALF * (k + np.linspace(0.0, 1.0, 9))
        shape = " ".join(f"{14 * np.cos(a):.2f},{14 * np.sin(a):.2f}" for a in angles)
        edges.append({"id": f"ring{k}", "from": f"a{k}", "to": f"a{(k + 1) % 4}", "shape": shape, "speed": 7.0,
                      "priority": 9})  # fmt: skip
    rates = {
        (kind, f"in{k}", f"out{(k + turn) % 4}"): rate / 3.0
        for k in range(4) for turn in (1, 2, 3) for kind in ("car", "bicycle")
    }  # fmt: skip
    demand = CARS + BICYCLES + flows(rates)
    return driven(seed, nodes, edges, demand, [], (40.0, 130.0), 60.0, {"car": 2.4, "bicycle": 0.9})


def motorway(seed: int, rate: float) -> Frames:
    """Three lanes in the sublane model, with cars that change lanes."""
    nodes = [{"id": "w", "x": -600, "y": 0}, {"id": "e", "x": 600, "y": 0}]
    edges = [{"id": "way", "from": "w", "to": "e", "numLanes": 3, "speed": 11.0}]
    kind = '<vType id="car" accel="2" decel="4.5" sigma="0.6" speedDev="0.3" lcSpeedGain="5" lcSublane="3" '
    kind += 'minGapLat="0.4"/>\n'
    demand = kind + flows({("car", "way", "way"): rate}).replace('"best"', '"random"')
    return driven(seed, nodes, edges, demand, ["--lateral-resolution", "0.4"], (110.0, 200.0), 70.0, {"car": 2.4})


# Flocks, by published rules.


def reynolds(seed: int, count: int, speed: float) -> Frames:
    """Separation, alignment and cohesion in the plane, and a pull towards places that move on."""
    rng = np.random.default_rng(seed)
    p, v = rng.uniform(-8.0, 8.0, (count, 2)), rng.normal(0.0, speed, (count, 2))
    found, dt = Frames(), 1.0 / RATE
    for k in range(int(100 * RATE)):
        away = p[:, None] - p[None]
        far = np.linalg.norm(away, axis=2) + 1e9 * np.eye(count)
        near, close = far < 3.0, far < 1.2
        size = np.maximum(near.sum(axis=1), 1)[:, None]
        steer = 1.5 * (away / far[..., None] ** 2 * close[..., None]).sum(axis=1)
        steer += 0.8 * near.any(axis=1)[:, None] * (near @ v / size - v) + 0.3 * near.any(axis=1)[:, None] * (
            near @ p / size - p
        )
        home = 7.0 * np.array([np.cos(0.12 * k * dt), np.sin(0.19 * k * dt)])
        steer += 0.12 * (home * np.where(np.arange(count) % 2, 1.0, -1.0)[:, None] - p)
        v = v + dt * steer * min(1.0, 3.0 / max(float(np.linalg.norm(steer, axis=1).max()), 1e-9))
        v *= (speed * np.clip(np.linalg.norm(v, axis=1) / speed, 0.6, 1.3) / np.linalg.norm(v, axis=1))[:, None]
        p = p + dt * v
        found += [(k * dt, j, tuple(map(float, p[j])), 0.2) for j in range(count)] if k >= 10 * RATE else []
    return found


def vicsek(seed: int, count: int, speed: float, noise: float) -> Frames:
    """Headings that follow the mean of those within 1.5 m, with noise, in a periodic box of 24 m."""
    rng, size, dt = np.random.default_rng(seed), 24.0, 1.0 / RATE
    p, angle, id = rng.uniform(0.0, size, (count, 2)), rng.uniform(-np.pi, np.pi, count), np.arange(count)
    found, after = Frames(), count
    for k in range(int(100 * RATE)):
        if k % 5 == 0:
            gap = (p[:, None] - p[None] + 0.5 * size) % size - 0.5 * size
            near = np.linalg.norm(gap, axis=2) < 1.5
            angle = np.angle(near @ np.exp(1j * angle)) + noise * rng.uniform(-np.pi, np.pi, count)
        p = p + dt * speed * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        for j in np.flatnonzero(((p < 0) | (p >= size)).any(axis=1)):
            id[j], after = after, after + 1
        p %= size
        found += [(k * dt, int(id[j]), tuple(map(float, p[j] - 12.0)), 0.2) for j in range(count)]
    return [row for row in found if row[0] >= 10.0]


def couzin(seed: int, count: int, speed: float) -> Frames:
    """Zones of repulsion, orientation and attraction in space; a pull back to the middle makes sharp turns."""
    rng, dt = np.random.default_rng(seed), 1.0 / RATE
    p = rng.uniform(-4.0, 4.0, (count, 3))
    v = rng.normal(size=(count, 3))
    v /= np.linalg.norm(v, axis=1)[:, None]
    found = Frames()
    for k in range(int(100 * RATE)):
        away = p[None] - p[:, None]
        far = np.linalg.norm(away, axis=2) + 1e9 * np.eye(count)
        unit = away / far[..., None]
        wish = -(unit * (far < 1.2)[..., None]).sum(axis=1)
        free = np.linalg.norm(wish, axis=1) == 0.0
        others = ((far >= 1.2) & (far < 3.0)) @ v + (unit * ((far >= 3.0) & (far < 7.0))[..., None]).sum(axis=1)
        wish[free] = others[free]
        outside = np.linalg.norm(p, axis=1) > 6.0
        wish[outside] = -p[outside] / np.linalg.norm(p[outside], axis=1)[:, None]
        none = np.linalg.norm(wish, axis=1) == 0.0
        wish[none] = v[none]
        wish = wish / np.linalg.norm(wish, axis=1)[:, None] + rng.normal(0.0, 0.05, (count, 3))
        wish /= np.linalg.norm(wish, axis=1)[:, None]
        angle = np.arccos(np.clip((v * wish).sum(axis=1), -1.0, 1.0))
        share = np.minimum(1.0, 1.5 * dt / np.maximum(angle, 1e-9))[:, None]
        v = v + share * (wish - v)
        v /= np.linalg.norm(v, axis=1)[:, None]
        p = p + dt * speed * v
        found += [(k * dt, j, tuple(map(float, p[j])), 0.3) for j in range(count)] if k >= 10 * RATE else []
    return found


# The recordings. Seeds, densities and speeds were fixed before the first measurement.


WALK = (1.6, 2.0, 0.3)
ACROSS = (HALF, -HALF)
ROUND = tuple(np.arange(8) * HALF / 2.0)
JUNCTION = (12.0, 4.0, 1.5)
Made = tuple[Callable[[], Frames], float, Crossing]  # the motions, [s] over which they are smoothed, the ways
RECORDINGS: dict[str, Made] = {
    "corridor_05": (lambda: corridor(51, 0.5), 0.6, Crossing((20, 2.5), 4.4, 0.2, 0.2, *WALK, ACROSS, 3.0)),
    "corridor_08": (lambda: corridor(52, 0.8), 0.6, Crossing((20, 2.5), 4.4, 0.2, 0.2, *WALK, ACROSS, 3.0)),
    "corridor_12": (lambda: corridor(53, 1.2), 0.6, Crossing((20, 2.5), 4.4, 0.15, 0.15, *WALK, ACROSS, 3.0)),
    "streams_03": (lambda: two_streams(54, 0.3), 0.6, Crossing((14.5, 14.5), 6.0, 0.2, 0.2, *WALK, ROUND, 1.0)),
    "bottleneck": (lambda: bottleneck(55, 110), 0.6, Crossing((11.5, 4.0), 6.0, 0.2, 0.2, *WALK, ACROSS, 1.0)),
    "square_4_cars": (
        lambda: square(56, 50, 4, 4.0), 0.9, Crossing((18, 18), 16.0, 0.3, "radius", 1.6, 1.5, 0.4, ROUND, 3.0)),
    "square_7_cars": (
        lambda: square(57, 80, 7, 3.0), 0.9, Crossing((18, 18), 16.0, 0.3, "radius", 1.6, 1.5, 0.4, ROUND, 3.0)),
    "signals": (
        lambda: signals(58, "traffic_light", 700), 1.7, Crossing((0, 0), 90.0, 1.0, 2.4, *JUNCTION, ROUND[1::2], 8.0)),
    "priority": (
        lambda: signals(59, "priority", 300), 1.7, Crossing((0, 0), 90.0, 1.0, 2.4, *JUNCTION, ROUND[1::2], 8.0)),
    "bicycles": (
        lambda: bicycles(60, 260), 1.7, Crossing((0, 0), 70.0, 0.6, "radius", 8.0, 3.0, 1.0, ROUND[1::2], 6.0)),
    "motorway": (
        lambda: motorway(61, 3600), 1.7, Crossing((0, -4.8), 28.0, 0.4, 2.4, 6.0, 4.0, 0.8, ACROSS, 20.0, 0.5)),
    "reynolds": (lambda: reynolds(62, 80, 1.5), 0.6, Crossing((0, 0), 16.0, 0.2, 0.2, 2.0, 2.0, 0.3, ROUND, 2.0)),
    "vicsek": (lambda: vicsek(63, 90, 1.2, 0.15), 0.6, Crossing((0, 0), 12.0, 0.2, 0.2, 1.6, 2.0, 0.3, ROUND, 3.0)),
    "couzin": (lambda: couzin(64, 40, 2.0), 0.6, Crossing((0, 0, 0), 10.0, 0.3, 0.3, 3.0, 5.0, 0.5, ROUND, 2.0)),
}  # fmt: skip


# Tracks, tasks and witnesses.


@dataclass(frozen=True)
class Track:
    """Positions (n, d) [m] of one agent at multiples of 1 / RATE [s] from the step `first` on."""

    first: int
    positions: np.ndarray
    radius: float


def tracks_of(frames: Frames, smooth: float) -> list[Track]:
    """One track for each agent and each time that it is there, smoothed over `smooth` [s]."""
    rows: dict[int, list[tuple[int, tuple[float, ...], float]]] = {}
    for t, id, place, radius in frames:
        rows.setdefault(id, []).append((round(t * RATE), place, radius))
    found, window = [], 2 * int(smooth * RATE / 2) + 1
    for own in rows.values():
        steps = np.array([row[0] for row in own])
        for part in np.split(np.arange(len(own)), np.flatnonzero(np.diff(steps) > 1) + 1):
            places = np.array([own[k][1] for k in part])
            if len(part) > window + 2:
                found.append(Track(int(steps[part[0]]), savgol_filter(places, window, 2, axis=0), own[part[0]][2]))
    begin = min(track.first for track in found)
    return [Track(track.first - begin, track.positions, track.radius) for track in found]


class Motions:
    """All agents at any time, for distances."""

    def __init__(self, tracks: list[Track], robot: float) -> None:
        last = max(track.first + len(track.positions) for track in tracks)
        self.places = np.full((last, len(tracks), tracks[0].positions.shape[1]), np.nan)
        for k, track in enumerate(tracks):
            self.places[track.first : track.first + len(track.positions), k] = track.positions
        self.least = np.array([track.radius for track in tracks]) + robot

    def gaps(self, t: float, points: np.ndarray) -> np.ndarray:
        """Least clearance (n,) [m] of points (n, d) [m] at the time t [s]."""
        k = min(int(t * RATE + 1e-9), len(self.places) - 2)
        share = t * RATE - k
        places = (1.0 - share) * self.places[k] + share * self.places[k + 1]
        gap = np.full(len(points), np.inf)
        for least in np.unique(self.least):
            there = ~np.isnan(places[:, 0]) & (self.least == least)
            if there.any():
                gap = np.minimum(gap, cKDTree(places[there]).query(points)[0] - least)
        return gap


def witness(motions: Motions, t0: float, start: np.ndarray, goal: np.ndarray, of: Crossing, horizon: float) -> Any:
    """Arrival time and least clearance of a motion with piecewise constant accelerations; None if none is found."""
    d, h = len(start), max(1.0 / RATE, round(of.vmax / of.amax / 4.0, 3))
    ways = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * d, indexing="ij"), axis=-1).reshape(-1, d)
    ways = of.amax * ways / np.maximum(np.linalg.norm(ways, axis=1), 1.0)[:, None]
    p, v, gap = start[None], np.zeros((1, d)), np.full(1, np.inf)
    for step in range(int(horizon / h)):
        n = len(p)
        a = np.tile(ways, (n, 1))
        q, u, least = (np.repeat(x, len(ways), axis=0) for x in (p, v, gap))
        keep = np.linalg.norm(u + h * a, axis=1) <= of.vmax
        q, u, a, least = q[keep], u[keep], a[keep], least[keep]
        for k in range(1, SUBSTEPS + 1):
            s = h * k / SUBSTEPS
            least = np.minimum(least, motions.gaps(t0 + step * h + s, q + s * u + 0.5 * s * s * a))
        q, u = q + h * u + 0.5 * h * h * a, u + h * a
        free = least > 0.01
        q, u, least = q[free], u[free], least[free]
        if not len(q):
            return None
        there = np.linalg.norm(q - goal, axis=1) <= 0.8 * of.tolerance
        if there.any():
            return (step + 1) * h, float(least[there].max())
        cells = np.round(np.concatenate([q / (0.15 * of.vmax * h * 4), u / (0.2 * of.vmax)], axis=1)).astype(int)
        cost = np.linalg.norm(goal - q, axis=1) / of.vmax - 0.05 * np.minimum(least, 0.2)
        order = np.argsort(cost, kind="stable")
        _, one = np.unique(cells[order], axis=0, return_index=True)
        chosen = order[np.sort(one)][:BEAM]
        p, v, gap = q[chosen], u[chosen], least[chosen]
    return None


def tasks_of(name: str, tracks: list[Track], of: Crossing, seed: int, count: int) -> list[dict[str, Any]]:
    """Up to `count` tasks with a witness, spread over the recording; `name` is that of the draw."""
    rng, motions = np.random.default_rng(seed), Motions(tracks, of.robot)
    horizon = round(1.1 + 4.0 * of.length / of.vmax, 1)
    last = len(motions.places) / RATE - horizon
    found: list[dict[str, Any]] = []
    tried = 0
    while tried < TRIES and len(found) < count:
        tried += 1
        t0 = round(float(rng.uniform(len(found), len(found) + 1) / count * last), 1)
        center, angle = np.array(of.center, float), float(rng.choice(of.angles)) + of.turn * rng.uniform(-1, 1)
        offset = rng.uniform(-of.spread, of.spread)
        way = np.array([np.cos(angle), np.sin(angle)])
        center[:2] += offset * np.array([-way[1], way[0]])
        way = np.append(way, [0.3 * rng.uniform(-1, 1)] * (len(center) - 2))
        way /= np.linalg.norm(way)
        start, goal = np.round(center - 0.5 * of.length * way, 3), np.round(center + 0.5 * of.length * way, 3)
        if motions.gaps(t0, start[None])[0] < 0.3 + 0.1 * of.robot:
            continue
        speeds = of.vmax * np.array([0.5, 0.65, 0.8, 0.95])
        hits = sum(
            any(motions.gaps(t0 + s, (start + v * s * way)[None])[0] < 0 for s in np.arange(0, of.length / v, 0.1))
            for v in speeds.tolist()
        )
        solved = witness(motions, t0, start, goal, of, horizon) if hits >= 3 else None
        if solved is None:
            continue
        found.append({
            "id": f"{name}#{len(found)}", "t0": t0, "horizon": horizon, "start": start.tolist(),
            "start_velocity": [0.0] * len(start), "goal": goal.tolist(), "goal_tolerance": of.tolerance,
            "straight_speeds_tried": 4, "straight_speeds_colliding": int(hits),
            "witness_time": round(solved[0], 2), "witness_min_clearance": round(solved[1], 3),
        })  # fmt: skip
    print(f"{name:16} {len(tracks):4d} tracks, {len(found)} tasks of {tried} draws", flush=True)
    return found


def write_tracks(tracks: list[Track], file: Path) -> None:
    d = tracks[0].positions.shape[1]
    lines = [",".join(["t", "id", *"xyz"[:d], "radius"])]
    for id, track in enumerate(tracks):
        for k, place in enumerate(track.positions):
            numbers = ",".join(f"{x:.4f}" for x in place)
            lines.append(f"{(track.first + k) / RATE:.1f},{id},{numbers},{track.radius:g}")
    file.write_text("\n".join(lines) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", nargs="+", choices=list(RECORDINGS), default=list(RECORDINGS))
    parser.add_argument("--tasks", type=int, default=6, help="of each recording")
    parser.add_argument("--seed", type=int, default=SEED, help="of the tasks; the recordings stay the same")
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    index = arguments.folder / "tasks.json"
    entries = json.loads(index.read_text()) if index.exists() else {}
    for number, (name, (make, smooth, of)) in enumerate(RECORDINGS.items()):
        if name not in arguments.only:
            continue
        tracks = tracks_of(make(), smooth)
        write_tracks(tracks, arguments.folder / f"{name}.csv")
        draw = name if arguments.seed == SEED else f"{name}#{arguments.seed}"
        tasks = tasks_of(draw, tracks, of, arguments.seed + number, arguments.tasks)
        entries[name] = {
            "file": f"{name}.csv", "dt": 1.0 / RATE, "robot_radius": of.robot, "agent_radius": of.agent,
            "vmax": of.vmax, "amax": of.amax, "tasks": tasks,
        }  # fmt: skip
        index.write_text(json.dumps(entries, indent=1) + "\n")


if __name__ == "__main__":
    sys.exit(main())
