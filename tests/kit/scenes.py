"""Random decisions, each made from one integer: plain numbers for the oracle, and the library's objects from them."""

from dataclasses import asdict, dataclass, fields, replace
from functools import cached_property

import numpy as np
import parts
from oracle import MOTIONS, STAMPS, Admissible, Problem, assumed, directions, motion

import slalom
from slalom import (
    METHODS,
    Box,
    ConvexPolygon,
    Friction,
    HalfSpace,
    HeadingCone,
    LeastSpeed,
    Limits,
    Obstacle,
    ObstacleWindow,
    State,
    TurningRadius,
)
from slalom.decision.methods import HOLDS
from slalom.model.response import RESPONSES, AccelerateThenTurn
from slalom.model.shape import Capsule, Disc, Polygon, Polyline, Rectangle, Union, round_shape
from slalom.model.trajectory import TRAJECTORIES

INITIAL_CLEARANCE = 0.05  # [m]
FASTEST = 15.0  # [m/s]
SHAPED, SHAPED_ROBOT, WALL_STANDS = 0.5, 0.35, 0.7
# How often not everything in a scene is round; then, how often the robot is not; how often a wall stands still.
# How often the preferred control, or one drawn at random, is kept free, and how often a scene has many large obstacles:
# they set the mix of statuses.
CLEAR, HAVEN, CROWDED = 0.33, 0.8, 0.3


def _unit(rng, d):
    v = rng.normal(size=d)
    return v / np.linalg.norm(v)


# Trajectories: (kind, parameters) near the origin; the scene moves them to where they are in the way.


def _stationary(rng, d, start, horizon):
    return "stationary", {"initial_position": np.zeros(d)}


def _constant_velocity(rng, d, start, horizon):
    speed = _unit(rng, d) * rng.uniform(0.1, 4.0)
    return "constant_velocity", {
        "initial_position": np.zeros(d),
        "initial_velocity": speed,
        "at": start + rng.uniform(-1, 1),
    }


def _constant_acceleration(rng, d, start, horizon):
    velocity, acceleration = _unit(rng, d) * rng.uniform(0.1, 3.0), _unit(rng, d) * rng.uniform(0.1, 1.5)
    return "constant_acceleration", {
        "initial_position": np.zeros(d),
        "initial_velocity": velocity,
        "initial_acceleration": acceleration,
        "at": start,
    }


def _circular(rng, d, start, horizon):
    radius = float(np.exp(rng.uniform(np.log(0.5), np.log(20.0))))
    speed = float(rng.choice([-1, 1]) * rng.uniform(0.3, min(4.0, 3.0 * radius)))
    parameters = {"center": np.zeros(d), "radius": radius, "speed": speed, "phase": float(rng.uniform(0, 2 * np.pi))}
    if d == 3 and rng.random() < 0.8:
        parameters["normal"] = rng.normal(size=3)
    return "circular", parameters


def _samples(rng, d, first, last, interpolation):
    steps = rng.uniform(0.15, 1.5, size=int(rng.integers(2, 9)))
    times = first + np.concatenate([[0.0], np.cumsum(steps)]) * (last - first) / steps.sum()
    walk = np.cumsum(rng.normal(size=(len(times), d)) * rng.uniform(0.2, 1.2), axis=0)
    drift = _unit(rng, d) * rng.uniform(0.0, 2.0)
    return "sampled", {
        "times": times,
        "positions": walk + (times - first)[:, None] * drift,
        "interpolation": interpolation,
    }


def _linear(rng, d, start, horizon):
    return _samples(rng, d, start - rng.uniform(0, 2), start + horizon + rng.uniform(0, 2), "linear")


def _smooth(rng, d, start, horizon):
    return _samples(rng, d, start - rng.uniform(0, 2), start + horizon + rng.uniform(0, 2), "smooth")


