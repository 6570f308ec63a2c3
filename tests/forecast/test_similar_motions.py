"""Laws of the model that repeats similar motions of the past: against an oracle, without the future, of others."""

from collections.abc import Sequence

import numpy as np
import pytest

from slalom import Disc, FromModels, Obstacle, ObstacleWindow, Sampled, Stationary, kernels
from slalom.base.checks import Array
from slalom.base.tolerances import SIMILAR_VELOCITY_SPAN
from slalom.kernels.arrays import TrackSamples
from slalom.kernels.crowd import SIMILAR_CANDIDATES, SIMILAR_DOUBT, SIMILAR_PLACE, SIMILAR_REACH, SIMILAR_VELOCITY
from slalom.model.trajectory import Trajectory
from slalom.obstacle.window import futures

STEP = 0.1
each_dimension = pytest.mark.parametrize("d", [2, 3])
draws = pytest.mark.parametrize("seed", range(6))


def around_a_corner(start: float, seed: int = 0, until: float = 99.0) -> Sampled:
    """A person who walks 6 m at 1.2 m/s, turns left at a corner of 1 m radius, and walks 6 m on."""
    rng = np.random.default_rng(seed)
    times = np.arange(start, min(start + 11.0, until), STEP)
    way = 1.2 * (times - start)
    angle = np.clip(way - 6.0, 0.0, 0.5 * np.pi)
    on = np.maximum(way - 6.0 - 0.5 * np.pi, 0.0)
    x = np.minimum(way, 6.0) + np.sin(angle)
    places = np.stack([x, 1.0 - np.cos(angle) + on], axis=1) + rng.uniform(-0.1, 0.1, 2)
    return Sampled(times, places + rng.normal(0.0, 0.02, places.shape), "linear")


def wandering(seed: int, d: int, count: int = 6) -> list[Sampled]:
    """Tracks that begin and end at different times and accelerate at random in a small place."""
    rng, tracks = np.random.default_rng(seed), []
    for _ in range(count):
        times = rng.uniform(0.0, 4.0) + STEP * np.arange(rng.integers(30, 90))
        velocities = rng.normal(size=d) + np.cumsum(rng.normal(0.0, 0.1, (len(times), d)), axis=0)
        tracks.append(Sampled(times, rng.uniform(-2.0, 2.0, d) + np.cumsum(STEP * velocities, axis=0), "linear"))
    return tracks


def people(tracks: Sequence[Sampled]) -> list[Obstacle]:
    return [Obstacle(Disc(0.3), track, after_end="leaves") for track in tracks]


def expected(places: Array, velocities: Array, knots: Array, column: int, positions: Array, count: int) -> Array:
    """Displacements, variances and shares of the weights by the definition, from all motions at once."""
    span, found = SIMILAR_VELOCITY_SPAN, []
    for place, velocity in zip(places, velocities, strict=True):
        speed, motions = np.linalg.norm(velocity), []
        for i, track in enumerate(positions):
            for k in range(span, column + 1):
                own = (track[k] - track[k - span]) / span
                if not np.isfinite(own).all() or speed == 0.0:
                    continue
                apart = np.linalg.norm(track[k] - place) / (SIMILAR_PLACE * speed)
                differs = np.linalg.norm(own - velocity) / (SIMILAR_VELOCITY * speed)
                if np.hypot(apart, differs) < SIMILAR_REACH:
                    motions.append((np.hypot(apart, differs), i, k, own))
        motions = sorted(motions, key=lambda motion: motion[:3])[: SIMILAR_CANDIDATES * count]
        row = []
        for knot in knots:
            known = [m for m in motions if m[2] + knot <= column and np.isfinite(positions[m[1], m[2] + knot]).all()]
            weights = [np.exp(-0.5 * m[0] ** 2) for m in known[:count]]
            left = [positions[m[1], m[2] + knot] - positions[m[1], m[2]] - knot * m[3] for m in known[:count]]
            points = np.array([0.0 * place, *left])
            mean = np.average(points, axis=0, weights=[SIMILAR_DOUBT, *weights])
            variance = np.average(((points - mean) ** 2).sum(axis=1), weights=[SIMILAR_DOUBT, *weights])
            row.append([*(knot * velocity + mean), variance, sum(weights) / (SIMILAR_DOUBT + sum(weights))])
        found.append(row)
    return np.array(found)


