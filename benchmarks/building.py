"""A building of six rooms: how many agents get from room to room by slalom, by models of JuPedSim and by ORCA.

usage: python benchmarks/building.py [--methods nao_shared orca ...] [--robots 200] [--seeds 10] [--first 2000]
       [--duration 300] [--quick]

Agents of 0.2 to 0.3 m and 0.9 to 1.5 m/s in rooms of 10 x 8 m go to another one, through doors of 1.3 m and a corridor
of 4 m, and stay there. All methods have the same starts, goals, radii, speeds and walls. `nao_shared` is guided. Peers
of slalom (`orca` and others, with parameters after colons) follow `slalom.routes` through the doors. Models of
JuPedSim, by the names of their classes, have its default parameters and time step. They go to waypoints at the goals by
JuPedSim's own routes, which pass corners at 0.2 m; with `:routes` after the name, from point to point of
`slalom.routes`. In JuPedSim wall ends are square, elsewhere round: its routes take several times as long among arcs.
Its positions are taken every 0.05 s, with straight motion in between. An agent has arrived within 0.3 m of its goal, as
long as it stays within 0.6 m; slalom and its peers require a speed below 0.3 m/s as well. Contacts are pairs that
overlap by more than 1 mm at some time, in continuous time. Flow and density are those of PedPy at the door of the first
room: agents that cross it a second, from the first to the last of them, and those a m^2 in the 2 x 2 m in front of it,
on average in that time. A step is that of a method; the first one, which loads kernels, counts. Methods whose package
is not installed are left out.
"""

import argparse
from collections.abc import Callable, Iterator
from dataclasses import replace
from importlib.util import find_spec
from itertools import pairwise
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
import shapely
from program import finish, options, table, target

from slalom import Disc, Goal, Limits, Obstacle, PathGoal, Polyline, State, Stationary, method, routes
from slalom.base.checks import Array
from slalom.peers import Peer
from slalom.sim import Recording, Robot, Scenario, simulate
from slalom.sim.measure.closest_approach import between_robots, nearest_clearances
from slalom.sim.measure.metrics import COLLISION
from slalom.sim.measure.recording import RunLog, Step
from slalom.sim.run.states import RobotStates

TOLERANCE, WALL, FRAME, PEDESTRIAN_STEP = 0.3, 0.05, 0.1, 0.01
ENDS = [0.0, *(x for door in (5.0, 15.0, 25.0) for x in (door - 0.7, door + 0.7)), 30.0]
OUTSIDE = [(0.0, 0.0), (30.0, 0.0), (30.0, 20.0), (0.0, 20.0), (0.0, 0.0)]
LINES = [
    OUTSIDE,
    *([(x, y), (x, y + 8.0)] for x in (10.0, 20.0) for y in (0.0, 12.0)),
    *([(ENDS[k], y), (ENDS[k + 1], y)] for y in (8.0, 12.0) for k in range(0, 8, 2)),
]
"""[m] The middles of the walls, which are 0.1 m thick."""
DOOR, FRONT = [(4.35, 8.0), (5.65, 8.0)], [(4.0, 5.95), (6.0, 5.95), (6.0, 7.95), (4.0, 7.95)]
"""[m] The door of the first room, and the area in front of it."""
ROUTED = ":routes"
"""After the name of a model of JuPedSim: agents go along `slalom.routes`, from point to point."""


def building(n: int, rng: np.random.Generator) -> Scenario:
    """Six rooms at a corridor, each with a door, and agents that go from one to another."""
    corners = [(x, y) for y in (0.0, 12.0) for x in (0.0, 10.0, 20.0)]
    taken: tuple[list[Array], list[Array]] = ([], [])

    def place(room: int, others: list[Array]) -> Array:
        while True:
            at = corners[room] + rng.uniform((0.5, 0.5), (9.5, 7.5))
            if all(np.linalg.norm(at - other) > 0.65 for other in others):
                others.append(at)
                return at

    robots = []
    for k in range(n):
        start, goal = place(k % 6, taken[0]), place((k % 6 + 1 + int(rng.integers(5))) % 6, taken[1])
        disc, limits = Disc(rng.uniform(0.2, 0.3)), Limits(rng.uniform(0.9, 1.5), 2.0)
        aim = Goal(Stationary(goal), TOLERANCE, stop=True)
        robots.append(Robot(disc, limits, State(start, np.zeros(2)), aim, f"agent {k}"))
    walls = [Obstacle(Polyline(line, WALL), Stationary((0.0, 0.0)), f"wall {k}") for k, line in enumerate(LINES)]
    return Scenario("building", tuple(robots), tuple(walls), duration=300.0)