def _brief(rng, d, start, horizon):
    """Appears, vanishes or both within the horizon."""
    first = rng.uniform(-0.3, 0.9)
    last = max(first, 0.0) + rng.uniform(0.05, 0.8)
    return _samples(rng, d, start + first * horizon, start + last * horizon, str(rng.choice(["linear", "smooth"])))


def _polynomials(rng, d, start, horizon):
    """Pieces of degree 5 that meet, with velocities that may jump; some begin or end within the horizon."""
    durations = rng.uniform(0.4, 3.0, size=int(rng.integers(1, 6)))
    coefficients = rng.normal(size=(len(durations), 6, d)) * np.array([1.0, 1.0, 0.5, 0.2, 0.05, 0.01])[:, None]
    for k in range(1, len(durations)):
        coefficients[k, 0] = sum(coefficients[k - 1, power] * durations[k - 1] ** power for power in range(6))
    first = start + (rng.uniform(0.0, 0.5) * horizon if rng.random() < 0.3 else -0.1)
    return "piecewise_polynomial", {"durations": durations, "coefficients": coefficients, "start": first}


def _like_the_example(kind):
    """A drawing of the kind by its example in `parts`."""

    def drawn(rng, d, start, horizon):
        example = next(one for make in parts.TRAJECTORIES.values() if type(one := make(d)) is TRAJECTORIES[kind])
        return kind, {field.name: np.array(getattr(example, field.name)) for field in fields(example)}

    return drawn


DRAWN = (_stationary, _constant_velocity, _constant_acceleration, _circular, _linear, _smooth, _brief, _polynomials)
_COVERED = ("stationary", "constant_velocity", "constant_acceleration", "circular", "sampled", "piecewise_polynomial")
KINDS = (*DRAWN, *(_like_the_example(kind) for kind in MOTIONS if kind not in _COVERED))
"""Every kind of trajectory that has a formula in `oracle.MOTIONS`."""


def _capsule(rng, d, size):
    half, middle = _unit(rng, d) * size * rng.uniform(0.2, 1.2), rng.normal(size=d) * size * 0.3
    if rng.random() < 0.1:
        half = 0.0 * half  # a disc about somewhere else
    return Capsule(middle - half, middle + half, size * rng.uniform(0.2, 0.8))


def _rectangle(rng, d, size):
    rounding = size * rng.uniform(0.05, 0.4) if rng.random() < 0.4 else 0.0
    return Rectangle(size * rng.uniform(0.8, 3.0), size * rng.uniform(0.4, 1.5), rounding)


def _around(rng, count):
    """Angles of corners: one in each sector, so that neighbours are less than half a turn apart."""
    return 2 * np.pi * (np.arange(count) + rng.uniform(0, 0.8, size=count)) / count


def _ring(angles, radii):
    return np.column_stack([np.cos(angles), np.sin(angles)]) * np.broadcast_to(radii, len(angles))[:, None]


def _convex(rng, d, size):
    """Corners on an ellipse, in either sense, not about its middle."""
    corners = _ring(_around(rng, int(rng.integers(3, 8))), 1.0) * rng.uniform(0.5, 1.5, size=2)
    corners = size * (corners + rng.normal(size=2) * 0.3)
    rounding = size * rng.uniform(0.05, 0.4) if rng.random() < 0.3 else 0.0
    return Polygon(corners[:: int(rng.choice([-1, 1]))], rounding)


def _star(rng, d, size):
    """Not convex: every second corner is much nearer."""
    count = 2 * int(rng.integers(2, 5))
    radii = np.where(np.arange(count) % 2, rng.uniform(0.2, 0.5, size=count), rng.uniform(0.9, 1.6, size=count))
    rounding = size * rng.uniform(0.05, 0.2) if rng.random() < 0.3 else 0.0
    return Polygon(size * _ring(_around(rng, count), radii)[:: int(rng.choice([-1, 1]))], rounding)


