"""`select` and `ControlObstacle` against an independent oracle, on thousands of random scenes."""

import mpmath
import numpy as np
import pytest
from definitions import out_of_bound
from draws import draws
from oracle import STAMPS, better_control, motion, polynomial_gap, times
from scenes import SHAPES, scene

import slalom
from slalom import (
    METHODS,
    Acceleration,
    ConstantAcceleration,
    ConvexPolygon,
    Jerk,
    LeastSpeed,
    Obstacle,
    State,
    Status,
    Velocity,
    control_obstacle,
    select,
)
from slalom.model.response import RESPONSES
from slalom.model.shape import SHAPES as SERVED, round_shape


def chunks(d: int, scenes: int) -> list:
    """Dimension and numbers of the scenes of each chunk; the first one is small."""
    return draws(
        (d, numbers) for numbers in [range(10), range(10, 25), *(range(k, k + 25) for k in range(25, scenes, 25))]
    )


CHUNKS = [*chunks(2, 2000), *chunks(3, 500)]

SAFE = -1e-6  # [m] least true clearance of a choice
FREE = 1e-5  # [m] clearance of a control that no better choice may have
NEARER = 1e-6  # [1] by which nothing free may be nearer to the preferred control, relative to max(1, distance)
CLEARANCE = 5e-6  # [m] between the library's clearance and the oracle's
GRAZING = 1e-4  # [m] within which the time of first contact is open
CONTACT_TIME = 1e-3  # [s]


@pytest.fixture(scope="module", params=CHUNKS, ids=lambda chunk: f"{chunk[0]}d-{chunk[1].start}")
def chunk(request):
    """Scenes, made once for all tests of the chunk."""
    d, numbers = request.param
    return [scene(number, d) for number in numbers]


def check_choice(s):
    """Admissible, safe, and nothing the oracle finds is better, unless undecided; returns the status."""
    choice = select(s.preferred, s.admissible, s.blocked)
    free = s.plain_admissible
    scale = 1.0 + max(s.admissible.radii.max(), np.abs(s.admissible.offsets).max(initial=0.0))
    reach, why = np.inf, f"{choice}\n{s}"
    if choice.status in (Status.CLEAR, Status.CONSTRAINED):
        u = choice.control
        assert free.excess(u[None])[0] <= 1e-9 * scale, f"not admissible: {why}"
        clearance = s.problem.clearance(u)
        assert clearance >= SAFE, f"clearance {clearance:g}: {why}"
        distance = float(np.linalg.norm(u - s.preferred))
        assert choice.distance == pytest.approx(distance, rel=1e-12, abs=1e-15), why
        reach = distance - NEARER * max(1.0, distance)
        assert (choice.status is Status.CLEAR) == (distance == 0.0), why
    else:
        assert choice.control is None, why
        if choice.status is Status.UNDECIDED:
            return choice.status
        assert choice.status in (Status.BLOCKED, Status.INADMISSIBLE), why
    found = better_control(s.problem, free, s.preferred, reach, FREE, choice.control)
    if choice.status is Status.INADMISSIBLE:
        found = better_control(s.problem.alone(), free, s.preferred, reach, FREE)
    if found is not None:
        nearer = np.linalg.norm(found - s.preferred)
        pytest.fail(f"{found} is free by {s.problem.clearance(found):g} at distance {nearer:.9g}: {why}")
    if free.excess(s.preferred[None])[0] <= 0 and s.problem.clearance(s.preferred) >= FREE:
        assert choice.status is Status.CLEAR, f"the preferred control is free: {why}"
    return choice.status


def test_the_choice_is_safe_and_nothing_is_better(chunk):
    """At most one is undecided, at the limit of its work: 1 of the 2000 scenes in the plane."""
    assert [check_choice(s) for s in chunk].count(Status.UNDECIDED) <= 1


