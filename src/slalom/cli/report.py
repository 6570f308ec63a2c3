"""Results as text for a terminal, and the Markdown page of a comparison."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

from slalom.sim.sweep.tables import count, decimal, failures, metric_text, printed, scenario_text, yes

if TYPE_CHECKING:
    from slalom.sim import Recording

LEVEL_SENTENCES: Final = {
    "recorded": "future motion of all obstacles known, including later ones",
    "present": "future motion of the obstacles present now known",
    "observed": "only past and present motion known",
    "published": "committed manoeuvres of the other robots known",
}
"""Descriptions of the levels of foresight, in results."""
FORESIGHT_SENTENCES: Final = {
    "recorded": "The future motion of all obstacles is known, including obstacles that appear later.",
    "present": "The future motion of the obstacles present now is known.",
    "observed": "Only past motion is known; several motion models and similar motions of others continue it.",
    "observed_velocity": "Only past motion is known; predictions hold the velocity.",
    "observed_turn": "Only past motion is known; predictions hold the speed and the rate of turn.",
}
"""Descriptions of the names of `forecast.FORESIGHTS`, for METHOD@FORESIGHT."""

CONSTANTS: Final = {
    "ADJUSTMENT": "m/s^2",
    "STALLED_SPEED": "m/s",
    "PROGRESS_DISTANCE": "m",
    "PROGRESS_TIME": "s",
    "PERSONAL_SPACE": "m",
}
"""Units of the constants in the docstrings and formulas of metrics."""


def with_values(text: str) -> str:
    """Return the description of a metric with values and units in place of the names of constants."""
    from slalom.sim.measure import metrics

    for name, unit in CONSTANTS.items():
        text = text.replace(name, f"{getattr(metrics, name):g} {unit}")
    return text


def formatted(value: Any) -> str:
    """Format a value for reading: four digits, vectors in parentheses."""
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list) and value:
        return "(" + ", ".join(formatted(x) for x in value) + ")"
    return "none" if value is None or value == [] else str(value)


def counted(number: int, noun: str) -> str:
    """Return a number with its noun: 1 robot, 2 robots."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def milliseconds(microseconds: float) -> str:
    """Format a time [us] in milliseconds: one decimal place, or two digits below 0.1 ms."""
    value = microseconds / 1e3
    return f"{value:.2g} ms" if 0.0 < value < 0.1 else f"{value:.1f} ms"


def run_text(recording: "Recording", result: dict[str, Any]) -> str:
    """Format the result of a run."""
    from slalom.sim.measure.metrics import max_acceleration, max_speed, path_length

    each = [recording.only(k) for k, t in enumerate(recording.appeared.tolist()) if t < float("inf")] or [recording]
    late = _appearances(recording)
    paths = [path_length(one) for one in each]
    robots, there = result["robots"], result["arrived"]
    arrived = "arrived" if there == robots else f"{there} of {robots} arrived" if robots > 1 else "did not arrive"
    collisions = counted(result["collisions"], "collision") if result["collisions"] else "no collision"
    clearance = result["min_clearance"]
    decision_time, statuses = (
        result["decision_us"],
        ", ".join(f"{k.lower()} {v}" for k, v in result["statuses"].items()),
    )
    lines = [
        f"{result['scenario']} with {result['method']}, seed {result['seed']}: {arrived}, {collisions}",
        f"  foresight          {_foresight(result)}",
        f"  time               {result['time']:.1f} s",
        *([f"  appearance         {late}"] if late else []),
        f"  least clearance    {'none' if clearance is None else f'{formatted(clearance)} m'}",
        f"  adjustments        {result['adjustments']}",
        f"  jerk               {result['jerk']:.2f} m/s^3{' (mean of the robots)' if len(each) > 1 else ''}",
        f"  path length        {sum(paths) / len(paths):.1f} m{' (mean of the robots)' if len(paths) > 1 else ''}",
        f"  largest speed      {max(max_speed(one) for one in each):.2f} m/s",
        f"  largest accel.     {max(max_acceleration(one) for one in each):.2f} m/s^2",
        *_task_lines(result.get("tasks")),
        f"  decision time      {milliseconds(decision_time['p50'])} (99 %: {milliseconds(decision_time['p99'])})",
        f"  decisions          {statuses or 'none'}",
    ]
    return "\n".join(lines)


def _task_lines(figures: dict[str, float] | None) -> list[str]:
    """Return the lines of a run with tasks."""
    if figures is None:
        return []
    done = f"{figures['tasks_done']:.0f} of {figures['tasks']:.0f} done, {figures['tasks_per_hour']:.0f} an hour"
    p50, p99, longest = (figures[f"waiting_{name}"] for name in ("50", "99", "longest"))
    waits = f"{p50:.1f} s (99 %: {p99:.1f} s, longest {longest:.1f} s)"
    way = f"{formatted(figures['way_over_free'])} times the shortest; efficiency {figures['efficiency']:.2f}"
    return [f"  tasks              {done}", f"  waiting            {waits}", f"  way for tasks      {way}"]


def _appearances(recording: "Recording") -> str:
    """Return how many robots appeared after the start, waited for their place, and did not appear; "" for none."""
    if not len(recording.appears):
        return ""
    waits = (recording.appeared - recording.appears).tolist()
    # Robots appear at decisions: less than the time between these is no waiting.
    shortest = max(recording.dt, recording.settings.get("replan", 0.0))
    late = [wait for wait in waits if shortest < wait < float("inf")]
    missing, later = waits.count(float("inf")), int((recording.appears > recording.times[0]).sum())
    parts = [f"{later} after the start"] if later else []
    parts += [f"{len(late)} waited for their place, at most {max(late):.1f} s"] if late else []
    return ", ".join([*parts, *([f"{missing} did not appear"] if missing else [])])


