"""Results as text for a terminal."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from slalom.sim import Recording


def shown(value: Any) -> str:
    """A value as a person reads it: four digits, vectors in brackets."""
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return "(" + ", ".join(shown(x) for x in value) + ")"
    return "none" if value is None else str(value)


def run_text(recording: "Recording", result: dict[str, Any]) -> str:
    """How a run went."""
    from slalom.sim.metrics import METRICS

    arrived = "arrived" if result["arrived"] == result["robots"] else "did not arrive"
    hits = "no collision" if not result["collisions"] else f"{result['collisions']} obstacles hit"
    spent, statuses = result["decision_us"], ", ".join(f"{k.lower()} {v}" for k, v in result["statuses"].items())
    lines = [
        f"{result['scenario']} with {result['method']}, seed {result['seed']}: {arrived}, {hits}",
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


def list_text(result: dict[str, Any]) -> str:
    """Scenarios, methods, and figures and claims of the paper, one or two lines each."""
    lines = []
    for what, entries in result.items():
        lines.append(f"{what}:")
        for name, entry in entries.items():
            lines.append(f"  {name:22} {entry['sentence']}")
            if "source" in entry:
                lines.append(f"  {'':22} {entry['source']}")
            elif entry.get("parameters"):
                parameters = ", ".join(f"{k}={v:g}" for k, v in entry["parameters"].items())
                lines.append(f"  {'':22} --set {parameters}")
    return "\n".join(lines)


def files_text(result: dict[str, Any]) -> str:
    """What was reproduced, one file a line."""
    return "\n".join([f"figures and claims: {len(result['entries'])}, seeds: {result['seeds']}", *result["files"]])


def table_text(result: dict[str, Any]) -> str:
    """A comparison as a table, one method a row."""
    width = max(8, *(len(name) + 1 for name in result["methods"]))
    lines = [
        f"{result['scenario']}, {result['seeds']} seeds",
        f"{'method':{width}}{'collided':>10}{'arrived':>10}{'time s':>10}{'adjustm.':>10}{'clearance m':>14}",
    ]
    for name, row in result["methods"].items():
        time = "-" if row["time"] is None else f"{row['time']:.2f}"
        clearance = "-" if row["min_clearance"] is None else f"{row['min_clearance']:.3f}"
        counts = f"{row['runs_with_collision']:>10}{row['runs_all_arrived']:>10}"
        lines.append(f"{name:{width}}{counts}{time:>10}{row['adjustments']:>10.1f}{clearance:>14}")
    return "\n".join(lines)
