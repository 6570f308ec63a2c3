"""Random decisions, each made from one integer: plain numbers for the oracle, and the library's objects from them."""

from dataclasses import asdict, dataclass

import numpy as np
from oracle import STAMPS, Admissible, Problem, assumed, directions, motion

import slalom
from slalom import METHODS, HalfSpace, Limits, Obstacle, State, Traffic
from slalom.methods import HOLDS
from slalom.response import RESPONSES
from slalom.shape import round_shape
from slalom.trajectory import TRAJECTORIES

INITIAL_CLEARANCE = 0.05  # [m]
FASTEST = 15.0  # [m/s]
# How often the preferred control, or one drawn at random, is kept free, and how often a scene has many large obstacles:
# they set the mix of statuses.
CLEAR, HAVEN, CROWDED = 0.28, 0.8, 0.3


def _unit(rng, d):
    v = rng.normal(size=d)
    return v / np.linalg.norm(v)


# ---------------------------------------------------------------------------------------------------------------------
# Trajectories: (kind, parameters) near the origin; the scene moves them to where they are in the way.


def _stationary(rng, d, start, horizon):
    return "stationary", {"place": np.zeros(d)}


def _constant_velocity(rng, d, start, horizon):
    speed = _unit(rng, d) * rng.uniform(0.1, 4.0)
    return "constant_velocity", {"place": np.zeros(d), "speed": speed, "at": start + rng.uniform(-1, 1)}


def _constant_acceleration(rng, d, start, horizon):
    speed, push = _unit(rng, d) * rng.uniform(0.1, 3.0), _unit(rng, d) * rng.uniform(0.1, 1.5)
    return "constant_acceleration", {"place": np.zeros(d), "speed": speed, "push": push, "at": start}


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


KINDS = (
    _stationary,
    _constant_velocity,
    _constant_acceleration,
    _circular,
    _linear,
    _smooth,
    _brief,
    _polynomials,
)
"""Every kind of trajectory: a later one joins here, and in `oracle.MOTIONS`."""


# ---------------------------------------------------------------------------------------------------------------------
# Responses by class, for random ones beside those of the method rows.

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
    "Jerk": lambda rng: {},
}
"""Random parameters for every kind of response: a later one joins here, and in `oracle.RESPONSES`."""

BOXES = {"velocity_bounds": 0.15, "acceleration_bounds": 0.15}
"""How often a scene has half-spaces beside its largest norms."""


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
    blocked: slalom.ControlObstacle
    problem: Problem
    plain_admissible: Admissible
    trials: np.ndarray  # (n, d) controls to compare clearances at

    def __str__(self):
        kinds = [kind for kind, _ in self.problem.motions]
        return (
            f"scenes.scene({self.seed}, {self.state.dimension}): {self.method}, {self.response}, "
            f"horizon {self.problem.horizon:.3f} s, obstacles {kinds}"
        )


