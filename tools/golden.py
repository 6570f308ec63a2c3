"""Digests of what slalom decides, kept in `golden.json`: a change that shall change no result is checked against them.

    python tools/golden.py            # compare; exit code 1 and the names of what differs
    python tools/golden.py --write    # keep the present digests; the commit says which changed and why

A digest covers arrays, outcomes and the numeric parameters of responses, never the name of a class, field or module.

The runs take place in the processes of `portable.py`: their bits are the same on other processors.
"""

import argparse
import hashlib
import json
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import portable

import slalom
from slalom.io.table import sample_data
from slalom.peers import contender
from slalom.sim import Recording, Robot, Scenario, compare, gallery, read_scenario, simulate
from slalom.sim.measure.metrics import METRICS

ROOT = Path(__file__).parents[1]
FILE = Path(__file__).with_name("golden.json")
Found = dict[str, str]


def digest(*parts: Any) -> str:
    """A hash of arrays, numbers and texts, in their order."""
    found = hashlib.sha256()
    for part in parts:
        content = part.encode() if isinstance(part, str) else np.ascontiguousarray(part, dtype=np.float64).tobytes()
        found.update(f"{len(content)}:".encode() + content)
    return found.hexdigest()[:16]


def of_run(run: Recording) -> str:
    """The digest of a recording and of all metrics of its first robot, without the others."""
    first = run.only(0)
    return digest(run.digest(), [metric(first) for metric in METRICS.values()])


# Runs: scenario, settings, methods.

ALONE: dict[str, dict[str, float]] = {
    "empty": {"duration": 3.0},
    "head_on": {"duration": 4.0},
    "curved_road": {"duration": 4.0},
    "roundabout_crossing": {"duration": 5.0},
    "roundabout_exit": {"duration": 3.0},
    "merging": {"duration": 5.0},
    "drones_crossing": {"duration": 4.0},
    "corridor": {"duration": 4.0, "start": 2.0},
    "crowdnav": {"duration": 4.0},
    "recorded_roundabout": {"duration": 3.0},
}
METHODS_ALONE = ("vo", "rvo", "nlvo", "avo", "ao", "nao", "nao_shared", "nao_ahead", "nao@observed", "nao@present")
FLEETS: dict[str, dict[str, float]] = {
    "circle": {"robots": 6.0, "radius": 6.0, "duration": 6.0},
    "circle_random": {"robots": 5.0, "radius": 6.0, "duration": 5.0},
    "ring": {"robots": 12.0, "radius": 5.0, "duration": 6.0},
    "random_goals": {"robots": 8.0, "side": 8.0, "duration": 6.0},
    "crossing_streams": {"robots": 8.0, "duration": 5.0},
    "corridor_swap": {"robots": 6.0, "length": 8.0, "width": 2.5, "duration": 5.0},
    "doorway": {"robots": 6.0, "both": 1.0, "room": 4.0, "duration": 6.0},
    "navground_antipodal": {"robots": 6.0, "radius": 0.5, "duration": 6.0},
    "navground_cross": {"robots": 8.0, "side": 2.0, "duration": 6.0},
}
METHODS_AMONG = ("vo", "rvo", "avo", "ao", "nao", "nao_shared")
EXTRA: tuple[tuple[str, dict[str, float], str], ...] = (
    ("circle", {"robots": 5.0, "radius": 5.0, "duration": 5.0, "sight_noise": 0.02, "sight_loss": 0.2}, "nao"),
    ("ring", {"robots": 6.0, "radius": 4.0, "duration": 5.0, "sight_delay": 0.2}, "nao"),
    ("ring", {"robots": 12.0, "radius": 5.0, "duration": 4.0, "replan": 0.2}, "nao"),
    ("ring", {"robots": 50.0, "radius": 12.0, "duration": 2.0}, "nao_shared"),
    ("random_goals", {"robots": 8.0, "side": 8.0, "duration": 5.0, "guided": 0.0}, "nao"),
    ("roundabout_crossing", {"duration": 5.0, "horizon": 2.0, "margin": 0.3, "start": 3.0}, "nlvo"),
    ("roundabout_crossing", {"duration": 9.0, "max_acceleration": 1.5}, "vo"),
    ("head_on", {"duration": 6.0, "horizon": 0.8, "speed": 9.0}, "vo"),
    ("head_on", {"duration": 6.0, "horizon": 0.8, "speed": 9.0}, "nao"),
    ("roundabout_crossing", {"duration": 4.0, "replan": 0.5}, "nao"),
    ("crowdnav", {"duration": 6.0, "people": 12.0}, "nao_ahead@observed"),
    ("circle", {"robots": 6.0, "radius": 6.0, "duration": 4.0}, "orca"),
    ("circle", {"robots": 6.0, "radius": 6.0, "duration": 4.0}, "orca_limited"),
    ("corridor_swap", {"robots": 6.0, "length": 8.0, "width": 2.5, "duration": 4.0}, "orca_inflated"),
    ("ring", {"robots": 8.0, "radius": 4.0, "duration": 4.0}, "hrvo"),
    ("ring", {"robots": 8.0, "radius": 4.0, "duration": 4.0}, "hl_limited"),
    ("ring", {"robots": 8.0, "radius": 4.0, "duration": 4.0}, "social_force"),
    ("ring", {"robots": 8.0, "radius": 4.0, "duration": 4.0}, "navground_orca"),
    ("roundabout_crossing", {"duration": 3.0}, "orca"),
    ("blind_corner", {"people": 6.0, "duration": 15.0, "passive_safety": 1.0}, "nao@observed_velocity"),
    ("circle", {"robots": 6.0, "radius": 6.0, "duration": 4.0, "sight_range": 3.0, "occlusion": 2.0}, "nao"),
)


