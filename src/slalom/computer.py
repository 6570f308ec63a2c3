"""What depends on the computer: compilation of kernels on request, and counted work per second."""

import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import replace
from itertools import product
from pathlib import Path
from time import perf_counter, process_time
from typing import Any, Final

import numpy as np

from slalom import kernels
from slalom.base.checks import known, whole
from slalom.base.errors import InvalidInput, first_missing
from slalom.base.writing import writing
from slalom.choice.control_obstacle import ControlObstacle
from slalom.choice.selection import select_many
from slalom.decision import Decision
from slalom.decision.methods import METHODS
from slalom.decision.navigator import Navigator
from slalom.decision.objective import Arrive, FollowVelocity, preferred_control
from slalom.fleet.fleet import Fleet
from slalom.forecast.forecast import FromModels
from slalom.lookahead.navigator import LookAhead
from slalom.model.bounds import axes
from slalom.model.goal import Goal
from slalom.model.limits import Limits
from slalom.model.path_goal import PathGoal
from slalom.model.response import Acceleration
from slalom.model.shape import Disc, Polyline, Rectangle, Shape, round_shape
from slalom.model.state import State
from slalom.model.trajectory import Circular, ConstantVelocity, Stationary
from slalom.obstacle import Obstacle
from slalom.obstacle.table import ObstacleTable
from slalom.obstacle.tracks import Tracks
from slalom.obstacle.window import Obstacles, ObstacleWindow
from slalom.perception.crowd import AvoidingCrowd

LIMITS = Limits(2.0, 2.0)


def _vector(x: float, y: float, d: int) -> np.ndarray:
    return np.array([x, y, 0.0][:d])


def _decide(robot: Shape, obstacles: Sequence[Obstacle], d: int = 2) -> None:
    """Decisions among obstacles, tables, tracks and robots; of all kinds of responses; where nothing is safe."""
    state, goal = State(_vector(0.0, 0.0, d), _vector(1.0, 0.0, d)), Goal(Stationary(_vector(9.0, 0.0, d)), 0.5, True)
    tracks = Tracks([_vector(0.0, -4.0, d)], [_vector(0.0, 0.5, d)], 0.3)
    for name in ("nao", "vo", "avo"):
        navigator = Navigator(METHODS[name], robot, LIMITS)
        some: list[Obstacles] = [list(obstacles), ObstacleTable(obstacles), [*obstacles, tracks]]
        path = PathGoal([state.position, goal.position(0.0)])
        for around in some:
            navigator.decide(state, around, path)
            decision: Decision | None = None
            # At the last time it is held up.
            for now in (0.0, 0.1, 9.0):
                decision = navigator.decide(state, around, goal, now=now, previous=decision)
        navigator.decide(state, obstacles, goal, robots=tracks)
        blocked = navigator.decide(state, obstacles, goal).blocked
        blocked.clearance(_vector(0.1, 0.0, d))
        blocked.time_to_collision(_vector(0.1, 0.0, d))
    # Inside an obstacle, and before one that can no longer be avoided.
    for gap in (-0.1, 0.3):
        place = _vector(obstacles[0].shape.bounding_radius + robot.bounding_radius + gap, 0.0, d)
        wall = Obstacle(obstacles[0].shape, Stationary(place))
        navigator.decide(State(_vector(0.0, 0.0, d), _vector(2.0, 0.0, d)), [wall, *obstacles], goal)
    window = ObstacleWindow(obstacles, 0.0, 6.0)
    for stop in (False, True):
        goal = replace(goal, stop=stop)
        for situation in navigator.situations(state, goal, 0.0):
            situation.admissible.toward(preferred_control(Arrive().aims(situation)))
        goal.desired_velocity(state.position, state.velocity, 0.0, LIMITS)
        goal.time_to_go(state.position, state.velocity, 0.0, LIMITS)
    axes(state)
    LIMITS.admissible(Acceleration(), state, 6.0).contains(_vector(1.0, 0.0, d))
    select_many([_vector(1.0, 0.0, d)], [state], Acceleration(), LIMITS, window, robot)


