"""Results as text for a terminal."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from slalom.sim import Recording

LEVELS: Final = {
    "recorded": "the futures of all are known, also of who will appear",
    "present": "the futures of those who are there are known",
    "observed": "nothing is known but what was seen until then",
    "published": "robots know the manoeuvres that others are committed to",
}
"""What the levels of foresight are, in results."""
FORESEEN: Final = {
    "recorded": "The futures of all are known, also of who will appear.",
    "present": "The futures of those who are there are known.",
    "observed": "What was seen until now is known; accelerations are taken to last a second.",
    "observed_velocity": "What was seen until now is known; velocities are taken to last.",
    "observed_turn": "What was seen until now is known; speeds and rates of turning are taken to last.",
}
"""What the names of `forecast.FORESIGHTS` mean, for METHOD@FORESIGHT."""

COLUMNS: Final = (
    "scenario",
    "method",
    "foresight",
    "runs",
    "with a collision",
    "all arrived",
    "success",
    "last arrival s",
    "extra time s",
    "efficacy",
    "least clearance m",
)
"""Of the table of a page."""


def shown(value: Any) -> str:
    """A value as a person reads it: four digits, vectors in brackets."""
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return "(" + ", ".join(shown(x) for x in value) + ")"
    return "none" if value is None else str(value)


def run_text(recording: "Recording", result: dict[str, Any]) -> str:
    """How a run went."""
    from slalom.sim.measure.metrics import METRICS

    arrived = "arrived" if result["arrived"] == result["robots"] else "did not arrive"
    hits = "no collision" if not result["collisions"] else f"{result['collisions']} obstacles hit"
    spent, statuses = result["decision_us"], ", ".join(f"{k.lower()} {v}" for k, v in result["statuses"].items())
    lines = [
        f"{result['scenario']} with {result['method']}, seed {result['seed']}: {arrived}, {hits}",
        f"  foresight          {_foresight(result)}",
        f"  time               {result['time']:.1f} s",
        f"  least clearance    {shown(result['min_clearance'])} m",
        f"  adjustments        {result['adjustments']}",
        f"  path length        {METRICS['path_length'](recording):.1f} m",
        f"  largest speed      {METRICS['max_speed'](recording):.2f} m/s",
        f"  largest accel.     {METRICS['max_acceleration'](recording):.2f} m/s^2",
        f"  decision time      {spent['p50'] / 1e3:.1f} ms (99 %: {spent['p99'] / 1e3:.1f} ms)",
        f"  decisions          {statuses or 'none'}",
    ]
    return "\n".join(lines)


def _foresight(result: dict[str, Any]) -> str:
    level = result["foresight"] or "not said"
    return f"{level}: {LEVELS[level]}" if level in LEVELS else level


def list_text(result: dict[str, Any]) -> str:
    """Scenarios, methods, levels of foresight, formats, and figures and claims of the paper, one or two lines each."""
    lines = []
    for what, entries in result.items():
        lines.append(f"{what}:")
        for name, entry in entries.items():
            lines.append(f"  {name:22} {entry['sentence']}")
            if "source" in entry:
                lines.append(f"  {'':22} {entry['source']}; foresight: {entry['foresight']}")
            elif entry.get("parameters"):
                parameters = ", ".join(f"{k}={v:g}" for k, v in entry["parameters"].items())
                lines.append(f"  {'':22} --set {parameters}")
    return "\n".join(lines)


def files_text(result: dict[str, Any]) -> str:
    """What was reproduced, one file a line."""
    return "\n".join([f"figures and claims: {len(result['entries'])}, seeds: {result['seeds']}", *result["files"]])


def table_text(result: dict[str, Any]) -> str:
    """A comparison in one scenario as a table, one method a row, and below it the runs that have no result."""
    width = max(8, *(len(name) + 1 for name in result["methods"]))
    lines = [
        f"{_scene(result)}, {result['seeds']} seeds",
        f"{'method':{width}}{'foresight':>10}{'collided':>10}{'arrived':>10}{'time s':>10}{'adjustm.':>10}"
        f"{'clearance m':>14}",
    ]
    for name, row in result["methods"].items():
        if row["runs"]:
            counts = f"{row['foresight']:>10}{row['runs_with_collision']:>10}{row['runs_all_arrived']:>10}"
            lines.append(
                f"{name:{width}}{counts}{_number(row['time'], 2):>10}{row['adjustments']:>10.1f}"
                f"{_number(row['min_clearance'], 3):>14}"
            )
        else:
            lines.append(f"{name:{width}}{'-':>10}{'-':>10}{'-':>10}{'-':>10}{'-':>10}{'-':>14}")
    for name, row in result["methods"].items():
        lines += [f"{name}: {why}" for why in _failures(row, result["seeds"])]
    return "\n".join(lines)


def page_text(
    tables: Sequence[dict[str, Any]],
    title: str,
    text: str,
    command: str,
    versions: dict[str, str],
    left_out: Sequence[str] = (),
) -> str:
    """Comparisons as a Markdown page: the command that made it, and one table with confidence intervals.

    `left_out` are the files of test cases that were not there.
    """
    made_with = ", ".join(f"{name} {version}" for name, version in versions.items())
    lines = [
        f"# {title or 'Comparison'}",
        "",
        *([text, ""] if text else []),
        f"Made by `{command}` with {made_with}.",
        "",
        "A collision is a clearance below -1 mm in continuous time. Success: all arrived and nobody collided. Last "
        "arrival: the mean over the runs in which all arrived. Extra time: what robots that arrived took longer than "
        "the straight way takes at top speed, at 50, 75 and 90 % of them. Efficacy: how fast robots came nearer to "
        "their goals, as a share of top speed, mean. In brackets 95 % confidence intervals, Wilson's for shares and "
        "Student's for means. Foresight: what is known of obstacles and, where several robots meet, of each other.",
        "",
        *([_without(left_out), ""] if left_out else []),
        f"| {' | '.join(COLUMNS)} |",
        "|---" * len(COLUMNS) + "|",
    ]
    for table in tables:
        for name, row in table["methods"].items():
            cells = [
                _scene(table),
                name,
                row["foresight"] or "-",
                "; ".join([str(row["runs"]), *_failures(row, table["seeds"])]),
                _share(row, "runs_with_collision"),
                _share(row, "runs_all_arrived"),
                _share(row, "runs_successful"),
                _mean(row),
                ", ".join(_number(x, 2) for x in row["extra_time"] or [None]),
                _number(row["efficacy"], 2),
                _number(row["min_clearance"], 3),
            ]
            lines.append("| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def _without(left_out: Sequence[str]) -> str:
    """A sentence about files of test cases that were not there."""
    files = ", ".join(f"`{name}`" for name in left_out)
    return f"Left out, as the files of their test cases were not there when this page was made: the rows of {files}."


def _scene(result: dict[str, Any]) -> str:
    """A scenario with its settings; of a file of test cases only its name, wherever it is."""
    settings = ", ".join(f"{name}={value:g}" for name, value in result["settings"].items())
    scenario = str(result["scenario"])
    return f"{Path(scenario).name if scenario.endswith('.csv') else scenario} {settings}".rstrip()


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


def _share(row: dict[str, Any], what: str) -> str:
    """A count and the interval of its share."""
    if not row["runs"]:
        return "-"
    low, high = row[f"{what}_interval"]
    return f"{row[what]} ({100 * low:.0f}-{100 * high:.0f} %)"


def _mean(row: dict[str, Any]) -> str:
    """The mean time and its interval."""
    spread = row["time_interval"]
    return _number(row["time"], 1) + (f" ({spread[0]:.1f}-{spread[1]:.1f})" if spread else "")


def _failures(row: dict[str, Any], seeds: int) -> list[str]:
    """Why runs have no result, and which."""
    said = []
    for failure in row["failures"]:
        which, many = failure["seeds"], len(failure["seeds"])
        listed = ", ".join(str(seed) for seed in which[:6]) + (", ..." if many > 6 else "")
        said.append(
            ("none ran" if many == seeds else f"{many} did not run (seeds {listed})") + f": {failure['reason']}"
        )
    return said
