"""Chains of safe decisions wear no clearance away: a robot keeps its margin, or what it had of it, within LOST.

Distances are computed here, from the formulas of discs and segments. All motion is integrated exactly. `make nightly`
drives for one hour; other runs drive for a short time.
"""

import os

import numpy as np
import pytest
from draws import draws

import slalom

STEPS = int(os.environ.get("SLALOM_STEPS", "0"))
"""Decisions of each chain; 0: a few."""

LOST = 1e-5
"""[m] Most that a chain of decisions may lose of a clearance."""

PERIOD = 0.1

WALL, BESIDE, ACROSS = ((-5.0, 0.0), (900.0, 0.0)), ((-5.0, 0.68), (900.0, 0.68)), ((5.0, 0.0), (5.0, 9.0))
SCENES = {
    "wall": ([WALL], [], (0.0, 0.35), [(40.0, -30.0), (-2.0, -1.0)]),
    "two walls": ([WALL, BESIDE], [], (0.0, 0.34), [(40.0, 5.0), (-2.0, -5.0)]),
    "corner": ([((-5.0, 0.0), (5.0, 0.0)), ACROSS], [], (3.0, 0.5), [(9.0, -3.0), (8.0, 2.0)]),
    "disc": ([], [((0.0, 0.0), 1.0)], (-2.0, 0.1), [(3.0, 0.0), (-3.0, 0.2)]),
    "two goals": ([((-5.0, 0.0), (5.0, 0.0))], [((0.0, 1.0), 0.3)], (-2.0, 0.5), [(2.0, -1.0), (-2.0, -1.0)]),
}
"""Segments, discs, the start and the goals [m] of a robot with a radius of 0.3 m."""


def from_segment(segment, point):
    """The distance of a point from a segment."""
    a, along = np.array(segment[0]), np.subtract(segment[1], segment[0])
    return np.linalg.norm(point - a - np.clip((point - a) @ along / (along @ along), 0.0, 1.0) * along)


