"""Short runs among obstacles of every kind, and whether two values are the same to the bit."""

from dataclasses import fields, replace

import numpy as np
from parts import TRAJECTORIES as ENROLLED, disc_or_ball

from slalom import (
    METHODS,
    Circular,
    ConstantAcceleration,
    ConstantVelocity,
    Goal,
    HalfSpace,
    Limits,
    Obstacle,
    Sampled,
    State,
    Stationary,
    Trajectory,
)
from slalom.model.trajectory import TRAJECTORIES, PiecewisePolynomial
from slalom.sim import Recording, Robot, Scenario, simulate


def every_kind(d: int) -> dict[str, Trajectory]:
    """A trajectory of every kind, with numbers that no decimal writes exactly."""
    rng = np.random.default_rng(d)

    def near() -> np.ndarray:
        return rng.uniform(4.0, 9.0, size=d)

    times = np.cumsum(rng.uniform(0.3, 0.9, size=30)) - 1.0
    walk = near() + np.cumsum(rng.normal(0.0, 0.2, size=(30, d)), axis=0)
    kinds: dict[str, Trajectory] = {
        "stationary": Stationary(near()),
        "constant_velocity": ConstantVelocity(near(), rng.normal(size=d) / 3, 1 / 3),
        "constant_acceleration": ConstantAcceleration(near(), rng.normal(size=d) / 3, rng.normal(size=d) / 30, 1 / 7),
        "circular": Circular(near(), 2 / 3, -1 / 3, np.pi / 7, None if d == 2 else (1.0, 2.0, 2.5)),
        "circular along z": Circular(near(), 2 / 3, 1 / 3),
        "sampled": Sampled(times, walk, "smooth"),
        "sampled, linear": Sampled(times, walk, "linear"),
    }
    coefficients = rng.normal(size=(2, 5, d)) / 3
    coefficients[:, 0] += 7.0
    coefficients[1, 0] = (coefficients[0] * (1 / 3) ** np.arange(5)[:, None]).sum(axis=0)
    kinds["piecewise_polynomial"] = PiecewisePolynomial([1 / 3, 9.0], coefficients, -1 / 7)
    if d == 3:
        kinds |= {f"tilted {k}": Circular(near(), 1.0, 1.0, normal=rng.normal(size=3)) for k in range(4)}
    here = {type(kind) for kind in kinds.values()}
    others = {name: one for name, make in ENROLLED.items() if type(one := make(d)) in {*TRAJECTORIES.values()} - here}
    return kinds | others


def recorded(d: int, goal: Trajectory | None = None, **settings) -> Recording:
    """A short run among obstacles of every kind."""
    bounds = tuple(HalfSpace(np.arange(1.0, d + 1) + k, 3.0 + k / 3) for k in range(8))
    robot = Robot(
        disc_or_ball(1 / 3, d),
        Limits(2.1, 1.3, velocity_bounds=bounds, acceleration_bounds=bounds[:1]),
        State(np.full(d, 0.1), np.full(d, 0.2)),
        Goal(goal or Stationary(np.full(d, 12.0)), 0.7, stop=True),
    )
    others = tuple(
        Obstacle(disc_or_ball(0.1, d), t, f"an {name} – {k}") for k, (name, t) in enumerate(every_kind(d).items())
    )
    scenario = Scenario("every kind", (robot,), others, duration=1.2, replan=0.3, parameters={"a": 0.1, "b": 2.0})
    return simulate(replace(scenario, **settings), METHODS["nao"], seed=7)


def same_bits(a: object, b: object) -> bool:
    """Whether two frozen values hold the same numbers, fields included."""
    if isinstance(a, np.ndarray):
        return isinstance(b, np.ndarray) and a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if hasattr(a, "__dataclass_fields__"):
        return type(a) is type(b) and all(same_bits(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    if isinstance(a, tuple):
        return isinstance(b, tuple) and len(a) == len(b) and all(map(same_bits, a, b))
    return a == b
