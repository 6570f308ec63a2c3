"""The `control` message: the control space of one robot at one step, and what it predicts."""

from typing import Any, Final

import numpy as np
import numpy.typing as npt
import shapely

from slalom.checks import Array
from slalom.limits import Admissible
from slalom.live.fields import PLANES, Field, Fields, Plane
from slalom.live.messages import Quantised, pack, quantised
from slalom.live.near import half_side
from slalom.live.projections import multiples, projections
from slalom.live.reasons import Reasons, reasons
from slalom.live.seen import Seen
from slalom.tolerances import VIEW_PREDICTED, VIEW_SAMPLES
from slalom.view.kinds import kind
from slalom.view.regions import admissible_region

CENTIMETRE: Final = 0.01
"""[m] Step of predicted positions."""
RING_STEPS: Final = 8192
"""[1] Steps of the outlines of control obstacles from the middle of a plane to its border."""
Arrays = dict[str, npt.NDArray[Any] | Quantised]


def control_message(seen: Seen, fields: Fields, answers: int = 0, slot: int = 0) -> bytes:
    """Return the message of a decision.

    Args:
        fields: what was computed before. answers: number of the command that asked. slot: panel of the view, 0 or 1.
    """
    told, quantity = reasons(seen), kind(seen.response)
    controls, times = seen.controls, np.linspace(0.0, seen.blocked.horizon, VIEW_SAMPLES)
    image = seen.response.position(seen.state, times)
    arrays: Arrays = {
        "times": times.astype(np.float32),
        "drift": image.drift.astype(np.float32),
        "gain": image.gain.astype(np.float32),
        "contact": np.where(np.isfinite(told.contact_times), told.contact_times, -1.0).astype(np.float32),
    }
    if seen.manoeuvre is not None:
        arrays["manoeuvre"] = seen.manoeuvre.position(seen.time + times).astype(np.float32)
    shown = _predictions(seen, times, told, arrays)
    planes = [_panel(seen, fields, plane, k, arrays) for k, plane in enumerate(planes_of(seen))]
    if seen.state.dimension == 3:
        arrays |= projections(seen.blocked, seen.admissible, planes_of(seen)[0].half)
    described = {
        "answers": answers,
        "slot": slot,
        "step": seen.step,
        "time": seen.time,
        "robot": seen.robot,
        "method": seen.navigator.method.name,
        "quantity": {"name": quantity.name, "letter": quantity.letter, "unit": quantity.unit},
        "response": quantity.description,
        "responses": [f"{kind(each).name} {kind(each).description}" for each in seen.responses],
        "horizon": seen.blocked.horizon,
        "margin": seen.navigator.margin,
        "outcome": seen.outcome,
        "target": None if seen.target is None else seen.target.position(seen.time).tolist(),
        "preferred": controls.preferred.tolist(),
        "chosen": None if controls.chosen is None else controls.chosen.tolist(),
        "chosen_label": controls.label,
        "sentences": list(told.sentences),
        "first": told.first,
        "binding": [{"other": m.other, "time": m.time, "clearance": m.clearance} for m in told.binding],
        "others": [[other.kind, other.number] for other in seen.others],
        "margins": np.broadcast_to(np.asarray(seen.blocked.margin), (len(seen.others),)).tolist(),
        "predicted": shown,
        "planes": planes,
    }
    return pack("control", described, arrays)


def planes_of(seen: Seen) -> list[Plane]:
    """Return the planes of the control space that are drawn: one, in space three through the chosen control."""
    chosen, d = seen.controls.chosen, seen.state.dimension
    through = seen.controls.preferred if chosen is None else chosen
    clipped = np.zeros(2) if d == 2 else seen.admissible.toward(through)
    place = tuple(float(x) for x in clipped)
    return [Plane(axes, half_side(seen.response, seen.navigator.limits, seen.admissible), place) for axes in PLANES[d]]


