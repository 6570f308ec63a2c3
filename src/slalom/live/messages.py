"""Messages to the renderer: a JSON object and arrays in one binary block; pages; what moves and what does not."""

import base64
import gzip
import html
import json
import struct
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from slalom.base.checks import Array
from slalom.base.errors import InvalidInput
from slalom.decision.methods import METHODS
from slalom.forecast.forecast import FORESIGHTS
from slalom.live.seen import is_absent
from slalom.model.path_goal import PathGoal
from slalom.model.shape import Shape
from slalom.model.trajectory import Stationary
from slalom.obstacle import Obstacle
from slalom.sim.measure.closest_approach import between_robots, closest_approaches
from slalom.sim.measure.metrics import COLLISION
from slalom.sim.measure.recording import Recording, RunLog, Step
from slalom.sim.scenario import Scenario
from slalom.sim.shape_distance import clearances
from slalom.view.workspace import TIMES, drawn_box

FORMAT: Final = "slalom view 1"
"""Name of the format of messages, which a `scene` message states."""
TYPES: Final[dict[str, Any]] = {"f4": np.float32, "i2": np.int16, "u1": np.uint8, "i4": np.int32}
"""Types of arrays by their names in a message, little-endian."""
HEAD: Final = struct.Struct("<I")


class Quantised(NamedTuple):
    """Numbers as 16-bit multiples of `step`: value = origin + step * whole, one origin for each last index.

    `order` says how often differences along the first axis were taken, which makes smooth curves compressible. They are
    taken modulo 2^16, so that sums modulo 2^16 return the numbers.
    """

    whole: npt.NDArray[np.int16]
    step: float
    origin: tuple[float, ...]
    absent: npt.NDArray[np.uint8] | None = None
    order: int = 0


def quantised(
    values: npt.ArrayLike, low: npt.ArrayLike, high: npt.ArrayLike, *, step: float = 0.0, order: int = 0
) -> Quantised:
    """Quantise values (..., d) between low (d,) and high (d,); those that are not finite count as absent.

    The error is at most half a step, which is at least the largest range / 65000. Values outside are moved to the
    limits.
    """
    numbers, lower, upper = (np.asarray(x, dtype=np.float64) for x in (values, low, high))
    finest = max(float(np.max(upper - lower)), 1e-6) / 65000.0
    origin, chosen = 0.5 * (lower + upper), max(step, finest)
    known = np.isfinite(numbers)
    scaled = np.clip(np.round((np.where(known, numbers, origin) - origin) / chosen), -32500, 32500)
    whole = scaled.astype(np.int16)
    for _ in range(order):
        whole = np.diff(whole, axis=0, prepend=np.zeros_like(whole[:1]))
    absent = None if known.all() else (~known).astype(np.uint8)
    return Quantised(whole, chosen, tuple(float(x) for x in np.atleast_1d(origin)), absent, order)


def pack(kind: str, fields: Mapping[str, Any], arrays: Mapping[str, npt.NDArray[Any] | Quantised]) -> bytes:
    """Return a message: the length of the JSON text, the text, padding to 8 bytes, and the arrays.

    The object holds `kind`, the `fields`, and under `arrays` the type, shape and position of each array.

    Raises:
        InvalidInput: numbers in `fields` that JSON cannot hold.
    """
    described: dict[str, dict[str, Any]] = {}
    blocks = _Blocks()
    for name, given in arrays.items():
        values = given.whole if isinstance(given, Quantised) else np.asarray(given)
        described[name] = {"type": blocks.type_of(values), "shape": list(values.shape), "at": blocks.add(values)}
        if isinstance(given, Quantised):
            described[name] |= {"step": given.step, "origin": list(given.origin), "order": given.order}
            if given.absent is not None:
                described[name]["absent"] = blocks.add(given.absent)
    try:
        content = json.dumps({"kind": kind, **fields, "arrays": described}, allow_nan=False, separators=(",", ":"))
    except ValueError as error:
        raise InvalidInput(f"{kind}: expected finite numbers in a message, found others ({error})") from None
    text = content.encode()
    text += b" " * (-(len(text) + HEAD.size) % 8)
    return HEAD.pack(len(text)) + text + b"".join(blocks.blocks)