def _polyline(rng, d, size):
    steps = rng.uniform(-1.0, 1.0) * np.pi + np.cumsum(rng.uniform(-1.5, 1.5, size=int(rng.integers(1, 5))))
    points = np.cumsum(np.concatenate([np.zeros((1, 2)), _ring(steps, rng.uniform(0.4, 1.5, size=len(steps)))]), axis=0)
    return Polyline(size * (points - points.mean(axis=0)), size * float(rng.choice([0.0, rng.uniform(0.02, 0.3)])))


def _union(rng, d, size):
    kinds = rng.choice([_capsule, _rectangle, _convex, lambda rng, d, size: Disc(size)], size=2, replace=False)
    return Union([kind(rng, d, 0.8 * size) for kind in kinds])


SHAPES = {
    "round": lambda rng, d, size: round_shape(size, d),
    "capsule": _capsule,
    "rectangle": _rectangle,
    "convex": _convex,
    "star": _star,
    "polyline": _polyline,
    "union": _union,
}
"""Random shapes of every kind, those without a drawing of their own by their example in `parts`."""
SHAPES |= {
    name: lambda rng, d, size, example=parts.SHAPES[name]: example(size, d)
    for name in slalom.model.shape.SHAPES
    if name not in SHAPES and name not in ("disc", "ball", "polygon")
}

IN_SPACE = ("round", "capsule")
"""Those that are there in space too."""

ROBOTS = ("capsule", "rectangle", "convex", "star", "union")
"""Those of which robots are, beside round ones. A wall is none."""

HEADED = tuple(kind for kind, formula in MOTIONS.items() if formula.faces)
"""Trajectories along which a body can face."""


def _robot(rng, d, size):
    """Mostly round; whether it is; in space a capsule meets balls only."""
    if rng.random() >= SHAPED_ROBOT:
        return round_shape(size, d), True
    return SHAPES["capsule" if d == 3 else str(rng.choice(ROBOTS))](rng, d, size), False


def _body(rng, d, size, all_round):
    """Name, shape and heading of an obstacle."""
    if all_round or rng.random() < 0.2:
        return "round", round_shape(size, d), 0.0
    name = str(rng.choice(IN_SPACE if d == 3 else list(SHAPES)))
    heading = 0.0
    if d == 2 and rng.random() < 0.8:
        heading = "motion" if rng.random() < 0.5 else float(rng.uniform(-7.0, 7.0))
    return name, SHAPES[name](rng, d, size), heading


def _speed(seen, heading, reach, t):
    """The most [m/s] by which a point of an obstacle moves at times t, its turning included."""
    _, velocity, acceleration = motion(*seen, t)
    total = np.linalg.norm(velocity, axis=1)
    if heading == "motion":
        across = velocity[:, 0] * acceleration[:, 1] - velocity[:, 1] * acceleration[:, 0]
        total = total + reach * np.abs(across) / np.maximum(total, 1e-6) ** 2
    return np.nanmax(total)


PARAMETERS = {
    "Velocity": lambda rng: {"ramp": float(rng.choice([0.0, 0.1, 0.5, 1.5]))},
    "LaggedVelocity": lambda rng: {"lag": float(rng.uniform(0.2, 2.0))},
    "Acceleration": lambda rng: {},
    "AccelerateThenCoast": lambda rng: {"hold": float(rng.uniform(0.2, 3.0))},
    "AccelerateThenStop": lambda rng: {
        "hold": float(rng.uniform(0.2, 3.0)),
        "rate": float(rng.uniform(0.2, 2.0)),
        "period": float(rng.choice([0.05, 0.1, 0.25])),
    },
    "AccelerateThenBrake": lambda rng: {"hold": float(rng.uniform(0.2, 3.0)), "brake": float(rng.uniform(0.3, 3.0))},
    "AccelerateThenTurn": lambda rng: {
        "hold": float(rng.uniform(0.2, 3.0)),
        "rate": float(rng.choice([-1.0, 1.0]) * rng.uniform(0.1, 1.5)),
    },
    "Jerk": lambda rng: {},
}
"""Random parameters of kinds of responses; other kinds have those of their example in `parts`."""