def run_of(name: str, settings: Mapping[str, float], method: str) -> tuple[str, Recording]:
    """The name of a run in the file, and its recording."""
    told = ",".join(f"{key}={value:g}" for key, value in settings.items())
    return f"run {name} {told} {method}", simulate(gallery.build(name, settings, seed=1), contender(method), seed=1)


def scene_of_bodies(method: str, shapes: str) -> tuple[str, Recording]:
    """Four robots of other shapes than discs change places around a turning rectangle and a wall."""
    body: slalom.Shape = slalom.Rectangle(1.6, 0.8)
    if shapes == "unions":
        body = slalom.Union((slalom.Disc(0.5), slalom.Capsule((0.0, 0.0), (0.7, 0.2), 0.3)))
    starts = 5.0 * np.array([(1.0, 0.05), (0.0, 1.0), (-1.0, 0.0), (0.05, -1.0)])
    robots = tuple(
        Robot(
            body,
            slalom.Limits(2.0, 2.0),
            slalom.State(start, -0.2 * start),
            slalom.Goal(slalom.Stationary(-start), 0.3, stop=True),
            f"robot {k}",
        )
        for k, start in enumerate(starts)
    )
    car = slalom.Obstacle(slalom.Rectangle(1.5, 0.6), slalom.Circular((0.0, 0.0), 2.0, 1.0), "car", heading="motion")
    wall = slalom.Obstacle(slalom.Polyline([(-2.0, 6.0), (2.0, 6.0)], 0.1), slalom.Stationary((0.0, 0.0)), "wall")
    scenario = Scenario("bodies", robots, (car, wall), duration=5.0, holds=(0.5, 1.0, 2.0))
    return f"run bodies {shapes} {method}", simulate(scenario, contender(method), seed=1)


def scene_of_vehicle(method: str) -> tuple[str, Recording]:
    """A car with bounds that depend on its velocity, overtaken and met, from a state above its speed limit."""
    bounds = (slalom.Friction(2.5, 3.5, 3.0), slalom.TurningRadius(4.0), slalom.HeadingCone(1.2))
    robot = Robot(
        slalom.Rectangle(2.0, 1.0),
        slalom.Limits(5.0, 4.0, bounds=bounds),
        slalom.State((0.0, 0.0), (5.6, 0.0)),
        slalom.Goal(slalom.ConstantVelocity((25.0, 1.0), (0.5, 0.0)), 1.0),
    )
    person = slalom.Obstacle(
        slalom.Disc(0.4),
        slalom.ConstantVelocity((14.0, 3.0), (-0.5, -0.8)),
        "person",
        uncertainty=slalom.GaussianError(0.1, 0.1, probability=0.05),
    )
    truck = slalom.Obstacle(
        slalom.Capsule((-3.0, 0.0), (3.0, 0.0), 1.2), slalom.Circular((18.0, 12.0), 11.0, 3.0, 4.0), "truck"
    )
    scenario = Scenario("vehicle", (robot,), (person, truck), duration=6.0)
    return f"run vehicle {method}", simulate(scenario, contender(method), seed=1)


