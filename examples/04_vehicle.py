"""A differential drive follows the decisions for a point ahead of its axle, which is grown by the proven error."""

import numpy as np

import slalom
from slalom.vehicle import DifferentialDrive, Pose

RADIUS = 0.5
drive = DifferentialDrive(track=0.8, max_wheel_speed=4.0, max_wheel_acceleration=8.0, ahead=0.4, period=0.05)
navigator = slalom.Navigator(slalom.method("nao"), drive.shape(RADIUS), drive.limits, period=drive.period, margin=0.05)
goal = slalom.Goal(slalom.Stationary((20.0, 0.0)), tolerance=0.1, stop=True)
rocks = [slalom.Obstacle(slalom.Disc(1.0), slalom.Stationary((x, y))) for x, y in ((5, 0.3), (9, -1.5), (14, 0.8))]

pose, decision, step, nearest, farthest = Pose((0.0, 0.0), heading=2.0), None, 0, np.inf, 0.0
while step * drive.period < 60.0 and not goal.reached(pose.position, pose.velocity, step * drive.period):
    now = step * drive.period
    decision = navigator.decide(
        drive.state(pose, decision, now), rocks, drive.goal(pose, goal, now), now=now, previous=decision
    )
    pose, step = drive.drive(pose, drive.command(pose, decision, now)), step + 1
    point, _ = drive.point(pose)
    farthest = max(farthest, float(np.linalg.norm(point - decision.manoeuvre.position(step * drive.period))))
    gaps = [np.linalg.norm(pose.position - rock.trajectory.initial_position) - 1.0 - RADIUS for rock in rocks]
    nearest = min(nearest, *map(float, gaps))
print(f"arrived after {step * drive.period:.1f} s, least clearance {nearest:.3f} m")
print(f"tracking error {1000 * farthest:.2f} mm, proven bound {1000 * drive.tracking_error:.2f} mm")
assert goal.reached(pose.position, pose.velocity, step * drive.period)
assert nearest > 0.0
assert farthest <= drive.tracking_error
