"""Random decisions in space with an oracle of their own: many controls, each tested at many times, in plain formulas.

Only this module's formulas decide here; of slalom the scenes use the public entries alone. The oracle is compiled, so
that tens of thousands of scenes can be judged: `python tests/kit/spatial.py 20000`.
"""

import argparse
import time
from collections import Counter
from dataclasses import dataclass

import numba
import numpy as np

import slalom

FAR = 1e6  # [m] from the origin, where a coordinate has a rounding of 1e-10 m
SAFE = -1e-6  # [m] least true clearance of a choice
FREE = 1e-5  # [m] clearance of a control that no better choice may have
NEARER = 1e-6  # [1] by which nothing free may be nearer to the preferred control, relative to max(1, distance)
COARSE, MEDIUM, FINE = 48, 120, 2000  # samples of time: of many controls, of promising ones, of a single one
RESPONSES = (slalom.Velocity(), slalom.Acceleration(), slalom.AccelerateThenCoast(hold=0.8))
FAMILIES = ("head-on", "hovering", "mixed", "crowded")


@dataclass(frozen=True)
class Scene:
    """One decision in plain numbers, relative to a robot at the origin: arrays of obstacles (n, 3) and (n,)."""

    family: str
    response: int  # in RESPONSES
    horizon: float
    velocity: np.ndarray  # (3,) of the robot
    preferred: np.ndarray  # (3,)
    balls: np.ndarray  # (b, 4) centre and radius: controls stay inside
    halves: np.ndarray  # (h, 4) unit normal and offset
    origin: np.ndarray  # (n, 3) [m] of the obstacles at the begin
    speed: np.ndarray  # (n, 3) [m/s]
    bend: np.ndarray  # (n, 3) [m/s^2]
    axis: np.ndarray  # (n, 3) [m] from the middle to one end: 0 of a ball
    radius: np.ndarray  # (n,) [m]
    robot: float  # [m] its radius

    @property
    def admissible(self):
        """The admissible set of the library."""
        return slalom.Admissible(self.balls[:, :3], self.balls[:, 3], self.halves[:, :3], self.halves[:, 3])

    def blocked(self, place):
        """The library's control obstacle, with the robot at `place` (3,)."""
        obstacles = []
        for k in range(len(self.radius)):
            motion = slalom.ConstantAcceleration(place + self.origin[k], self.speed[k], self.bend[k])
            shape = slalom.Ball(self.radius[k])
            if self.axis[k].any():
                shape = slalom.Capsule(-self.axis[k], self.axis[k], self.radius[k])
            obstacles.append(slalom.Obstacle(shape, motion))
        state = slalom.State(place, self.velocity)
        return slalom.control_obstacle(
            RESPONSES[self.response], state, obstacles, slalom.Ball(self.robot), horizon=self.horizon
        )

    @property
    def plain(self):
        """The arguments of the oracle's functions."""
        drift = np.zeros(3) if self.response == 0 else self.velocity
        rows = np.concatenate(
            [self.origin, self.speed - drift, self.bend, self.axis, (self.radius + self.robot)[:, None]], axis=1
        )
        return rows, self.response, self.horizon