def _response(rng, number, limits):
    """Method and response: in turn those of the method rows, and every kind with random parameters."""
    name = list(METHODS)[number % len(METHODS)]
    if number % 2:
        kind = RESPONSES[(number // 10) % len(RESPONSES)]
        return name, kind(**PARAMETERS[kind.__name__](rng))
    rows = METHODS[name].responses(limits, float(rng.choice([0.05, 0.1, 0.2])), HOLDS)
    return name, rows[(number // 10) % len(rows)]


def _admissible(response, state, limits, horizon):
    return limits.admissible(response, state, horizon)


def scene(seed, d):
    """The scene of that number: method and response follow from it, everything else is drawn from its generator."""
    rng = np.random.default_rng([seed, d])
    start, horizon = float(rng.choice([0.0, rng.uniform(-5, 50)])), float(rng.uniform(1.5, 8.0))
    top, push = float(rng.uniform(1.0, 6.0)), float(rng.uniform(0.5, 4.0))
    # Now and then faster than the limit, for which the admissible set follows another rule.
    velocity = _unit(rng, d) * top * (1.2 if rng.random() < 0.04 else rng.uniform(0, 1) ** 0.7)
    acceleration = _unit(rng, d) * push * rng.uniform(0, 0.9)
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
    limits = Limits(top, push, **bounds)
    method, response = _response(rng, seed, limits)
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
        robot_radius=0.0,
        radii=np.empty(0),
        motions=[],
    )
    # Sizes follow how far the controls reach, or else one obstacle would block every control of a weak robot.
    size = float(np.clip(plain.maps([horizon])[1][0] * reach, 0.5, 8.0))
    plain.robot_radius = robot = float(size * rng.uniform(0.01, 0.06))
    crowd = rng.random() < CROWDED
    count = int(rng.integers(4, 13)) if crowd else int(rng.integers(1, 13))
    haven = preferred if rng.random() < CLEAR else control(0.0, 1.0) if rng.random() < HAVEN else None
    if haven is not None and admissible.excess(haven) > 0:
        haven = None
    truths, radii, motions, sparse = [], [], [], np.linspace(0.0, horizon, 60)
    often = start + np.linspace(0.0, horizon, 400)
    best = preferred if admissible.excess(preferred) <= 0 else middle + reach * _pull(preferred - middle)
    for index in range(count):
        for _ in range(12):
            kind, parameters = KINDS[int(rng.integers(len(KINDS)))](rng, d, start, horizon)
            radius = float(size * (rng.uniform(0.08, 0.3) if crowd else rng.uniform(0.01, 0.15)))
            # In the way of the preferred control, or of one drawn from the admissible set, at some time.
            central = index == 0 and haven is not preferred
            aimed = best if central or rng.random() < 0.1 else control(0.0, 1.0 if crowd else 1.8)
            _shift(parameters, rng, plain, forecast, kind, aimed, radius)
            seen = assumed(type(forecast).__name__, kind, parameters, start)
            if seen is None:
                continue
            plain.motions, plain.radii = [seen], np.array([radius])
            # nan: not there yet
            initial = np.linalg.norm(plain.place(0, np.zeros(1))[0] - plain.position) - radius - robot
            if initial < INITIAL_CLEARANCE or (haven is not None and plain.gap(0, haven, sparse).min() < 0.01 * size):
                continue
            # Faster than that, the millisecond samples of the oracle say little, and nothing real moves so.
            if np.nanmax(np.linalg.norm(motion(*seen, often)[1], axis=1)) > FASTEST:
                continue
            truths.append((kind, parameters))
            motions.append(seen)
            radii.append(radius)
            break
    plain.motions, plain.radii = motions, np.array(radii)
    obstacles = [
        Obstacle(round_shape(radius, d), forecast(TRAJECTORIES[kind](**parameters), start), f"{index} {kind}")
        for index, (radius, (kind, parameters)) in enumerate(zip(radii, truths))
    ]
    blocked = slalom.ControlObstacle(response, state, Traffic(obstacles, start, horizon), round_shape(robot, d))
    return Scene(
        seed=seed,
        method=method,
        state=state,
        response=response,
        limits=limits,
        admissible=admissible,
        preferred=preferred,
        blocked=blocked,
        problem=plain,
        plain_admissible=Admissible(admissible.centers, admissible.radii, admissible.normals, admissible.offsets),
        trials=np.array([control(0.0, 1.3) for _ in range(5)]),
    )


def _pull(offset):
    return 0.98 * offset / np.linalg.norm(offset)


def _shift(parameters, rng, plain, forecast, kind, aimed, radius):
    """Move a trajectory so that, as it is foreseen, it stands in the way of the control `aimed` at some time."""
    now, t = plain.start, plain.horizon * rng.uniform(0.05, 1.0) ** 0.6
    if kind in STAMPS:
        first, last = STAMPS[kind](parameters)[[0, -1]] - now
        t = rng.uniform(max(first, 0.0), min(last, plain.horizon))
    seen = assumed(type(forecast).__name__, kind, parameters, now) or (kind, parameters)
    target = plain.robot(aimed, np.array([t]))[0] + _offset(rng, plain.dimension, radius + plain.robot_radius)
    here = motion(*seen, [now + t])[0][0]
    if np.isnan(here[0]):
        return
    if kind == "piecewise_polynomial":
        parameters["coefficients"][:, 0] += target - here
        return
    where = {"circular": "center", "sampled": "positions"}.get(kind, "place")
    parameters[where] = parameters[where] + (target - here)


def _offset(rng, d, radius):
    return directions(64, d)[int(rng.integers(64))] * radius * rng.uniform(0, 1.1)