BOXES = {"velocity_bounds": 0.15, "acceleration_bounds": 0.15}
"""How often a scene has half-spaces beside its largest norms."""

BOUNDED = 0.3
"""How often a scene has bounds that depend on the state."""


@dataclass
class Scene:
    """A decision: the library's objects, the same in plain numbers, and what made it."""

    seed: int
    method: str
    state: State
    response: slalom.Response
    limits: Limits
    admissible: slalom.Admissible
    preferred: np.ndarray
    obstacles: list
    problem: Problem
    plain_admissible: Admissible
    robot: slalom.Shape
    shapes: list  # names of those of the obstacles
    trials: np.ndarray  # (n, d) controls to compare clearances at

    @cached_property
    def blocked(self):
        """The library's answer to the scene, which the oracle's own tests do not ask for."""
        traffic = ObstacleWindow(self.obstacles, self.problem.start, self.problem.horizon)
        return slalom.ControlObstacle(self.response, self.state, traffic, self.robot)

    def __str__(self):
        bodies = [
            f"{name} {kind} {heading if heading == 'motion' else round(heading, 3)}"
            for name, (kind, _), heading in zip(self.shapes, self.problem.motions, self.problem.headings)
        ]
        return (
            f"scenes.scene({self.seed}, {self.state.dimension}): {self.method}, {self.response}, "
            f"horizon {self.problem.horizon:.3f} s, robot {type(self.robot).__name__}, obstacles {bodies}"
        )


