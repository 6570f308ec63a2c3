"""A differential drive on a way past rocks: decisions by the motion of its body, a rectangle."""

import numpy as np

import slalom
from slalom.vehicle import DifferentialDrive, Pose, VehicleNavigator

drive = DifferentialDrive(track=0.8, max_wheel_speed=4.0, max_wheel_acceleration=8.0, period=0.05)
body = slalom.Rectangle(1.2, 0.8)
navigator = VehicleNavigator(drive, slalom.method("nao"), body, center=0.2)
goal = slalom.Goal(slalom.Stationary((20.0, 0.0)), tolerance=0.1, stop=True)
rocks = [slalom.Obstacle(slalom.Disc(1.0), slalom.Stationary((x, y))) for x, y in ((5, 0.3), (9, -1.5), (14, 0.8))]


def clearance(pose: Pose, rock: slalom.Obstacle) -> float:
    """Distance [m] of the body from a rock."""
    x, y = rock.trajectory.initial_position - pose.position
    ahead = np.array([[np.cos(pose.heading), np.sin(pose.heading)], [-np.sin(pose.heading), np.cos(pose.heading)]])
    outside = np.maximum(np.abs(ahead @ (x, y) - (navigator.center, 0.0)) - (0.6, 0.4), 0.0)
    return float(np.hypot(*outside)) - 1.0


pose, decision, step, nearest = Pose((0.0, 0.0), heading=2.0), None, 0, np.inf
while step * drive.period < 60.0 and not goal.reached(pose.position, pose.velocity, step * drive.period):
    decision = navigator.decide(pose, rocks, goal, now=step * drive.period, previous=decision)
    pose, step = drive.drive(pose, decision.command), step + 1
    nearest = min(nearest, *(clearance(pose, rock) for rock in rocks))
print(f"arrived after {step * drive.period:.1f} s, least clearance {nearest:.3f} m")
assert goal.reached(pose.position, pose.velocity, step * drive.period)
assert nearest > 0.0