@pytest.mark.parametrize("scale", draws([1.0, 1e-3, 1e3, 30.0], 2))
@pytest.mark.parametrize("margin", draws([0.0, 0.05, 1e-4, 1e-3], 2))
@pytest.mark.parametrize("name", SCENES)
def test_a_robot_keeps_its_clearance_from_bodies_at_rest(name, margin, scale):
    segments, discs, start, goals = SCENES[name]
    segments = [[tuple(scale * np.array(corner)) for corner in segment] for segment in segments]
    discs = [(scale * np.array(center), scale * radius) for center, radius in discs]
    still = slalom.Stationary
    table = slalom.ObstacleTable(
        [slalom.Obstacle(slalom.Polyline(segment), still((0.0, 0.0))) for segment in segments]
        + [slalom.Obstacle(slalom.Disc(radius), still(center)) for center, radius in discs]
    )
    radius, margin = 0.3 * scale, margin * scale
    limits = slalom.Limits(1.5 * scale, scale)
    robot = slalom.Navigator(
        slalom.method("nao"), slalom.Disc(radius), limits, period=PERIOD, horizon=4.0, margin=margin
    )
    position, velocity, decision, kept = scale * np.array(start), np.zeros(2), None, margin
    for step in range(STEPS or 250):
        near = [from_segment(segment, position) for segment in segments]
        clearance = min(near + [np.linalg.norm(position - center) - size for center, size in discs]) - radius
        kept = min(kept, clearance) if step == 0 else kept
        assert clearance >= kept - LOST, step
        goal = slalom.Goal(still(scale * np.array(goals[step // 100 % 2])), 0.05 * scale, stop=True)
        now = PERIOD * step
        decision = robot.decide(slalom.State(position, velocity), table, goal, now=now, previous=decision)
        assert decision.safe, (step, decision.outcome)
        applied = decision.manoeuvre.mean_acceleration(now, PERIOD)
        position = position + PERIOD * velocity + 0.5 * PERIOD**2 * applied
        velocity = velocity + PERIOD * applied


@pytest.mark.parametrize("seed", draws(range(20)))
def test_robots_that_press_towards_one_place_do_not_overlap(seed):
    draw = np.random.default_rng(seed)
    count, margin = int(draw.integers(4, 13)), float(draw.choice([0.0, 1e-4, 1e-3, 0.05]))
    fleet = slalom.Fleet(
        *(slalom.method("nao_shared"), slalom.Disc(0.3), slalom.Limits(1.5, 1.0)),
        robots=count,
        period=PERIOD,
        horizon=8.0,
        margin=margin,
    )
    positions = 1.2 * np.stack([np.arange(count) % 4, np.arange(count) // 4], axis=1)
    positions, velocities = positions + draw.normal(scale=0.1, size=(count, 2)), np.zeros((count, 2))
    place = positions.mean(axis=0) + draw.normal(scale=0.15, size=(count, 2))
    pairs = np.triu_indices(count, 1)
    for step in range(STEPS or 1200):
        if step % 60 == 0:
            goals = place + draw.normal(scale=0.3, size=(count, 2)) * (step // 60 % 2)
        apart = np.linalg.norm(positions[pairs[0]] - positions[pairs[1]], axis=1).min()
        assert apart >= 0.6 + margin - LOST, step
        decisions = fleet.step(PERIOD * step, positions, velocities, goals)
        assert all(outcome.safe for outcome in decisions.outcomes), step
        positions = positions + PERIOD * velocities + 0.5 * PERIOD**2 * decisions.accelerations
        velocities = velocities + PERIOD * decisions.accelerations


def drawn_body(draw, scale, moves):
    """A disc, or a wall where it does not move, and its distance from a point at a time."""
    center = draw.uniform(-3.0, 3.0, 2) * scale
    if not moves and draw.random() < 0.5:
        end = center + draw.uniform(-3.0, 3.0, 2) * scale
        wall = slalom.Obstacle(slalom.Polyline([center, end]), slalom.Stationary((0.0, 0.0)))
        return wall, lambda point, t: from_segment((center, end), point)
    size, path = draw.uniform(0.1, 0.6) * scale, slalom.Stationary(center)
    if moves and draw.random() < 0.5:
        path = slalom.Circular(center, draw.uniform(0.5, 2.0) * scale, draw.normal(scale=0.5), draw.uniform(0.0, 6.0))
    elif moves:
        path = slalom.ConstantVelocity(center, draw.normal(scale=0.5, size=2) * scale)
    body = slalom.Obstacle(slalom.Disc(size), path)
    return body, lambda point, t: np.linalg.norm(point - path.position(t)) - size


@pytest.mark.parametrize("chunk", draws(range(80)))
def test_a_chain_of_safe_decisions_stays_safe(chunk):
    """25 chains among bodies with known motion; a body that moves may drive into a robot at rest."""
    for seed in range(25 * chunk, 25 * chunk + 25):
        draw = np.random.default_rng(seed)
        scale = draw.choice([1.0, 1.0, 1e-2, 10.0, 100.0])
        margin = draw.choice([0.0, 1e-6, 1e-5, 1e-4, 1e-3, 0.05]) * min(scale, 1.0)
        radius, period = draw.uniform(0.1, 0.4) * scale, draw.choice([0.05, 0.1, 0.2])
        fastest, strongest = draw.uniform(0.5, 3.0, 2) * scale
        moving = int(draw.integers(0, 3))
        bodies = [drawn_body(draw, scale, k < moving) for k in range(moving + int(draw.integers(1, 5)))]
        horizon = max(4.0, 1.5 * fastest / strongest)
        robot = slalom.Navigator(
            *(slalom.method("nao"), slalom.Disc(radius), slalom.Limits(fastest, strongest)),
            period=period,
            horizon=horizon,
            margin=margin,
        )
        position, velocity, decision = np.zeros(2), draw.normal(scale=0.3, size=2) * fastest, None
        if min(distance(position, 0.0) for _, distance in bodies) < radius + margin + 0.05 * scale:
            continue
        for step in range(60):
            if step % 20 == 0:
                goal = slalom.Goal(slalom.Stationary(draw.uniform(-4.0, 4.0, 2) * scale), 0.1 * scale, stop=True)
            now, before = period * step, decision
            state = slalom.State(position, velocity)
            decision = robot.decide(state, [body for body, _ in bodies], goal, now=now, previous=before)
            if not decision.safe:
                assert moving > 0 or before is None, (seed, step, decision.outcome)
                break
            assert before is None or min(distance(position, now) for _, distance in bodies) >= radius - LOST
            applied = decision.manoeuvre.mean_acceleration(now, period)
            position = position + period * velocity + 0.5 * period**2 * applied
            velocity = velocity + period * applied
