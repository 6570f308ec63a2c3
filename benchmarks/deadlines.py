"""The longest decision of one robot in a crowd: with and without a budget of work.

usage: python benchmarks/deadlines.py [--quick] [--out FOLDER]

A robot drives to and fro for a minute in a hall with 200 wall segments, between people that walk on circles and do not
avoid it. It decides ten times a second by nao; each seed is another crowd. Times are processor times of `decide` as
called from Python, so that other processes count little. The counted work is the same on every machine.

A robot that looks ahead and predicts from the past (`nao_ahead@observed`) drives for 20 s between WALKERS people that
walk on circles and turn at random, in the same hall without walls.
"""

import gc
import time
from typing import Any, NamedTuple

import numpy as np
from program import finish, options, table, target

import slalom

LIMITS, ROBOT, PERIOD = slalom.Limits(1.5, 1.5), slalom.Disc(0.3), 0.1
PEOPLE, BUDGETS = (10, 40, 80), (None, 1e-3, 2e-4)
WALKERS, AHEAD_SECONDS = 100, 20.0


def hall(rng: np.random.Generator) -> slalom.ObstacleTable:
    """A wall of 40 segments around a hall of 20 m, and 40 pillars of four segments each."""
    angles = np.linspace(0.0, 2.0 * np.pi, 41)
    rim = slalom.Polyline(14.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1), 0.05)
    walls = [slalom.Obstacle(rim, slalom.Stationary((0.0, 0.0)), "rim")]
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]])
    while len(walls) < 41:
        place = rng.uniform(-12.0, 12.0, 2)
        if min(np.linalg.norm(place - (-7, 0)), np.linalg.norm(place - (7, 0))) > 1.5:
            walls.append(slalom.Obstacle(slalom.Polyline(0.15 * corners, 0.02), slalom.Stationary(place)))
    return slalom.ObstacleTable(walls)


class Measured(NamedTuple):
    """One decision: its processor time [s], counted work [s], whether the budget cut it, and its outcome."""

    time: float
    work: float
    cut: bool
    outcome: slalom.Outcome


def minute(seed: int, people: int, budget: float | None, steps: int) -> list[Measured]:
    """The decisions of one run."""
    rng = np.random.default_rng(seed)
    walls, navigator = hall(rng), slalom.Navigator(slalom.method("nao"), ROBOT, LIMITS, period=PERIOD)
    centers, radii = rng.uniform(-9.0, 9.0, (people, 2)), rng.uniform(1.0, 6.0, people)
    rates, phases = rng.uniform(0.5, 1.5, people) / radii * rng.choice([-1, 1], people), rng.uniform(0, 7, people)
    ends = [slalom.Goal(slalom.Stationary((x, 0.0)), stop=True) for x in (7.0, -7.0)]
    position, velocity, found = np.array([-7.0, 0.0]), np.zeros(2), []
    previous = None
    for k in range(steps):
        now, angle = PERIOD * k, rates * PERIOD * k + phases
        around = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        ahead = np.stack([-around[:, 1], around[:, 0]], axis=1)
        crowd = slalom.Tracks(centers + radii[:, None] * around, (radii * rates)[:, None] * ahead, 0.25, now)
        state, goal = slalom.State(position, velocity), ends[int(now / 12.0) % 2]
        before = time.process_time()
        previous = navigator.decide(state, [walls, crowd], goal, now=now, previous=previous, budget=budget)
        taken = time.process_time() - before
        found.append(Measured(taken, previous.work, previous.cut, previous.outcome))
        applied = previous.manoeuvre.mean_acceleration(now, PERIOD)
        position, velocity = position + PERIOD * velocity + 0.5 * PERIOD**2 * applied, velocity + PERIOD * applied
    return found