def scene_of_trouble(kind: str) -> tuple[str, Recording]:
    """What no method avoids: an obstacle that appears late, a robot inside a disc, a trap, bounds that exclude all."""
    goal, limits = slalom.Goal(slalom.Stationary((20.0, 0.0)), 0.5, stop=True), slalom.Limits(4.0, 1.0)
    at, seen = slalom.State((0.0, 0.0), (4.0, 0.0)), []
    if kind == "too late":
        seen = [slalom.Obstacle(slalom.Disc(1.5), slalom.Sampled([1.0, 9.0], [(7.0, 0.3), (7.0, 0.2)]), "late")]
    elif kind == "inside":
        seen = [slalom.Obstacle(slalom.Disc(1.0), slalom.ConstantVelocity((0.5, 0.9), (0.5, 0.1)), "over")]
    elif kind == "trapped":
        seen = [
            slalom.Obstacle(slalom.Disc(2.0), slalom.ConstantVelocity(place, velocity), f"wall {k}")
            for k, (place, velocity) in enumerate(
                [
                    ((8.0, 0.1), (-3.0, 0.0)),
                    ((-8.0, 0.0), (7.0, 0.0)),
                    ((3.0, 6.0), (0.5, -2.5)),
                    ((3.0, -6.0), (0.5, 2.5)),
                ]
            )
        ]
    elif kind == "narrow":
        seen = [
            slalom.Obstacle(slalom.Disc(2.0), slalom.Stationary((6.0, y)), f"post {y:g}")
            for y in (-2.52, 2.52, -6.55, 6.55)
        ]
    elif kind == "bounded":
        bounds = (slalom.HalfSpace((1.0, 0.0), 2.0),)
        limits = slalom.Limits(
            4.0, 1.0, velocity_bounds=bounds, acceleration_bounds=(slalom.HalfSpace((0.0, 1.0), 0.1),)
        )
        seen = [slalom.Obstacle(slalom.Disc(1.0), slalom.ConstantVelocity((12.0, 0.5), (-6.0, 0.0)), "car")]
    robot = Robot(slalom.Disc(0.5), limits, at, goal)
    method = "nao@observed" if kind == "too late" else "ao" if kind == "inside" else "nao"
    scenario = Scenario(kind, (robot,), tuple(seen), duration=4.0, margin=0.1)
    return f"run trouble {kind}", simulate(scenario, contender(method), seed=1)


def scene_ahead(kind: str) -> tuple[str, Recording]:
    """A search over sequences among posts: through a gate that turns, or with a budget that ends before an arrival."""
    posts = [
        slalom.Obstacle(slalom.Disc(1.0), slalom.Stationary((6.0, y)), f"post {y:g}") for y in np.arange(-9.0, 9.1, 1.8)
    ]
    if kind == "gate":
        posts = [post for k, post in enumerate(posts) if k not in (4, 5)]
    gate = slalom.Obstacle(slalom.Disc(1.2), slalom.Circular((9.0, 0.0), 4.0, 2.0, 1.0), "gate")
    robot = Robot(
        slalom.Disc(0.4),
        slalom.Limits(3.0, 1.5),
        slalom.State((0.0, 0.0), (1.0, 0.0)),
        slalom.Goal(slalom.Stationary((14.0, 0.0)), 0.4, stop=True),
    )
    scenario = Scenario(kind, (robot,), (*posts, gate), duration=8.0, margin=0.1)
    return f"run ahead {kind}", simulate(scenario, contender("nao_ahead"), seed=1)


def scene_from_file(path: str) -> tuple[str, Recording]:
    """A scenario file, as the command line reads it."""
    scenario = read_scenario(sample_data(path)).with_settings({"duration": 4.0})
    return f"run {path}", simulate(scenario, contender("nao"), seed=1)


