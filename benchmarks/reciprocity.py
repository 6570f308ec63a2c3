"""One robot among agents that decide by ORCA, or that never yield: arrival and collisions, by what is assumed of them.

usage: python benchmarks/reciprocity.py [--seeds 20] [--scenarios circle_random random_goals ring]

The first robot of a scenario of the gallery decides by ORCA itself ("orca"), or by nao with all others as obstacles
("obstacles"), as robots that do half of the avoidance ("half"), or with the share that `slalom.Reciprocity` estimates
("estimate"). The others decide by ORCA of pyrvo, whose velocities change at once, or drive straight to their goals.
Runs end when the first robot arrives. A collision is counted where the robot moved at the first contact.
"""

import argparse
from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np

import slalom
from slalom.base.tolerances import REST
from slalom.peers import PEERS, Discs, Team
from slalom.sim import gallery
from slalom.sim.run.states import integrate
from slalom.sim.scenario import Scenario

SETTINGS: Final[Mapping[str, Mapping[str, float]]] = {
    "circle_random": {"robots": 16.0, "radius": 10.0, "robot_radius": 0.4},
    "random_goals": {"robots": 16.0},
    "ring": {"robots": 20.0, "radius": 12.0},
}
KINDS: Final = ("orca", "obstacles", "half", "estimate")
LONGEST: Final = 90.0
"""[s] of a run in which the robot does not arrive."""
INSTANTS: Final = 5
"""[1] Times in a step at which clearances are measured."""


class Run(NamedTuple):
    """What became of the first robot."""

    arrival: float  # [s], inf if it did not arrive
    clearance: float  # [m] least
    speed: float  # [m/s] at the first contact, 0 without one


class Me:
    """The first robot of a scenario, among agents of which it observes positions and velocities."""

    def __init__(self, scenario: Scenario, kind: str) -> None:
        own, period = scenario.robot, scenario.dt * scenario.steps_per_decision
        self.kind, self.goal, self.decision = kind, own.goal, None
        self.navigator = slalom.Navigator(
            slalom.method("nao"),
            own.shape,
            own.limits,
            period=period,
            horizon=scenario.horizon,
            margin=scenario.margin,
            holds=scenario.holds,
        )
        self.estimate = slalom.Reciprocity(own.shape.bounding_radius + scenario.margin)
        self.acceleration = np.zeros(2)

    def decide(self, now: float, positions: np.ndarray, velocities: np.ndarray, radii: np.ndarray) -> np.ndarray:
        """The acceleration (2,) [m/s^2] until the next decision; row 0 is the robot."""
        state = slalom.State(positions[0], velocities[0], self.acceleration)
        agents = slalom.Tracks(positions[1:], velocities[1:], radii[1:], now)
        if self.kind == "estimate":
            agents = self.estimate.update(state, agents)
        alone = self.kind == "obstacles"
        self.decision = self.navigator.decide(
            state,
            [agents] if alone else [],
            self.goal,
            robots=None if alone else agents,
            now=now,
            previous=self.decision,
        )
        self.acceleration = self.decision.manoeuvre.mean_acceleration(now, self.navigator.period)
        return self.acceleration


def run(scenario: Scenario, kind: str, *, yields: bool) -> Run:
    """One run; with `yields` the others decide by ORCA, else they drive straight to their goals."""
    robots, period = scenario.robots, scenario.dt * scenario.steps_per_decision
    positions, velocities = (np.array([getattr(r.state, name) for r in robots]) for name in ("position", "velocity"))
    radii = np.array([robot.shape.bounding_radius for robot in robots])
    speeds, accelerations = (
        np.array([getattr(r.limits, f"max_{w}") for r in robots]) for w in ("speed", "acceleration")
    )
    crowd = PEERS["orca"].begin(Team(radii, speeds, accelerations, period))
    nothing, me = Discs(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0)), Me(scenario, kind)
    least, speed = np.inf, 0.0
    for step in range(round(LONGEST / period)):
        now = step * period
        each = zip(robots, positions, velocities, strict=True)
        wanted = np.array([r.goal.desired_velocity(p, v, now, r.limits) for r, p, v in each])
        chosen = crowd.choose(positions, velocities, wanted, nothing) if yields else wanted
        acceleration = (chosen - velocities) / period
        if kind != "orca":
            acceleration[0] = me.decide(now, positions, velocities, radii)
        for share in (np.arange(INSTANTS) + 1.0) / INSTANTS:
            places, moves = integrate(positions, velocities, acceleration, share * period)
            clearance = float((np.linalg.norm(places[1:] - places[0], axis=1) - radii[1:] - radii[0]).min())
            if clearance < 0.0 <= least:
                speed = float(np.linalg.norm(moves[0]))
            least = min(least, clearance)
        reached = robots[0].goal.reached_during(positions[0], velocities[0], acceleration[0], now, period)
        positions, velocities = integrate(positions, velocities, acceleration, period)
        if reached:
            return Run(now + period, least, speed)
    return Run(np.inf, least, speed)


def main() -> None:
    """Print a row for each scenario, kind of agents and assumption."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--scenarios", nargs="+", default=list(SETTINGS), choices=list(SETTINGS))
    arguments = parser.parse_args()
    print("scenario, agents, assumption: arrived, mean arrival [s], moved into contact, least clearance [m]")
    for name in arguments.scenarios:
        for yields in (True, False):
            for kind in KINDS if yields else KINDS[1:]:
                built = (gallery.build(name, SETTINGS[name], seed=seed) for seed in range(arguments.seeds))
                runs = [run(scenario, kind, yields=yields) for scenario in built]
                arrivals = np.array([one.arrival for one in runs])
                moved = sum(one.speed > REST for one in runs)
                print(
                    f"{name}, {'orca' if yields else 'never yield'}, {kind}: {np.isfinite(arrivals).sum()}, "
                    f"{arrivals[np.isfinite(arrivals)].mean():.2f}, {moved}, {min(r.clearance for r in runs):.4f}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
