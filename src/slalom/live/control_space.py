"""The `control` message: the control space of one robot at one step, and what it predicts."""

from collections import OrderedDict
from collections.abc import Hashable
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry.polygon import orient

from slalom.base.checks import Array
from slalom.choice.control_obstacle import ControlObstacle
from slalom.live.messages import Quantised, pack, quantised
from slalom.live.seen import VIEW_PREDICTED, VIEW_SAMPLES, Other, Seen, half_side, reasons
from slalom.model.limits import Admissible
from slalom.obstacle.window import ObstacleWindow
from slalom.sim.explanation import Reasons, kind
from slalom.view.control_space import admissible_region

# Control obstacles of single obstacles on the drawn plane: exact outlines, and times to collision on a grid.
#
# They are kept between messages, so that after a change of one obstacle only its own are computed anew.


VIEW_GRID: Final = 61
"""[1] Grid points along each axis on which the renderer colours times to collision, inside exact outlines. Larger:
finer shades, and more time for each obstacle that is dragged. Smaller: coarser shades."""

VIEW_SLICE_GRID: Final = 121
"""[1] Grid points along each axis of a slice of the control space of a robot in space, whose outline they determine.
Larger: a finer outline and more time. Smaller: a coarser outline."""

VIEW_CONTEXTS: Final = 24
"""[1] States and responses of which a view keeps control obstacles of single obstacles. Larger: more memory, about 30
kB for each obstacle of each. Smaller: more is computed again after a change of response."""


PLANES: Final = {2: ((0, 1),), 3: ((0, 1), (0, 2), (1, 2))}
"""Axes of the planes that are drawn, by dimension."""


class Plane(NamedTuple):
    """Square part of the control space that is drawn: two axes, its half side, and the control that it goes through."""

    axes: tuple[int, int]
    half: float
    through: tuple[float, ...]

    @property
    def size(self) -> int:
        """Number of grid points along each axis."""
        return VIEW_GRID if len(self.through) == 2 else VIEW_SLICE_GRID

    @property
    def controls(self) -> Array:
        """Controls (n, n, d) of the grid, rows along the second axis, from low to high."""
        x = np.linspace(-self.half, self.half, self.size)
        controls = np.tile(np.array(self.through), (self.size, self.size, 1))
        controls[..., self.axes[0]], controls[..., self.axes[1]] = x[None, :], x[:, None]
        return controls


class Field(NamedTuple):
    """Control obstacle of one obstacle on a plane."""

    rings: tuple[Array, ...]  # closed curves (k, 2), holes opposite to outer ones; none in space
    times: Array | None  # (n, n) [s] time to collision, inf if there is none; None: inf everywhere


def field(seen: Seen, row: int, plane: Plane) -> Field:
    """Return the control obstacle of one other (row) on a plane."""
    blocked, other = seen.blocked, seen.others[row]
    until = blocked.obstacles.until[row : row + 1]
    window = ObstacleWindow([other.obstacle], seen.time, blocked.obstacles.horizon, until)
    single = ControlObstacle(blocked.response, blocked.state, window, blocked.robot, other.margin)
    # The share of a change from the control that changes nothing, see `Seen.times`.
    kept, share = seen.unchanged, other.share
    controls = kept + (plane.controls - kept) / share
    if len(plane.through) == 3:
        times = single.times_to_collision(controls)[..., 0]
        return Field((), times if np.isfinite(times).any() else None)
    panel = shapely.box(-plane.half, -plane.half, plane.half, plane.half)
    # A window slightly larger than the panel, so that the border of the window is not drawn.
    whole = single.boundary(kept - kept / share, 1.45 * plane.half / share).regions[0]
    whole = shapely.transform(whole, lambda points: kept + share * (points - kept)) if share < 1.0 else whole
    region = shapely.intersection(whole, panel)
    parts = [part for part in shapely.get_parts(region) if part.geom_type == "Polygon"]
    if not parts:
        return Field((), None)
    rings = [shapely.get_coordinates(ring) for one in parts for ring in shapely.get_rings(orient(one))]
    # Outside the outline no control collides; only those inside it, and close to it, are tested.
    shapely.prepare(near := region.buffer(2.0 * plane.half / plane.size))
    inside = shapely.contains_xy(near, plane.controls[..., 0], plane.controls[..., 1])
    times = np.full(inside.shape, np.inf)
    times[inside] = single.times_to_collision(controls[inside])[..., 0]
    return Field(tuple(rings), times)


def _key(other: Other, start: float, end: float) -> Hashable:
    """What the field of another one depends on, but for the robot: equal keys have equal fields."""
    obstacle, motion = other.obstacle, other.obstacle.trajectory
    first, last = max(start, motion.span[0]), min(end, motion.span[1])
    path = motion.path(first, last) if first < last else None
    moves = (first, last) if path is None else (path.times.tobytes(), path.points.tobytes())
    return obstacle.shape, obstacle.heading, repr(obstacle.uncertainty), moves, other.margin, other.share


