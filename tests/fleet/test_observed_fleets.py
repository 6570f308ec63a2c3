"""Robots that only observe each other: what is guaranteed of one decision, and what random fleets do."""

import numpy as np
import pytest
from draws import draws

from slalom import METHODS, ConstantVelocity, Disc, Fleet, Limits, Obstacle, Outcome, Sight, Tracks
from slalom.sim.run.states import integrate

DT, WORLDS, EACH = 0.1, 40, 3
WITH_MARGIN = (Outcome.CLEAR, Outcome.CONSTRAINED, Outcome.KEPT)
"""Outcomes of decisions that keep the whole margin, where it was there before."""


def crowd(seed: int) -> tuple[Fleet, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Robots on the move in many worlds, near each other: the fleet, states, targets, radii and accelerations.

    Their margin is what observed robots add to it, and nothing else.
    """
    rng, n = np.random.default_rng(seed), WORLDS * EACH
    radii, most, fast = rng.uniform(0.2, 0.8, n), rng.uniform(1.0, 4.0, n), rng.uniform(0.5, 2.0, n)
    around = 2.0 * np.pi * (np.tile(np.arange(EACH), WORLDS) / EACH + rng.uniform(0.0, 0.2, n))
    far = rng.uniform(1.4, 3.0, n)[:, None]
    places = far * np.stack([np.cos(around), np.sin(around)], axis=1)
    velocities = -places / far * (fast * rng.uniform(0.2, 1.0, n))[:, None]
    limits = [Limits(float(v), float(a)) for v, a in zip(fast, most, strict=True)]
    worlds = np.repeat(np.arange(WORLDS), EACH)
    fleet = Fleet(METHODS["nao"], [Disc(float(r)) for r in radii], limits, margin=0.0, worlds=worlds)
    return fleet, places, velocities, -places, radii, most


def gaps(positions: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Clearances (..., WORLDS, EACH, EACH) [m] of the robots of each world; inf with itself."""
    places, sizes = positions.reshape(*positions.shape[:-2], WORLDS, EACH, 2), radii.reshape(WORLDS, EACH)
    apart = np.linalg.norm(places[..., :, None, :] - places[..., None, :, :], axis=-1)
    return apart - sizes[:, :, None] - sizes[:, None, :] + np.diag(np.full(EACH, np.inf))


@pytest.mark.parametrize("seed", draws(range(5)))
def test_a_safe_decision_holds_for_one_period_whatever_the_others_do(seed: int) -> None:
    """The guarantee of docs/theory.md, 16: no contact within the period, if the clearance is the margin before it.

    Each of the others accelerates towards the robot as much as it can.
    """
    fleet, positions, velocities, targets, radii, most = crowd(seed)
    margin, times, tested, nearest = 2.0 * most.max() * DT * DT, np.linspace(0.0, DT, 6), 0, np.inf
    for k in range(25 if seed else 12):
        decided = fleet.step(k * DT, positions, velocities, targets)
        with_margin = np.array([outcome in WITH_MARGIN for outcome in decided.outcomes]).reshape(WORLDS, EACH)
        now = gaps(positions, radii)
        for i in range(EACH):
            own = np.arange(i, WORLDS * EACH, EACH)
            towards = positions[own].repeat(EACH, axis=0) - positions
            towards /= np.maximum(np.linalg.norm(towards, axis=1), 1e-9)[:, None]
            worst = most[:, None] * towards
            worst[own] = decided.accelerations[own]
            later = np.array([gaps(integrate(positions, velocities, worst, t)[0], radii) for t in times])
            counted = with_margin[:, i, None] & (now[:, i] >= margin) & np.isfinite(now[:, i])
            tested += int(counted.sum())
            nearest = min(nearest, float(later[:, :, i][:, counted].min(initial=np.inf)))
        positions, velocities = integrate(positions, velocities, decided.accelerations, DT)
    assert tested > (1000 if seed else 400)
    assert nearest >= -1e-6
    assert nearest < margin


@pytest.mark.parametrize("method", ["vo", "nao", "nao_shared"])
def test_robots_with_sight_meet_the_tracks_of_their_world_only(method: str) -> None:
    """As without sight: tracks of world 0 count, those of another world do not."""
    found = {}
    for sight in (None, Sight(9.0)):
        for worlds in (None, [0], [1]):
            person = Tracks([(3.0, 0.05)], [(-1.5, 0.0)], 0.3, worlds=worlds)
            fleet = Fleet(METHODS[method], Disc(0.3), Limits(1.5, 2.0), robots=1, sight=sight)
            decided = fleet.step(0.0, [(0.0, 0.0)], [(1.4, 0.0)], [(8.0, 0.0)], others=[person])
            found[sight is None, str(worlds)] = decided.accelerations[0]
    for worlds in ("None", "[0]", "[1]"):
        np.testing.assert_array_equal(found[False, worlds], found[True, worlds])
    np.testing.assert_array_equal(found[True, "None"], found[True, "[0]"])
    assert np.linalg.norm(found[True, "[0]"] - found[True, "[1]"]) > 0.1


@pytest.mark.parametrize("velocity", [0.0, 0.3])
def test_robots_see_where_their_bodies_face(velocity: float) -> None:
    """One that backs away from a car sees it only if it faces it."""
    car = Obstacle(Disc(0.5), ConstantVelocity((3.0, 0.0), (-1.5, 0.0)), "car")
    found = []
    for facing, obstacles in ((0.0, [car]), (np.pi, [car]), (0.0, [])):
        fleet = Fleet(METHODS["nao"], Disc(0.3), Limits(1.0, 1.0), robots=1, obstacles=obstacles, sight=Sight(9.0, 1.0))
        decided = fleet.step(0.0, [(0.0, 0.0)], [(-velocity, 0.0)], [(-8.0, 0.0)], headings=[facing])
        found.append(decided.accelerations[0])
    seen, unseen, alone = found
    assert np.linalg.norm(seen - alone) > 0.01
    np.testing.assert_array_equal(unseen, alone)
