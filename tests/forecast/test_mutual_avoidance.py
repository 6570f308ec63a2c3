"""Laws of the forecast of a crowd whose agents avoid each other."""

import numpy as np
import pytest

from slalom import AvoidingCrowd, BoundedError, Tracks

PERIOD = 0.25


def scene(seed: int, n: int = 8) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions (n, 2), velocities (n, 2) and radii (n,) of agents, of which some are close to each other."""
    rng = np.random.default_rng(seed)
    return rng.uniform(-3.0, 3.0, (n, 2)), rng.normal(scale=0.5, size=(n, 2)), rng.uniform(0.2, 0.4, n)


def simulator(positions, velocities, radii, preferred, speeds, horizon=5.0, distance=0.16):
    """The crowd in RVO2, the library of the authors of the model, in single precision."""
    library = pytest.importorskip("pyrvo")
    found = library.RVOSimulator(PERIOD, 10.0, 20, horizon, horizon, 0.3, 1.0)
    for k, place in enumerate(positions):
        found.add_agent(tuple(place), 10.0, 20, horizon, horizon, float(radii[k] + distance), float(speeds[k]))
        found.set_agent_velocity(k, tuple(velocities[k]))
        found.set_agent_pref_velocity(k, tuple(preferred[k]))
    return found


def walked(seed: int, steps: int, n: int = 8):
    """Positions (steps + 1, n, 2) of agents that RVO2 moves across a circle, radii and preferred velocities."""
    rng = np.random.default_rng(seed)
    angles, radii = 2.0 * np.pi * (np.arange(n) + rng.uniform(-0.2, 0.2, n)) / n, rng.uniform(0.2, 0.4, n)
    out = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    positions, preferred = 4.0 * out + rng.normal(scale=0.3, size=(n, 2)), -out
    crowd, places = simulator(positions, preferred, radii, preferred, np.ones(n)), [positions]
    for _ in range(steps):
        crowd.do_step()
        places.append(np.array([crowd.get_agent_position(k).to_tuple() for k in range(n)]))
    return np.array(places), radii, preferred


@pytest.mark.parametrize("seed", range(6))
def test_one_step_is_that_of_the_library_of_the_model(seed: int) -> None:
    """At the first observation preferred and present velocity are the same; crowded scenes permit no velocity."""
    positions, velocities, radii = scene(seed)
    speeds = np.linalg.norm(velocities, axis=1)
    other = simulator(positions, velocities, radii, velocities, speeds)
    other.do_step()
    expected = np.array([other.get_agent_velocity(k).to_tuple() for k in range(len(positions))])
    people = AvoidingCrowd(PERIOD, steps=1).predict(Tracks(positions, velocities, radii, 2.0))
    found = np.array([person.trajectory.velocity(2.1) for person in people])
    np.testing.assert_allclose(found, expected, atol=5e-3)
    assert np.abs(found - velocities).max() > 0.05


def test_agents_out_of_reach_keep_their_velocity() -> None:
    positions, velocities = np.array([[0.0, 0.0], [30.0, 0.0]]), np.array([[1.0, 0.0], [-1.0, 0.0]])
    people = AvoidingCrowd(PERIOD, steps=4).predict(Tracks(positions, velocities, 0.3))
    for person, place, velocity in zip(people, positions, velocities, strict=True):
        times = np.array([0.0, 0.6, 3.0, 500.0])
        np.testing.assert_allclose(person.trajectory.position(times), place + times[:, None] * velocity, atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_a_crowd_that_obeys_the_model_is_predicted_better_than_at_constant_velocity(seed: int) -> None:
    """Its agents are moved by RVO2, and their preferred velocities are not given."""
    places, radii, _ = walked(seed, 24)
    crowd, errors, constant = AvoidingCrowd(PERIOD), [], []
    for k in range(1, 20):
        velocities = (places[k] - places[k - 1]) / PERIOD
        people = crowd.predict(Tracks(places[k], velocities, radii, PERIOD * k))
        ahead = np.array([person.trajectory.position(PERIOD * (k + 4)) for person in people])
        errors.append(np.linalg.norm(ahead - places[k + 4], axis=1).mean())
        constant.append(np.linalg.norm(places[k] + 4 * PERIOD * velocities - places[k + 4], axis=1).mean())
    assert np.mean(errors[2:]) < 0.5 * np.mean(constant[2:])


def test_a_free_agent_has_its_velocity_as_its_estimate() -> None:
    crowd = AvoidingCrowd(PERIOD)
    for k, velocity in enumerate(([0.6, 0.2], [0.6, 0.2], [0.1, -0.5], [0.1, -0.5])):
        crowd.predict(Tracks([[0.1 * k, 0.0]], [velocity], 0.3, PERIOD * k))
    np.testing.assert_allclose(crowd.preferred[0], [0.1, -0.5], atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_the_estimate_explains_the_velocity_of_an_agent_that_one_other_restricts(seed: int) -> None:
    """The model with the estimate makes the velocity that was observed, from the observation before."""
    places, radii, hidden = walked(seed, 8, 2)
    velocities, crowd = np.diff(places, axis=0) / PERIOD, AvoidingCrowd(PERIOD)
    for k in range(7):
        crowd.predict(Tracks(places[k + 1], velocities[k], radii, PERIOD * k))
    preferred = np.array([crowd.preferred[k] for k in range(2)])
    other = simulator(places[6], velocities[5], radii, preferred, np.linalg.norm(velocities[:7], axis=2).max(axis=0))
    other.do_step()
    found = np.array([other.get_agent_velocity(k).to_tuple() for k in range(2)])
    np.testing.assert_allclose(found, velocities[6], atol=1e-4)
    assert np.abs(velocities[6] - hidden).max() > 0.01


def test_agents_that_do_not_avoid_are_predicted_at_constant_velocity() -> None:
    """Two that pass through each other: the model is wrong, which their past shows."""
    crowd, velocities = AvoidingCrowd(PERIOD), np.array([[0.8, 0.0], [-0.8, 0.0]])
    for k in range(9):
        places = np.array([[-2.5, 0.0], [2.5, 0.05]]) + PERIOD * k * velocities
        people = crowd.predict(Tracks(places, velocities, 0.3, PERIOD * k))
    for person, place, velocity in zip(people, places, velocities, strict=True):
        end = person.trajectory.position(PERIOD * 8 + 2.0)
        np.testing.assert_allclose(end, place + 2.0 * velocity, atol=1e-9)


def test_names_radii_and_uncertainty_are_those_of_the_tracks() -> None:
    own, given = BoundedError(0.1), BoundedError(0.2)
    tracks = Tracks([[0.0, 0.0]], [[1.0, 0.0]], 0.4, ids=["a"], uncertainty=given)
    (kept,) = AvoidingCrowd(PERIOD).predict(tracks)
    assert (kept.name, kept.shape.radius, kept.uncertainty) == ("a", 0.4, given)
    (other,) = AvoidingCrowd(PERIOD, uncertainty=own).predict(tracks)
    assert other.uncertainty is own
    assert AvoidingCrowd(PERIOD).predict(Tracks(np.empty((0, 2)), np.empty((0, 2)), 0.3)) == []


def test_scales_follow_the_errors_that_were_observed() -> None:
    """Of the crowd and of each agent, by the definition; an agent that was not predicted so far has the largest."""
    assert AvoidingCrowd(PERIOD).scales == {}
    crowd, rng = AvoidingCrowd(PERIOD), np.random.default_rng(3)
    places = 50.0 * np.arange(6.0)[:, None] * np.ones(2)
    velocities, squares, count, last = rng.normal(size=(6, 2)), 0.0, 0, np.zeros(6)
    for k in range(40):
        crowd.predict(Tracks(places, velocities, 0.3, PERIOD * k, ids=list("abcdef")))
        # Agents so far apart keep their velocities; one observation is needed to predict and one to compare.
        if k > 1:
            squares, count = squares + float((np.minimum(last, 0.4) ** 2).sum()), count + 6
        if k < 2:
            assert crowd.scales == pytest.approx(dict.fromkeys("abcdef", 2.0))
        else:
            common = np.sqrt((squares + 100 * 0.072**2) / (count + 100)) / 0.072
            expected = np.clip(common, 0.4, 2.0) * (0.6 + np.sqrt(last / 0.12))
            assert crowd.scales == pytest.approx(dict(zip("abcdef", expected, strict=True)))
        change = rng.normal(scale=[[0.0], [0.01], [0.03], [0.1], [0.2], [0.6]], size=(6, 2))
        velocities, last = velocities + change, np.linalg.norm(change, axis=1)
        places = places + PERIOD * velocities
    crowd.predict(Tracks([places[0], [9.0, 9.0]], [velocities[0], [1.0, 0.0]], 0.3, 100.0, ids=["a", "new"]))
    assert crowd.scales["new"] > 2.0 * crowd.scales["a"]
