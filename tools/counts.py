"""Exact counts of the work of decisions in fixed scenes, beside those of tools/counts.toml.

    python tools/counts.py           # the short scenes: each count by decision, and what rose or fell
    python tools/counts.py --all     # the long scenes too, some minutes
    python tools/counts.py --stages  # the stages of a decision: calls of each, and its share of the time
    python tools/counts.py --write   # writes today's counts; `bought` of a rise is then to be filled in

Kernels run as Python, so that a profiler sees each call, in the processes of `portable.py`. A count is thus equal on
every machine, under any load.
"""

import argparse
import cProfile
import json
import sys
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from itertools import islice
from pathlib import Path
from types import CodeType
from typing import Any

import portable

ROOT = Path(__file__).parents[1]
FILE = ROOT / "tools" / "counts.toml"
SOURCE = str(ROOT / "src" / "slalom")
KERNELS = str(ROOT / "src" / "slalom" / "kernels")
INLINED = ("<listcomp>", "<setcomp>", "<dictcomp>", "<genexpr>")
"""Parts of functions that are functions of their own up to Python 3.11."""
Scene = Callable[[], tuple[Callable[[], Any], int]]
"""Prepares a scene; returns what is counted, and how many decisions that makes."""
sys.path[:0] = [str(ROOT / "benchmarks"), str(ROOT / "src")]

import budget  # noqa: E402


def print_stages(scene: str, work: Callable[[], Any], decisions: int) -> None:
    """Print calls of each stage by decision, and its share of the time."""
    from slalom.decision.stages import stages_of

    found = stages_of(work)
    whole = sum(stage.time for stage in found.values())
    for name, (count, time) in found.items():
        print(f"{scene:16}{name:10}{count / decisions:8.4g} calls{time / whole:8.0%}")


def counted_kernels() -> dict[CodeType, str]:
    """The name of a count by each kernel whose calls it counts."""
    from slalom.kernels.decision import bodies, collision, costs, paths, policy, response_motion
    from slalom.kernels.relative_motion import segments
    from slalom.kernels.selection import exchange

    kernels: dict[str, tuple[Any, ...]] = {
        "keeping": (policy.keep_committed,),
        "gatherings": (bodies.obstacle_pieces,),
        "relaxations": (bodies.reduce_margin, policy.most_clearance, collision.latest_collision),
        "searches": (policy.change_manoeuvre,),
        "exact_choices": (exchange.nearest_free,),
        "segment_tables": (response_motion.relative_table,),
        "chord_passes": (segments.put_chord_distances,),
        "optimistic_costs": (costs.optimistic_cost,),
        "response_paths": (paths.response_path,),
        "ball_tests": (bodies.is_near, bodies.meets_balls),
    }
    return {function.__code__: name for name, some in kernels.items() for function in some}


def calls(work: Callable[[], Any]) -> Counter[str]:
    """Calls of functions of slalom while `work` runs: in Python, `__init__` of dataclasses, kernels all and some."""
    names = counted_kernels()
    found = Counter[str](dict.fromkeys(("python", "objects", "kernels", *names.values()), 0))
    profile = cProfile.Profile(builtins=False)
    profile.runcall(work)
    for one in profile.getstats():
        code = one.code
        if not isinstance(code, CodeType) or code.co_name in INLINED:
            continue
        if code.co_filename.startswith(KERNELS):
            found["kernels"] += one.callcount
            if code in names:
                found[names[code]] += one.callcount
        elif code.co_filename.startswith(SOURCE):
            found["python"] += one.callcount
        elif code.co_filename == "<string>" and code.co_name == "__init__":
            found["objects"] += one.callcount
    return found


# Scenes.


def crossing(kind: str, size: Any, steps: int) -> Scene:
    """The first steps of a robot of `closed_loop.py`."""

    def prepare() -> tuple[Callable[[], Any], int]:
        import closed_loop

        of: dict[str, Callable[[], Any]] = {
            "gallery": lambda: closed_loop.of_gallery(size, 1),
            "observed": lambda: closed_loop.among(size, 1),
            "town": lambda: closed_loop.of_town(1),
            "listed": lambda: map(as_list, closed_loop.among(size, 1)),
        }
        (one,) = islice(of[kind](), 1)
        return lambda: closed_loop.drive(one, steps), steps

    return prepare


def as_list(crossing: Any) -> Any:
    """The crossing with the tracks as a list of obstacles, made once."""
    obstacles = list(crossing.around(crossing.start)[1].obstacles)
    return crossing._replace(around=lambda now: (obstacles, None))


def fleet(method: str, robots: int, steps: int, room: float) -> Scene:
    """The first steps of a fleet with `room` [m^2] for each robot."""

    def prepare() -> tuple[Callable[[], Any], int]:
        import pace

        import slalom

        scenario = pace.fleet(robots, steps * pace.DT, room)
        return lambda: pace.steps(scenario, slalom.method(method)), robots * steps

    return prepare


def of_gallery(name: str, robots: int, steps: int) -> Scene:
    """The first steps of the robots of a scenario of the gallery."""

    def prepare() -> tuple[Callable[[], Any], int]:
        import slalom
        from slalom.sim import gallery, simulate

        scenario = replace(gallery.build(name, {"robots": robots}), duration=0.1 * steps)
        return lambda: simulate(scenario, slalom.method("nao")), robots * steps

    return prepare


def filtered() -> tuple[Callable[[], Any], int]:
    """One action at the largest acceleration through the safety filter."""
    import numpy as np

    from slalom.adapters.gym import RobotEnv, SafetyFilter

    env = SafetyFilter(RobotEnv("roundabout_crossing"))
    env.reset(seed=0, options={"scenario_seed": 0})
    return lambda: env.step(np.array([1.0, 0.0], np.float32)), 1


