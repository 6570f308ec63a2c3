"""A bicycle follows the decisions for a holonomic robot, which is planned larger by the proven tracking error."""

import numpy as np

import slalom
from slalom.tracking import Bicycle, Vehicle

bicycle, radius, dt, slowest = Bicycle(wheelbase=1.0, max_steering=0.7), 0.5, 0.1, 2.0
plain = slalom.Limits(max_speed=6.0, max_acceleration=3.0)
error = bicycle.tracking_error(plain, dt, slowest)
turn = bicycle.turning_radius(plain, dt, slowest)
limits = slalom.Limits(
    6.0,
    3.0,
    bounds=(
        slalom.Friction(forward=2.0, braking=3.0, lateral=2.5),
        slalom.TurningRadius(turn),
        slalom.HeadingCone(1.2),
        slalom.LeastSpeed(slowest),
    ),
)
navigator = slalom.Navigator(slalom.method("nao"), slalom.Disc(radius + error), limits, period=dt, margin=0.05)
goal = slalom.Goal(slalom.Stationary((40.0, 0.0)), tolerance=2.0)
rocks = [slalom.Obstacle(slalom.Disc(1.0), slalom.Stationary((x, y))) for x, y in ((10, 0.3), (18, -1.5), (26, 0.8))]

state = slalom.State((0.0, 0.0), (4.0, 0.0))
vehicle, decision, time, nearest, farthest, arrived = Vehicle.on(state), None, 0.0, np.inf, 0.0, False
while time < 30.0 and not arrived:
    decision = navigator.decide(state, rocks, goal, now=time, previous=decision)
    applied = decision.manoeuvre.mean_acceleration(time, dt)
    # The goal is passed: it is reached during a step, not only at its end.
    arrived = goal.reached_during(state.position, state.velocity, applied, time, dt)
    vehicle = bicycle.step(vehicle, state, applied, dt)
    state = slalom.State(
        state.position + dt * state.velocity + 0.5 * dt * dt * applied,
        state.velocity + dt * applied,
        acceleration=applied,
    )
    time += dt
    farthest = max(farthest, float(np.linalg.norm(vehicle.position - state.position)))
    gaps = [np.linalg.norm(vehicle.position - rock.trajectory.position(time)) - 1.0 - radius for rock in rocks]
    nearest = min(nearest, *map(float, gaps))
print(f"turning radius {turn:.2f} m; arrived after {time:.1f} s, least clearance {nearest:.3f} m")
print(f"tracking error {1000 * farthest:.2f} mm, proven bound {1000 * error:.2f} mm")
assert nearest > 0.0
assert farthest <= error