def one_robot() -> None:
    """One disc among discs."""
    _decide(Disc(0.4), [Obstacle(Disc(0.5), ConstantVelocity((5.0, 0.2), (-0.5, 0.0)))])


def polygons() -> None:
    """One robot among polygons, or of that shape, that turn or rest."""
    car = Obstacle(Rectangle(2.0, 1.0), Circular((6.0, 0.0), 2.0, 1.0), heading="motion")
    walls = Obstacle(Polyline([(0.0, 3.0), (9.0, 3.0)]), Stationary((0.0, 0.0)))
    _decide(Disc(0.4), [car, walls])
    _decide(Rectangle(0.8, 0.5), [car, walls])
    _decide(Rectangle(0.8, 0.5), [walls])


def space() -> None:
    """One ball among balls."""
    body = Obstacle(round_shape(0.5, 3), ConstantVelocity((5.0, 0.2, 0.1), (-0.5, 0.0, 0.0)))
    _decide(round_shape(0.4, 3), [body], 3)


def fleets() -> None:
    """Fleets of discs, rectangles and balls that observe each other or publish their manoeuvres; their guidance."""
    walls = Obstacle(Polyline([(-9.0, 5.0), (9.0, 5.0)]), Stationary((0.0, 0.0)))
    pillar = Obstacle(Disc(0.5), Stationary((0.3, 0.2)))
    places = np.array([(-3.0, 0.0), (3.0, 0.0)])
    for name in ("nao", "nao_shared"):
        for shape, around in ((Disc(0.3), []), (Disc(0.3), [pillar]), (Rectangle(0.6, 0.4), [walls])):
            fleet, places = (
                Fleet(METHODS[name], shape, LIMITS, robots=2, obstacles=around),
                np.array([(-3.0, 0), (3, 0)]),
            )
            for k in range(2):
                fleet.step(0.1 * k, places, 0.0 * places, -places)
    if first_missing("sim") is None:
        _simulate()


def _simulate() -> None:
    """Runs of fleets, also among walls, and of one robot."""
    from slalom.sim import gallery, simulate

    short = {"robots": 3.0, "duration": 0.2}
    simulate(gallery.build("navground_cross", {"duration": 0.2}), METHODS["nao"])
    for scenario in ("circle", "doorway"):
        simulate(gallery.build(scenario, short), METHODS["nao_shared"])
    simulate(gallery.build("corridor", {"duration": 0.2}), METHODS["nao"])


def vehicles() -> None:
    """A drive and a bicycle among discs and polygons; to places, to poses, on paths, and out of an overlap."""
    from slalom.vehicle import Bicycle, DifferentialDrive, Pose, VehicleNavigator

    walls = Obstacle(Polyline([(-9.0, 1.5), (9.0, 1.5)]), Stationary((0.0, 0.0)))
    disc = Obstacle(Disc(0.5), ConstantVelocity((5.0, 0.4), (-0.5, 0.0)))
    start, place = Pose((0.0, 0.0), 0.2), Stationary((5.0, 0.5))
    goals = [Goal(place, 0.2, True), Goal(place, 0.2, True, heading=0.3), PathGoal([(0.0, 0.0), (5.0, 0.0)])]
    for car in (DifferentialDrive(0.4, 1.0, 2.0), Bicycle(0.4, 0.6, 3.0, 1.0, 1.0, max_reverse_speed=0.5)):
        robot = VehicleNavigator(car, METHODS["nao"], Rectangle(0.6, 0.4), horizon=1.0)
        for goal, around in product(goals, ([], [disc], [walls, disc])):
            pose, decision = start, None
            for now in (0.0, 0.1):
                decision = robot.decide(pose, around, goal, now=now, previous=decision)
                pose = car.drive(pose, decision.command)
        robot.decide(start, [disc], objective=FollowVelocity((0.0, 0.0)))
        for y in (0.4, 0.6):
            rock = Obstacle(Disc(0.3), Stationary((0.3, y)))
            for around in ([rock], [rock, walls]):
                robot.decide(start, around, goals[0])