def runs() -> Iterator[tuple[Callable[..., tuple[str, Recording]], tuple[Any, ...]]]:
    """Every run: what makes it, and from what."""
    for name, settings in ALONE.items():
        for method in METHODS_ALONE:
            if not (name in ("curved_road", "merging") and method == "nao_ahead"):  # their goals move
                yield run_of, (name, settings, method)
    for name, settings in FLEETS.items():
        for method in METHODS_AMONG:
            yield run_of, (name, settings, method)
    for extra in EXTRA:
        yield run_of, extra
    for method in ("nao", "nao_shared", "rvo"):
        yield scene_of_bodies, (method, "rectangles")
        yield scene_of_bodies, (method, "unions")
    for method in ("nao", "vo"):
        yield scene_of_vehicle, (method,)
    for kind in ("too late", "inside", "trapped", "narrow", "bounded"):
        yield scene_of_trouble, (kind,)
    for kind in ("gate", "walled in"):
        yield scene_ahead, (kind,)
    for path in ("crossing.yaml", "recorded.yaml"):
        yield scene_from_file, (path,)


# Single answers: exact choices, boundaries, clearances; vehicles that follow; studies.

RESPONSES: tuple[slalom.Response, ...] = (
    slalom.Velocity(0.1),
    slalom.LaggedVelocity(0.6),
    slalom.Acceleration(),
    slalom.AccelerateThenCoast(0.7),
    slalom.AccelerateThenStop(0.5, 0.6, 0.1),
    slalom.AccelerateThenBrake(0.5, 1.5),
    slalom.Jerk(),
)


def blocked_in(seed: int) -> tuple[slalom.ControlObstacle, slalom.Admissible, np.ndarray]:
    """A random scene: what is blocked, what is admissible, and a preferred control."""
    rng = np.random.default_rng([seed, 7])
    d, response = (3 if seed % 5 == 4 else 2), RESPONSES[seed % len(RESPONSES)]
    state = slalom.State(rng.normal(size=d), rng.normal(size=d), 0.3 * rng.normal(size=d))
    limits, seen = slalom.Limits(4.0, 3.0), []
    for k in range(int(rng.integers(1, 9))):
        place = state.position + rng.normal(size=d) * 2.0 + 4.0 * np.sign(rng.normal(size=d))
        velocity, size = rng.normal(size=d), float(rng.uniform(0.2, 0.8))
        paths = (
            slalom.ConstantVelocity(place, velocity),
            slalom.ConstantAcceleration(place, velocity, 0.2 * rng.normal(size=d)),
            slalom.Sampled(np.arange(6.0), place + np.cumsum(rng.normal(size=(6, d)), axis=0)),
            slalom.Circular(place, 1.5, float(rng.uniform(0.5, 2.0)), float(rng.uniform(0.0, 6.0))),
        )
        shapes: tuple[slalom.Shape, ...] = (slalom.Ball(size), slalom.Capsule(np.zeros(d), 0.5 * velocity, size))
        if d == 2:
            corners = size * np.array([(-1.0, -0.5), (1.2, -0.6), (0.8, 0.9), (0.1, 0.2), (-0.7, 0.8)])
            shapes = (slalom.Disc(size), slalom.Rectangle(2 * size, size, 0.1), slalom.Polygon(corners))
        kind = int(rng.integers(4))
        turns = d == 2 and kind in (0, 3) and bool(rng.random() < 0.5)
        shape = shapes[int(rng.integers(len(shapes)))]
        seen.append(slalom.Obstacle(shape, paths[kind], f"{k}", heading="motion" if turns else 0.0))
    robot: slalom.Shape = slalom.Ball(0.3) if d == 3 else (slalom.Disc(0.3), slalom.Rectangle(0.8, 0.4))[seed % 2]
    blocked = slalom.control_obstacle(response, state, seen, robot, horizon=4.0, margin=0.05)
    return blocked, limits.admissible(response, state, 4.0), rng.normal(size=d)


def choices(first: int, last: int) -> Found:
    """Exact choices, clearances and times to collision of random scenes."""
    found: list[Any] = []
    for seed in range(first, last):
        blocked, admissible, preferred = blocked_in(seed)
        choice = slalom.select(preferred, admissible, blocked)
        found += [choice.status.name, choice.distance, [] if choice.control is None else choice.control]
        found += [blocked.clearances(preferred), blocked.times_to_collision(preferred)]
    return {f"choices {first} to {last}": digest(*found)}