def along_routes(scenario: Scenario) -> Scenario:
    """The building with routes in place of goals."""
    robots = scenario.robots
    starts, goals = [robot.state.position for robot in robots], [robot.goal.position(0.0) for robot in robots]
    paths = routes(starts, goals, [robot.shape.bounding_radius for robot in robots], scenario.obstacles)
    led = (replace(robot, goal=PathGoal(path, tolerance=TOLERANCE)) for robot, path in zip(robots, paths))
    return replace(scenario, robots=tuple(led))


# Runs: a recording and the number of steps that the method made.


def by_slalom(name: str, scenario: Scenario, seed: int) -> tuple[Recording, int]:
    """A run of a method of slalom, guided, or of a peer, on routes."""
    chosen = method(name)
    run = simulate(along_routes(scenario) if isinstance(chosen, Peer) else scenario, chosen, seed=seed)
    return run, len(run.accelerations)


def by_jupedsim(name: str, scenario: Scenario, seed: int) -> tuple[Recording, int]:
    """A run of a model of JuPedSim, whose number of steps is that of its own time step."""
    import jupedsim

    kind, routed, _ = name.partition(ROUTED)
    model = getattr(jupedsim, kind)
    model = model(rng_seed=seed) if "rng_seed" in model.__dataclass_fields__ else model()
    inner = shapely.union_all([shapely.LineString(line).buffer(WALL, cap_style="square") for line in LINES])
    area = shapely.Polygon(OUTSIDE).difference(inner)
    simulation = jupedsim.Simulation(model=model, geometry=area, dt=PEDESTRIAN_STEP)
    agents = []
    for robot in (along_routes(scenario) if routed else scenario).robots:
        goal = robot.goal
        points = goal.points[1:] if isinstance(goal, PathGoal) else [goal.position(0.0)]
        stages = [simulation.add_waypoint_stage(tuple(point), TOLERANCE) for point in points]
        journey = jupedsim.JourneyDescription(stages)
        for before, after in pairwise(stages):
            journey.set_transition_for_stage(before, jupedsim.Transition.create_fixed_transition(after))
        given = getattr(jupedsim, f"{kind}AgentParameters")(
            position=tuple(robot.state.position),
            radius=robot.shape.bounding_radius,
            desired_speed=robot.limits.max_speed,
            journey_id=simulation.add_journey(journey),
            stage_id=stages[0],
        )
        agents.append(simulation.add_agent(given))
    scenario = replace(scenario, dt=0.5 * FRAME)
    states, still, log = RobotStates(scenario), np.zeros((len(agents), 2)), RunLog(scenario, name, seed, "observed")
    times, positions = np.zeros(len(agents)), states.position[:, :2].copy()
    while not states.all_arrived and log.count * scenario.dt < scenario.duration:
        simulation.iterate(round(scenario.dt / PEDESTRIAN_STEP))
        log.count += 1
        found = {agent.id: agent.position for agent in simulation.agents()}
        states.position[:, :2] = [found[agent] for agent in agents]
        states.note_arrivals(log.count * scenario.dt)
        velocities = (states.position[:, :2] - positions) / scenario.dt
        log.steps.append(Step(positions, velocities, still, still, (name,) * len(agents), ("",) * len(agents), times))
        positions = states.position[:, :2].copy()
    log.end(positions, still, states.arrived)
    return Recording.of(log), log.count * round(scenario.dt / PEDESTRIAN_STEP)


class Source(NamedTuple):
    """How the methods of a package run, and which one it is."""

    run: Callable[[str, Scenario, int], tuple[Recording, int]]
    package: str


def source(name: str) -> Source:
    """The source of a method: names of models of JuPedSim begin with a capital, as its classes do."""
    if name[:1].isupper():
        return Source(by_jupedsim, "jupedsim")
    chosen = method(name)
    return Source(by_slalom, chosen.package if isinstance(chosen, Peer) else "slalom")


# Measures of a run.


class Measured(NamedTuple):
    """Measures of one run; of the door NaN without PedPy.

    Attributes:
        arrivals: (n,) [s], inf for agents that did not arrive.
        between, walls: pairs of agents, and of an agent and a wall, that touched. clearance: [m] the least.
        crossed: agents through the door. flow: [1/s]. density: [1/m^2].
        rate: steps of the method per second. speed: simulated seconds per second.
    """

    arrivals: Array
    between: int
    walls: int
    clearance: float
    crossed: float
    flow: float
    density: float
    rate: float
    speed: float