def _response(rng, number, limits, d):
    """Method and response: in turn those of the method rows, and every kind with random parameters.

    In space those that do not turn the control.
    """
    served = [kind for kind in RESPONSES if d == 2 or kind is not AccelerateThenTurn]
    name = list(METHODS)[number % len(METHODS)]
    turn = number // len(METHODS)
    if turn % 2:
        kind = served[(turn // 2) % len(served)]
        if kind.__name__ in PARAMETERS:
            return name, kind(**PARAMETERS[kind.__name__](rng))
        return name, next(example for example in parts.RESPONSES.values() if type(example) is kind)
    if METHODS[name].shared:
        limits = replace(limits, bounds=tuple(b for b in limits.bounds if not isinstance(b, LeastSpeed)))
    rows = METHODS[name].responses(limits, float(rng.choice([0.05, 0.1, 0.2])), HOLDS)
    return name, rows[(turn // 2) % len(rows)]


# Bounds on what a robot does, by kind: random parameters, about as strong as its largest acceleration.

BOUNDS = {
    "friction": lambda rng, d, most: Friction(*(most * rng.uniform(0.3, 1.2, 3)), heading=_faced(rng, d)),
    "box": lambda rng, d, most: Box(most * rng.uniform(0.3, 1.2, d), _frame(rng, d), _faced(rng, d)),
    "convex_polygon": lambda rng, d, most: ConvexPolygon(_corners(rng, most), _frame(rng, d), _faced(rng, d)),
    "heading_cone": lambda rng, d, most: HeadingCone(rng.uniform(0.2, np.pi / 2), _faced(rng, d)),
    "turning_radius": lambda rng, d, most: TurningRadius(rng.uniform(0.5, 5.0), _faced(rng, d)),
    "least_speed": lambda rng, d, most: LeastSpeed(rng.uniform(0.1, 2.0), _faced(rng, d)),
}
"""Every kind of bound, those without a drawing of their own by their example in `parts`."""


def _like_the_bound(kind):
    def drawn(rng, d, max_acceleration):
        return next(b for make in parts.BOUNDS.values() for b in make(d) if type(b) is slalom.model.bounds.BOUNDS[kind])

    return drawn


BOUNDS |= {kind: _like_the_bound(kind) for kind in slalom.model.bounds.BOUNDS if kind not in BOUNDS}


def _frame(rng, d):
    return str(rng.choice(["world", "body"])) if d == 2 else "world"


def _faced(rng, d):
    return rng.normal(size=d) if rng.random() < 0.5 else None


def _corners(rng, radius):
    """Three to seven corners on a circle, one in every half of it."""
    while True:
        angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, int(rng.integers(3, 8))))
        if np.diff(angles, append=angles[0] + 2.0 * np.pi).max() < 0.9 * np.pi:
            return radius * rng.uniform(0.5, 1.5) * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def _bounds(seed, d, max_acceleration):
    """None for most scenes, else one to three; from a generator of their own, which moves nothing else."""
    rng = np.random.default_rng([seed, d, 1])
    if rng.random() > BOUNDED:
        return ()
    kinds = [kind for kind in BOUNDS if d == 2 or kind != "convex_polygon"]
    return tuple(
        BOUNDS[kind](rng, d, max_acceleration) for kind in rng.choice(kinds, int(rng.integers(1, 4)), replace=False)
    )


def _admissible(response, state, limits, horizon):
    return limits.admissible(response, state, horizon)


def scene(seed, d):
    """The scene of that number: method and response follow from it, everything else is drawn from its generator."""
    rng = np.random.default_rng([seed, d])
    start, horizon = float(rng.choice([0.0, rng.uniform(-5, 50)])), float(rng.uniform(1.5, 8.0))
    max_speed, max_acceleration = float(rng.uniform(1.0, 6.0)), float(rng.uniform(0.5, 4.0))
    # Now and then faster than the limit, for which the admissible set follows another rule.
    velocity = _unit(rng, d) * max_speed * (1.2 if rng.random() < 0.04 else rng.uniform(0, 1) ** 0.7)
    acceleration = _unit(rng, d) * max_acceleration * rng.uniform(0, 0.9)
    state = State(rng.uniform(-20, 20, size=d), velocity, acceleration)
    bounds = {}
    for what, often in BOXES.items():
        now = velocity if what == "velocity_bounds" else acceleration
        bounds[what] = ()
        if rng.random() < often:
            normal = _unit(rng, d)
            offset = max(0.2, float(normal @ now) + 0.1) + rng.uniform(0, 0.5)
            scale = rng.uniform(0.5, 2.0)
            bounds[what] = (HalfSpace(normal * scale, offset * scale),)
    limits = Limits(max_speed, max_acceleration, **bounds, bounds=_bounds(seed, d, max_acceleration))
    method, response = _response(rng, seed, limits, d)
    admissible = _admissible(response, state, limits, horizon)
    forecast = METHODS[method].forecast
    smallest = int(np.argmin(admissible.radii))
    middle, reach = admissible.centers[smallest], float(admissible.radii[smallest])

    def control(low, high):
        return middle + reach * rng.uniform(low, high) * _unit(rng, d)

    preferred = control(0.0, 0.95) if rng.random() < 0.65 else control(1.05, 1.6)
    plain = Problem(
        dimension=d,
        start=start,
        horizon=horizon,
        position=np.array(state.position),
        velocity=np.array(state.velocity),
        acceleration=np.array(state.acceleration),
        response=(type(response).__name__, asdict(response)),
        robot_parts=[],
        shapes=[],
        headings=[],
        motions=[],
    )
    # Sizes follow how far the controls reach, or else one obstacle would block every control of a weak robot.
    size = float(np.clip(abs(plain.maps([horizon])[1][0]) * reach, 0.5, 8.0))
    robot, is_round = round_shape(float(size * rng.uniform(0.01, 0.06)), d), True
    all_round = rng.random() >= SHAPED
    if not all_round:
        robot, is_round = _robot(rng, d, robot.radius)
        all_round = d == 3 and not is_round
    plain.robot_parts = list(robot.parts)
    crowd = rng.random() < CROWDED
    count = int(rng.integers(4, 13)) if crowd else int(rng.integers(1, 13))
    haven = preferred if rng.random() < CLEAR else control(0.0, 1.0) if rng.random() < HAVEN else None
    if haven is not None and admissible.excess(haven) > 0:
        haven = None
    truths, shapes, headings, motions, names = [], [], [], [], []
    sparse, dense = np.linspace(0.0, horizon, 60), start + np.arange(0.0, horizon, 2e-3)
    best = preferred if admissible.excess(preferred) <= 0 else middle + reach * _pull(preferred - middle)
    for index in range(count):
        for _ in range(12):
            kind, parameters = KINDS[int(rng.integers(len(KINDS)))](rng, d, start, horizon)
            room = float(size * (rng.uniform(0.08, 0.3) if crowd else rng.uniform(0.01, 0.15)))
            name, shape, heading = _body(rng, d, room, all_round)
            if name == "polyline" and rng.random() < WALL_STANDS:
                kind, parameters = _stationary(rng, d, start, horizon)
            if heading == "motion" and kind not in HEADED:
                heading = float(rng.uniform(-7.0, 7.0))
            # In the way of the preferred control, or of one drawn from the admissible set, at some time.
            central = index == 0 and haven is not preferred
            aimed = best if central or rng.random() < 0.1 else control(0.0, 1.0 if crowd else 1.8)
            _shift(parameters, rng, plain, forecast, kind, aimed, room + robot.bounding_radius)
            seen = assumed(type(forecast).__name__, kind, parameters, start)
            if seen is None:
                continue
            alone = plain.among([list(shape.parts)], [heading], [seen])
            # inf: not there yet
            if alone.gap(0, preferred, np.zeros(1))[0] < INITIAL_CLEARANCE:
                continue
            if haven is not None and alone.gap(0, haven, sparse).min() < 0.01 * size:
                continue
            # Faster than that, the millisecond samples of the oracle say little, and nothing real moves so.
            if _speed(seen, heading, shape.bounding_radius, dense) > FASTEST:
                continue
            truths.append((kind, parameters))
            shapes.append(shape)
            headings.append(heading)
            motions.append(seen)
            names.append(name)
            break
    plain = plain.among([list(shape.parts) for shape in shapes], headings, motions)
    obstacles = [
        Obstacle(
            shape,
            forecast(TRAJECTORIES[kind](**parameters), start),
            f"{index} {kind}",
            heading=heading,
            after_end="leaves",
        )
        for index, (shape, heading, (kind, parameters)) in enumerate(zip(shapes, headings, truths))
    ]
    return Scene(
        seed=seed,
        method=method,
        state=state,
        response=response,
        limits=limits,
        admissible=admissible,
        preferred=preferred,
        obstacles=obstacles,
        problem=plain,
        plain_admissible=Admissible(admissible.centers, admissible.radii, admissible.normals, admissible.offsets),
        robot=robot,
        shapes=names,
        trials=np.array([control(0.0, 1.3) for _ in range(5)]),
    )


def _pull(offset):
    return 0.98 * offset / np.linalg.norm(offset)


def _shift(parameters, rng, plain, forecast, kind, aimed, room):
    """Move a trajectory so that, as it is foreseen, it stands in the way of the control `aimed` at some time."""
    now, t = plain.start, plain.horizon * rng.uniform(0.05, 1.0) ** 0.6
    if kind in STAMPS:
        first, last = STAMPS[kind](parameters)[[0, -1]] - now
        t = rng.uniform(max(first, 0.0), min(last, plain.horizon))
    seen = assumed(type(forecast).__name__, kind, parameters, now) or (kind, parameters)
    target = plain.robot(aimed, np.array([t]))[0] + _offset(rng, plain.dimension, room)
    here = motion(*seen, [now + t])[0][0]
    if np.isnan(here[0]):
        return
    MOTIONS[kind].moved(parameters, target - here)


def _offset(rng, d, radius):
    return directions(64, d)[int(rng.integers(64))] * radius * rng.uniform(0, 1.1)