def _foresight(result: dict[str, Any]) -> str:
    level = result["foresight"] or "not stated"
    return f"{level}: {LEVEL_SENTENCES[level]}" if level in LEVEL_SENTENCES else level


def list_text(result: dict[str, Any]) -> str:
    """Format scenarios, methods, foresights, formats, and figures and claims of the paper, one or two lines each."""
    lines = []
    for kind, entries in result.items():
        lines.append(f"{kind}:")
        for name, entry in entries.items():
            lines.append(f"  {name:22} {entry['sentence']}")
            if "source" in entry:
                lines.append(f"  {'':22} {entry['source']}; foresight: {entry['foresight']}")
            if entry.get("parameters"):
                first, between = (f"{name}:", ":") if "source" in entry else ("--set ", ", ")
                parameters = between.join(f"{k}={v:g}" for k, v in entry["parameters"].items())
                lines.append(f"  {'':22} {first}{parameters}")
    return "\n".join(lines)


def files_text(result: dict[str, Any]) -> str:
    """Format the list of files that `slalom reproduce` has written, one per line."""
    return "\n".join([f"figures and claims: {len(result['entries'])}, seeds: {result['seeds']}", *result["files"]])


def table_text(result: dict[str, Any]) -> str:
    """Format a comparison in one scenario as a table, one row per method, followed by the runs without a result."""
    width = max(8, *(len(name) + 1 for name in result["methods"]))
    lines = [
        f"{scenario_text(str(result['scenario']), result['settings'])}, {_runs_text(result)}",
        f"{'method':{width}}{'foresight':>10}{'guided':>8}{'collided':>10}{'arrived':>10}{'time s':>10}"
        f"{'adjustm.':>10}{'jerk m/s^3':>12}{'clearance m':>13}",
    ]
    for name, row in result["methods"].items():
        if row["runs"]:
            collided, arrived = (count(row, f"runs_{what}") for what in ("with_collision", "all_arrived"))
            counts = f"{row['foresight']:>10}{yes(row['guided']):>8}{collided:>10}{arrived:>10}"
            lines.append(
                f"{name:{width}}{counts}{decimal(row['time'], 2):>10}{row['adjustments']:>10.1f}"
                f"{decimal(row['jerk'], 2):>12}{decimal(row['min_clearance'], 3):>13}"
            )
        else:
            lines.append(f"{name:{width}}{'-':>10}{yes(row['guided']):>8}" + 4 * f"{'-':>10}" + f"{'-':>12}{'-':>13}")
    for name, row in result["methods"].items():
        lines += [f"{name}: {reason}" for reason in failures(result, row)]
        lines += [f"{name}: {metric} {metric_text(row, metric)}" for metric in row.get("metrics", ())]
    return "\n".join(lines)


def page_text(
    tables: Sequence[dict[str, Any]],
    title: str,
    text: str,
    command: str,
    versions: dict[str, str],
    left_out: Sequence[str] = (),
) -> str:
    """Format comparisons as a Markdown page: the command, and one table with confidence intervals.

    Args:
        tables: results of `compare_all`. title, text: heading and introduction.
        command: command line that made the page. versions: version by name of library or method.
        left_out: names of the missing files of test cases.
    """
    heads, *rows = printed(tables)
    made_with = ", ".join(f"{name} {version}" for name, version in versions.items())
    lines = [
        f"# {title or 'Comparison'}",
        "",
        *([text, ""] if text else []),
        f"Made by `{command}` with {made_with}.",
        "",
        "A collision is a clearance below -1 mm in continuous time. Success: all robots arrived and none collided. "
        "Last arrival: mean over the runs in which all robots arrived. Guided: guidance leads the robots of slalom's "
        "methods around obstacles at rest and past each other; it is off with the setting guided=0. "
        f"{with_values('Adjustments: changes of the acceleration by more than ADJUSTMENT')} from one step to the next, "
        "of all robots; mean over the runs. Jerk: mean of |change of the acceleration| / dt over the steps, the robots "
        "and the runs; the acceleration is constant during a step. Extra time: travel time of arrived robots minus "
        "the time of the straight path at maximum speed; quantiles 50, 75 and 90 %. Efficacy: mean rate of approach to "
        "the goal, as a share of the maximum speed. In parentheses: 95 % confidence intervals, Wilson's for shares and "
        "Student's for means; none where all seeds give the same run. Foresight: knowledge of obstacles and, with "
        "several robots, of the other robots.",
        "",
        *([_omission_sentence(left_out), ""] if left_out else []),
        f"| {' | '.join(heads)} |",
        "|---" * len(heads) + "|",
    ]
    for row in rows:
        lines.append("| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in row) + " |")
    return "\n".join(lines) + "\n"


def _omission_sentence(left_out: Sequence[str]) -> str:
    """Return a sentence about the missing files of test cases."""
    files = ", ".join(f"`{name}`" for name in left_out)
    return f"Left out, because the files of test cases were missing when this page was made: the rows of {files}."


def _runs_text(table: dict[str, Any]) -> str:
    """Return the number of seeds, or that all give the same run."""
    return "deterministic: 1 run" if table["deterministic"] else counted(table["seeds"], "seed")