def through_door(run: Recording) -> tuple[float, float, float]:
    """Agents that cross the door, a second [1/s], and the mean density before it [1/m^2], by PedPy."""
    if not find_spec("pedpy"):
        return np.nan, np.nan, np.nan
    import pandas
    import pedpy

    positions = run.positions[:: round(FRAME / run.dt)]
    frames, agents = np.divmod(np.arange(positions.shape[0] * positions.shape[1]), positions.shape[1])
    places = dict(zip("xy", positions.reshape(-1, 2).T))
    walks = pedpy.TrajectoryData(pandas.DataFrame({"id": agents, "frame": frames, **places}), 1.0 / FRAME)
    _, crossings = pedpy.compute_n_t(traj_data=walks, measurement_line=pedpy.MeasurementLine(DOOR))
    if len(crossings) < 2:
        return float(len(crossings)), np.nan, np.nan
    first, last = int(crossings["frame"].min()), int(crossings["frame"].max())
    density = pedpy.compute_classic_density(traj_data=walks, measurement_area=pedpy.MeasurementArea(FRONT))
    within = density["density"][density["frame"].between(first, last)]
    return float(len(crossings)), (len(crossings) - 1) / ((last - first) * FRAME), float(within.mean())


def measured(name: str, n: int, seed: int, duration: float) -> Measured:
    """Measures of the run of a method with one seed."""
    scenario = replace(building(n, np.random.default_rng([seed, n])), duration=duration)
    before = perf_counter()
    run, steps = source(name).run(name, scenario, seed)
    wall = perf_counter() - before
    walls, between = nearest_clearances(run), between_robots(run)
    least = float(min(walls.min(), between.min()))
    touched = int((between < -COLLISION).sum()) // 2, int((walls < -COLLISION).sum())
    return Measured(run.arrived, *touched, least, *through_door(run), steps / wall, float(run.times[-1]) / wall)


def row(name: str, runs: list[Measured]) -> list[Any]:
    """The row of a method: sums over runs of contacts, means at the door, the least of clearances and rates."""
    arrivals = np.array([run.arrivals for run in runs])
    there = np.isfinite(arrivals)
    door = np.mean([(run.crossed, run.flow, run.density) for run in runs], axis=0)
    return [
        *(name, len(runs), int(there.all(axis=1).sum()), int(there.sum()), arrivals.size),
        *(float(np.median(arrivals)), float(arrivals.max())),
        *(sum(run.between for run in runs), sum(run.walls for run in runs), min(run.clearance for run in runs)),
        *(float(value) for value in door),
        *(min(run.rate for run in runs), min(run.speed for run in runs)),
    ]


HEADS = ["method", "runs", "all arrived", "agents arrived", "of", "median arrival s", "last arrival s"]
HEADS += ["contacts of agents", "contacts with walls", "least clearance m", "agents through the door", "flow 1/s"]
HEADS += ["density 1/m2", "least steps/s", "least simulated s/s"]
METHODS = (
    "nao_shared",
    "orca:horizon=0.5:wall_horizon=0.5",
    "CollisionFreeSpeedModelV2",
    f"SocialForceModel{ROUTED}",
)


def rows(arguments: argparse.Namespace, n: int, seeds: range, duration: float) -> Iterator[list[Any]]:
    """The rows of the methods whose packages are installed."""
    for name in arguments.methods:
        package = source(name).package
        if not find_spec(package):
            print(f"{name}: left out, because {package} is not installed (pip install {package})", flush=True)
            continue
        runs = []
        for seed in seeds:
            runs.append(measured(name, n, seed, duration))
            print(seed, *row(name, runs[-1:]), flush=True)
        yield row(name, runs)


def compare(arguments: argparse.Namespace) -> dict[str, Any]:
    """The table of all methods; the targets are those of slalom."""
    if not find_spec("pedpy"):
        print("flow and density: left out, because pedpy is not installed (pip install 'slalom[pedpy]')", flush=True)
    n, count, duration = (6, 1, 60.0) if arguments.quick else (arguments.robots, arguments.seeds, arguments.duration)
    found = list(rows(arguments, n, range(arguments.first, arguments.first + count), duration))
    targets = []
    for one in (dict(zip(HEADS, cells)) for cells in found if cells[0] == "nao_shared"):
        lost = one["of"] - one["agents arrived"]
        targets += [target("agents that did not arrive, nao_shared", lost, most=0.0)]
        targets += [target(f"{what}, nao_shared", one[what], most=0.0) for what in HEADS[7:9]]
        targets += [target("steps, nao_shared", one["least steps/s"], least=20.0, unit="1/s")]
    return {
        "question": "Do all agents get from room to room in a building, and how do they pass a door?",
        "parameters": {"robots": n, "first": arguments.first, "duration": duration},
        "tables": [table("The building", HEADS, found)],
        "targets": targets,
    }


if __name__ == "__main__":
    parser = options(__doc__)
    parser.add_argument("--methods", nargs="+", default=METHODS)
    parser.add_argument("--robots", type=int, default=200)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first", type=int, default=2000)
    parser.add_argument("--duration", type=float, default=300.0)
    given = parser.parse_args()
    used = {source(name).package for name in given.methods} | {"pedpy"}
    finish("building", compare(given), given, [name for name in sorted(used - {"slalom"}) if find_spec(name)])