def unit(rng):
    """A random unit vector."""
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def scene(seed):
    """The scene of that number or list of numbers."""
    rng = np.random.default_rng(seed)
    family = str(rng.choice(FAMILIES, p=(0.3, 0.2, 0.4, 0.1)))
    response, horizon, most = int(rng.integers(3)), float(rng.uniform(2.0, 8.0)), float(rng.uniform(0.2, 4.0))
    velocity = unit(rng) * rng.uniform(0.0, 2.0) * (family != "hovering")
    balls = [[0.0, 0.0, 0.0, most]]
    if rng.random() < 0.3:
        balls.append([*(unit(rng) * most * rng.uniform(0.1, 1.0)), most * rng.uniform(0.8, 1.2)])
    halves = [[*unit(rng), most * rng.uniform(-0.2, 0.8)] for _ in range(int(rng.choice([0, 0, 0, 1, 2])))]
    preferred = np.zeros(3)
    if rng.random() < (0.2 if family in ("head-on", "hovering") else 0.85):
        preferred = (
            unit(rng) * most * rng.choice([rng.uniform(0.0, 1.0), rng.uniform(1.0, 2.0), 10.0], p=(0.7, 0.25, 0.05))
        )
    count = {"head-on": 1 + int(3 * rng.random() ** 2), "crowded": int(rng.integers(15, 60))}.get(
        family, int(rng.integers(1, 12))
    )
    robot, rows = float(rng.uniform(0.05, 0.4)), []
    ahead = velocity / max(np.linalg.norm(velocity), 1e-9) if velocity.any() else unit(rng)
    jitter = float(rng.choice([0.0, *10.0 ** np.arange(-15, -4)]))
    for _ in range(count):
        radius, bend, axis = rng.uniform(0.1, 1.0), np.zeros(3), np.zeros(3)
        if rng.random() < (0.15 if family == "head-on" else 0.4):
            axis = unit(rng) * rng.uniform(0.1, 2.0)
        if family == "head-on":
            origin, speed = ahead * rng.uniform(3.0, 10.0) + jitter * unit(rng), -ahead * rng.uniform(0.0, 2.0)
        else:
            if rng.random() < 0.3:
                bend = unit(rng) * rng.uniform(0.0, 1.0)
            when, aim = horizon * rng.uniform(0.1, 1.0), unit(rng) * most * rng.random() ** (1 / 3)
            if rng.random() < 0.3:
                aim = preferred if np.linalg.norm(preferred) < most else np.zeros(3)
            speed = unit(rng) * rng.uniform(0.0, 2.0)
            meeting = reached(response, velocity, aim, when) + unit(rng) * radius * rng.choice([0.0, rng.random()])
            origin = meeting - speed * when - bend * when**2 / 2
        gap = segment_distance(*origin, *axis) - radius - robot
        if gap > 0.02:
            rows.append((origin, speed, bend, axis, radius))
    rows = rows or [(np.full(3, 50.0), np.zeros(3), np.zeros(3), np.zeros(3), 1.0)]
    return Scene(
        family,
        response,
        horizon,
        velocity,
        preferred,
        np.array(balls),
        np.array(halves).reshape(-1, 4),
        *(np.array([row[k] for row in rows]) for k in range(5)),
        robot,
    )


def reached(response, velocity, u, t):
    """Where control u (3,) leads until t, from the origin."""
    return gain(response, t) * u + (0.0 if response == 0 else t) * velocity


@numba.njit(cache=True)
def gain(response, t):
    """By how much a control moves the robot until t: a velocity, an acceleration, one that ends after 0.8 s."""
    if response == 0:
        return t
    if response == 1 or t < 0.8:
        return t * t / 2
    return 0.32 + 0.8 * (t - 0.8)


@numba.njit(cache=True)
def segment_distance(x, y, z, ax, ay, az):
    """The distance of a point from the segment between -a and a."""
    square = ax * ax + ay * ay + az * az
    share = 0.0 if square == 0.0 else min(1.0, max(-1.0, (x * ax + y * ay + z * az) / square))
    return np.sqrt((x - share * ax) ** 2 + (y - share * ay) ** 2 + (z - share * az) ** 2)


@numba.njit(cache=True)
def gap(row, response, u, t):
    """Distance of the surfaces of the robot under control u and one obstacle at time t."""
    g, h = gain(response, t), t * t / 2
    x = row[0] + t * row[3] + h * row[6] - g * u[0]
    y = row[1] + t * row[4] + h * row[7] - g * u[1]
    z = row[2] + t * row[5] + h * row[8] - g * u[2]
    return segment_distance(x, y, z, row[9], row[10], row[11]) - row[12]


@numba.njit(cache=True)
def sampled(rows, response, horizon, u, count, floor):
    """Least gap over so many samples, never below the true clearance; ends below `floor`."""
    least = np.inf
    for row in rows:
        for k in range(count + 1):
            least = min(least, gap(row, response, u, horizon * k / count))
        if least < floor:
            break
    return least


