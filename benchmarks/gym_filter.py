"""A blind noisy policy with and without the safety filter, and the steps a second of the environments.

usage: python benchmarks/gym_filter.py [--episodes 500] [--noise 0.5] [--only single|vector] [--quick] [--out FOLDER]

The policy heads for the goal at the largest speed and sees no obstacle; its action has normal noise. Futures are known
(nao). Episode k is that of scenario seed k, with and without the filter. The least clearance of all episodes is found a
second time by samples of the true trajectories, by code that has no part in decisions. Steps a second are those of
random actions, in scenarios that are built once. In the vector environment all episodes run side by side, in LAYOUTS
scenarios that are built once: one robot in each of as many worlds. Worlds whose episode has ended begin another one;
all decisions count, the outcomes are those of the first episode of each.
"""

import argparse
import time
from collections import Counter
from typing import Any

import numpy as np
from program import finish, options, table, target

from slalom.adapters.gym import RobotEnv, RobotsEnv, SafetyFilter, VectorSafetyFilter
from slalom.sim.shape_distance import clearances

SCENES = ("roundabout_crossing", "crowdnav")
SAMPLES, GAIN, SECONDS, LAYOUTS = 8, 2.0, 4.0, 20
FILTERED = 4000
"""[1/s] Filtered steps in a second of processor time, all decisions counted, that a learner needs at least."""


def blind(observation: np.ndarray, noise: np.ndarray, limits: Any, period: float) -> np.ndarray:
    """An action towards the velocity that leads to the goal, of what a robot knows of itself and its goal alone."""
    goal = observation[2:4] / max(float(np.linalg.norm(observation[2:4])), 1e-9)
    wanted = limits.max_speed * (goal - observation[:2]) / (GAIN * limits.max_acceleration * period)
    return (wanted / max(1.0, float(np.linalg.norm(wanted))) + noise).astype(np.float32)


def sampled_clearance(env: RobotEnv, times: list[float], states: list[np.ndarray], applied: list[np.ndarray]) -> float:
    """Least clearance [m] of an episode at SAMPLES times of each step."""
    scenario, h = env.worlds.scenarios[0], env.worlds.period * np.arange(SAMPLES) / SAMPLES
    start, (p, v), a = np.array(times), np.moveaxis(np.array(states), 1, 0), np.array(applied)
    at = (start[:, None] + h).ravel()
    s = h[None, :, None]
    positions = (p[:, None] + s * v[:, None] + 0.5 * s * s * a[:, None]).reshape(len(at), -1)
    shape = scenario.robots[0].shape
    return min(float(clearances(each, shape, at, positions).min()) for each in scenario.obstacles)


def episode(env: Any, seed: int, noise: float) -> dict[str, Any]:
    """One episode of the blind policy."""
    observation, _ = env.reset(seed=seed, options={"scenario_seed": seed})
    rng, worlds, limits = (
        np.random.default_rng(seed),
        env.unwrapped.worlds,
        env.unwrapped.worlds.scenarios[0].robot.limits,
    )
    found: dict[str, Any] = {"steps": 0, "intervened": 0, "uncertified": 0}
    times, states, applied = [], [], []
    while True:
        action = blind(observation, rng.normal(0.0, noise, 2), limits, worlds.period)
        times.append(worlds.now())
        states.append(np.array([worlds.position[0, 0], worlds.velocity[0, 0]]))
        observation, _, ended, late, info = env.step(action)
        applied.append((worlds.velocity[0, 0] - states[-1][1]) / worlds.period)
        found["steps"] += 1
        found["intervened"] += info.get("intervened", False)
        found["uncertified"] += not info.get("certified", True)
        if ended or late:
            least = sampled_clearance(env.unwrapped, times, states, applied)
            return {**found, "outcome": info["outcome"], "time": info["time"], "least": least}


def filtered(name: str, episodes: int, noise: float, on: bool) -> dict[str, Any]:
    """All episodes of a scenario."""
    env: Any = RobotEnv(name)
    env = SafetyFilter(env) if on else env
    started = time.process_time()
    rows = [episode(env, seed, noise) for seed in range(episodes)]
    ends, steps = Counter(row["outcome"] for row in rows), sum(row["steps"] for row in rows)
    return {
        "name": name,
        "filter": "yes" if on else "no",
        "collisions": ends["collision"],
        "arrived": ends["arrived"],
        "late": ends["time"],
        "intervened": sum(row["intervened"] for row in rows) / steps,
        "uncertified": sum(row["uncertified"] for row in rows),
        "least": min(row["least"] for row in rows),
        "time": float(np.mean([row["time"] for row in rows if row["outcome"] == "arrived"] or [np.nan])),
        "ms": 1e3 * (time.process_time() - started) / steps,
    }