def test_clearance_and_contact_are_those_of_the_true_motion(chunk):
    for s in chunk:
        clearances, times = s.blocked.clearance(s.trials), s.blocked.time_to_collision(s.trials)
        inside = s.blocked.contains(s.trials)
        for u, clearance, time, contained in zip(s.trials, clearances, times, inside):
            true, why = s.problem.clearance(u), f"control {u.tolist()}: {s}"
            assert clearance == true or abs(clearance - true) <= CLEARANCE, f"{clearance:.9g}, true {true:.9g}, {why}"
            assert contained == np.isfinite(time), why
            if abs(true) > CLEARANCE:
                assert contained == (true < 0), f"contains: {contained}, true clearance {true:g}, {why}"
            # Not too early: something is touched then. Not too late: nothing was overlapped before.
            if contained:
                gap = s.problem.least_gap_near(u, time, CONTACT_TIME)
                assert gap <= GRAZING, f"contact at {time:.6f}, but the true gap is {gap:g}, {why}"
            late = s.problem.first_overlap(u, GRAZING)
            assert time <= late + CONTACT_TIME, f"contact at {time:.6f}, but true overlap at {late:.6f}, {why}"


def test_admissible_controls_obey_the_limits(chunk):
    for s in chunk:
        # A robot that is too fast cannot obey at once; its admissible set follows another rule.
        if np.linalg.norm(s.state.velocity) > s.limits.max_speed:
            continue
        for u in s.trials[s.admissible.contains(s.trials)]:
            velocity, acceleration = s.problem.speeds(u)
            for values, most, bounds in (
                (velocity, s.limits.max_speed, s.limits.velocity_bounds),
                (acceleration, s.limits.max_acceleration, s.limits.acceleration_bounds),
            ):
                excess = np.sqrt((values**2).sum(axis=1)).max() / most - 1.0
                assert excess <= 1e-7, f"over a limit by {excess:g} with {u.tolist()}: {s}"
                for bound in bounds:
                    assert (values @ bound.normal).max() <= bound.offset + 1e-7, f"out of bounds, {u.tolist()}: {s}"
            name, parameters = s.problem.response
            if name == "AccelerateThenTurn":
                # Bounds in the frame of the body turn along.
                angle = parameters["rate"] * np.maximum(s.problem.times - parameters["hold"], 0.0)
                velocity, acceleration = (times(np.exp(-1j * angle), x) for x in (velocity, acceleration))
            for bound in s.limits.bounds:
                values = velocity if bound.of == "velocity" else acceleration
                if isinstance(bound, LeastSpeed) and name in ("AccelerateThenStop", "AccelerateThenBrake"):
                    values = values[: max(1, int(len(values) * parameters["hold"] / s.problem.horizon) - 1)]
                if name == "Jerk" and bound.of == "acceleration":
                    # It begins from what was applied before, which no control changes.
                    values = values[-1:]
                excess = out_of_bound(bound, s.state.velocity, values).max()
                assert excess <= 1e-7, f"out of {bound} by {excess:g}, {u.tolist()}: {s}"


@pytest.mark.slow
def test_the_scenes_have_bounds_of_every_kind():
    for d in (2, 3):
        seen = [type(bound) for number in range(100) for bound in scene(number, d).limits.bounds]
        assert all(
            seen.count(kind) >= 3 for kind in slalom.model.bounds.BOUNDS.values() if (d, kind) != (3, ConvexPolygon)
        )


@pytest.mark.slow
def test_the_scenes_are_hard_and_of_every_kind():
    seen = {what: set() for what in ("method", "response", "kind", "shape", "robot", "turning")}
    statuses, all_round = [], 0
    for number in range(300):
        s = scene(number, 2)
        seen["method"].add(s.method)
        seen["response"].add((s.method, type(s.response).__name__))
        seen["kind"] |= {kind for kind, _ in s.problem.motions}
        seen["shape"] |= {(name, type(o.shape)) for name, o in zip(s.shapes, s.obstacles)}
        seen["robot"].add(type(s.robot))
        seen["turning"] |= {(name, o.heading == "motion") for name, o in zip(s.shapes, s.obstacles)}
        all_round += set(s.shapes) | {type(s.robot).__name__} <= {"round", "Disc"}
        statuses.append(select(s.preferred, s.admissible, s.blocked).status)
    assert seen["method"] == set(METHODS)
    assert len(seen["response"]) == len(METHODS) * len(RESPONSES)
    assert {"constant_acceleration", "circular", "sampled"} <= seen["kind"]
    in_the_plane = {kind for name, kind in SERVED.items() if name != "ball"}
    assert {name for name, _ in seen["shape"]} == set(SHAPES)
    assert {kind for _, kind in seen["shape"]} == in_the_plane
    assert seen["robot"] == in_the_plane - {SERVED["polyline"]}
    assert seen["turning"] == {(name, turning) for name in SHAPES for turning in (False, True)}
    assert 0.4 < all_round / len(statuses) < 0.6, all_round
    shares = {status: statuses.count(status) / len(statuses) for status in Status}
    assert shares[Status.CONSTRAINED] > 0.4, shares
    assert shares[Status.BLOCKED] > 0.1, shares
    assert shares[Status.CLEAR] > 0.1, shares