class _Blocks:
    """Arrays one after the other, each from a multiple of 8 bytes on."""

    def __init__(self) -> None:
        self.blocks: list[bytes] = []
        self._end = 0

    @staticmethod
    def type_of(values: npt.NDArray[Any]) -> str:
        """Return the name of the type of an array."""
        return next(name for name, dtype in TYPES.items() if values.dtype == dtype)

    def add(self, values: npt.NDArray[Any]) -> int:
        """Append an array; return its position."""
        at = self._end
        block = np.ascontiguousarray(values).astype(values.dtype.newbyteorder("<")).tobytes()
        self.blocks.append(block + bytes(-len(block) % 8))
        self._end += len(self.blocks[-1])
        return at


def unpack(message: bytes) -> tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]:
    """Return the object of a message and its arrays, quantised ones as float64 with nan where absent."""
    (length,) = HEAD.unpack_from(message)
    fields = json.loads(message[HEAD.size : HEAD.size + length])
    begin, arrays = HEAD.size + length, {}
    for name, one in fields.pop("arrays").items():
        dtype, count = np.dtype(TYPES[one["type"]]).newbyteorder("<"), int(np.prod(one["shape"]))
        values: npt.NDArray[Any] = np.frombuffer(message, dtype, count, begin + one["at"]).reshape(one["shape"])
        if "step" in one:
            for _ in range(one["order"]):
                values = np.cumsum(values, axis=0, dtype=np.int16)
            values = np.asarray(one["origin"]) + one["step"] * values
            if "absent" in one:
                mask = np.frombuffer(message, np.uint8, count, begin + one["absent"]).reshape(one["shape"])
                values[mask != 0] = np.nan
        arrays[name] = values
    return fields, arrays


_PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<link rel="icon" href="data:,">
<title>{title}</title>
<style>body {{ margin: 0 }}</style>
</head>
<body>
<div id="slalom"{live}></div>
{data}<script type="module">{renderer}</script>
</body>
</html>
"""
_POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; connect-src {to}"


@cache
def renderer() -> str:
    """Return the bundled renderer.

    Raises:
        InvalidInput: a bundle that ends its script element.
    """
    text = Path(__file__).with_name("renderer").joinpath("view.js").read_text(encoding="utf-8")
    if "</script" in text.lower():
        raise InvalidInput("renderer: expected a script without an end tag, found one; build it again from web/")
    return text


def block(messages: Iterable[bytes]) -> bytes:
    """Return messages, each after its length, compressed by gzip; equal messages give equal bytes."""
    whole = b"".join(struct.pack("<I", len(message)) + message for message in messages)
    return gzip.compress(whole, compresslevel=9, mtime=0)


def file_page(title: str, messages: Iterable[bytes]) -> str:
    """Return a page that holds its messages and makes no request."""
    data = base64.b64encode(block(messages)).decode()
    held = f'<script type="application/octet-stream" id="slalom-data">{data}</script>\n'
    policy = _POLICY.format(to="'none'")
    return _PAGE.format(policy=policy, title=html.escape(title), live="", data=held, renderer=renderer())


def live_page(title: str, runs: int = 1) -> str:
    """Return the page of the server, which receives its messages from there, of one run or two beside each other."""
    policy = _POLICY.format(to="'self'")
    return _PAGE.format(
        policy=policy, title=html.escape(title), live=f' data-live="{runs}"', data="", renderer=renderer()
    )


MILLIMETRE: Final = 1e-3
"""[m, m/s, m/s^2, rad] Step of numbers in messages, coarser where 16 bits do not suffice."""


class Scene:
    """The drawn parts of a scenario: the box, and the obstacles that move.

    Attributes:
        low, high: (d,) [m] of the box that is drawn. moving: indices of the obstacles that move.
        goals: whether a goal moves.
    """

    def __init__(self, scenario: Scenario, steps: Sequence[Step] = (), box: tuple[Array, Array] | None = None) -> None:
        self.scenario = scenario
        self.moving = [k for k, o in enumerate(scenario.obstacles) if not o.at_rest]
        self.goals = any(not isinstance(robot.goal.trajectory, Stationary) for robot in scenario.robots)
        self.low, self.high = box or _box(scenario, steps)
        # Robots that have not appeared in the frames so far.
        self._absent = set[int]()

    def message(self, method: str, *, live: bool, notes: Sequence[str] = (), extra: dict[str, Any]) -> bytes:
        """Return the `scene` message. `extra` are further fields, such as the number of undoable changes."""
        scenario, shapes = self.scenario, _Shapes()
        robots = [
            {
                "name": robot.name,
                "shape": shapes.index(robot.shape),
                "radius": robot.shape.bounding_radius,
                "max_speed": robot.limits.max_speed,
                "max_acceleration": robot.limits.max_acceleration,
                "goal": robot.goal.position(scenario.start).tolist(),
                "tolerance": robot.goal.tolerance,
                "stop": robot.goal.stop,
                "path": robot.goal.points.tolist() if isinstance(robot.goal, PathGoal) else None,
                "method": None if robot.method is None else robot.method.name,
            }
            for robot in scenario.robots
        ]
        obstacles = [
            {
                "name": obstacle.name or f"obstacle {k}",
                "shape": shapes.index(obstacle.shape),
                "radius": obstacle.shape.bounding_radius,
                "turns": obstacle.turns,
                "heading": obstacle.angle or 0.0,
                "position": None if k in set(self.moving) else obstacle.trajectory.position(scenario.start).tolist(),
            }
            for k, obstacle in enumerate(scenario.obstacles)
        ]
        fields = {
            "format": FORMAT,
            "title": scenario.name,
            "method": method,
            "methods": {name: method.sentence for name, method in METHODS.items()},
            "foresights": list(FORESIGHTS),
            "dimension": scenario.dimension,
            "start": scenario.start,
            "dt": scenario.dt,
            "duration": scenario.duration,
            "period_steps": scenario.steps_per_decision,
            "horizon": scenario.horizon,
            "margin": scenario.margin,
            "live": live,
            "low": self.low.tolist(),
            "high": self.high.tolist(),
            "shapes": shapes.listed,
            "robots": robots,
            "obstacles": obstacles,
            "moving": self.moving,
            "notes": [*scenario.notes, *notes],
            **extra,
        }
        return pack("scene", fields, {})

    def frames(self, steps: Sequence[Step], first: int, arrived: Array, ended: "Ended | None") -> bytes:
        """Return the `frames` message of some steps, of which the first has the number `first`.

        Positions of robots before their appearance are absent.
        `arrived` (n,) [s] are the times of arrival known so far; `ended` says how the run ended, None if it goes on.
        """
        scenario = self.scenario
        positions = np.array([step.positions for step in steps])
        if first == 0:
            self._absent = {k for k, robot in enumerate(scenario.robots) if robot.appears is not None}
        for own, step in zip(positions, steps):
            self._absent -= {k for k in self._absent if step.outcomes[k]}
            own[list(self._absent)] = np.nan
        times = scenario.start + scenario.dt * (first + np.arange(len(steps), dtype=np.float64))
        obstacles, directions = self._obstacles(times)
        names = [name for step in steps for name in step.outcomes]
        table = sorted(set(names))
        outcomes = np.array([table.index(name) for name in names], dtype=np.uint8).reshape(len(steps), -1)
        speeds = np.array([robot.limits.max_speed for robot in scenario.robots]).max() * np.ones(scenario.dimension)
        velocities = np.array([step.velocities for step in steps])
        fastest = np.maximum(1.1 * speeds, np.abs(velocities).max(axis=(0, 1), initial=0.0))
        accelerations = np.array([step.accelerations for step in steps])
        hardest = np.abs(accelerations).max(axis=(0, 1), initial=1e-3)
        arrays: dict[str, Any] = {
            "positions": quantised(positions, *self._reach(positions), step=MILLIMETRE, order=2),
            "velocities": quantised(velocities, -fastest, fastest, step=MILLIMETRE, order=1),
            "accelerations": quantised(accelerations, -hardest, hardest, step=MILLIMETRE),
            "outcomes": outcomes,
        }
        if self.moving:
            arrays["obstacles"] = quantised(obstacles, *self._reach(obstacles), step=MILLIMETRE, order=2)
            if directions.any():
                arrays["directions"] = quantised(directions[..., None], [-np.pi], [np.pi], step=MILLIMETRE, order=1)
        if self.goals:
            goals = np.stack([robot.goal.position(times) for robot in scenario.robots], axis=1)
            arrays["goals"] = quantised(goals, *self._reach(goals), step=MILLIMETRE, order=2)
        fields = {
            "first": first,
            "count": len(steps),
            "outcomes_table": table,
            "arrived": [float(t) if np.isfinite(t) else None for t in arrived],
            "complete": ended is not None,
            "ended": None if ended is None else ended._asdict(),
        }
        return pack("frames", fields, arrays)

    def _reach(self, positions: Array) -> tuple[Array, Array]:
        """Lower and upper limits (d,) of positions, nan ignored, at least the box."""
        flat = positions.reshape(-1, self.scenario.dimension)
        flat = flat[np.isfinite(flat).all(axis=1)]
        return flat.min(axis=0, initial=self.low.min()), flat.max(axis=0, initial=self.high.max())

    def _obstacles(self, times: Array) -> tuple[Array, Array]:
        """Positions (t, m, d) [m] of the moving obstacles, nan where they do not exist; and directions (t, m) [rad]."""
        d = self.scenario.dimension
        positions = np.full((len(times), len(self.moving), d), np.nan)
        directions = np.zeros((len(times), len(self.moving)))
        for column, k in enumerate(self.moving):
            obstacle = self.scenario.obstacles[k]
            first, last = obstacle.trajectory.span
            there = (times >= first) & (times <= last)
            if there.any():
                positions[there, column] = obstacle.trajectory.position(times[there])
                if d == 2 and obstacle.turns:
                    directions[there, column] = np.arctan2(*obstacle.direction(times[there]).T[::-1])
        return positions, directions


def series(scenario: Scenario, steps: Sequence[Step], robot: int, first: int = 0) -> bytes:
    """Return the `series` message of one robot at some steps, from `first` on.

    `clearance` (t,) [m] to all others, nan without any; `decision` (t,) [ms]: processor time, 0 where none was made.
    """
    times = scenario.start + scenario.dt * (first + np.arange(len(steps), dtype=np.float64))
    own = np.array([step.positions[robot] for step in steps])
    shape, least = scenario.robots[robot].shape, np.full(len(steps), np.inf)
    for obstacle in scenario.obstacles:
        begin, end = obstacle.trajectory.span
        there = (times >= begin) & (times <= end)
        if there.any():
            least[there] = np.minimum(least[there], clearances(obstacle, shape, times[there], own[there]))
    for k, other in enumerate(scenario.robots):
        if k != robot:
            still = Obstacle(other.shape, Stationary(np.zeros(scenario.dimension)))
            relative = own - np.array([step.positions[k] for step in steps])
            present = np.array([not is_absent(scenario, steps, j, k) for j in range(len(steps))])
            found = clearances(still, shape, times, relative)
            least = np.where(present, np.minimum(least, found), least)
    if scenario.robots[robot].appears is not None:
        least[[is_absent(scenario, steps, j, robot) for j in range(len(steps))]] = np.inf
    clearance = np.where(np.isfinite(least), least, np.nan).astype(np.float32)
    decision = np.array([1e3 * step.decision_times[robot] for step in steps], dtype=np.float32)
    return pack("series", {"robot": robot, "first": first}, {"clearance": clearance, "decision": decision})


class Ended(NamedTuple):
    """How a run ended, as a sentence, whether there was a collision, and each: time [s], robot, with what."""

    text: str
    collided: bool
    hits: list[tuple[float, int, str]]


def ended(scenario: Scenario, steps: Sequence[Step], end: Step, arrived: Array) -> Ended:
    """Return how a run of all `steps` ended: arrivals (n,) [s], inf for none, and collisions in continuous time."""
    log = RunLog(scenario, "", 0, "", list(steps), positions=end.positions, velocities=end.velocities, arrived=arrived)
    run, hits = Recording.of(log), list[str]()
    each: list[tuple[float, int, str]] = []
    n = len(scenario.robots)
    if steps:
        for k, robot in enumerate(scenario.robots):
            own = "" if n == 1 else f"{robot.name} and "
            for number, (obstacle, found) in enumerate(zip(scenario.obstacles, closest_approaches(run, k))):
                if found.clearance < -COLLISION:
                    name = obstacle.name or f"obstacle {number}"
                    hits.append(f"{own}{name}, deepest at {found.time:.1f} s")
                    each.append((float(found.time), k, name))
        for j, k in np.argwhere(np.triu(between_robots(run) < -COLLISION)).tolist():
            names = scenario.robots[j].name, scenario.robots[k].name
            hits.append(" and ".join(names))
            apart = np.linalg.norm(run.positions[:, j] - run.positions[:, k], axis=1)
            closest = float(run.times[int(np.argmin(apart))])
            each += [(closest, j, names[1]), (closest, k, names[0])]
    there = np.isfinite(arrived)
    last = arrived[there].max() if there.any() else scenario.start + scenario.dt * len(steps)
    reached = f"{there.sum()} of {n} robots arrived" if n > 1 else "Arrived" if there.all() else "Not arrived"
    when = f" after {last:.1f} s" if not there.any() else f"{', the last' if n > 1 else ''} at {last:.1f} s"
    more = f"; and {len(hits) - 3} more" if len(hits) > 3 else ""
    told = f"Collision: {'; '.join(hits[:3])}{more}." if hits else "No collision."
    return Ended(f"{reached}{when}. {told}", bool(hits), each)


class _Shapes:
    """Shapes of a scene, each once."""

    def __init__(self) -> None:
        self.listed: list[list[dict[str, Any]]] = []
        self._known: dict[str, int] = {}

    def index(self, shape: Shape) -> int:
        """Return the number of a shape, as parts with corners and radius."""
        parts = [{"corners": part.corners.tolist(), "radius": part.radius} for part in shape.parts]
        key = repr(parts)
        if key not in self._known:
            self._known[key] = len(self.listed)
            self.listed.append(parts)
        return self._known[key]


def _box(scenario: Scenario, steps: Sequence[Step]) -> tuple[Array, Array]:
    """Lower and upper corner (d,) [m] of the box that is drawn: robots, goals, and the obstacles near them."""
    end = scenario.start + (scenario.dt * len(steps) if steps else min(scenario.duration, 3.0 * scenario.horizon))
    points = [robot.state.position for robot in scenario.robots]
    radius = max(robot.shape.bounding_radius for robot in scenario.robots)
    points += [robot.goal.position(t) for robot in scenario.robots for t in (scenario.start, end)]
    points += [position for step in steps[:: max(1, len(steps) // TIMES)] for position in step.positions]
    return drawn_box(np.array(points), radius, scenario.obstacles, scenario.start, end)
