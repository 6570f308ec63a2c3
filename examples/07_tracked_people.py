"""A differential drive at 20 Hz among ten tracked people in a hall, from late and noisy measurements."""

import numpy as np

import slalom
from slalom.vehicle import DifferentialDrive, Pose, VehicleNavigator

PERIOD, LATE, BODY, PERSON = 0.05, 0.05, 0.25, 0.3
rng = np.random.default_rng(1)
people = rng.uniform((4.0, 0.5), (19.0, 7.5), (10, 2))
velocities = rng.uniform((-1.2, -0.4), (-0.4, 0.4), (10, 2))

drive = DifferentialDrive(track=0.4, max_wheel_speed=1.6, max_wheel_acceleration=4.0, ahead=0.4, period=PERIOD)
robot = VehicleNavigator(drive, slalom.method("nao"), slalom.Disc(BODY), horizon=5.0)
tracker = slalom.Tracker(slalom.Disc(PERSON), slalom.ConstantVelocityFilter(position=0.05, first_velocity=0.7))
hall = slalom.Obstacle(slalom.Polyline([(0, 0), (20, 0), (20, 8), (0, 8), (0, 0)]), slalom.Stationary((0, 0)))
driver = slalom.Driver(robot, tracker, walls=slalom.ObstacleTable([hall]))
driver.head_for(slalom.PathGoal([(1, 4), (19, 4)], speeds=1.2, tolerance=0.3))

slalom.compile("vehicles")
pose, least, step = Pose((1, 4), heading=0.0), np.inf, 0
while not driver.arrived:
    now = step * PERIOD
    noisy = people - LATE * velocities + rng.normal(0.0, 0.05, people.shape)
    driver.see(now - LATE, [(k, place) for k, place in enumerate(noisy) if rng.random() < 0.8])
    driver.locate(now, pose)
    told = driver.command(now)  # its speed and turn rate go to the wheels
    if step % 40 == 0:
        print(f"{now:4.1f} s at {pose.position.round(1)}: {told.sentence}")
    pose, people = drive.drive(pose, told.command), people + PERIOD * velocities
    least = min(least, float(np.linalg.norm(people - pose.position, axis=1).min()) - BODY - PERSON)
    step += 1
print(f"arrived after {now:.1f} s; least distance from people {least:.2f} m")
assert least > 0.0
