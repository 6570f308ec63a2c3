"""A robot that takes velocities and follows them with a lag: planned velocities, or measured ones plus acceleration.

usage: python benchmarks/velocity_commands.py

The robot crosses a corridor of 20 m among three people. Its velocity approaches the command at the rate 1 / lag. The
command is the velocity of the manoeuvre at the end of the period, or the measured velocity plus the acceleration over
the period. Both are the same for a robot without a lag.
"""

from typing import Final

import numpy as np

import slalom

PERIOD, LAGS = 0.1, (0.1, 0.2, 0.4)
PARTS: Final = 10
"""[1] Instants in a period at which the robot moves on and clearances are measured."""
PEOPLE: Final = np.array([(8.0, 0.3), (12.0, -0.5), (18.0, 0.4)])
WALKS: Final = np.array([(-0.8, 0.0), (-0.6, 0.05), (-1.0, 0.0)])


def drive(lag: float, planned: bool) -> tuple[float, float]:
    """Time of arrival [s], inf without arrival, and least clearance [m] to people and walls."""
    robot = slalom.Navigator(slalom.method("nao"), slalom.Disc(0.3), slalom.Limits(1.2, 1.5), period=PERIOD, margin=0.1)
    goal = slalom.Goal(slalom.Stationary((20, 0)), tolerance=0.2, stop=True)
    sides = (slalom.Polyline([(-2, y), (22, y)]) for y in (-2, 2))
    walls = slalom.ObstacleTable(slalom.Obstacle(side, slalom.Stationary((0, 0))) for side in sides)
    state, decision, least = slalom.State((0, 0), (0, 0)), None, np.inf
    h, left = PERIOD / PARTS, np.exp(-PERIOD / PARTS / lag)
    for step in range(400):
        now = step * PERIOD
        if goal.reached(state.position, state.velocity, now):
            return now, least
        seen = slalom.Tracks(PEOPLE + now * WALKS, WALKS, 0.3, now)
        decision = robot.decide(state, [walls, seen], goal, now=now, previous=decision)
        command = state.velocity + PERIOD * decision.manoeuvre.mean_acceleration(now, PERIOD)
        command = decision.manoeuvre.velocity(now + PERIOD) if planned else command
        for part in range(1, PARTS + 1):
            more = state.velocity - command
            state = slalom.State(state.position + h * command + lag * (1.0 - left) * more, command + left * more)
            apart = np.linalg.norm(PEOPLE + (now + part * h) * WALKS - state.position, axis=1) - 0.6
            least = min(least, float(apart.min()), 1.7 - abs(float(state.position[1])))
    return np.inf, least


def main() -> None:
    """Print a row for each lag and command."""
    print("lag [s], command: arrival [s], least clearance [m]")
    for lag in LAGS:
        for planned in (True, False):
            arrival, least = drive(lag, planned)
            print(f"{lag:g}, {'planned' if planned else 'measured'}: {arrival:.1f}, {least:.4f}")


if __name__ == "__main__":
    main()
