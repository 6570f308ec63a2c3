"""Findings of each claim as text and tables, with corrections of the paper's statements."""

from collections.abc import Callable, Sequence
from typing import Final

from slalom.paper.findings_oscillation import oscillation
from slalom.paper.findings_smooth import smoothness
from slalom.paper.prose import Result, count_and_share, paragraph, table


def curves(result: Result) -> list[str]:
    """Render the findings of claim `curves`: alarms on curved roads."""
    rows = []
    for row in result["tables"]:
        first, second = (name.upper() for name in row["methods"])
        counts = row["all"]
        rows.append(
            [
                f"{first}, {second}",
                row["side"],
                f"{row['horizon']:g}",
                count_and_share(counts["first"], counts["cases"]),
                count_and_share(counts["second"], counts["cases"]),
                str(counts["only_first"]),
                str(counts["only_second"]),
            ]
        )
    head = ["question", "lane of the car", "horizon, s", "first alarms", "second alarms", "only first", "only second"]
    inner = [row for row in result["tables"] if row["side"] == "inner"]
    outer = [row for row in result["tables"] if row["side"] == "outer"]
    radii = [f"{r:g} m" for r in result["radii"]]
    return [
        paragraph(
            f"The robot (radius {result['robot_radius']:g} m) drives on a circle of {', '.join(radii)}. Its speed is "
            f"{', '.join(f'{v:g}' for v in result['speeds'])} m/s. One car (radius {result['car_radius']:g} m) drives "
            f"in the next lane, {result['lane']:g} m farther in or out. Its speed is "
            f"{', '.join(f'{q:g}' for q in result['ratios'])} times that of the robot, and it is "
            f"{min(result['ahead']):g} to {max(result['ahead']):g} m ahead."
        ),
        table(head, rows),
        "Alarms for a car in the inner lane, by the radius of the robot's lane (VO and AO; NLVO and NAO in "
        "parentheses):",
        table(
            ["question", "horizon, s", *radii],
            [
                [
                    ", ".join(name.upper() for name in row["methods"]),
                    f"{row['horizon']:g}",
                    *(f"{c['first']} ({c['second']}) of {c['cases']}" for c in row["by_radius"].values()),
                ]
                for row in inner
            ],
        ),
        paragraph(
            f"A car in the inner lane: NLVO and NAO raise {sum(r['all']['second'] for r in inner)} alarms in "
            f"{sum(r['all']['cases'] for r in inner)} cases, VO and AO {sum(r['all']['first'] for r in inner)}. All "
            "are for cars whose straight line or parabola leaves the lane towards the robot. The claim holds. "
            "**Correction:** it holds only for cars in the inner lane. For a car in the outer lane NLVO and NAO "
            f"raise {sum(r['all']['second'] for r in outer)} alarms, more than VO and AO with "
            f"{sum(r['all']['first'] for r in outer)}. They use the car's lane, but assume that the robot holds its "
            "velocity or acceleration and thereby leaves its own lane outwards. That motion would collide, but a "
            "robot that follows the road does not execute it."
        ),
    ]