def boundaries(first: int, last: int) -> Found:
    """Areas of control obstacles and of temporal elements, points of grazing curves."""
    found: list[Any] = []
    for seed in range(first, last):
        blocked, _, preferred = blocked_in(seed if seed % 5 != 4 else seed + 1000)
        if blocked.dimension == 2 and not blocked.overlaps:
            found += [blocked.boundary(preferred, 3.0).region.area, *blocked.boundary(preferred, 3.0).curves]
            found += [blocked.element(1.0).centers]
    return {f"boundaries {first} to {last}": digest(*found)}


def clearest_and_many() -> Found:
    """`select_clearest` and `select_many`."""
    found: list[Any] = []
    for seed in range(20):
        blocked, admissible, preferred = blocked_in(seed)
        choice, kept = slalom.select_clearest(preferred, admissible, blocked, enough=0.5)
        found += [choice.status.name, kept, [] if choice.control is None else choice.control]
    blocked, _, _ = blocked_in(2)
    states = np.random.default_rng(3).normal(size=(200, 2, 2)) * 3.0
    many = slalom.select_many(
        np.zeros((200, 2)),
        states,
        blocked.response,
        slalom.Limits(4.0, 3.0),
        blocked.obstacles,
        blocked.robot,
        threads=2,
    )
    return {"clearest and many": digest(*found, many.controls, " ".join(s.name for s in many.statuses))}


def bounded_decisions() -> tuple[Found, Counter[str]]:
    """Decisions of one robot in the roundabout with no, little and much work, and their outcomes."""
    scenario, found, outcomes = gallery.build("roundabout_crossing", seed=2), [], Counter[str]()
    robot, table = scenario.robot, slalom.ObstacleTable(scenario.obstacles)
    navigator = scenario.navigator(slalom.method("nao"))
    for budget in (0.0, 2e-4, 1.0):
        state, previous = robot.state, None
        for k in range(40):
            now = scenario.start + 0.1 * k
            previous = navigator.decide(state, table, robot.goal, now=now, previous=previous, budget=budget)
            acceleration = previous.manoeuvre.mean_acceleration(now, 0.1)
            position = state.position + 0.1 * state.velocity + 0.005 * acceleration
            state = slalom.State(position, state.velocity + 0.1 * acceleration, acceleration)
            outcomes[previous.outcome.name] += 1
            found += [previous.outcome.name, state.position, previous.work]
    return {"bounded decisions": digest(*found)}, outcomes


def deviating_decisions() -> tuple[Found, Counter[str]]:
    """A robot of least expected loss through a crowd that avoids itself as predicted, and its outcomes."""
    limits, goal = slalom.Limits(1.0, 4.0), slalom.Goal(slalom.Stationary((6.0, 0.0)), 0.3)
    single = slalom.Navigator(slalom.method("nao_ahead"), slalom.Disc(0.3), limits, period=0.25, horizon=1.5)
    robot, crowd, rng = (
        slalom.ExpectedLoss(slalom.LookAhead(single)),
        slalom.AvoidingCrowd(0.25),
        np.random.default_rng(4),
    )
    places, velocities = rng.uniform((1.0, -2.5), (5.0, 2.5), (6, 2)), rng.normal(scale=0.5, size=(6, 2))
    state, previous, found, outcomes = slalom.State((0.0, 0.0), (1.0, 0.0)), None, [], Counter[str]()
    for k in range(25):
        now = 0.25 * k
        people = crowd.predict(slalom.Tracks(places, velocities, 0.3, now))
        previous = robot.decide(state, people, goal, now=now, previous=previous)
        ends = now + 0.25
        state = slalom.State(previous.manoeuvre.position(ends), previous.manoeuvre.velocity(ends))
        velocities = np.array([person.trajectory.velocity(now) for person in people])
        places = places + 0.25 * velocities
        outcomes[previous.outcome.name] += 1
        found += [previous.outcome.name, state.position]
    return {"deviating decisions": digest(*found)}, outcomes