def _predictions(seen: Seen, times: Array, told: Reasons, arrays: Arrays) -> list[int]:
    """Add the predicted positions (k, m, d) and directions of the nearest others; return their rows."""
    here = seen.state.position
    distances = []
    for other in seen.others:
        begin, end = other.obstacle.trajectory.span
        at = float(np.clip(seen.time, begin, end))
        distances.append(float(np.linalg.norm(other.obstacle.trajectory.position(at) - here)))
    important = {meeting.other for meeting in told.binding} | set(np.flatnonzero(np.isfinite(told.contact_times)))
    order = sorted(range(len(distances)), key=lambda k: (k not in important, distances[k]))
    rows = sorted(order[:VIEW_PREDICTED])
    positions = np.full((len(times), len(rows), seen.state.dimension), np.nan)
    directions = np.full((len(times), len(rows)), 0.0)
    for column, row in enumerate(rows):
        obstacle = seen.others[row].obstacle
        begin, end = obstacle.trajectory.span
        there = (seen.time + times >= begin) & (seen.time + times <= end)
        if there.any():
            positions[there, column] = obstacle.trajectory.position(seen.time + times[there])
            if seen.state.dimension == 2 and obstacle.angle != 0.0:
                directions[there, column] = np.arctan2(*obstacle.direction(seen.time + times[there]).T[::-1])
    flat = positions.reshape(-1, seen.state.dimension)
    finite = flat[np.isfinite(flat).all(axis=1)] if flat.size else flat
    if len(finite):
        arrays["positions"] = quantised(positions, finite.min(axis=0), finite.max(axis=0), step=CENTIMETRE, order=2)
        if directions.any():
            arrays["directions"] = directions.astype(np.float32)
        growth = _growth(seen, rows, times)
        if growth.any():
            arrays["growth"] = growth.astype(np.float32)
    return rows if len(finite) else []


def _growth(seen: Seen, rows: list[int], times: Array) -> Array:
    """Uncertainty (k, m) [m] of the positions of some others at elapsed times [s]."""
    grown = np.zeros((len(times), len(rows)))
    for column, row in enumerate(rows):
        unsure = seen.others[row].obstacle.uncertainty
        if unsure is not None:
            grown[:, column] = [float(unsure.radius(float(t), seen.state.dimension)) for t in times]
    return grown


def _panel(seen: Seen, fields: Fields, plane: Plane, number: int, arrays: Arrays) -> dict[str, Any]:
    """Add grid, outlines and admissible set of one plane to the arrays; return its description."""
    found = fields.of(seen, plane)
    arrays[f"grid{number}"] = times_grid(found, plane, seen.blocked.horizon)
    low, high = np.full(2, -plane.half), np.full(2, plane.half)
    rings = [(row, ring) for row, field in enumerate(found) for ring in field.rings]
    if rings:
        arrays[f"rings{number}"] = quantised(
            np.concatenate([ring for _, ring in rings]), low, high, step=plane.half / RING_STEPS, order=1
        )
        arrays[f"ends{number}"] = np.cumsum([len(ring) for _, ring in rings]).astype(np.int32)
        arrays[f"owners{number}"] = np.array([row for row, _ in rings], dtype=np.int32)
    region = admissible_region(_section(seen.admissible, plane))
    if not region.is_empty:
        outline = shapely.get_coordinates(shapely.simplify(region, 1e-3 * plane.half))
        arrays[f"admissible{number}"] = outline.astype(np.float32)
    return {"axes": list(plane.axes), "half": plane.half, "through": list(plane.through)}


def _section(admissible: Admissible, plane: Plane) -> Admissible:
    """Return the section of a set in space with a plane, as a set in the plane."""
    if len(plane.through) == 2:
        return admissible
    axes, hidden = list(plane.axes), next(axis for axis in range(3) if axis not in plane.axes)
    depth = plane.through[hidden] - admissible.centers[:, hidden]
    radii = np.sqrt(np.maximum(admissible.radii**2 - depth**2, 0.0))
    lengths = np.linalg.norm(admissible.normals[:, axes], axis=1)
    offsets = admissible.offsets - admissible.normals[:, hidden] * plane.through[hidden]
    cuts = lengths > 1e-12
    normals = admissible.normals[cuts][:, axes] / lengths[cuts, None]
    return Admissible(admissible.centers[:, axes], radii, normals, offsets[cuts] / lengths[cuts])


def times_grid(found: list[Field], plane: Plane, horizon: float) -> npt.NDArray[np.uint8]:
    """Return the least time to collision (n, n) on the grid of a plane, in multiples of the horizon / 250, or NONE."""
    least = np.full((plane.size, plane.size), np.inf)
    for each in found:
        if each.times is not None:
            least = np.minimum(least, each.times)
    return multiples(least, horizon)