def look_ahead() -> None:
    """The search over sequences of accelerations, among discs and among polygons, and again with other predictions."""
    goal = Goal(Stationary((9.0, 0.0)), 0.5)
    for body in (Disc(0.5), Rectangle(1.0, 0.5)):
        robot, decision = LookAhead(Navigator(METHODS["nao_ahead"], Disc(0.4), LIMITS)), None
        for now, y in ((0.0, 0.2), (0.1, 0.3)):
            state = State((now, 0.0), (1.0, 0.0))
            if decision is not None:
                state = State(decision.manoeuvre.position(now), decision.manoeuvre.velocity(now))
            obstacles = [Obstacle(body, ConstantVelocity((5.0, y), (-0.5, 0.0)))]
            decision = robot.decide(state, obstacles, goal, now=now, previous=decision)
        # Without an arrival the best sequence found ends with a stop.
        replace(robot, budget=1.0).decide(State((0.0, 0.0), (1.0, 0.0)), obstacles, goal)


def crowd() -> None:
    """The forecasts of a crowd that avoids itself, and from similar motions."""
    FromModels()(ConstantVelocity((0.0, 0.0), (1.0, 0.0)), 0.0)
    forecast, places = AvoidingCrowd(0.1), np.array([(-3.0, 0.0), (3.0, 0.0)])
    for k in range(2):
        forecast.predict(Tracks(places - 0.01 * k * places, -0.1 * places, 0.3, 0.1 * k))


def learners() -> None:
    """The filter of the actions of learners, among discs and among walls."""
    if first_missing("gym") is None:
        from slalom.adapters.gym import RobotsEnv, VectorSafetyFilter

        for scenario in ("head_on", "corridor"):
            env = VectorSafetyFilter(RobotsEnv(1, scenario))
            env.reset(seed=0)
            env.step(np.ones((1, 2)))


def figures() -> None:
    """Exact borders of control obstacles."""
    for body in (Disc(1.0), Rectangle(2.0, 1.0)):
        window = ObstacleWindow([Obstacle(body, Stationary((5.0, 0.0)))], 0.0, 5.0)
        blocked = ControlObstacle(Acceleration(), State((0.0, 0.0), (1.0, 0.0)), window, Disc(0.5))
        blocked.boundary((0.0, 0.0), 2.0)


USES: Final[dict[str, Callable[[], None]]] = {
    "robot": one_robot,
    "polygons": polygons,
    "fleets": fleets,
    "space": space,
    "vehicles": vehicles,
    "ahead": look_ahead,
    "crowd": crowd,
    "learners": learners,
    "figures": figures,
}
"""Uses of slalom by name. Each calls the kernels that it compiles."""


def compile(*uses: str, jobs: int = 1, progress: Callable[[str, float], None] | None = None) -> None:
    """Compile everything that some uses need, all of them by default; afterwards no decision compiles anything.

    Compiled kernels are kept on disk, for this user and until slalom or numba changes: a later call takes seconds. Each
    use is compiled in a process of its own, whose memory is free afterwards; this process loads the result.

    Args:
        uses: names of `USES`. jobs: processes at a time. progress: called with the name of a use and how long it
            took [s].

    Raises:
        InvalidInput: an unknown use, jobs below 1.
    """
    for name in compile_apart(*uses, jobs=jobs, progress=progress):
        _timed(name)


def compile_apart(*uses: str, jobs: int = 1, progress: Callable[[str, float], None] | None = None) -> list[str]:
    """As `compile`; return the uses that other processes compiled, and that this one has not loaded."""
    from slalom.kernels import entries

    names = [known(name, "uses", list(USES)) for name in uses] or list(USES)
    tell, todo = progress or (lambda name, seconds: None), list[str]()
    whole(jobs, "jobs", 1)
    for name in names:
        try:
            # Where nothing is kept, only this process has use of the result. Elsewhere it ends with the first kernel
            # that no file holds.
            tell(name, _timed(name, [] if entries.OWN is None else [sys.exit]))
        except SystemExit:
            todo.append(name)
    todo.sort(key="learners".__ne__)  # first, since it takes longest
    with ThreadPoolExecutor(jobs) as pool:
        named = {pool.submit(_in_process, name): name for name in todo}
        for done in as_completed(named):
            tell(named[done], done.result())
    return todo


