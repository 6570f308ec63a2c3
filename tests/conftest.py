"""Settings and fixtures of all tests."""

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, settings
from parts import PERIOD, disc_or_ball

from slalom import Circular, Obstacle, State, Velocity, admissible_ball, control_obstacle, select

# Reproducible and quick by default. `--hypothesis-profile=long` looks harder, with new examples every time, and
# shrinks what it finds.
settings.register_profile(
    "slalom",
    derandomize=True,
    deadline=None,
    max_examples=15,
    phases=(Phase.explicit, Phase.generate),
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)
settings.register_profile(
    "long", deadline=None, max_examples=500, suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much]
)
settings.load_profile("slalom")


@pytest.fixture(scope="session", autouse=True)
def warm_kernels() -> None:
    """Compile (or load) every kernel once, so that no test pays for it."""
    for d in (2, 3):
        center, start = np.zeros(d), State(np.full(d, 4.0), np.zeros(d))
        obstacle = Obstacle(disc_or_ball(1.0, d), Circular(center, 2.0, 1.0))
        blocked = control_obstacle(Velocity(PERIOD), start, [obstacle], disc_or_ball(0.5, d), horizon=5.0)
        blocked.clearance(center)
        blocked.time_to_collision(center)
        select(np.full(d, -1.0), admissible_ball(center, 3.0), blocked)
