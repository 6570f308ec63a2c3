"""A forecast learned by ridge regression, with sets of its errors: 17_learned_forecast.py [RISE FILE FILE ...]."""

import sys

import numpy as np

import slalom
from slalom.io.formats import read_recording

PAST, LEADS, RIDGE = 8, np.array([0, 2, 4, 8, 16]), 1e-3  # [steps] eight are a rise; penalty


class Learned:
    """Constant velocity, corrected by weighted sums of the last displacements, along and across the newest of them."""

    includes_future = False

    def __init__(self, step, sums):
        self.step, (self.along, self.across) = step, sums

    def __call__(self, trajectory, now):
        if now - PAST * self.step < trajectory.span[0]:
            return slalom.AtConstantVelocity()(trajectory, now)
        places = trajectory.position(now - self.step * np.arange(PAST, -1, -1)) @ (1, 1j)
        moves, turn = in_frame(np.diff(places))
        path = places[-1] + turn * (moves[-1] * LEADS + moves.real @ self.along + 1j * (moves.imag @ self.across))
        path = np.append(path, 10.0 * path[-1] - 9.0 * path[-2])  # straight on to step 88
        places = np.stack([path.real, path.imag], axis=1)
        return slalom.Sampled(now + self.step * np.append(LEADS, 88), places, "linear")


def in_frame(moves):
    turn = np.exp(1j * np.angle(moves[..., -1:]))
    return moves / turn, turn


def learned(recordings, step):
    """The sums for what came after LEADS beyond the newest displacement; recordings count alike."""
    moments, products = np.zeros((2, PAST, PAST)), np.zeros((2, PAST, len(LEADS)))
    for motions in recordings:
        tracks = [m.position(np.arange(m.span[0], m.span[1] - 1e-9, step)) @ (1, 1j) for m in motions]
        rows = np.array([t[k - PAST : k + 17] for t in tracks for k in range(PAST, len(t) - 16, 2)])
        moves, turn = in_frame(np.diff(rows)[:, :PAST])
        beyond = (rows[:, PAST + LEADS] - rows[:, [PAST]]) / turn - moves[:, -1:] * LEADS
        for k, part in enumerate((np.real, np.imag)):
            moments[k] += part(moves).T @ part(moves) / np.linalg.norm(moves[:, -1]) ** 2
            products[k] += part(moves).T @ part(beyond) / np.linalg.norm(moves[:, -1]) ** 2
    return Learned(step, np.linalg.solve(moments + RIDGE * np.eye(PAST), products))


def judged(forecast, motions, step):
    """Mean errors [m], shares of errors in sets of 0.95, and obstacles with the last of these sets; the first 120 s."""
    sets, errors = slalom.Calibration(0.95, step * LEADS[1:], max_gap=8 * step), []
    first, last = min(m.span[0] for m in motions), max(m.span[1] for m in motions)
    for now in np.arange(first, min(first + 120.0, last), 4 * step):
        there = {k: m for k, m in enumerate(motions) if m.span[0] + PAST * step < now <= m.span[1]}
        paths, due = [forecast(m, now) for m in there.values()], now + step * LEADS
        places = np.reshape([m.position(now) for m in there.values()], (-1, 2))
        sets.observe(slalom.Tracks(places, 0.0 * places, 0.3, now, ids=list(there)), paths)
        known = [(m, path) for m, path in zip(there.values(), paths) if due[-1] <= m.span[1]]
        errors += [np.linalg.norm(path.position(due) - m.position(due), axis=1)[2:] for m, path in known]
    people = [slalom.Obstacle(slalom.Disc(0.3), path, uncertainty=sets.error) for path in paths]
    return np.mean(errors, axis=0).round(3), [f"{lead.measured:.2f}" for lead in sets.coverage[1:]], people


# [s] of the robot from rest to its maximum speed; recordings, of which each is left out once
rise, files = (float(sys.argv[1]), sys.argv[2:]) if sys.argv[1:] else (0.8, ())
recordings = {f: [a.trajectory for a in read_recording(f, interpolation="linear").agents.values()] for f in files}
for k in range(0 if files else 3):  # without files: people who turn
    turns = np.cumsum(0.02 * np.cumsum(np.random.default_rng(k).normal(0.0, 0.1, (12, 120)), axis=1), axis=1)
    walks = np.cumsum(0.13 * np.stack([np.cos(turns), np.sin(turns)], axis=2), axis=1)
    recordings[f"walks {k}"] = [slalom.Sampled(0.1 * np.arange(120), walk, "linear") for walk in walks]
for name, motions in recordings.items():
    rest = [each for other, each in recordings.items() if other != name]
    for forecast in (slalom.FromPast(slalom.AtConstantVelocity()), learned(rest, rise / 8)):
        errors, held, people = judged(forecast, motions, rise / 8)
        print(f"{name}, {type(forecast).__name__}: errors after 0.5, 1, 2 rises {errors} m, sets of 0.95 hold {held}")
robot = slalom.Navigator(slalom.method("nao"), slalom.Disc(0.3), slalom.Limits(1.6, 2.0), horizon=2.0 * rise)
print(robot.decide(slalom.State((-5, -5), (0, 0)), people, slalom.Goal(slalom.Stationary((9, 9)), 0.3)).outcome)