def _in_process(name: str) -> float:
    """Compile a use in a new process; return the time [s]."""
    program = f"import slalom.computer; slalom.computer._timed({name!r})"
    paths = os.pathsep.join(path for path in sys.path if path)
    before = perf_counter()
    subprocess.run([sys.executable, "-P", "-c", program], env={**os.environ, "PYTHONPATH": paths}, check=True)
    return perf_counter() - before


def export_entries(folder: Path) -> list[Path]:
    """Copy the compiled kernels that are kept on disk, and that fit, into a folder, which other machines can use.

    Raises:
        InvalidFile: a file that cannot be written.
    """
    from slalom.kernels import entries

    kept = {path.name: path for one in (*entries.GIVEN, entries.OWN) if one for path in entries.fitting(one)}
    with writing(folder):
        for name, path in kept.items():
            entries.write(folder / name, path.read_bytes())
        entries.write(folder / entries.LABEL, entries.MADE_FOR.encode() + b"\n")
    return [folder / name for name in kept]


def import_entries(folder: Path) -> tuple[list[Path], list[Path]]:
    """Copy the compiled kernels of a folder that fit to where they are kept; return them, and those that are damaged.

    Raises:
        InvalidInput: a folder without a kernel that fits. InvalidFile: a file that cannot be written.
    """
    from slalom.kernels import entries

    found = entries.fitting(folder)
    damaged = [path for path in found if entries.read(path) is None]
    if not found:
        label = folder / entries.LABEL
        there = f"those for {label.read_text().strip()}" if label.is_file() else "none"
        raise InvalidInput(
            f"{folder}: expected compiled kernels of these sources for {entries.MADE_FOR}, found {there}"
        )
    if entries.OWN is None:
        raise InvalidInput("import: expected a folder that can be written, found none: NUMBA_CACHE_DIR names one")
    with writing(entries.OWN):
        for path in found:
            if path not in damaged:
                entries.write(entries.OWN / path.name, path.read_bytes())
    return [path for path in found if path not in damaged], damaged


def _timed(name: str, when_compiling: Sequence[Callable[[str], Any]] = ()) -> float:
    """Time [s] that a use took; `when_compiling`: what is called before it compiles a kernel."""
    functions, before = list(kernels.when_compiling), perf_counter()
    kernels.when_compiling[:] = when_compiling
    try:
        USES[name]()
    finally:
        kernels.when_compiling[:] = functions
    return perf_counter() - before


WORK_DECISIONS: Final = 300
"""[1] Decisions from which the counted work in a second of a computer is measured. Larger: a more exact figure that
takes longer, about 0.3 ms for each decision. Smaller: a less exact one."""


def work_per_second() -> float:
    """Counted work [s] in a second of processor time on this computer, for `Navigator.decide(budget=)`.

    It is measured by decisions among 40 moving discs, with all that Python does around the kernels. For decisions of
    about 5 ms, pass budget = 0.005 * work_per_second(). The figure differs from call to call, and decisions that are to
    be repeated need the same budget: measure once, and keep the number.
    """
    navigator, goal = Navigator(METHODS["nao"], Disc(0.3), Limits(1.5, 1.5)), Goal(Stationary((20.0, 0.0)))
    rng, state = np.random.default_rng(0), State((0.0, 0.0), (1.0, 0.0))
    crowds = [Tracks(rng.uniform((1.5, -6.0), (12.0, 6.0), (40, 2)), rng.normal(size=(40, 2)), 0.25) for _ in range(30)]
    navigator.decide(state, crowds[0], goal)
    work, begin = 0.0, process_time()
    for k in range(WORK_DECISIONS):
        decision: Decision = navigator.decide(state, crowds[k % len(crowds)], goal)
        work += decision.work
    return work / (process_time() - begin)