@numba.njit(cache=True)
def clearance(rows, response, horizon, u):
    """Least gap: dense samples, and each dip between its neighbours by thirds."""
    least, step = np.inf, horizon / FINE
    for row in rows:
        before, here = np.inf, gap(row, response, u, 0.0)
        for k in range(FINE + 1):
            after = gap(row, response, u, (k + 1) * step) if k < FINE else np.inf
            if here <= before and here <= after and here < least + 0.1:
                low, high = max(0.0, (k - 1) * step), min(horizon, (k + 1) * step)
                while high - low > 1e-10:
                    a, b = low + (high - low) / 3, high - (high - low) / 3
                    if gap(row, response, u, a) < gap(row, response, u, b):
                        high = b
                    else:
                        low = a
                least = min(least, gap(row, response, u, low), gap(row, response, u, high), here)
            before, here = here, after
    return least


@numba.njit(cache=True)
def excess(balls, halves, u):
    """By how much a control leaves the admissible set."""
    most = -np.inf
    for x, y, z, r in balls:
        most = max(most, np.sqrt((u[0] - x) ** 2 + (u[1] - y) ** 2 + (u[2] - z) ** 2) - r)
    for x, y, z, r in halves:
        most = max(most, u[0] * x + u[1] * y + u[2] * z - r)
    return most


@numba.njit(cache=True)
def free_control(rows, response, horizon, balls, halves, preferred, reach, points, moves, starts):
    """A free admissible control within `reach` of the preferred one: whether there is one, and the control.

    First `points` (k, 3) themselves; then, from the `starts` that come nearest to being free, ever shorter `moves`
    (m, 3) to what is nearer to being free.
    """
    best, at, u = np.full(starts, -np.inf), np.zeros((starts, 3)), np.empty(3)
    size = 2.0 * balls[0, 3]
    for point in points:
        u[:] = point
        if ((u - preferred) ** 2).sum() > reach * reach or excess(balls, halves, u) > 0.0:
            continue
        score = sampled(rows, response, horizon, u, COARSE, best.min())
        if score >= FREE and clearance(rows, response, horizon, u) >= FREE:
            return True, u
        apart = np.inf
        for s in range(starts):
            if best[s] > -np.inf:
                apart = min(apart, ((at[s] - u) ** 2).sum())
        worst = best.argmin()
        if score > best[worst] and (apart > (0.03 * size) ** 2 or score > best.max()):
            best[worst], at[worst] = score, u
    for s in range(starts):
        if best[s] == -np.inf:
            continue
        score, step = sampled(rows, response, horizon, at[s], MEDIUM, -np.inf), 0.1 * size
        for turn in range(30):
            moved = False
            for k in range(6):
                u[:] = at[s] + step * moves[(6 * turn + k + 7 * s) % len(moves)]
                away = np.sqrt(((u - preferred) ** 2).sum())
                if away > reach:
                    u[:] = preferred + (u - preferred) * (reach * (1.0 - 1e-12) / away)
                if excess(balls, halves, u) > 0.0:
                    continue
                there = sampled(rows, response, horizon, u, MEDIUM, score)
                if there > score:
                    score, moved = there, True
                    at[s] = u
            if score >= FREE and clearance(rows, response, horizon, at[s]) >= FREE:
                return True, at[s]
            step *= 1.3 if moved else 0.6
    return False, u


