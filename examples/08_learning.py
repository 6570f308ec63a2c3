"""A policy that learns to pass an oncoming car, and the safety filter for another policy.

The learner is the cross-entropy method: it draws policies, keeps the best, and draws the next ones about these. All of
them drive at the same time, each in several worlds of one vector environment. Needs `pip install 'slalom[gym]'`.
"""

import sys
from importlib.util import find_spec

if not find_spec("gymnasium"):
    print("This example needs gymnasium: pip install 'slalom[gym]'.")
    sys.exit()

import numpy as np

from slalom.adapters.gym import RobotEnv, RobotsEnv, SafetyFilter
from slalom.sim import Scenario, gallery

POLICIES, KEPT, WORLDS, GENERATIONS, SEEN = 60, 8, 3, 15, 1


def head_on(seed: int) -> Scenario:
    """A car that drives towards the robot, up to 1 m to one side."""
    return gallery.build("head_on", {"offset": np.random.default_rng(seed).uniform(-1.0, 1.0), "duration": 10.0})


def actions(policies: np.ndarray, observations: np.ndarray) -> np.ndarray:
    """Actions (n, 2) of linear policies (n, 2, size + 1) for observations (n, size)."""
    return np.tanh(np.einsum("nak,nk->na", policies[..., :-1], observations) + policies[..., -1])


def episodes(env: RobotsEnv, drivers: np.ndarray, seeds: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return and arrival (n,) of policies, each in the world of its seed."""
    observations, _ = env.reset(seed=seeds)
    returns, arrived, running = (np.zeros(len(drivers)) for _ in range(3))
    running += 1.0
    while running.any():
        observations, rewards, terminated, truncated, info = env.step(actions(drivers, observations))
        returns += running * rewards
        arrived += running * info["is_success"]
        running *= ~(terminated | truncated)
    return returns, arrived


env = RobotsEnv(POLICIES * WORLDS, head_on, nearest=SEEN, command="velocity")
shape = (2, env.single_observation_space.shape[0] + 1)
rng, mean, spread = np.random.default_rng(0), np.zeros(shape), np.ones(shape)
for generation in range(GENERATIONS):
    drawn = mean + spread * rng.normal(size=(POLICIES, *shape))
    # Each policy drives in the same WORLDS worlds.
    seeds = [1000 * generation + k % WORLDS for k in range(POLICIES * WORLDS)]
    returns, arrived = episodes(env, np.repeat(drawn, WORLDS, axis=0), seeds)
    best = drawn[np.argsort(-returns.reshape(POLICIES, WORLDS).mean(axis=1))[:KEPT]]
    mean, spread = best.mean(axis=0), best.std(axis=0) + 0.1 * 0.8**generation
    print(f"generation {generation + 1}: mean return {returns.mean():5.2f}, {arrived.mean():4.0%} arrive")

new = list(range(10**6, 10**6 + POLICIES * WORLDS))
_, arrived = episodes(env, np.repeat(mean[None], len(new), axis=0), new)
print(f"the learned policy arrives in {arrived.mean():.0%} of {len(new)} new episodes")

# This policy observes no obstacle and drives to its goal; the filter changes actions that are not safe.
filtered = SafetyFilter(RobotEnv(head_on, command="velocity"))
observation, _ = filtered.reset(seed=1)
ended, changed = False, 0
while not ended:
    observation, _, terminated, truncated, info = filtered.step(observation[2:4] / np.linalg.norm(observation[2:4]))
    ended, changed = terminated or truncated, changed + info["intervened"]
print(f"a blind policy with the filter: {info['outcome']} after {info['time']:.1f} s, {changed} changed actions")
