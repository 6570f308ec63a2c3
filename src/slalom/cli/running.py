"""`slalom run` and `slalom decide`."""

from pathlib import Path

from slalom.cli.console import (
    DONE,
    FAILED,
    Flag,
    Settings,
    answer,
    drawable,
    parse_settings,
    progress,
    writable,
    writing,
)
from slalom.report import run_text, shown

METHOD = "nao"


def run(
    scenario: str,
    /,
    *,
    settings: Settings = None,
    method: str = METHOD,
    seed: int = 0,
    out: Path | None = None,
    figure: Path | None = None,
    at: float | None = None,
    json: Flag = False,
) -> int:
    """Run a scenario and say how it went; exit code 1 if the robot collided or did not arrive.

    Parameters
    ----------
    scenario
        A name from `slalom list scenarios`, or a .yaml file.
    settings
        NAME=VALUE for parameters of the scenario or settings of every scenario; may be repeated.
    method
        A name from `slalom list methods`.
    seed
        What random scenarios are drawn with.
    out
        Write the recording to this HDF5 file.
    figure
        Draw a decision of the run to this .svg, .pdf or .png file.
    at
        Time [s] of the decision that is drawn; by default a tight one.
    json
        Print one JSON object.
    """
    from slalom.peers import contender
    from slalom.sim import load, simulate
    from slalom.sim.metrics import summary

    chosen, loaded = contender(method), load(scenario, parse_settings(settings), seed=seed)
    drawable(figure)
    writable(out)
    with progress("running") as advance:
        recording = simulate(loaded, chosen, seed=seed, progress=advance)
    result = summary(recording)
    if out is not None:
        with writing(out):
            recording.save(out)
    if figure is not None:
        from slalom import view
        from slalom.view.replay import replay

        with writing(figure):
            view.save(replay(recording, loaded, method, at), figure)
    answer(result, json, lambda: run_text(recording, result))
    return DONE if result["arrived"] == result["robots"] and not result["collisions"] else FAILED


def decide(
    scene: str,
    /,
    *,
    method: str = METHOD,
    json: Flag = False,
    figure: Path | None = None,
) -> int:
    """One decision at the beginning of a scenario; exit code 1 if no manoeuvre is safe.

    Parameters
    ----------
    scene
        A .yaml scenario file, or a name from `slalom list scenarios`.
    method
        A name from `slalom list methods`.
    json
        Print one JSON object.
    figure
        Draw the decision to this .svg, .pdf or .png file.
    """
    import numpy as np

    from slalom.control_obstacle import ControlObstacle
    from slalom.methods import method as method_of
    from slalom.sim import load
    from slalom.sim.metrics import finite

    loaded = load(scene)
    drawable(figure)
    navigator, robot = loaded.navigator(method_of(method)), loaded.robot
    decision = navigator.decide(robot.state, loaded.obstacles, robot.goal, now=loaded.start)
    manoeuvre, blocked = decision.manoeuvre, decision.blocked
    bare = ControlObstacle(manoeuvre.response, robot.state, blocked.traffic, robot.shape)
    result = {
        "scenario": loaded.name,
        "method": method,
        "response": repr(manoeuvre.response),
        "control": [float(x) for x in manoeuvre.control],
        "acceleration": [float(x) for x in manoeuvre.mean_acceleration(loaded.start, navigator.period)],
        "status": decision.outcome.name,
        "sentence": decision.outcome.value,
        "clearance": finite(float(bare.clearance(np.array(manoeuvre.control)))),
        "preferred": [float(x) for x in decision.preferred],
        "time_to_collision": finite(float(bare.time_to_collision(decision.preferred))),
    }
    if figure is not None:
        from slalom import view

        with writing(figure):
            view.save(view.decision(decision, navigator, robot.goal, title=loaded.name), figure)
    answer(result, json, lambda: "\n".join(f"{k:18} {shown(v)}" for k, v in result.items()))
    return DONE if decision.outcome.safe else FAILED
