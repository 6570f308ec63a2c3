"""Robots of flows: from area to area, as a list of origins and destinations states."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from slalom.base.checks import Array
from slalom.base.errors import InvalidFile
from slalom.io.recorded import refuse
from slalom.io.sheet import comma_table
from slalom.sim.files.parts import PartModel, Place
from slalom.sim.files.schema import Areas, FlowSpec, RangeSpec, RobotKeys, WrittenRobot, is_table
from slalom.sim.files.yaml_errors import Mistakes

_Flow = tuple[FlowSpec, dict[str, Any], Place]


def robots_of_flows(
    content: Mapping[str, Any], margin: float, folder: Path, number: int, mistakes: Mistakes
) -> list[WrittenRobot]:
    """Return the robots of the flows of a file, each with the keys of a robot that is written on its own.

    Positions in an area are drawn for all flows together. Starts of robots that are there from the start, and goals to
    stop at, are two of the largest radii and the margin apart.

    Args:
        content: of the file. margin: [m] of the file. folder: of the file. Others: as of `robots_of`.
    """
    flows = _flows(content, folder, mistakes)
    areas = {name: area.build() for name, area in _areas(content).items()}
    margins = [margin, *(_largest(flow.margin) for flow, _, _ in flows)]
    radii = [
        _largest(flow.radius) if flow.shape is None else flow.shape.build().bounding_radius for flow, _, _ in flows
    ]
    apart = 2.0 * max(radii, default=0.0) + max(margins)
    points = dict[tuple[str, int], Array]()
    for key in ("origin", "destination"):
        for name, area in areas.items():
            some = [k for k, (flow, _, _) in enumerate(flows) if getattr(flow, key) == name]
            if key == "origin":
                crowded = any(flows[k][0].appears is None for k in some)
            else:
                crowded = any(flows[k][0].goal.stop for k in some)
            if crowded and hasattr(area, "min_distance"):
                area = replace(area, min_distance=max(area.min_distance, apart))
            ends = np.cumsum([flows[k][0].number() for k in some], dtype=np.int64)
            draw = partial(area.points, int(ends[-1]) if some else 0, key)
            found = mistakes.attempt(("areas", name), draw) if some else None
            if found is not None:
                points |= {(key, k): part for k, part in zip(some, np.split(found, ends[:-1]))}
    robots = list[WrittenRobot]()
    for k, (flow, raw, place) in enumerate(flows):
        if ("origin", k) in points and ("destination", k) in points:
            ends_of = points["origin", k].tolist(), points["destination", k].tolist()
            robots += _robots_of_flow(flow, raw, place, number + len(robots), *ends_of)
    return robots


def _robots_of_flow(
    flow: FlowSpec, raw: Mapping[str, Any], place: Place, number: int, starts: list[Any], goals: list[Any]
) -> Iterator[WrittenRobot]:
    """Yield the robots of a flow with these starts and goals."""
    shared = {key: raw[key] for key in RobotKeys.model_fields if key in raw}
    # Flows with one seed draw independently of each other.
    of_flow = f"{flow.origin} {flow.destination}"
    ranges = {key: value.values(len(starts), f"{key} {of_flow}") for key, value in flow if isinstance(value, RangeSpec)}
    if times := flow.times(f"appears {of_flow}"):
        ranges["appears"] = times
    elsewhere = {"position": (*place, "origin"), "goal": (*place, "destination")}
    for k, (start, goal) in enumerate(zip(starts, goals)):
        robot = shared | {key: values[k] for key, values in ranges.items()}
        name = f"{flow.name} {k}" if flow.name else f"robot {number + k}"
        robot |= {"name": name, "position": start, "goal": {**raw.get("goal", {}), "position": goal}}
        yield WrittenRobot(name, robot, place, elsewhere)


def _flows(
    content: Mapping[str, Any], folder: Path, mistakes: Mistakes
) -> list[tuple[FlowSpec, dict[str, Any], Place]]:
    """Return the model, the content and the place of each valid flow, those of tables included."""
    listed = content.get("flows", [])
    found = list[_Flow]()
    for k, raw in enumerate(listed if isinstance(listed, list) else []):
        place, rows = ("flows", k), [raw]
        if is_table(raw):
            rows = _rows_of_flow_table(folder / str(raw["table"]), raw, mistakes)
        for row in rows:
            try:
                flow = FlowSpec.model_validate(row)
            except ValidationError:
                # Reported with the mistakes of the whole file.
                continue
            for key in ("origin", "destination"):
                if getattr(flow, key) not in _areas(content):
                    known = ", ".join(_areas(content)) or "none"
                    at = (*place, "table" if is_table(raw) else key)
                    mistakes.note(at, f"expected one of the areas ({known}), found {getattr(flow, key)!r}")
                    break
            else:
                found.append((flow, row, place))
    return found


def _rows_of_flow_table(file: Path, raw: Mapping[str, Any], mistakes: Mistakes) -> list[dict[str, Any]]:
    """Return the content of the flow of each row of a table; rows with the count 0 are none."""
    try:
        table = comma_table(file, ("origin", "destination", "count"))
        counts = table.numbers("count", whole=True)
        for row in np.flatnonzero(counts < 0.0):
            table.wrong(row, "count", f"expected a number from 0, found {counts[row]:g}")
        refuse(table.path, table.mistakes, table.location)
    except InvalidFile as error:
        mistakes.mistakes.extend(error.mistakes)
        return []
    shared = {key: value for key, value in raw.items() if key != "table"}
    rows = zip(table.texts("origin"), table.texts("destination"), counts.tolist())
    return [shared | {"origin": a, "destination": b, "count": int(count)} for a, b, count in rows if count]


def _areas(content: Mapping[str, Any]) -> dict[str, PartModel]:
    """Return the models of the valid areas of a file by name."""
    try:
        return TypeAdapter[Areas](Areas).validate_python(content.get("areas", {}))
    except ValidationError:
        return {}


def _largest(value: Any) -> float:
    """Return the largest number of a number or a range; 0 for None."""
    return max(value.first, value.last) if isinstance(value, RangeSpec) else float(value or 0.0)