def crossing(result: Result) -> list[str]:
    """Render the findings of claim `crossing`: one constant acceleration."""
    seeds = result["seeds"]
    first = result["tables"][0]
    limits = list(first["anything_is_free"])
    rows = [
        [f"{t['lane_speed']:g}", entry, *(count_and_share(t["crossing_exists"][entry][a], seeds) for a in limits)]
        for t in result["tables"]
        for entry in t["crossing_exists"]
    ]
    shares = [
        100.0 * share
        for t in result["tables"]
        for shares_by_limit in t["share_of_crossings_free"].values()
        for share in shares_by_limit.values()
    ]
    held = [
        [f"{t['lane_speed']:g}", *(count_and_share(t["anything_is_free"][a], seeds) for a in limits)]
        + [count_and_share(t["held_first_choice_collides"][m], seeds) for m in ("nao", "ao")]
        for t in result["tables"]
    ]
    largest_limit = max(limits, key=float)
    collisions = sum(t["held_first_choice_collides"]["ao"] for t in result["tables"])
    return [
        paragraph(
            f"30 cars on circles of 12, 16 and 20 m at 5, 6.5 and 8 m/s times the lane speed, {seeds} random starts; "
            "robot from (-26 m, 0) towards the centre. An acceleration crosses under three conditions. The robot "
            "enters the circle of 26 m at once, leaves it within 45 degrees of straight ahead, and has no collision "
            f"for {result['horizon']:g} s. The search uses a grid of {result['step']:g} m/s². "
            "If the grid contains none, "
            "exact selection nearest to crossings 1 m/s² apart is added. The counts are lower bounds. Starts for "
            "which one was found, by the acceleration limit:"
        ),
        table(["lane speed", "entry speed, m/s", *(f"{a} m/s²" for a in limits)], rows),
        paragraph(
            f"Of all accelerations that cross an empty roundabout, {min(shares):.1f} to {max(shares):.1f} % are free "
            "on average. **Correction:** one constant acceleration crosses for many starts, but not for all. Its "
            "existence depends on the start, the entry speed and the limit. The next table counts starts with any "
            "free constant acceleration, found exactly (the robot may also turn back or leave on any side). The "
            "first choice is the free acceleration nearest to the preferred one. The table also counts its collisions "
            f"if it is held for {result['horizon']:g} s at 5 m/s and {largest_limit} m/s²:"
        ),
        table(
            [
                "lane speed",
                *(f"any free, {a} m/s²" for a in limits),
                "first NAO choice collides",
                "first AO choice collides",
            ],
            held,
        ),
        paragraph(
            "An acceleration outside the NAO at the start stays free to the horizon. One decision is therefore "
            "sufficient if a crossing exists. Held choices from the AO map collide in "
            f"{count_and_share(collisions, seeds * len(held))} cases."
        ),
    ]


def sweep(result: Result) -> list[str]:
    """Render the findings of claim `sweep`: NAO against AO."""
    rows, seeds = result["rows"], result["seeds"]
    replans = sorted({row["replan"] for row in rows})
    keys = list(dict.fromkeys((r["keep"], r["neighbours"], r["lane_speed"], r["method"]) for r in rows))
    found = {(r["keep"], r["neighbours"], r["lane_speed"], r["method"], r["replan"]): r for r in rows}
    lines = [
        ["kept" if keep else "chosen again", str(count or "all"), f"{speed:g}", f"`{method}`"]
        + [
            f"{found[keep, count, speed, method, t]['runs_with_collision']} / "
            f"{found[keep, count, speed, method, t]['adjustments']:.1f}"
            for t in replans
        ]
        for keep, count, speed, method in sorted(keys, key=lambda k: (not k[0], k[1], k[2], k[3] == "ao"))
    ]
    return [
        paragraph(
            f"The roundabout of the last claim, {seeds} seeds in each cell. The robot has 5 m/s, at most 4 m/s², no "
            "speed limit, a horizon of 6 s and a margin of 0.05 m. The preferred acceleration turns the "
            "velocity to 8 m/s "
            "towards the far side within 1 s. Control `kept`: the present acceleration is kept while it is free. "
            "Control `chosen again`: the free acceleration nearest to the preferred one is chosen at every decision. "
            "If none is free, the one with the latest collision is taken. A run ends 26 m from the centre, or after "
            "20 s. Separate code finds collisions in continuous time. Runs with a collision / adjustments per run, "
            "by the replan interval:"
        ),
        table(["control", "cars considered", "lane speed", "method", *(f"{t:g} s" for t in replans)], lines),
        *_sweep_details(result),
    ]