class Fields:
    """Fields that were computed, for the latest VIEW_CONTEXTS states and responses of a robot."""

    def __init__(self) -> None:
        self._kept: OrderedDict[Hashable, dict[Hashable, Field]] = OrderedDict()
        self.computed = 0

    def of(self, seen: Seen, plane: Plane) -> list[Field]:
        """Return the fields of all others of a decision; those that were computed before are the same objects."""
        blocked = seen.blocked
        state = tuple(x.tobytes() for x in (seen.state.position, seen.state.velocity, seen.state.acceleration))
        context = (blocked.response, blocked.robot, seen.time, blocked.obstacles.horizon, state, plane)
        known = self._kept.pop(context, {})
        self._kept[context] = known
        while len(self._kept) > VIEW_CONTEXTS:
            self._kept.popitem(last=False)
        found: list[Field] = []
        now: dict[Hashable, Field] = {}
        for row, (other, until) in enumerate(zip(seen.others, blocked.obstacles.until.tolist())):
            key = _key(other, seen.time, seen.time + until), until
            if key not in known:
                known[key] = field(seen, row, plane)
                self.computed += 1
            now[key] = known[key]
            found.append(known[key])
        # Those of obstacles that are no longer there are forgotten.
        self._kept[context] = now
        return found


VIEW_PROJECTION_GRID: Final = 33
"""[1] Grid points along each axis of the projections of the control space of a robot in space. Larger: finer
projections, and time that grows with the cube. Smaller: narrow free parts may be missed in them."""

VIEW_SILHOUETTE: Final = 800
"""[1] Directions in which the border of an admissible set in space is sought, whose hull is drawn as its projection.
Larger: a smoother outline. Smaller: an outline with visible corners."""


NONE: Final = 255
"""Stands for no collision in a grid of times; others are multiples of the horizon / 250."""
OUTSIDE: Final = 254
"""Stands for no admissible control in a projection."""


def multiples(times: Array, horizon: float) -> npt.NDArray[np.uint8]:
    """Return times [s] as multiples of the horizon / 250, inf as NONE."""
    return np.where(np.isfinite(times), np.round(250.0 * times / horizon), NONE).astype(np.uint8)


def projections(seen: Seen, half: float) -> dict[str, npt.NDArray[Any]]:
    """Return arrays of the three projections: along z, y and x.

    `shadow0` to `shadow2` (n, n), rows along the second axis: of all admissible controls on a line along the hidden
    axis, the latest time to collision, NONE if one of them is free, OUTSIDE if there is no such control.
    `silhouette0` to `silhouette2` (k, 2): outline of the projection of the admissible set.
    """
    admissible, horizon = seen.admissible, seen.blocked.horizon
    x = np.linspace(-half, half, VIEW_PROJECTION_GRID)
    controls = np.stack(np.meshgrid(x, x, x, indexing="ij"), axis=-1)
    inside = admissible.contains(controls)
    latest = np.full(inside.shape, -np.inf)
    found = seen.times(controls[inside])
    latest[inside] = found.min(axis=-1, initial=np.inf)
    arrays: dict[str, npt.NDArray[Any]] = {}
    border = silhouette(admissible, controls[inside])
    for k, hidden in enumerate((2, 1, 0)):
        best = latest.max(axis=hidden).T
        arrays[f"shadow{k}"] = np.where(np.isneginf(best), OUTSIDE, multiples(np.maximum(best, 0.0), horizon))
        arrays[f"shadow{k}"] = arrays[f"shadow{k}"].astype(np.uint8)
        if len(border):
            hull = shapely.convex_hull(shapely.multipoints(np.delete(border, hidden, axis=1)))
            arrays[f"silhouette{k}"] = shapely.get_coordinates(hull).astype(np.float32)
    return arrays


def silhouette(admissible: Admissible, inner: Array) -> Array:
    """Return points (n, 3) on the border of a convex set that contains the controls `inner` (m, 3); none for m = 0."""
    if not len(inner):
        return np.empty((0, 3))
    middle = inner.mean(axis=0)
    index = np.arange(VIEW_SILHOUETTE) + 0.5
    polar, turn = np.arccos(1.0 - 2.0 * index / VIEW_SILHOUETTE), np.pi * (1.0 + np.sqrt(5.0)) * index
    ways = np.stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)], axis=1)
    low, high = np.zeros(len(ways)), np.full(len(ways), 2.0 * admissible.largest)
    for _ in range(40):
        half = 0.5 * (low + high)
        within = admissible.excess(middle + half[:, None] * ways) <= 0.0
        low, high = np.where(within, half, low), np.where(within, high, half)
    return np.asarray(middle + low[:, None] * ways)


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
        arrays |= projections(seen, planes_of(seen)[0].half)
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
        "target": None if seen.target is None else seen.target.tolist(),
        "preferred": controls.preferred.tolist(),
        "chosen": None if controls.chosen is None else controls.chosen.tolist(),
        "sentences": list(told.sentences),
        "first": told.first,
        "binding": [{"other": m.other, "time": m.time, "clearance": m.clearance} for m in told.binding],
        "others": [[other.kind, other.number] for other in seen.others],
        "margins": [other.margin for other in seen.others],
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
    drawn = [k for k, other in enumerate(seen.others) if other.kind != "hidden"]
    order = sorted(drawn, key=lambda k: (k not in important, distances[k]))
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
    height = plane.through[3 - sum(plane.axes)] if len(plane.through) == 3 else None
    region = admissible_region(seen.admissible, height, plane.axes)
    if not region.is_empty:
        outline = shapely.get_coordinates(shapely.simplify(region, 1e-3 * plane.half))
        arrays[f"admissible{number}"] = outline.astype(np.float32)
    return {"axes": list(plane.axes), "half": plane.half, "through": list(plane.through)}


def times_grid(found: list[Field], plane: Plane, horizon: float) -> npt.NDArray[np.uint8]:
    """Return the least time to collision (n, n) on the grid of a plane, in multiples of the horizon / 250, or NONE."""
    least = np.full((plane.size, plane.size), np.inf)
    for each in found:
        if each.times is not None:
            least = np.minimum(least, each.times)
    return multiples(least, horizon)