def spread(rng, d, most):
    return rng.uniform(-most, most, size=d)


@pytest.mark.parametrize("response", [Velocity(), Acceleration(), Jerk()], ids=["quadratic", "quartic", "sextic"])
@pytest.mark.parametrize("d", [2, 3])
def test_closed_forms_agree(response, d):
    """The gap is a polynomial for VO (quadratic), AO (quartic) and jerk (sextic): the roots know all."""
    rng = np.random.default_rng(d)
    order, contacts = {Velocity: 1, Acceleration: 2, Jerk: 3}[type(response)], 0
    for number in range(100):
        state = State(spread(rng, d, 1.0), spread(rng, d, 2.0), spread(rng, d, 1.0))
        # For VO the obstacle keeps its velocity, or the polynomial would be a quartic there too.
        acceleration = spread(rng, d, 1.0) * (order > 1)
        position, velocity, radius, horizon = spread(rng, d, 8.0), spread(rng, d, 2.0), rng.uniform(0.1, 1.0), 6.0
        other = Obstacle(round_shape(radius, d), ConstantAcceleration(position, velocity, acceleration))
        blocked = control_obstacle(response, state, [other], round_shape(0.2, d), horizon=horizon)
        # A control that leads towards the obstacle at some time, so that many meet it.
        t = rng.uniform(1.0, horizon)
        image = response.position(state, t)
        u = image.inverse(other.trajectory.position(t) + spread(rng, d, 1.0))
        terms = [position - state.position, velocity - state.velocity, acceleration - state.acceleration, -u]
        if order == 1:
            terms = [terms[0], velocity - u]
        elif order == 2:
            terms = [*terms[:2], acceleration - u]
        if np.linalg.norm(terms[0]) < radius + 0.25:
            continue
        why = f"number {number}, d = {d}, {response}"
        least, contact = polynomial_gap(terms, radius + 0.2, horizon)
        assert float(blocked.clearance(u)) == pytest.approx(least, abs=1e-8), why
        if abs(least) < 1e-6:
            continue
        assert np.isfinite(contact) == bool(blocked.contains(u)), why
        if np.isfinite(contact):
            contacts += 1
            exact = precise_root(terms, radius + 0.2, contact)
            assert float(blocked.time_to_collision(u)) == pytest.approx(exact, abs=1e-6), why
    assert contacts > 15


def precise_root(terms, radius, near):
    """The time of contact closest to `near`, to 30 digits."""
    with mpmath.workdps(30):
        parts = [[mpmath.mpf(float(x)) / mpmath.factorial(k) for k, x in enumerate(axis)] for axis in np.array(terms).T]
        n = len(terms)
        square = [
            mpmath.fsum(part[i] * part[k - i] for part in parts for i in range(n) if 0 <= k - i < n)
            for k in range(2 * n - 1)
        ]
        square[0] -= mpmath.mpf(float(radius)) ** 2
        return float(mpmath.findroot(lambda t: mpmath.fsum(c * t**k for k, c in enumerate(square)), near))


@pytest.mark.parametrize("number", range(40))
def test_derived_motions_have_the_derivatives_they_state(number):
    """The oracle's own velocities and accelerations, by differences: forecasts rest on them."""
    s, h = scene(number, 2 + number % 2), 1e-4
    for kind, parameters in s.problem.motions:
        t = s.problem.start + np.linspace(0.05, 0.95, 7) * s.problem.horizon
        if kind in STAMPS:
            stamps = STAMPS[kind](parameters)
            t = 0.6 * stamps[1:] + 0.4 * stamps[:-1]
        before, now, after = (motion(kind, parameters, x) for x in (t - h, t, t + h))
        for order in (0, 1):
            np.testing.assert_allclose((after[order] - before[order]) / (2 * h), now[order + 1], atol=1e-4, rtol=1e-4)