def observed(seed: int, steps: int) -> list[float]:
    """Processor times [s] of the decisions of one run among people that are predicted from their past."""
    rng, times = np.random.default_rng(seed), np.arange(-5.0, PERIOD * steps + 1.0, PERIOD)
    rates = rng.normal(0.0, 0.3, (WALKERS, 1)) + np.cumsum(rng.normal(0.0, 0.1, (WALKERS, len(times))), axis=1)
    angles = rng.uniform(0.0, 2.0 * np.pi, (WALKERS, 1)) + PERIOD * np.cumsum(rates, axis=1)
    steps_taken = rng.uniform(0.5, 1.5, (WALKERS, 1, 1)) * PERIOD * np.stack([np.cos(angles), np.sin(angles)], axis=2)
    ways = rng.uniform(-9.0, 9.0, (WALKERS, 1, 2)) + np.cumsum(steps_taken, axis=1)
    crowd = [slalom.Obstacle(slalom.Disc(0.25), slalom.Sampled(times, way, "linear")) for way in ways]
    single = slalom.Navigator(slalom.method("nao_ahead@observed"), ROBOT, LIMITS, period=PERIOD, margin=0.1)
    robot, goal = slalom.LookAhead(single), slalom.Goal(slalom.Stationary((9.0, 0.0)))
    state, spent, previous = slalom.State((-9.0, 0.0), (0.0, 0.0)), [], None
    for k in range(steps):
        before = time.process_time()
        previous = robot.decide(state, crowd, goal, now=PERIOD * k, previous=previous)
        spent.append(time.process_time() - before)
        state = previous.manoeuvre.advance(PERIOD * (k + 1) - previous.manoeuvre.start)
    return spent


def main() -> None:
    """Measure, print, write."""
    arguments = options(__doc__).parse_args()
    seeds, steps = (1, 20) if arguments.quick else (20, 600)
    slalom.compile()
    minute(0, 10, None, 3)
    # As docs/robots.md tells: a full collection takes 50 ms once the compiled code is loaded.
    gc.collect()
    gc.freeze()
    rows, targets, loop = [], [], 0.0
    for people in PEOPLE:
        for budget in BUDGETS:
            made = [each for seed in range(seeds) for each in minute(seed, people, budget, steps)]
            times, work = np.array([d.time for d in made]), np.array([d.work for d in made])
            outcomes = [d.outcome for d in made]
            # At a budget, decisions that had a safe manoeuvre when it was used up.
            over = np.array([d.cut for d in made]) if budget else np.zeros(len(made), np.bool_)
            rows.append(
                [
                    people,
                    "none" if budget is None else f"{1e3 * budget:g} ms",
                    len(made),
                    1e3 * float(np.median(times)),
                    1e3 * float(np.quantile(times, 0.999)),
                    1e3 * float(times.max()),
                    1e3 * float(work.max()),
                    float(over.mean()),
                    outcomes.count(slalom.Outcome.INTERRUPTED),
                    sum(not outcome.safe for outcome in outcomes),
                ]
            )
            loop += float(times.sum())
            if budget is None:
                name = f"longest of {len(made)} decisions among {people} people"
                targets.append(target(name, 1e3 * float(times.max()), most=20.0, unit="ms"))
    observed(0, 20)
    spent = 1e3 * np.concatenate(
        [observed(seed, steps if arguments.quick else round(AHEAD_SECONDS / PERIOD)) for seed in range(seeds)]
    )
    few = [WALKERS, len(spent), float(np.median(spent)), float(np.quantile(spent, 0.99)), float(spent.max())]
    targets.append(target(f"99 % of decisions among {WALKERS} people, observed", few[3], most=80.0, unit="ms"))
    heads = ["people", "budget", "decisions", "median ms", "99.9 % ms", "largest ms", "largest work ms"]
    heads += ["budget used up", "interrupted", "not safe"]
    result: dict[str, Any] = {
        "question": "The longest decision of one robot in a crowd, with and without a budget of work.",
        "parameters": {"seeds": seeds, "steps": steps},
        "tables": [
            table("Decisions by nao, 200 wall segments:", heads, rows),
            table("By nao_ahead@observed:", ["people", "decisions", "median ms", "99 % ms", "largest ms"], [few]),
        ],
        "targets": targets,
        "loop_ms": 1e3 * loop,
    }
    finish("deadlines", result, arguments)


if __name__ == "__main__":
    main()
