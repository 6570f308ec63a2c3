"""A robot in a loop of your own: a map that is updated, people observed anew at each step, a path from a planner."""

import numpy as np

import slalom

DT = 0.1
# Walls known beforehand are one table, made once. A map that changes has one table for each part.
hall = slalom.ObstacleTable(
    slalom.Obstacle(slalom.Polyline(line), slalom.Stationary((0, 0)), name)
    for name, line in {"north": [(-2, 4), (22, 4)], "south": [(-2, -4), (22, -4)]}.items()
)
boxes = slalom.ObstacleTable([])
path = slalom.PathGoal([(0, 0), (10, 0), (14, 2), (20, 2)], speeds=[1.2, 1.2, 0.8, 0.0], tolerance=0.2)
robot = slalom.Navigator(slalom.method("nao"), slalom.Disc(0.3), slalom.Limits(1.5, 1.0), period=DT)

rng = np.random.default_rng(0)
people, walks = np.array([(8.0, -3.0), (16.0, 1.0), (12.0, 3.0)]), np.array([(0.0, 0.6), (-0.9, 0.0), (-0.5, -0.5)])
state, decision, nearest, step = slalom.State((0, 0), (0, 0)), None, np.inf, 0
while not path.reached(state.position, state.velocity, step * DT):
    now = step * DT
    if step == 40:
        # The map has changed: only this part is made again.
        boxes = slalom.ObstacleTable(
            [slalom.Obstacle(slalom.Rectangle(1.0, 1.6), slalom.Stationary((9.0, -0.2)), "box")]
        )
    noise = slalom.BoundedError(position=0.05, velocity=0.1)
    seen = slalom.Tracks(people + rng.uniform(-0.03, 0.03, (3, 2)), walks, 0.3, now, uncertainty=noise)
    decision = robot.decide(state, [hall, boxes, seen], path, now=now, previous=decision)
    # The rest is the step of your robot: it is driven by the mean acceleration over the period.
    applied = decision.manoeuvre.mean_acceleration(now, DT)
    state = slalom.State(
        state.position + DT * state.velocity + 0.5 * DT * DT * applied, state.velocity + DT * applied, applied
    )
    people, step = people + DT * walks, step + 1
    nearest = min(nearest, np.linalg.norm(people - state.position, axis=1).min() - 0.6)
print(f"at the end of the path after {step * DT:.1f} s; least distance from people {nearest:.2f} m")