def vehicle() -> tuple[Callable[[], Any], int]:
    """One decision of a drive in a hall of six people."""
    import numpy as np

    import slalom
    from slalom.vehicle import DifferentialDrive, Pose, VehicleNavigator

    corners = [(0.0, 0.0), (12.0, 0.0), (12.0, 8.0), (0.0, 8.0), (0.0, 0.0)]
    hall = slalom.ObstacleTable([slalom.Obstacle(slalom.Polyline(corners), slalom.Stationary((0.0, 0.0)))])
    drive = DifferentialDrive(0.4, 1.2, 3.0, max_speed=1.0, lag=0.15)
    robot = VehicleNavigator(drive, slalom.method("nao"), slalom.Disc(0.3), horizon=3.0)
    rng = np.random.default_rng(0)
    people = slalom.Tracks(rng.uniform((3.0, 1.0), (11.0, 7.0), (6, 2)), rng.uniform(-0.8, 0.8, (6, 2)), 0.3)
    goal = slalom.PathGoal([(1.0, 4.0), (11.0, 4.0)], tolerance=0.2)
    return lambda: robot.decide(Pose((1.0, 4.0), 0.0), [hall, people], goal), 1


SHORT: dict[str, Scene] = {
    "roundabout": crossing("gallery", "roundabout_crossing", 12),
    "listed": crossing("listed", 30, 12),
    "fleet": fleet("nao", 8, 2, 9.0),
    "doorway": of_gallery("doorway", 8, 6),
    "filter": filtered,
    "vehicle": vehicle,
}
LONG: dict[str, Scene] = {
    "long_roundabout": crossing("gallery", "roundabout_crossing", 40),
    "recorded": crossing("gallery", "recorded_roundabout", 40),
    "observed_10": crossing("observed", 10, 40),
    "observed_40": crossing("observed", 40, 40),
    "town": crossing("town", None, 10),
    "fleet_300": fleet("nao", 300, 2, 100.0),
    "ring_50": of_gallery("ring", 50, 2),
}


# The file.


def expanded(file: Mapping[str, Any], scenes: Mapping[str, Scene]) -> dict[str, Any]:
    """The rows of some scenes in the form of tools/budget.toml: exact, and one entry for each rise."""
    raised = [
        {"what": what, "from": low, "to": high, "bought": entry.get("bought"), "removed": "-"}
        for entry in file.get("raised", [])
        for what, low, high in entry["rises"]
        if what.split(".")[0] in scenes
    ]
    return {"slack": 0, "raised": raised, **{name: file[name] for name in scenes if name in file}}


def renewed(file: Mapping[str, Any], found: Mapping[str, int]) -> dict[str, Any]:
    """The file with today's counts. All rises are one entry, whose reason is still empty."""
    histories = budget.rows(file)
    rises = []
    for name, count in found.items():
        history = histories.get(name, [count])
        if count > history[-1]:
            rises.append([name, history[-1], count])
            history = [*history, count]
        histories[name] = budget.lowered(history, count)
    raised = [*file.get("raised", []), *([{"bought": "", "rises": rises}] if rises else [])]
    sections: dict[str, Any] = {}
    for name, history in histories.items():
        scene, count = name.split(".")
        sections.setdefault(scene, {})[count] = history
    return {**sections, "raised": raised}


def written(file: Mapping[str, Any]) -> Iterator[str]:
    """The lines of the file."""
    yield "# Calls in all decisions of a scene, from the first to now. `python tools/counts.py --write` writes them."
    yield "# A commit that raises counts says in `bought` of its entry of [[raised]] what users get for it."
    for scene, rows in file.items():
        if scene != "raised":
            yield ""
            yield f"[{scene}]"
            yield from (f"{name} = {history}" for name, history in rows.items())
    for entry in file.get("raised", []):
        yield ""
        yield "[[raised]]"
        yield f"bought = {json.dumps(entry['bought'])}"
        yield "rises = ["
        yield from (f"    {json.dumps(rise)}," for rise in entry["rises"])
        yield "]"


def main() -> int:
    """Print every count by decision; 1 where one differs from the file, or rose without a reason."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--all", action="store_true", help="count the long scenes too")
    parser.add_argument("--write", action="store_true", help="write today's counts")
    parser.add_argument("--stages", action="store_true", help="print calls and times by stage, compare nothing")
    given = parser.parse_args()
    scenes = SHORT | (LONG if given.all else {})
    found: dict[str, int] = {}
    for scene, prepare in scenes.items():
        work, decisions = prepare()
        work()  # what is made once: modules, and pieces of tables
        if given.stages:
            print_stages(scene, work, decisions)
            continue
        some = calls(work)
        found |= {f"{scene}.{name}": count for name, count in some.items()}
        print(f"{scene}, by decision: " + ", ".join(f"{name} {n / decisions:.4g}" for name, n in some.items()))
    file = tomllib.loads(FILE.read_text()) if FILE.exists() else {}
    if given.stages:
        return 0
    if given.write:
        file = renewed(file, found)
        FILE.write_text("\n".join(written(file)) + "\n")
    mistakes = list(budget.breaches(expanded(file, scenes), found))
    print(*mistakes, sep="\n")
    return 1 if mistakes else 0


if __name__ == "__main__":
    if portable.is_set():
        sys.exit(main())
    sys.exit(portable.run(Path(__file__), sys.argv[1:], NUMBA_DISABLE_JIT="1", NUMBA_NUM_THREADS="1"))