@each_dimension
@draws
def test_displacements_follow_the_definition(seed: int, d: int) -> None:
    rng = np.random.default_rng(seed)
    positions = np.cumsum(rng.normal(0.1, 0.05, (7, 40, d)), axis=1) + rng.uniform(-0.5, 0.5, (7, 1, d))
    first, last = rng.integers(0, 20, 7), rng.integers(15, 40, 7)
    for track, begin, end in zip(positions, first, last, strict=True):
        track[:begin], track[end + 1 :] = np.nan, np.nan
    column, knots, count = 39, np.array([0, 2, 5, 11]), 4
    ways = np.nan_to_num(np.linalg.norm(np.diff(positions, axis=1), axis=2)).max(axis=1)
    samples = TrackSamples(positions, first, np.where(last >= first, last, -1), ways)
    places, velocities = rng.uniform(0.0, 3.0, (12, d)), rng.normal(0.1, 0.05, (12, d))
    velocities[0] = 0.0
    found = kernels.similar_displacements(places, velocities, knots, samples, count)
    np.testing.assert_allclose(
        found, expected(places, velocities, knots, column, positions, count), rtol=1e-9, atol=1e-12
    )


@each_dimension
@draws
def test_what_comes_later_has_no_effect(seed: int, d: int) -> None:
    """All tracks part from others after the time of the forecast, and more tracks begin then: the same bits."""
    tracks, now = wandering(seed, d), 5.0
    changed = []
    for track in tracks:
        times, places = track.times, track.positions.copy()
        later = times > now + STEP
        places[later] += np.cumsum(np.full((int(later.sum()), d), 0.3), axis=0)
        changed.append(Sampled(times, places, "linear"))
    new = Sampled(now + 1.0 + track.times - track.times[0], track.positions, "linear")
    results = []
    for some in (tracks, [*changed, new]):
        there = [track for track in some if track.span[0] < now < track.span[1]]
        results.append(FromModels().predictions(there, now, 1.0, some))
    for one, other in zip(*results, strict=True):
        ahead = now + np.linspace(0.0, 6.0, 31)
        np.testing.assert_array_equal(one.each[0][1].position(ahead), other.each[0][1].position(ahead))
        assert one.error == other.error


@draws
def test_earlier_forecasts_have_no_effect(seed: int) -> None:
    """A forecast after many others is that of new objects, to the bit."""
    results = []
    for times in (np.arange(2.0, 6.05, 0.07), np.array([])):
        tracks = wandering(seed, 2)
        for now in (*times, 6.03):
            there = [track for track in tracks if track.span[0] < now < track.span[1]]
            found = FromModels().predictions(there, now, 1.0, tracks)
        results.append([one.each[0][1].position(6.03 + np.linspace(0.0, 4.0, 9)) for one in found])
    np.testing.assert_array_equal(results[0], results[1])


@pytest.mark.parametrize("how", ["window", "futures"])
def test_those_that_left_show_the_way(how: str) -> None:
    """On the way to a corner and around it: the errors are a third, since others, which have left, went around it."""
    now, ahead, errors = 34.0, 2.5, []
    others = [around_a_corner(start, seed) for seed, start in enumerate((0.0, 7.0, 15.0, 22.0))]
    for begun in np.arange(3.0, 8.5, 0.5):
        newest = around_a_corner(now - begun, 9)
        obstacles = people([*others, newest])
        for rule in (FromModels(), FromModels(similar=0)):
            if how == "window":
                (found,) = ObstacleWindow.predicted(obstacles, rule, now, 4.0).obstacles
            else:
                ((found,),) = futures(obstacles, rule, now, [4])
            errors.append(np.linalg.norm(found.trajectory.position(now + ahead) - newest.position(now + ahead)))
    with_others, alone = np.mean(np.reshape(errors, (-1, 2)), axis=0)
    assert with_others < alone / 3.0


def test_a_track_that_has_just_appeared_is_predicted_from_itself() -> None:
    """Its velocity is not known well enough to find similar motions."""
    now = 34.0
    newest = around_a_corner(now - 0.15, 9)
    results = []
    for others in ([], [around_a_corner(start, seed) for seed, start in enumerate((0.0, 7.0, 15.0))]):
        (found,) = FromModels().predictions([newest], now, 1.0, [*others, newest])
        results.append(found.each[0][1].position(now + np.linspace(0.0, 4.0, 9)))
    np.testing.assert_array_equal(results[0], results[1])


def test_without_motions_of_others_a_straight_track_stays_straight() -> None:
    """Obstacles at rest are no motions; neither are tracks that ended long ago or are yet to begin."""
    times = np.arange(0.0, 8.0, STEP)
    track, wall = Sampled(times, np.stack([times, 0.0 * times], axis=1), "linear"), Stationary((1.0, 0.0))
    old, new = (Sampled(times + begin, np.stack([times, times], axis=1)) for begin in (-500.0, 50.0))
    some: list[list[Trajectory] | None] = [None, [wall], [wall, track], [old], [new], [old, new, track]]
    for seen in some:
        (found,) = FromModels().predictions([track], 5.0, 1.0, seen)
        np.testing.assert_allclose(found.each[0][1].position(7.0), (7.0, 0.0), atol=1e-9)