def side_by_side(name: str, episodes: int, noise: float) -> list[Any]:
    """The worlds of a filtered vector environment until the first episode of each has ended: a row of a table."""
    env = VectorSafetyFilter(RobotsEnv(episodes, name, layouts=LAYOUTS))
    rng, seconds = np.random.default_rng(0), 0.0
    observations, _ = env.reset(seed=0)
    worlds: Any = env.unwrapped.worlds
    running, ends, steps, changed, uncertified = np.ones(episodes, np.bool_), Counter[str](), 0, 0, 0
    while running.any():
        drawn = rng.normal(0.0, noise, (episodes, 2))
        limits = [scenario.robot.limits for scenario in worlds.scenarios]
        actions = np.array([blind(*each, worlds.period) for each in zip(observations, drawn, limits)])
        acting, started = worlds.acting[:, 0].copy(), time.process_time()
        observations, _, ended, late, info = env.step(actions)
        seconds += time.process_time() - started
        steps, changed = steps + int(acting.sum()), changed + int(info["intervened"].sum())
        uncertified += int((~info["certified"]).sum())
        over = running & (ended | late)
        ends.update(info["outcome"][over].tolist())
        running &= ~over
    counts = [ends[key] for key in ("collision", "arrived", "time")]
    return [name, *counts, changed / steps, uncertified, steps / seconds]


def speeds(seconds: float, counts: tuple[int, ...]) -> list[list[Any]]:
    """Steps a second of robots in many worlds."""
    rows = []
    for count in counts:
        env = RobotsEnv(count, layouts=20)
        env.reset(seed=0)
        env.action_space.seed(0)
        env.step(env.action_space.sample())
        calls, started = 0, time.process_time()
        while time.process_time() - started < seconds:
            env.step(env.action_space.sample())
            calls += 1
        rate = calls / (time.process_time() - started)
        rows.append([count, rate, rate * count])
    return rows


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--episodes", type=int, default=500)
    parser.add_argument("--noise", type=float, default=0.5)
    parser.add_argument("--only", choices=("single", "vector"))
    arguments: argparse.Namespace = parser.parse_args()
    episodes, seconds = (2, 0.05) if arguments.quick else (arguments.episodes, SECONDS)
    single, vector = arguments.only != "vector", arguments.only != "single"
    rows = [filtered(name, episodes, arguments.noise, on) for name in SCENES for on in (True, False) if single]
    many = [side_by_side(name, episodes, arguments.noise) for name in SCENES if vector]
    heads = ("name", "filter", "collisions", "arrived", "late", "intervened", "uncertified", "least", "time", "ms")
    labels = (
        *("scenario", "filter", "collisions", "arrivals", "too late", "share of interventions", "uncertified steps"),
        *("least clearance [m]", "time of arrival [s]", "processor time of a step [ms]"),
    )
    rates = speeds(seconds, (1, 100, 1000)) if single else []
    of_many = ("scenario", "collisions", "arrivals", "too late", "interventions", "uncertified steps", "steps a second")
    result = {
        "tables": [
            table(f"{episodes} episodes of a blind policy", labels, [[row[key] for key in heads] for row in rows]),
            table(f"{episodes} filtered worlds in one call", of_many, many),
            table("environment steps", ("robots", "calls a second", "steps a second"), rates),
        ],
        "targets": [
            target(f"collisions with the filter, {row['name']}", row["collisions"], most=0)
            for row in rows
            if row["filter"] == "yes"
        ]
        + [target(f"collisions of {episodes} filtered worlds in one call, {row[0]}", row[1], most=0) for row in many]
        + [target(f"filtered steps a second, {row[0]}", row[-1], least=FILTERED) for row in many[:1]],
        "rows": rows,
    }
    finish("gym_filter", result, arguments, ("gymnasium", "pettingzoo"))


if __name__ == "__main__":
    main()
