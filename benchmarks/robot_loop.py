"""A driver among tracked people for a minute and many seeds: distances, wheels, longest decision.

usage: python benchmarks/robot_loop.py [--quick] [--seeds 20] [--out FOLDER]

Ten people do not avoid the robot. They are measured with noise, late and with dropouts. The robot is a differential
drive at 20 Hz in a hall of 200 wall segments. Each seed is another crowd. A decision is everything from the tracks to
the command of the wheels. Times are processor times, so that other processes count little.
"""

import gc
import time
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from program import finish, options, table, target

import slalom
from slalom.vehicle import Command, DifferentialDrive, Pose, VehicleNavigator

DT = 0.05
BODY, PERSON = 0.25, 0.3
HALL = np.array([28.0, 18.0])
PILLARS = [(x, y) for x in np.arange(3.5, 26.0, 3.5) for y in (3.0, 6.0, 9.0, 12.0, 15.0)]
DRIVE = DifferentialDrive(track=0.4, max_wheel_speed=1.6, max_wheel_acceleration=4.0, ahead=0.4, period=DT)
ROUTE = [(1.75, 1.5), (26.25, 1.5), (26.25, 7.5), (1.75, 7.5), (1.75, 16.5), (26.25, 16.5)]


def building() -> slalom.ObstacleTable:
    """The map, 200 segments, made once: four walls of 15 segments each, and the four sides of 35 pillars."""
    corners = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)]) * HALL
    walls = [np.linspace(a, b, 16) for a, b in pairwise(corners)]
    square = 0.15 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)])
    lines = [*walls, *(square + pillar for pillar in PILLARS)]
    return slalom.ObstacleTable(
        slalom.Obstacle(slalom.Polyline(line), slalom.Stationary((0.0, 0.0)), f"line {k}")
        for k, line in enumerate(lines)
    )


class Crowd:
    """Ten people. They walk straight through the hall, do not avoid the robot, and are replaced when they have left."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng, self.number = rng, 0
        self.people: dict[int, tuple[np.ndarray, np.ndarray]] = {}

    def step(self, robot: np.ndarray) -> None:
        """Let all people walk for one period; new ones enter at a distance from the robot."""
        self.people = {k: (p + DT * v, v) for k, (p, v) in self.people.items()}
        self.people = {k: (p, v) for k, (p, v) in self.people.items() if np.all((p > 0.0) & (p < HALL))}
        while len(self.people) < 10:
            start, velocity = self._walk()
            if np.linalg.norm(start - robot) > 8.0:
                self.number += 1
                self.people[self.number] = start, velocity

    def _walk(self) -> tuple[np.ndarray, np.ndarray]:
        """A straight way from wall to wall that passes the pillars."""
        while True:
            along, side = self.rng.integers(2), self.rng.integers(2)
            start, end = self.rng.uniform(0.5, HALL - 0.5), self.rng.uniform(0.5, HALL - 0.5)
            start[along], end[along] = (0.4, HALL[along] - 0.4) if side else (HALL[along] - 0.4, 0.4)
            way = (end - start) / np.linalg.norm(end - start)
            across = (np.array(PILLARS) - start) @ np.array([-way[1], way[0]])
            if np.abs(across).min() > PERSON + 0.3:
                return start, self.rng.uniform(0.6, 1.4) * way


class Perception:
    """Measures positions every period, 50 ms late, with 5 cm of noise; one of five is missed, at times for 0.4 s."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng, self.coming = rng, []
        self.hidden: dict[int, int] = {}

    def measure(self, now: float, people: dict[int, tuple[np.ndarray, np.ndarray]]) -> list[tuple]:
        """What arrives at `now`: (time, id, position) in any order."""
        arrived, self.coming = self.coming, []
        for k, (position, _) in people.items():
            if self.hidden.get(k, 0) > 0 or self.rng.random() < 0.2:
                self.hidden[k] = self.hidden.get(k, 0) - 1
                continue
            self.hidden[k] = 8 if self.rng.random() < 0.01 else 0
            self.coming.append((now, k, position + self.rng.normal(0.0, 0.05, 2)))
        self.rng.shuffle(arrived)
        return arrived


@dataclass
class Report:
    """Measurements of a run."""

    people: float = np.inf  # [m] least distance from a person
    walls: float = np.inf  # [m] least distance from a wall
    wheels: float = 0.0  # [1] largest share of the limits of the wheels
    slowest: float = 0.0  # [s] of processor time, longest decision
    median: float = 0.0  # [s] of a decision
    distance: float = 0.0  # [m] that the robot drove
    unsafe: int = 0  # decisions without a safe manoeuvre