def studies() -> Found:
    """Tables of methods over seeds, without what the clock says."""
    table = compare("head_on", ["vo", "nao"], seeds=2)
    words = sorted(f"{key}={value!r}" for key, value in _flat(table) if "decision_us" not in key)
    return {"study": digest(" ".join(words))}


def _flat(value: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _flat(inner, f"{name}.{key}")
    else:
        yield name, value


def several_futures() -> tuple[Found, Counter[str]]:
    """Decisions of robots among agents with three futures each, some of which nothing avoids all."""
    found, outcomes, goal = [], Counter[str](), slalom.Goal(slalom.Stationary((8.0, 0.0)), 0.3)
    state, limits = slalom.State((0.0, 0.0), (1.0, 0.0)), slalom.Limits(1.5, 2.0)
    single = slalom.Navigator(slalom.method("nao"), slalom.Disc(0.3), limits, period=0.25, horizon=4.0)
    ahead = slalom.LookAhead(replace(single, method=slalom.method("nao_ahead")))
    for seed in range(20):
        rng = np.random.default_rng(seed)
        angles = rng.uniform(-np.pi, np.pi, (4, 1)) + rng.normal(0.0, [0.0, 0.4, 0.8], (4, 3))
        places = rng.uniform(1.6, 3.0, (4, 1, 1)) * np.stack([np.cos(angles), np.sin(angles)], axis=2)[:, :1]
        velocities = -rng.uniform(0.8, 1.6, (4, 3, 1)) * np.stack([np.cos(angles), np.sin(angles)], axis=2)
        agents = slalom.Tracks(
            np.repeat(places, 3, axis=1).reshape(-1, 2),
            velocities.reshape(-1, 2),
            0.6,
            ids=np.repeat(np.arange(4), 3).tolist(),
            probabilities=np.tile([0.6, 0.3, 0.1], 4) - 0.001 * np.arange(12),
        )
        for robot in (single, ahead):
            decision = robot.decide(state, [agents], goal)
            outcomes[decision.outcome.name] += 1
            found += [decision.manoeuvre.position(np.linspace(0.0, 4.0, 9)), np.array([decision.given_up])]
    return {"several futures": digest(*found)}, outcomes


def one(job: tuple[Callable[..., Any], tuple[Any, ...]]) -> tuple[Found, Counter[str]]:
    """What a job found, and how often each outcome occurred in it."""
    make, given = job
    result = make(*given)
    if isinstance(result, dict):
        return result, Counter()
    if isinstance(result[0], dict):
        return result
    name, recording = result
    return {name: of_run(recording)}, Counter(word for row in recording.outcomes for word in row)


def all_digests(processes: int) -> Found:
    """Every digest by name. Raises RuntimeError if some outcome never occurred: then the runs no longer cover it."""
    jobs: list[tuple[Callable[..., Any], tuple[Any, ...]]] = [*runs()]
    jobs += [(choices, (k, k + 50)) for k in range(0, 300, 50)] + [(boundaries, (k, k + 25)) for k in range(0, 100, 25)]
    jobs += [(clearest_and_many, ()), (bounded_decisions, ()), (several_futures, ()), (deviating_decisions, ())]
    jobs += [(studies, ())]
    found: Found = {}
    seen: Counter[str] = Counter()
    with portable.processes(processes) as pool:
        for digests, outcomes in pool.map(one, jobs):
            found.update(digests)
            seen.update(outcomes)
    missing = [outcome.name for outcome in slalom.Outcome if outcome.name not in seen]
    if missing:
        raise RuntimeError(f"outcomes: expected each in some run, found none of {', '.join(missing)}")
    return found


def main() -> int:
    """The exit code: 0 where all digests are those that are kept."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help="keep the present digests")
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    found = all_digests(options.processes)
    kept: Found = json.loads(FILE.read_text()) if FILE.exists() else {}
    changed = sorted(name for name in {*found, *kept} if found.get(name) != kept.get(name))
    if options.write:
        FILE.write_text(json.dumps(found, indent=1) + "\n")
    for name in changed:
        print(f"{name}: expected {kept.get(name, 'no run')}, found {found.get(name, 'no run')}")
    print(
        f"{len(found)} digests, {len(changed)} differ from {FILE.name}"
        + (", which is written" if options.write else "")
    )
    return 0 if options.write or not changed else 1


if __name__ == "__main__":
    sys.exit(main())