def _sweep_details(result: Result) -> list[str]:
    """Render more columns of the rows with all cars at lane speed 1, the variants, and the conclusions."""
    rows, seeds = result["rows"], result["seeds"]

    def line(row: Result, first: Sequence[str]) -> list[str]:
        time = "-" if row["time"] is None else f"{row['time']:.1f}"
        return [
            *first,
            f"{row['runs_with_collision']}",
            f"{row['adjustments_per_second']:.2f}",
            f"{100.0 * row['without_free_control']:.1f}",
            f"{row['left_the_ring']}",
            f"{row['far_side']}",
            time,
            f"{row['mean_acceleration']:.2f}",
            f"{row['mean_jerk']:.2f}",
        ]

    head = ["collided", "adjustments/s", "none free, %", "left", "far side", "time, s", "mean acc.", "mean jerk"]
    all_cars_slow = [row for row in rows if row["neighbours"] == 0 and row["lane_speed"] == 1.0]
    control = {True: "kept", False: "chosen again"}
    all_cars = [row for row in rows if row["neighbours"] == 0]
    nearest_cars = [row for row in rows if row["neighbours"]]

    def count(part: Sequence[Result], method: str) -> str:
        selected = [row for row in part if row["method"] == method]
        return count_and_share(
            sum(row["runs_with_collision"] for row in selected), sum(row["runs"] for row in selected)
        )

    text = [
        f"Further columns of the rows with all cars at lane speed 1 ({seeds} runs each; m/s² and m/s³):",
        table(
            ["control", "method", "replan, s", *head],
            [line(row, [control[row["keep"]], f"`{row['method']}`", f"{row['replan']:g}"]) for row in all_cars_slow],
        ),
        f"Other horizons and limits, kept, all cars, replan 0.5 s, {result['sensitivity_seeds']} runs each:",
        table(
            ["method", "horizon, s", "limit, m/s²", *head],
            [
                line(row, [f"`{row['method']}`", f"{row['horizon']:g}", f"{row['max_acceleration']:g}"])
                for row in result["sensitivity"]
            ],
        ),
        "These are sums over all intervals, speeds and both controls. With all cars considered, NAO collides in "
        f"{count(all_cars, 'nao')} runs. AO collides in {count(all_cars, 'ao')}. **Corrections:** AO collides if its "
        "forecast becomes wrong before the next decision, that is, at long intervals or on fast lanes. "
        + _collisions_at_shortest_interval(all_cars)
        + " The lower number of adjustments results from keeping a free acceleration together with a forecast that "
        "stays correct. A robot that chooses again at every decision adjusts often with both methods.",
    ]
    if nearest_cars:
        text.append(
            f"A robot that considers only the nearest 5 cars collides in {count(nearest_cars, 'nao')} runs with "
            f"NAO. With AO it collides in {count(nearest_cars, 'ao')}. Collisions of a robot that avoids "
            "only the nearest "
            "vehicles, as in the paper, are therefore weak evidence about AO."
        )
    return [part if part.startswith("|") else paragraph(part) for part in text]


def _collisions_at_shortest_interval(rows: Sequence[Result]) -> str:
    """Return a sentence about the collisions of AO at the shortest interval and lane speed 1."""
    slow = [row for row in rows if row["method"] == "ao" and row["lane_speed"] == 1.0]
    shortest = min(row["replan"] for row in slow)
    collisions = sum(row["runs_with_collision"] for row in slow if row["replan"] == shortest)
    runs = sum(row["runs"] for row in slow if row["replan"] == shortest)
    return (
        f"With a decision every {shortest:g} s and exact accelerations at lane speed 1 it collides in "
        f"{count_and_share(collisions, runs)} runs."
    )


def cone(result: Result) -> list[str]:
    """Render the findings of claim `cone`: the straight cone."""
    rows = [
        [
            f"({row['relative_velocity'][0]:g}, {row['relative_velocity'][1]:g})",
            str(row["points"]),
            str(row["in_ao"]),
            str(row["in_cone"]),
            str(row["judged_differently"]),
        ]
        for row in result["rows"]
    ]
    return [
        paragraph(
            f"Obstacle of the figure `ao_cone` (radius {result['radius']:g} m), horizon {result['horizon']:g} s, seed "
            f"{result['seed']}. Accelerations are uniform in (-3, 8) x (-3, 6) m/s², without the tip that the horizon "
            "cuts off:"
        ),
        table(["w, m/s", "accelerations", "in the AO", "in the cone", "judged differently"], rows),
        paragraph(
            "The claim holds. The paper does not define the sign of the relative velocity. Erratum 6: w = v_A - v_B. "
            "The AO reaches the acceleration of the obstacle from the side of -w. Let w be parallel to the line to "
            "the obstacle. The centres of the elements still lie on a ray, but the elements have no two common "
            "tangents. The AO is straight, but not a cone."
        ),
    ]


CLAIMS: Final[dict[str, Callable[[Result], list[str]]]] = {
    "curves": curves,
    "crossing": crossing,
    "sweep": sweep,
    "smoothness": smoothness,
    "cone": cone,
    "oscillation": oscillation,
}
"""Function that renders the findings of each claim, by name."""
