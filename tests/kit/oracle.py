"""An independent, slow and simple answer to every question that `slalom.select` and `ControlObstacle` answer.

All formulas are derived again from plain numbers, none is taken from the library, so that a wrong formula there shows.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, pi, prod, sqrt

import numpy as np
from hulls import Pair, turned

STEP = 1e-3  # [s] of the dense samples
JUMP = 1e-9  # [s] before and after a jump of a heading, bodies are looked at too
LEVELS = 6  # times the search for pockets refines its lattice
ABSENT = 1e18  # [m^2] stands for the squared distance of an obstacle that is not there; inf would give nan in products


def _taylor(origin, terms, t):
    """Motion with derivatives `terms` = (position, velocity, acceleration) at time `origin`."""
    position, velocity, acceleration = (np.asarray(term, dtype=float) for term in terms)
    s = (t - origin)[:, None]
    return position + s * velocity + s**2 / 2 * acceleration, velocity + s * acceleration, acceleration + 0 * s


def _stationary(p, t):
    zero = np.zeros(len(p["initial_position"]))
    return _taylor(0.0, (p["initial_position"], zero, zero), t)


def _constant_velocity(p, t):
    return _taylor(p["at"], (p["initial_position"], p["initial_velocity"], np.zeros(len(p["initial_position"]))), t)


def _constant_acceleration(p, t):
    return _taylor(p["at"], (p["initial_position"], p["initial_velocity"], p["initial_acceleration"]), t)


def _circular(p, t):
    center, radius, rate = np.asarray(p["center"], dtype=float), p["radius"], p["speed"] / p["radius"]
    spoke = np.zeros(center.size)
    if center.size == 2 or p.get("normal") is None:
        spoke[0], turned = 1.0, np.zeros(center.size)
        turned[1] = 1.0
    else:
        n = np.asarray(p["normal"], dtype=float) / sqrt(sum(x * x for x in p["normal"]))
        spoke[0 if abs(n[0]) < 0.9 else 1] = 1.0
        turned = np.cross(n, spoke)  # perpendicular to both, so the first direction is turned x n
        turned /= np.linalg.norm(turned)
        spoke = np.cross(turned, n)
    angle = p["phase"] + rate * t
    out = np.cos(angle)[:, None] * spoke + np.sin(angle)[:, None] * turned
    along = np.cos(angle)[:, None] * turned - np.sin(angle)[:, None] * spoke
    return center + radius * out, radius * rate * along, -radius * rate**2 * out


def _sampled(p, t):
    stamps, x = np.asarray(p["times"], dtype=float), np.asarray(p["positions"], dtype=float)
    n, h = len(stamps), np.diff(stamps)
    if n == 2:
        slopes = np.repeat((x[1:] - x[:1]) / h[0], 2, axis=0)
    else:
        # Slope at each stamp of the parabola (Lagrange) through the nearest three, the stamp and its neighbours.
        near = np.clip(np.arange(n), 1, n - 2)[:, None] + np.array([-1, 0, 1])
        a, b, c = stamps[near].T[..., None]
        at, (ya, yb, yc) = stamps[:, None], np.moveaxis(x[near], 1, 0)
        slopes = ya * (2 * at - b - c) / ((a - b) * (a - c)) + yb * (2 * at - a - c) / ((b - a) * (b - c))
        slopes += yc * (2 * at - a - b) / ((c - a) * (c - b))
    k = np.clip(np.searchsorted(stamps, t, side="right") - 1, 0, n - 2)
    s, step, rise = (t - stamps[k])[:, None], h[k][:, None], (x[k + 1] - x[k]) / h[k][:, None]
    if p["interpolation"] == "linear":
        c1, c2, c3 = rise, 0 * rise, 0 * rise
    else:
        c1, end = slopes[k], slopes[k + 1]
        c2, c3 = (3 * rise - 2 * c1 - end) / step, (c1 + end - 2 * rise) / step**2
    gone = ((t < stamps[0]) | (t > stamps[-1]))[:, None]
    found = x[k] + s * (c1 + s * (c2 + s * c3)), c1 + s * (2 * c2 + 3 * s * c3), 2 * c2 + 6 * s * c3
    return tuple(np.where(gone, np.nan, value) for value in found)


def _polynomial(p, t):
    begins = p["start"] + np.concatenate([[0.0], np.cumsum(p["durations"])])
    k = np.clip(np.searchsorted(begins, t, side="right") - 1, 0, len(p["durations"]) - 1)
    gone = ((t < begins[0]) | (t > begins[-1]))[:, None]
    x, c = (t - begins[k])[:, None], np.asarray(p["coefficients"], dtype=float)[k]
    powers, found = np.arange(c.shape[1]), []
    for order in range(3):
        falling = np.array([float(prod(range(n - order + 1, n + 1))) if n >= order else 0.0 for n in powers])
        terms = falling * x ** np.maximum(powers - order, 0)
        found.append(np.where(gone, np.nan, (terms[:, :, None] * c).sum(axis=1)))
    return tuple(found)


@dataclass(frozen=True)
class Formula:
    """The motion of a kind of trajectory, derived again.

    Attributes:
        motion: from parameters and absolute times (n,) to position, velocity and acceleration, each (n, d).
        moved: adds a displacement (d,) to the parameters. stamps: times at which the motion begins, may jump and ends;
            None if it has none. faces: whether a body can face along it.
    """

    motion: Callable
    moved: Callable
    stamps: Callable | None = None
    faces: bool = True


def _displace(name):
    """A displacement is added to the parameter of that name."""

    def moved(p, by):
        p[name] = p[name] + by

    return moved


def _displace_polynomial(p, by):
    p["coefficients"][:, 0] += by


MOTIONS = {
    "piecewise_polynomial": Formula(
        _polynomial,
        _displace_polynomial,
        stamps=lambda p: p["start"] + np.concatenate([[0.0], np.cumsum(p["durations"])]),
    ),
    "stationary": Formula(_stationary, _displace("initial_position"), faces=False),
    "constant_velocity": Formula(_constant_velocity, _displace("initial_position")),
    "constant_acceleration": Formula(_constant_acceleration, _displace("initial_position")),
    "circular": Formula(_circular, _displace("center")),
    "sampled": Formula(_sampled, _displace("positions"), stamps=lambda p: np.asarray(p["times"], dtype=float)),
}
"""The formula of every kind of trajectory."""

STAMPS = {kind: formula.stamps for kind, formula in MOTIONS.items() if formula.stamps}
"""Times at which a motion begins, may jump and ends, for those that have such times."""


def motion(kind, parameters, t):
    """Position, velocity and acceleration (n, d) at absolute times t (n,)."""
    return MOTIONS[kind].motion(parameters, np.asarray(t, dtype=float))


def facing(kind, parameters, t):
    """Unit vectors (n, 2) along the velocity at absolute times t (n,); nan where nothing is there.

    Where something waits it keeps the direction in which it came. Here only straight pieces between samples wait.
    """
    t = np.asarray(t, dtype=float)
    speed = motion(kind, parameters, t)[1]
    if kind == "sampled" and parameters["interpolation"] == "linear":
        stamps, gone = np.asarray(parameters["times"], dtype=float), np.isnan(speed)
        rises = np.diff(np.asarray(parameters["positions"], dtype=float), axis=0)
        for k in range(1, len(rises)):
            if not rises[k].any():
                rises[k] = rises[k - 1]
        piece = np.clip(np.searchsorted(stamps, t, side="right") - 1, 0, len(rises) - 1)
        speed = np.where(gone, np.nan, rises[piece])
    return speed / np.sqrt((speed**2).sum(axis=1))[:, None]


def assumed(forecast, kind, parameters, now):
    """The motion (kind, parameters) that a forecast assumes from `now` on; None when nothing is there to be seen."""
    position, velocity, acceleration = (value[0] for value in motion(kind, parameters, [now]))
    if forecast == "Known":
        return kind, parameters
    if np.isnan(position[0]):
        return None
    if forecast == "AtConstantVelocity":
        acceleration = np.zeros_like(position)
    return "constant_acceleration", {
        "initial_position": position,
        "initial_velocity": velocity,
        "initial_acceleration": acceleration,
        "at": now,
    }


# Responses: rows (weight of velocity, weight of acceleration, gain) of position, velocity and acceleration at times t:
# position = origin + rows[0] . (velocity, acceleration, u), velocity = rows[1] . (...), acceleration = rows[2] . (...).


def _velocity(t, ramp=0.0):
    one, nil = np.ones_like(t), 0 * t
    if ramp == 0:
        return (nil, nil, t), (nil, nil, one), (nil, nil, nil)
    inside = t < ramp
    gain = np.where(inside, t**2 / (2 * ramp), t - ramp / 2)
    return (
        (t - gain, nil, gain),
        (np.where(inside, 1 - t / ramp, 0.0), nil, np.where(inside, t / ramp, 1.0)),
        (np.where(inside, -1 / ramp, 0.0), nil, np.where(inside, 1 / ramp, 0.0)),
    )


def _lagged(t, lag):
    left = np.exp(-t / lag)
    spent = lag * (1 - left)
    return (spent, 0 * t, t - spent), (left, 0 * t, 1 - left), (-left / lag, 0 * t, left / lag)


def _acceleration(t):
    one, nil = np.ones_like(t), 0 * t
    return (t, nil, t**2 / 2), (one, nil, t), (nil, nil, one)


def _coast(t, hold):
    one, nil, inside = np.ones_like(t), 0 * t, t < hold
    gain = np.where(inside, t**2 / 2, hold**2 / 2 + hold * (t - hold))
    return (t, nil, gain), (one, nil, np.where(inside, t, hold)), (nil, nil, np.where(inside, 1.0, 0.0))


def _stop(t, hold, rate, period):
    # Step by step as a robot does it: distance and speed at the begin of each control period, per unit of speed.
    steps = max(1, ceil((t.max(initial=0.0) - hold) / period) + 1)
    distance, speed = [0.0], [1.0]
    for _ in range(steps):
        distance.append(distance[-1] + speed[-1] * period - rate * speed[-1] * period**2 / 2)
        speed.append(speed[-1] - rate * speed[-1] * period)
    since = np.maximum(t - hold, 0.0)
    k = np.minimum((since / period).astype(int), steps)
    r, v = since - k * period, np.array(speed)[k]
    gone, now, acceleration = np.array(distance)[k] + v * r - rate * v * r**2 / 2, v - rate * v * r, -rate * v
    inside, nil = t < hold, 0 * t
    return (
        (np.where(inside, t, hold + gone), nil, np.where(inside, t**2 / 2, hold**2 / 2 + hold * gone)),
        (np.where(inside, 1.0, now), nil, np.where(inside, t, hold * now)),
        (np.where(inside, 0.0, acceleration), nil, np.where(inside, 1.0, hold * acceleration)),
    )


def _brake(t, hold, brake):
    held, since = np.minimum(t, hold), np.clip(t - hold, 0.0, brake)
    # Evenly from the speed at the end of the hold to none.
    gone, now = since - since**2 / (2 * brake), 1 - since / brake
    acceleration = np.where((t >= hold) & (t < hold + brake), -1 / brake, 0.0)
    inside, nil = t < hold, 0 * t
    return (
        (held + gone, nil, held**2 / 2 + hold * gone),
        (now, nil, np.where(inside, held, hold * now)),
        (acceleration, nil, np.where(inside, 1.0, hold * acceleration)),
    )


def _turn(t, hold, rate):
    # Sines and cosines of the angle by which the velocity has turned since the hold.
    held, angle = np.minimum(t, hold), rate * np.maximum(t - hold, 0.0)
    way, heading = (np.sin(angle) + 1j * (1 - np.cos(angle))) / rate, np.cos(angle) + 1j * np.sin(angle)
    inside, nil = t < hold, 0 * t
    return (
        (held + way, nil, held**2 / 2 + hold * way),
        (heading, nil, held * heading),
        (np.where(inside, 0.0, 1j * rate * heading), nil, np.where(inside, 1.0, 1j * rate * hold * heading)),
    )


def times(factors, vectors):
    """Vectors (n, d) or (d,) times factors (n,); complex ones turn them in the plane."""
    if not np.iscomplexobj(factors):
        return factors[:, None] * vectors
    product = factors * (np.asarray(vectors)[..., 0] + 1j * np.asarray(vectors)[..., 1])
    return np.stack([product.real, product.imag], axis=-1)


def _jerk(t):
    one, nil = np.ones_like(t), 0 * t
    return (t, t**2 / 2, t**3 / 6), (one, t, t**2 / 2), (nil, one, t)


RESPONSES = {
    "Velocity": _velocity,
    "LaggedVelocity": _lagged,
    "Acceleration": _acceleration,
    "AccelerateThenCoast": _coast,
    "AccelerateThenStop": _stop,
    "AccelerateThenBrake": _brake,
    "AccelerateThenTurn": _turn,
    "Jerk": _jerk,
}


@dataclass
class Admissible:
    """Balls and half-spaces as plain arrays."""

    centers: np.ndarray
    radii: np.ndarray
    normals: np.ndarray
    offsets: np.ndarray

    def excess(self, u):
        """Largest signed distance of controls (n, d) to a boundary, (n,)."""
        worst = np.full(len(u), -np.inf)
        for center, radius in zip(self.centers, self.radii):
            worst = np.maximum(worst, np.sqrt(((u - center) ** 2).sum(axis=1)) - radius)
        for normal, offset in zip(self.normals, self.offsets):
            worst = np.maximum(worst, (u * normal).sum(axis=1) - offset)
        return worst


@dataclass
class Problem:
    """One decision in plain numbers.

    `shapes` and `robot_parts` are lists of rounded convex hulls (corners (n, d), radius) in the body frame, `headings`
    angles or "motion", `motions` (kind, parameters).
    """

    dimension: int
    start: float
    horizon: float
    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    response: tuple
    robot_parts: list
    shapes: list
    headings: list
    motions: list

    def alone(self):
        """The same without obstacles."""
        return self.among([], [], [])

    def among(self, shapes, headings, motions):
        """The same with these obstacles."""
        return replace(self, shapes=shapes, headings=headings, motions=motions)

    def maps(self, t, order=0):
        """Drift (n, d) and gain (n,) of position, velocity or acceleration (order 0, 1, 2) at elapsed times t."""
        name, parameters = self.response
        of_velocity, of_acceleration, gain = RESPONSES[name](np.asarray(t, dtype=float), **parameters)[order]
        drift = times(of_velocity, self.velocity) + of_acceleration[:, None] * self.acceleration
        return drift + (self.position if order == 0 else 0.0), gain

    def robot(self, u, t):
        """Position (n, d) at elapsed times t (n,) under control u (d,)."""
        drift, gain = self.maps(t)
        return drift + times(gain, u)

    def _absolute(self, i, t):
        """The times by the clock of obstacle i."""
        kind, parameters = self.motions[i]
        absolute = self.start + t
        if kind in STAMPS:
            # start + (stamp - start) may leave the life of an obstacle by one rounding; its ends belong to it.
            inside = np.clip(absolute, *STAMPS[kind](parameters)[[0, -1]])
            absolute = np.where(np.abs(inside - absolute) < 1e-12, inside, absolute)
        return absolute

    def place(self, i, t):
        """Position (n, d) of obstacle i at elapsed times t (n,); nan where it is not there."""
        return motion(*self.motions[i], self._absolute(i, t))[0]

    def facing(self, i, t):
        """Unit vectors (n, 2) along the body of obstacle i; None where its parts are turned once and for all."""
        if self.headings[i] != "motion":
            return None
        return facing(*self.motions[i], self._absolute(i, t))

    @cached_property
    def pairs(self):
        """Each convex part of each obstacle with each of the robot."""
        found = []
        for i, (parts, heading) in enumerate(zip(self.shapes, self.headings)):
            turns = heading == "motion"
            for a, rounding in parts:
                if not turns and heading != 0.0:
                    a = turned(a, np.array([[np.cos(heading), np.sin(heading)]]))[:, :, 0].T
                found += [Pair(i, a, b, rounding + radius, turns) for b, radius in self.robot_parts]
        return found

    def pair_gap(self, pair, u, t):
        """Signed distance of the surfaces of one pair at elapsed times t (n,); inf where the obstacle is not there."""
        return pair.gap(self.robot(u, t) - self.place(pair.obstacle, t), self.facing(pair.obstacle, t))

    def gap(self, i, u, t):
        """Signed distance (n,) of robot and obstacle i at elapsed times t (n,); inf where the obstacle is not there."""
        return np.min([self.pair_gap(pair, u, t) for pair in self.pairs if pair.obstacle == i], axis=0)

    def span(self, i):
        """Elapsed times at which obstacle i appears and vanishes."""
        kind, parameters = self.motions[i]
        if kind not in STAMPS:
            return 0.0, self.horizon
        first, last = STAMPS[kind](parameters)[[0, -1]] - self.start
        return max(first, 0.0), min(last, self.horizon)

    @cached_property
    def times(self):
        """Elapsed times every millisecond and wherever something may jump; where bodies may, on both sides of it."""
        at = [np.linspace(0.0, self.horizon, ceil(self.horizon / STEP) + 1)]
        for (kind, p), heading in zip(self.motions, self.headings):
            if kind in STAMPS:
                sides = [-JUMP, 0.0, JUMP] if heading == "motion" else [0.0]
                at += [STAMPS[kind](p) - self.start + side for side in sides]
        at = np.unique(np.concatenate(at))
        return at[(at >= 0) & (at <= self.horizon)]

    @cached_property
    def relative(self):
        """Obstacle minus drift at `times`, (m, n, d), nan where absent; and the gain (n,)."""
        drift, gain = self.maps(self.times)
        positions = [self.place(i, self.times) - drift for i in range(len(self.motions))]
        return np.array(positions).reshape(len(self.motions), -1, self.dimension), gain

    @cached_property
    def facings(self):
        """Where each obstacle faces at `times`."""
        return [self.facing(i, self.times) for i in range(len(self.motions))]

    @cached_property
    def scale(self):
        """How many times larger than the control its image is at `times`, (n,)."""
        return np.abs(self.relative[1])

    @cached_property
    def centered(self):
        """Middle of each pair minus drift at `times`, (pairs, n, d): where the robot must not be.

        Turned back by the angle by which the gain turns the control.
        """
        r, gain = self.relative
        found = [r[pair.obstacle] + pair.middle(self.facings[pair.obstacle]) for pair in self.pairs]
        if np.iscomplexobj(gain):
            back = np.conj(np.where(gain == 0, 1.0, gain) / np.where(gain == 0, 1.0, np.abs(gain)))
            found = [times(back, one) for one in found]
        return np.array(found).reshape(len(found), -1, self.dimension)

    @cached_property
    def bounds(self):
        """Radius of a ball about its middle that holds all of a pair, (pairs,): no gap is less than for the ball."""
        return np.array([pair.bound for pair in self.pairs])

    @cached_property
    def squares(self):
        """Rows a, b, c (pairs, d + 2, n) with |distance from the middle|^2 = a + b . u + c |u|^2 at `times`."""
        gain, r = self.scale, self.centered
        rows = np.empty((len(r), self.dimension + 2, len(gain)))
        rows[:, 0] = (r**2).sum(axis=-1)
        rows[:, 1:-1] = np.moveaxis(-2 * gain[:, None] * r, -1, 1)
        rows[:, -1] = gain**2
        gone = np.isnan(r[..., 0])
        for row, value in zip(range(self.dimension + 2), [ABSENT] + [0.0] * (self.dimension + 1)):
            rows[:, row][gone] = value
        return rows

    def gaps(self, controls, every=1):
        """Least gap of controls (k, d) over every so many-th sample, (k,): never below the true least clearance."""
        if not self.motions:
            return np.full(len(controls), np.inf)
        rows = np.ascontiguousarray(self.squares[..., ::every])
        features = np.column_stack([np.ones(len(controls)), controls, (controls**2).sum(axis=1)])
        chunk, found = max(1, int(1e6 / rows[:, 0].size)), []
        for k in range(0, len(controls), chunk):
            squares = np.matmul(features[k : k + chunk], rows)
            found.append(self._least(squares, controls[k : k + chunk], every))
        return np.concatenate(found) if found else np.empty(0)

    def _least(self, squares, controls, every):
        """Least gap (k,) from squared distances (pairs, k, n): where they leave it open, the shapes themselves."""
        nearest = squares.argmin(axis=-1)
        lowest = np.take_along_axis(squares, nearest[..., None], axis=-1)[..., 0]
        gap = np.sqrt(np.maximum(lowest, 0.0)) - self.bounds[:, None]
        is_round = np.array([pair.is_round for pair in self.pairs])
        found = gap[is_round].min(axis=0, initial=np.inf)
        rest = np.flatnonzero(~is_round)
        for p in rest:
            found = np.minimum(found, self.exact(p, controls, every * nearest[p]))
        for p in rest:
            below = np.minimum(np.maximum(found + self.bounds[p], 0.0) ** 2, ABSENT / 2)
            i, k = np.nonzero(squares[p] < below[:, None])
            np.minimum.at(found, i, self.exact(p, controls[i], every * k))
        return found

    def exact(self, p, u, k):
        """Gap of pair p under controls u (n, d) or (d,) at `times[k]`, k (n,)."""
        (r, gain), pair, k = self.relative, self.pairs[p], np.asarray(k)
        facing = self.facings[pair.obstacle]
        return pair.gap(times(gain[k], u) - r[pair.obstacle][k], None if facing is None else facing[k])

    def sampled_gap(self, u, below=np.inf):
        """Gap of each pair at `times`, (pairs, n); where not `below`, perhaps less, but not below either."""
        distance = np.sqrt(((self.centered - self.scale[:, None] * u) ** 2).sum(axis=-1))
        gap = np.where(np.isnan(distance), np.inf, distance - self.bounds[:, None])
        for p, pair in enumerate(self.pairs):
            if not pair.is_round:
                k = np.flatnonzero((gap[p] < below) & np.isfinite(gap[p]))
                gap[p, k] = self.exact(p, u, k)
        return gap

    def clearance(self, u):
        """Least clearance of control u (d,): the dense samples, then each low dip looked into ever more closely."""
        if not self.motions:
            return np.inf
        # From its samples the gap falls by no more than the relative motion between two of them; twice that is ample.
        best = self.gaps(u[None])[0]
        most = best + 2 * self.longest_step(u)
        gap = self.sampled_gap(u, most + 1e-9)
        wide = np.pad(gap, ((0, 0), (1, 1)), constant_values=np.inf)
        before, after = wide[:, :-2], wide[:, 2:]
        dips = (gap <= before) & (gap <= after) & ((gap < before) | (gap < after)) & (gap <= most)
        for p in np.flatnonzero(dips.any(axis=1)):
            best = min(best, self.look_closer(self.pairs[p], u, np.flatnonzero(dips[p])))
        return float(best)

    def look_closer(self, pair, u, k):
        """Least gap of a pair between the samples before and after each of `times[k]`."""
        first, last = self.span(pair.obstacle)
        low = np.maximum(self.times[np.maximum(k - 1, 0)], first)
        high = np.minimum(self.times[np.minimum(k + 1, len(self.times) - 1)], last)
        best, rows = np.inf, np.arange(len(k))
        while (high - low).max() > 1e-9:
            t = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, 33)
            t[:, -1] = high
            near = self.pair_gap(pair, u, t.ravel()).reshape(t.shape)
            j = near.argmin(axis=1)
            best = min(best, near.min())
            low, high = t[rows, np.maximum(j - 1, 0)], t[rows, np.minimum(j + 1, 32)]
        return best

    def longest_step(self, u):
        """The longest relative motion [m] of surfaces between two of `times` under control u, other than jumps."""
        r, gain = self.relative
        steps = np.sqrt((np.diff(r - times(gain, u), axis=1) ** 2).sum(axis=-1))
        for i, direction in enumerate(self.facings):
            if direction is not None:
                reach = max(np.sqrt((corners**2).sum(axis=1)).max() for corners, _ in self.shapes[i])
                steps[i] += reach * pi / 2 * np.sqrt((np.diff(direction, axis=0) ** 2).sum(axis=1))
        return np.nanmax(steps[:, np.diff(self.times) > 3 * JUMP], initial=0.0)

    def least_gap_near(self, u, t, width):
        """Least gap under control u within `width` [s] of time t."""
        near = np.append(np.clip(np.linspace(t - width, t + width, 21), 0.0, self.horizon), t)
        return min((self.gap(i, u, near).min() for i in range(len(self.motions))), default=np.inf)

    def first_overlap(self, u, depth):
        """First sampled time at which control u overlaps an obstacle by more than `depth`; inf if never."""
        if not self.motions:
            return np.inf
        deep = self.sampled_gap(u, 0.0).min(axis=0) < -depth
        return self.times[np.argmax(deep)] if deep.any() else np.inf

    def speeds(self, u):
        """Velocity and acceleration of the robot (n, d) at `times` under control u."""
        return tuple(drift + times(gain, u) for drift, gain in (self.maps(self.times, order) for order in (1, 2)))


# Search for controls that a better choice could have been.


def directions(count, dimension):
    """Unit vectors, evenly spread (on the sphere: a Fibonacci spiral)."""
    k = np.arange(count) + 0.5
    if dimension == 2:
        return np.column_stack([np.cos(2 * pi * k / count), np.sin(2 * pi * k / count)])
    z, angle = 1 - 2 * k / count, pi * (1 + sqrt(5)) * k
    return np.column_stack([np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z])


def grid(admissible, preferred, reach, chosen):
    """Admissible controls within `reach` of the preferred one, and how far apart they are.

    A lattice over the admissible set, its boundary, rings around the preferred control up to the last one, and a cloud
    of ever smaller offsets around the chosen control, where a better one would most likely be.
    """
    d = len(preferred)
    smallest = int(np.argmin(admissible.radii))
    center, radius = admissible.centers[smallest], admissible.radii[smallest]
    if reach < radius:
        center, radius = preferred, reach
    per_side = 33 if d == 2 else 13
    line = np.linspace(-1.0, 1.0, per_side)
    lattice = np.stack(np.meshgrid(*[line] * d), axis=-1).reshape(-1, d)
    lattice = lattice[(lattice**2).sum(axis=1) <= 1]
    points = [center + radius * lattice]
    around = directions(120 if d == 2 else 250, d)
    points += [c + r * (1 - 1e-9) * around for c, r in zip(admissible.centers, admissible.radii)]
    if np.isfinite(reach):
        points += [preferred + reach * (1 - share) * around for share in (1.0, 0.3, 0.1, 0.01, 1e-3, 1e-5)]
        # A free pocket that begins within reach mostly goes on to the border of reach: look there most closely.
        points += [preferred + reach * directions(480 if d == 2 else 2000, d)]
    if chosen is not None:
        points += [chosen + reach * 10.0**-k * around[::3] for k in range(1, 7)]
    points = np.concatenate(points)
    near = ((points - preferred) ** 2).sum(axis=1) <= (reach * (1 + 1e-9)) ** 2
    return _keep(points[near], admissible, preferred, reach), 2 * radius / (per_side - 1)


def _keep(points, admissible, preferred, reach):
    """Those that are admissible, after those beyond reach were pulled back to its border."""
    if reach <= 0:
        return points[:0]
    offsets = points - preferred
    points = preferred + offsets / np.maximum(1.0, np.sqrt((offsets**2).sum(axis=1)) / reach)[:, None]
    return points[admissible.excess(points) <= 0.0]


def _apart(points, spacing, count):
    """The first `count` of the points that keep `spacing` from those before them."""
    kept = points[:1]
    for point in points[1:]:
        if len(kept) == count:
            break
        if ((kept - point) ** 2).sum(axis=1).min() > spacing**2:
            kept = np.concatenate([kept, point[None]])
    return kept


def better_control(problem, admissible, preferred, reach, least, chosen=None):
    """An admissible control within `reach` of the preferred one with a clearance of `least` or more, or None.

    A sample that shows contact rejects a control for good, so coarse times come first. Then the neighbourhood of the
    controls that came nearest to being free is searched on a finer and finer lattice, for small pockets.
    """
    points, spacing = grid(admissible, preferred, reach, chosen)
    cloud = np.concatenate([0.5 * directions(12, problem.dimension), directions(20, problem.dimension)])
    coarse = max(1, len(problem.times) // 60)
    for level in range(LEVELS + 1):
        if not len(points):
            return None
        score = problem.gaps(points, coarse)
        left = points[score >= least]
        for every in (max(1, coarse // 8), 1):
            left = left[problem.gaps(left, every) >= least]
        for u in left:
            if problem.clearance(u) >= least:
                return u
        if level == LEVELS:
            break
        # Controls that only the finer times reject are no promising place: judge by those.
        best = points[np.argsort(-score)[:100]]
        best = _apart(best[np.argsort(-problem.gaps(best, max(1, coarse // 8)))], spacing, 8)
        points = _keep((best[:, None] + spacing * cloud).reshape(-1, problem.dimension), admissible, preferred, reach)
        spacing /= 2.5
    return None


# Closed forms.


def polynomial_gap(terms, radius, horizon):
    """Least clearance over [0, horizon] of a relative motion sum(terms[k] t^k / k!), and the time of first contact.

    The squared distance is a polynomial: a quadratic for VO, a quartic for AO. The contact is inf when there is none.
    """
    d = len(terms[0])
    parts = [[float(term[axis]) / (1, 1, 2, 6)[k] for k, term in enumerate(terms)][::-1] for axis in range(d)]
    square = sum((np.poly1d(part) ** 2 for part in parts), np.poly1d([0.0]))

    def inside(polynomial):
        roots = polynomial.roots
        real = roots[np.abs(roots.imag) < 1e-6].real
        return np.clip(np.append(real, [0.0, horizon]), 0.0, horizon)

    least = float(np.sqrt(max(square(inside(square.deriv())).min(), 0.0)) - radius)
    contact = inside(square - radius**2)
    contact = contact[(np.abs(square(contact) - radius**2) < 1e-6) & (contact > 0)]
    return least, float(contact.min(initial=np.inf)) if least < 0 else np.inf