def trials(s, rng, reach, chosen):
    """Controls (k, 3) for the oracle: over the admissible set, within reach, on its border, around the choice."""
    smallest = s.balls[s.balls[:, 3].argmin()]
    center, radius = smallest[:3], smallest[3]
    some = rng.normal(size=(1800, 3))
    some /= np.linalg.norm(some, axis=1)[:, None]
    lengths = rng.random(1800)
    parts = [center + radius * some[:400] * lengths[:400, None] ** (1 / 3), center + radius * (1 - 1e-12) * some[:200]]
    if np.isfinite(reach):
        parts += [s.preferred + reach * some[400:800] * lengths[400:800, None] ** (1 / 3)]
        parts += [s.preferred + reach * (1 - 1e-12) * some[800:1400]]
        parts += [chosen + reach * some[1400:] * 10.0 ** (-7 * lengths[1400:, None])]
        inward = parts[-1] - s.preferred
        length = np.linalg.norm(inward, axis=1)[:, None]
        parts.append(s.preferred + inward * np.minimum(1.0, reach * (1 - 1e-12) / np.maximum(length, 1e-300)))
    return np.concatenate(parts)


def faults(s, choice, seed, other=None):
    """What is wrong with a choice in a scene: a sentence, or empty; `other`: one judged before that is no nearer."""
    plain, reach, chosen = s.plain, np.inf, None
    if choice.status is slalom.Status.UNDECIDED:
        return ""
    if choice.control is not None:
        chosen = np.array(choice.control)
        if excess(s.balls, s.halves, chosen) > 1e-8 * (1.0 + s.balls[:, 3].max()):
            return f"not admissible by {excess(s.balls, s.halves, chosen):.3g}"
        least = clearance(*plain, chosen)
        if least < SAFE:
            return f"collides by {-least:.3g} m"
        distance = float(np.linalg.norm(chosen - s.preferred))
        reach = distance - NEARER * max(1.0, distance)
        if reach <= 0.0:
            return ""
    if other is not None and other.status is choice.status and choice.distance <= other.distance + 1e-9:
        return ""
    rng = np.random.default_rng([seed, 1])
    moves = rng.normal(size=(97, 3)) / np.sqrt(3.0)
    rows = plain[0] if choice.status is not slalom.Status.INADMISSIBLE else plain[0][:0]
    found, u = free_control(
        rows, *plain[1:], s.balls, s.halves, s.preferred, reach, trials(s, rng, reach, chosen), moves, 6
    )
    if found:
        return f"{choice.status.name} at {choice.distance:.9g}, free at {np.linalg.norm(u - s.preferred):.9g}"
    return ""


def judged(seed):
    """The choices in the scene of that number near the origin and far from it, their times [s], and their faults."""
    s, found, other = scene(seed), [], None
    for place in (np.zeros(3), FAR * np.random.default_rng([seed, 2]).uniform(-1.0, 1.0, 3)):
        blocked = s.blocked(place)
        _ = blocked.for_controls(s.admissible.largest).table
        begin = time.thread_time()
        choice = slalom.select(s.preferred, s.admissible, blocked)
        spent = time.thread_time() - begin
        found.append((choice, spent, faults(s, choice, seed, other)))
        other = choice
    return s, found


def main():
    """Judge scenes, and print what is wrong and what the choices took."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("scenes", type=int)
    parser.add_argument("--first", type=int, default=0)
    arguments = parser.parse_args()
    statuses, wrong, times, elements = Counter(), 0, [], []
    for warm in range(6):
        judged(warm)
    for seed in range(arguments.first, arguments.first + arguments.scenes):
        s, found = judged(seed)
        for where, (choice, spent, fault) in zip(("near", "far"), found):
            statuses[where, choice.status.name] += 1
            times.append(spent)
            elements.append(choice.elements)
            if fault:
                wrong += 1
                print(f"scene {seed} ({s.family}, {where}): {fault}", flush=True)
            if spent > 0.02:
                print(f"scene {seed} ({s.family}, {where}): {1e3 * spent:.1f} ms, {choice}", flush=True)
    print(f"{arguments.scenes} scenes from {arguments.first}, near the origin and at {FAR:g} m: {wrong} wrong choices")
    print(dict(statuses))
    for name, values in (("ms", 1e3 * np.array(times)), ("elements", np.array(elements))):
        print(name, "median, 99 %, 99.9 %, most:", np.quantile(values, [0.5, 0.99, 0.999, 1.0]).round(3).tolist())


if __name__ == "__main__":
    main()