def run(seed: int, duration: float) -> Report:
    """One run; every random number follows from the seed."""
    rng, report, times = np.random.default_rng(seed), Report(), []
    crowd, perception, walls = Crowd(rng), Perception(rng), building()
    motion = slalom.ConstantVelocityFilter(acceleration=0.1, position=0.05, first_velocity=0.7)
    robot = VehicleNavigator(DRIVE, slalom.method("nao"), slalom.Disc(BODY), horizon=5.0)
    driver = slalom.Driver(robot, slalom.Tracker(slalom.Disc(PERSON), motion), walls)
    driver.head_for(slalom.PathGoal(ROUTE, speeds=1.2, tolerance=0.3))
    pose = Pose(ROUTE[0], 0.0)
    lines = [segment for table in walls for segment in zip(table.shape.points, table.shape.points[1:])]
    begins, ends = (np.array(each) for each in zip(*lines))
    for step in range(round(duration / DT)):
        now = step * DT
        for t, person, position in perception.measure(now, crowd.people):
            driver.see(t, [(person, position)])
        driver.locate(now, pose)
        before = time.process_time()
        drive = driver.command(now)
        command = drive.command
        times.append(time.process_time() - before)
        report.unsafe += not drive.decision.safe
        report.wheels = max(report.wheels, load(pose, command))
        for part in np.linspace(0.0, DT, 6)[1:]:
            at = DRIVE.drive(pose, command, float(part)).position
            gaps = [np.linalg.norm(p + part * v - at) for p, v in crowd.people.values()]
            report.people = min(report.people, min(gaps, default=np.inf) - BODY - PERSON)
            report.walls = min(report.walls, distance(at, begins, ends) - BODY)
        after = DRIVE.drive(pose, command)
        report.distance += float(np.linalg.norm(after.position - pose.position))
        pose = after
        crowd.step(pose.position)
    report.slowest, report.median = max(times), float(np.median(times))
    return report


def load(pose: Pose, command: Command) -> float:
    """Largest share of the limits of the wheels that a command uses."""
    half, limits = 0.5 * DRIVE.track, (DRIVE.max_wheel_speed, DRIVE.max_wheel_acceleration)
    wheels = [(one.speed - half * one.turn, one.speed + half * one.turn) for one in (pose, command)]
    speeds, rates = np.abs(wheels[1]), np.abs(np.subtract(wheels[1], wheels[0])) / DT
    return max(float(speeds.max()) / limits[0], float(rates.max()) / limits[1])


def distance(point: np.ndarray, begins: np.ndarray, ends: np.ndarray) -> float:
    """Distance of a point from segments."""
    along = ends - begins
    share = np.clip(np.sum((point - begins) * along, axis=1) / np.sum(along * along, axis=1), 0.0, 1.0)
    return float(np.linalg.norm(begins + share[:, None] * along - point, axis=1).min())


def main() -> None:
    """Measure and write."""
    parser = options(__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    arguments = parser.parse_args()
    seeds, duration = (1, 1.0) if arguments.quick else (arguments.seeds, 60.0)
    run(0, 2.0)  # loads what is compiled
    # A full collection would examine all that was loaded, for about 60 ms, in the middle of a decision.
    gc.collect()
    gc.freeze()
    runs = [run(seed, duration) for seed in range(seeds)]
    rows = [
        [k, float(r.people), r.walls, 100.0 * r.wheels, r.distance, int(r.unsafe), 1e3 * r.median, 1e3 * r.slowest]
        for k, r in enumerate(runs)
    ]
    result: dict[str, Any] = {
        "question": "A differential drive among tracked people.",
        "parameters": {"seeds": seeds, "duration": duration},
        "tables": [
            table(
                f"{duration:g} s at 20 Hz, ten people, 200 wall segments:",
                ["seed", "people m", "walls m", "wheels %", "driven m", "not safe", "median ms", "longest ms"],
                rows,
            )
        ],
        "targets": [
            target("collisions with people", sum(bool(r.people <= 0.0) for r in runs), most=0),
            target("collisions with walls", sum(bool(r.walls <= 0.0) for r in runs), most=0),
            target("commands, share of the limits of the wheels", float(max(r.wheels for r in runs)), most=1.0 + 1e-9),
            target("longest decision", 1e3 * max(r.slowest for r in runs), most=20.0, unit="ms"),
            target("median decision", 1e3 * float(np.median([r.median for r in runs])), most=20.0, unit="ms"),
        ],
    }
    finish("robot_loop", result, arguments)


if __name__ == "__main__":
    main()
