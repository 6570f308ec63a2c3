"""Findings of the claim `smoothness` as text and tables: acceleration and jerk."""

from collections.abc import Sequence

from slalom.paper.prose import Result, paragraph, table


def smoothness(result: Result) -> list[str]:
    """Render the findings of claim `smoothness`: acceleration and jerk."""
    head = [
        "method",
        "replan, s",
        "collided",
        "arrived",
        "time, s",
        "adjustments",
        "mean acc.",
        "mean jerk",
        "max jerk",
    ]
    lines = [
        [
            f"`{row['method']}`",
            f"{row['replan']:g}",
            str(row["runs_with_collision"]),
            str(row["runs_that_arrived"]),
            f"{row['time']:.1f}",
            f"{row['adjustments']:.1f}",
            f"{row['mean_acceleration']:.2f}",
            f"{row['mean_jerk']:.2f}",
            f"{row['max_jerk']:.1f}",
        ]
        for row in [*result["rows"]]
    ]
    return [
        paragraph(
            f"`roundabout_crossing`, {result['seeds']} seeds, steps of 0.1 s; jerk is the change of the applied "
            "acceleration from one step to the next over 0.1 s. Means over the runs, in m/s² and m/s³:"
        ),
        table(
            [*head, "heading change, rad"], [[*a, f"{r['heading_change']:.1f}"] for a, r in zip(lines, result["rows"])]
        ),
        paragraph(
            f"{_compared(result['rows'])} {_effects(result['rows'])} Motion is smooth if a free control is kept, "
            "which NAO permits for the longest time. Compare the mean jerk of the paper's controller, kept, in the "
            "claim `sweep`."
        ),
    ]


def _compared(rows: Sequence[Result]) -> str:
    """Return sentences with the mean acceleration and jerk of each method, one per interval."""
    sentences = []
    for replan in sorted({row["replan"] for row in rows}):
        means = [
            f"{row['method'].upper()} {row['mean_acceleration']:.2f} m/s² and {row['mean_jerk']:.1f} m/s³"
            for row in rows
            if row["replan"] == replan
        ]
        sentences.append(f"Mean acceleration and jerk with a decision every {replan:g} s: {'; '.join(means)}.")
    return " ".join(sentences)


def _effects(rows: Sequence[Result]) -> str:
    """State how much the kind of control and the forecast change mean jerk and mean acceleration.

    Each is compared at the same interval, the kind of control with the same forecast, the forecast with the same kind.
    """
    found = {(row["method"], row["replan"]): row for row in rows}
    of_control, of_forecast = (("ao", "vo"), ("nao", "nlvo")), (("nlvo", "vo"), ("nao", "ao"))

    def shares(pairs: Sequence[tuple[str, str]], measure: str) -> list[float]:
        return [
            found[one, replan][measure] / found[other, replan][measure]
            for one, other in pairs
            for replan in sorted({row["replan"] for row in rows})
            if {(one, replan), (other, replan)} <= found.keys()
        ]

    control = shares(of_control, "mean_jerk")
    forecast = shares(of_forecast, "mean_jerk")
    acceleration = shares(of_control, "mean_acceleration")
    if not (control and forecast):
        return ""
    if max(control) < 1.0:
        jerk = "In these runs the mean jerk is lower if accelerations are chosen."
    else:
        jerk = "**Correction:** the mean jerk is not always lower if accelerations are chosen."
    larger = " Known trajectories have the larger effect." if max(forecast) < min(control) else ""
    mean = "" if max(acceleration) < 1.0 else " **Correction:** the mean acceleration is not always lower."
    return (
        f"{jerk} With the same forecast, AO and NAO have {_range(control)} of the mean jerk of VO and NLVO. With the "
        f"same kind of control, NLVO and NAO have {_range(forecast)} of that of VO and AO.{larger}{mean} AO and NAO "
        f"have {_range(acceleration)} of the mean acceleration of VO and NLVO."
    )


def _range(shares: Sequence[float]) -> str:
    """Format the range of shares in percent."""
    return f"{100.0 * min(shares):.0f} to {100.0 * max(shares):.0f} %"
