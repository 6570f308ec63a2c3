"""A differential drive and a car with steering in MuJoCo: contacts with people and walls, and who caused them.

usage: python benchmarks/mujoco_vehicles.py [--vehicles drive car] [--seeds 20] [--first 0] [--quick]

MuJoCo simulates wheels on the ground, velocity servos, the steering, slip and contacts (pip install mujoco). The drive
is a cylinder of 0.3 m with two driven wheels and two casters. The car is a box of 0.9 m x 0.5 m with two driven rear
wheels and two steered front wheels (Ackermann). The hall is 14 m x 8 m. Eight people, cylinders of 0.3 m, walk straight
at 0.4 m/s to 1.3 m/s, and turn about at walls. Nothing pushes them. Positions are measured at 10 Hz with 0.05 m of
noise and arrive 0.1 s late, the pose with 5 mm and 0.003 rad, speed and steering by the joints. The lag of the servos
is measured first, by a step of the command, and stated to slalom.

A contact is one that the engine reports between the vehicle and a person or a wall; it counts once until 0.5 s without
one. The vehicle caused it if its velocity at the contact towards the other was above 0.05 m/s before, and no other
person had pushed it in the last 0.5 s: people are not stopped by a vehicle. "Off" is the largest distance of the pose
from the one that the decision before predicted, and the largest difference of headings, before the first contact.
"""

import sys
from time import process_time
from typing import Any, NamedTuple

import numpy as np
from program import finish, options, table, target

import slalom
from slalom.vehicle import Bicycle, DifferentialDrive, Pose, Vehicle, VehicleNavigator

try:
    import mujoco
except ImportError:
    mujoco = None

Array = np.ndarray
STEP, PERIOD, DURATION = 0.005, 0.1, 40.0  # [s]
LENGTH, WIDTH, PEOPLE, RADIUS = 14.0, 8.0, 8, 0.3  # [m]
WHEEL, TRACK, BASE, MARGIN = 0.1, 0.4, 0.5, 0.05  # [m]
START, GOAL = np.array([1.0, 4.0]), np.array([13.0, 4.0])
MOVES, APART = 0.05, 0.5  # [m/s], [s]

FRAME = """<mujoco><option timestep="{step}" integrator="implicitfast" cone="elliptic" impratio="10"/>
<default><geom contype="1" conaffinity="0"/>
<default class="vehicle"><geom contype="0" conaffinity="1"/></default></default>
<worldbody><geom name="floor" type="plane" size="30 30 .1"/>{around}
<body name="vehicle" pos="{x} {y} {wheel}" childclass="vehicle"><freejoint/>{vehicle}</body></worldbody>
<actuator>{motors}</actuator></mujoco>"""
WALL = '<geom name="wall{k}" type="box" pos="{x} {y} .5" size="{a} {b} .5"/>'
PERSON = '<body name="person{k}" mocap="true"><geom name="person{k}" type="cylinder" size="{radius} .8"/></body>'
ROLLING = '<joint name="{name}" axis="0 1 0" damping=".01"/><geom type="ellipsoid" size="{r} .02 {r}" mass="1"/>'
CASTER = '<geom type="sphere" size=".03" pos="{x} 0 -.07" mass=".2" condim="1" priority="1"/>'
SERVO = '<velocity joint="{name}" kv="{kv}" forcerange="-6 6"/>'


def rolling(name: str, x: float, y: float, steered: bool = False) -> str:
    """A wheel; a steered one turns about its vertical axis, by the joint `steer_<name>`."""
    wheel = ROLLING.format(name=name, r=WHEEL)
    if steered:
        turns = f'<joint name="steer_{name}" axis="0 0 1" damping=".5" armature=".01"/>'
        wheel = f'{turns}<geom type="sphere" size=".02" mass=".3"/><body>{wheel}</body>'
    return f'<body pos="{x} {y} 0">{wheel}</body>'


class Machine:
    """A vehicle in MuJoCo: its geometry, its motors, and what its encoders say."""

    kv = 1.5  # [N m s] of the servos of wheels
    body: slalom.Shape
    center = 0.0

    def __init__(self, people: int, place: Array = START) -> None:
        sides = [(LENGTH / 2, -0.05, LENGTH / 2, 0.05), (LENGTH / 2, WIDTH + 0.05, LENGTH / 2, 0.05)]
        sides += [(-0.05, WIDTH / 2, 0.05, WIDTH / 2), (LENGTH + 0.05, WIDTH / 2, 0.05, WIDTH / 2)]
        around = "".join(WALL.format(k=k, x=x, y=y, a=a, b=b) for k, (x, y, a, b) in enumerate(sides))
        around += "".join(PERSON.format(k=k, radius=RADIUS) for k in range(people))
        known = {"step": STEP, "around": around, "x": place[0], "y": place[1], "wheel": WHEEL}
        xml = FRAME.format(**known, vehicle=self.parts(), motors=self.motors())
        self.model = mujoco.MjModel.from_xml_string(xml)
        self.data = mujoco.MjData(self.model)
        kinds = [mujoco.mj_id2name(self.model, mujoco.mjtObj.mjOBJ_GEOM, k) for k in range(self.model.ngeom)]
        self.names = ["vehicle" if name is None else name for name in kinds]
        self.data.mocap_pos[:] = 100.0
        self.advance(0.5)  # it settles on its wheels

    def parts(self) -> str:
        raise NotImplementedError

    def motors(self) -> str:
        raise NotImplementedError

    def vehicle(self, lag: Any) -> Vehicle:
        raise NotImplementedError

    def command(self, speed: float, turn: float) -> None:
        raise NotImplementedError

    def joints(self) -> tuple[float, float]:
        """Speed [m/s] and turn (rate [rad/s] or steering [rad]) of the joints."""
        raise NotImplementedError

    def joint(self, name: str) -> float:
        """Speed [m/s] of a wheel on the ground."""
        return WHEEL * float(self.data.joint(name).qvel[0])

    def advance(self, seconds: float) -> None:
        for _ in range(round(seconds / STEP)):
            mujoco.mj_step(self.model, self.data)

    @property
    def place(self) -> Array:
        return np.array(self.data.body("vehicle").xpos[:2])

    @property
    def heading(self) -> float:
        turned = self.data.body("vehicle").xmat
        return float(np.arctan2(turned[3], turned[0]))


class Drive(Machine):
    body, center = slalom.Disc(0.3), 0.0

    def parts(self) -> str:
        hull = '<geom type="cylinder" size=".3 .12" pos="0 0 .06" mass="20"/>'
        casters = "".join(CASTER.format(x=x) for x in (-0.24, 0.24))
        return hull + casters + rolling("left", 0.0, TRACK / 2) + rolling("right", 0.0, -TRACK / 2)

    def motors(self) -> str:
        return "".join(SERVO.format(name=name, kv=self.kv) for name in ("left", "right"))

    def vehicle(self, lag: Any) -> Vehicle:
        return DifferentialDrive(TRACK, 1.2, 2.0, max_speed=1.0, period=PERIOD, lag=lag[0])

    def command(self, speed: float, turn: float) -> None:
        self.data.ctrl[:] = (speed + 0.5 * TRACK * turn * np.array([-1.0, 1.0])) / WHEEL

    def joints(self) -> tuple[float, float]:
        left, right = self.joint("left"), self.joint("right")
        return 0.5 * (left + right), (right - left) / TRACK


class Car(Machine):
    body, center = slalom.Rectangle(0.9, 0.5), BASE / 2

    def parts(self) -> str:
        hull = f'<geom type="box" size=".45 .25 .08" pos="{BASE / 2} 0 .1" mass="20"/>'
        sides = ("left", TRACK / 2), ("right", -TRACK / 2)
        rear = "".join(rolling(f"rear_{name}", 0.0, y) for name, y in sides)
        return hull + rear + "".join(rolling(f"front_{name}", BASE, y, True) for name, y in sides)

    def motors(self) -> str:
        servos = "".join(SERVO.format(name=f"rear_{name}", kv=self.kv) for name in ("left", "right"))
        steering = '<position joint="steer_front_{name}" kp="20" kv="2" forcerange="-10 10"/>'
        return servos + "".join(steering.format(name=name) for name in ("left", "right"))

    def vehicle(self, lag: Any) -> Vehicle:
        return Bicycle(BASE, 0.6, 2.0, 1.0, 1.5, max_reverse_speed=0.4, period=PERIOD, lag=lag)

    def command(self, speed: float, turn: float) -> None:
        rate, sides = np.tan(turn) / BASE, 0.5 * TRACK * np.array([1.0, -1.0])
        self.data.ctrl[:2] = speed * (1.0 - rate * sides) / WHEEL
        self.data.ctrl[2:] = np.arctan(BASE * rate / (1.0 - rate * sides))

    def joints(self) -> tuple[float, float]:
        left, right = (np.tan(float(self.data.joint(f"steer_front_{n}").qpos[0])) for n in ("left", "right"))
        # Ackermann: 1 / tan of the wheels are those of the middle -+ half a track over the wheelbase.
        rates = [t / (1.0 + s * 0.5 * TRACK / BASE * t) for t, s in ((left, 1.0), (right, -1.0))]
        return 0.5 * (self.joint("rear_left") + self.joint("rear_right")), float(np.arctan(np.mean(rates)))


MACHINES: dict[str, type[Machine]] = {"drive": Drive, "car": Car}


def lags(kind: type[Machine]) -> tuple[float, float]:
    """The times [s] after which speed and turn have 63 % of a step of their commands, as one would measure them."""
    found = []
    for k, step in enumerate(((0.2, 0.0), (0.5, 0.3))):
        machine = kind(0, np.array([4.0, 4.0]))
        if k:
            machine.command(0.5, 0.0)
            machine.advance(1.0)
        machine.command(*step)
        past = 0.0
        while machine.joints()[k] < 0.632 * step[k] and past < 1.0:
            machine.advance(STEP)
            past += STEP
        found.append(round(past, 3))
    return found[0], found[1]


class Contact(NamedTuple):
    """A contact that began: with what, when [s], the velocity towards it [m/s], whether a person pushed the vehicle."""

    other: str
    t: float
    towards: float
    pushed: bool
    outcome: str
    turned: float  # [s] since the person turned about


class Run(NamedTuple):
    """What happened in one run."""

    arrived: float  # [s], nan: it did not
    contacts: list[Contact]
    off: tuple[float, float]  # [m], [rad]
    times: list[float]  # [s] of decisions


def touched(machine: Machine) -> dict[str, Array]:
    """The contacts of the vehicle with people and walls: (6,) point and direction from the vehicle, by the other."""
    found = {}
    for contact in machine.data.contact:
        a, b = (machine.names[k] for k in contact.geom)
        other = b if a == "vehicle" else a
        if "vehicle" in (a, b) and other.startswith(("wall", "person")):
            found[other] = np.concatenate([contact.pos, contact.frame[:3] * (1.0 if a == "vehicle" else -1.0)])
    return found


def run(kind: type[Machine], lag: tuple[float, float], seed: int, most: float = DURATION) -> Run:
    """One run of at most `most` [s]."""
    rng, people = np.random.default_rng(seed), []
    while len(people) < PEOPLE:
        place = rng.uniform((0.6, 0.6), (LENGTH - 0.6, WIDTH - 0.6))
        if np.hypot(*(place - START)) > 2.5:
            people.append(place)
    places, speeds, ways = np.array(people), rng.uniform(0.4, 1.3, PEOPLE), rng.uniform(0.0, 2.0 * np.pi, PEOPLE)
    velocities, turned = speeds[:, None] * np.stack([np.cos(ways), np.sin(ways)], 1), np.full(PEOPLE, -np.inf)
    machine, tracker, coming = kind(PEOPLE), slalom.Tracker(slalom.Disc(RADIUS)), []  # type: Any, Any, list[Any]
    robot = VehicleNavigator(
        machine.vehicle(lag), slalom.method("nao"), machine.body, machine.center, horizon=3.0, margin=MARGIN
    )
    room = [(0, 0), (LENGTH, 0), (LENGTH, WIDTH), (0, WIDTH), (0, 0)]
    walls = slalom.ObstacleTable([slalom.Obstacle(slalom.Polyline(room), slalom.Stationary((0, 0)))])
    goal, decision, contacts, last = slalom.Goal(slalom.Stationary(GOAL), 0.2, stop=True), None, [], {}
    off, times, arrived = np.zeros(2), [], np.nan
    for k in range(round(most / PERIOD)):
        now = k * PERIOD
        noise = rng.normal(0.0, 1.0, 3) * (0.005, 0.005, 0.003)
        pose = Pose(machine.place + noise[:2], machine.heading + float(noise[2]), *machine.joints())
        if np.hypot(*(machine.place - GOAL)) < 0.25 and abs(pose.speed) < 0.1:
            arrived = now
            break
        if decision is not None and not contacts:
            x, y, heading = decision.motions[1][:3]
            turn = (machine.heading - heading + np.pi) % (2.0 * np.pi) - np.pi
            off = np.maximum(off, (np.hypot(*(machine.place - (x, y))), abs(turn)))
        coming.append((now, places + rng.normal(0.0, 0.05, places.shape)))
        begin = process_time()
        if len(coming) > 1:
            for id, place in enumerate(coming[-2][1]):
                tracker.update(coming[-2][0], id, place)
        decision = robot.decide(pose, [walls, *tracker.at(now)], goal, now=now, previous=decision)
        times.append(process_time() - begin)
        machine.command(*decision.command)
        for j in range(round(PERIOD / STEP)):
            t, velocity, center = now + j * STEP, machine.data.qvel[:6].copy(), machine.data.qpos[:3].copy()
            outside = (places + 0.3 * velocities < RADIUS) | (places + 0.3 * velocities > (LENGTH - 0.3, WIDTH - 0.3))
            inward = outside & (velocities * (places - (LENGTH / 2, WIDTH / 2)) > 0.0)
            turned[inward.any(axis=1)] = t
            velocities = np.where(inward, -velocities, velocities)
            places = places + STEP * velocities
            machine.data.mocap_pos[:] = np.column_stack([places, np.full(PEOPLE, 0.8)])
            mujoco.mj_step(machine.model, machine.data)
            for other, at in touched(machine).items():
                if t - last.get(other, -np.inf) > APART:
                    towards = float((velocity[:3] + np.cross(velocity[3:], at[:3] - center)) @ at[3:])
                    since = t - turned[int(other[6:])] if other[0] == "p" else np.inf
                    pushed = any(t - at < APART for one, at in last.items() if one != other and one[0] == "p")
                    contacts.append(Contact(other, t, towards, pushed, decision.outcome.name, since))
                last[other] = t
    return Run(arrived, contacts, (float(off[0]), float(off[1])), times[2:])


def row(label: str, runs: list[Run]) -> list[Any]:
    """A row of the table."""
    arrived, times = np.array([one.arrived for one in runs]), 1e3 * np.concatenate([one.times for one in runs])
    contacts = [each for one in runs for each in one.contacts]
    moving = [each for each in contacts if each.towards > MOVES]
    caused = [each for each in moving if not each.pushed]
    walls, done = sum(each.other.startswith("wall") for each in caused), np.isfinite(arrived)
    off = np.max([one.off for one in runs], axis=0)
    counts = [int(done.sum()), float(arrived[done].mean()) if done.any() else np.nan, len(caused) - walls, walls]
    figures = [
        len(moving) - len(caused),
        len(contacts) - len(moving),
        1e3 * off[0],
        off[1],
        float(np.median(times)),
        float(times.max()),
    ]
    return [label, len(runs), *counts, *figures]


HEADS = [
    "vehicle",
    "runs",
    "arrived",
    "time s",
    "caused, people",
    "caused, walls",
    "pushed",
    "hit by people",
    "off mm",
    "off rad",
]
HEADS += ["median ms", "longest ms"]


def main() -> None:
    """Measure and write."""
    parser = options(__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--vehicles", nargs="+", default=list(MACHINES), choices=MACHINES)
    given = parser.parse_args()
    if mujoco is None:
        sys.exit("benchmarks/mujoco_vehicles.py needs MuJoCo: pip install mujoco")
    seeds, most = (1, 1.0) if given.quick else (given.seeds, DURATION)
    slalom.compile()
    rows, targets, stated = [], [], {}
    for name in given.vehicles:
        stated[name] = lag = lags(MACHINES[name])
        print(f"{name}: lags of {lag[0]:g} s and {lag[1]:g} s", file=sys.stderr, flush=True)
        runs = []
        for k in range(seeds):
            runs.append(run(MACHINES[name], lag, given.first + k, most))
            print(name, given.first + k, runs[-1].arrived, *runs[-1].contacts, file=sys.stderr, flush=True)
        rows.append(row(name, runs))
        targets.append(target(f"{name}: contacts that it caused", rows[-1][4] + rows[-1][5], most=0.0))
    result = {
        "question": "Does a vehicle in MuJoCo cause contacts?",
        "parameters": {"seeds": seeds, "first": given.first, "lags": stated},
        "tables": [table(f"{seeds} seeds from {given.first} on", HEADS, rows)],
        "targets": targets,
    }
    finish("mujoco_vehicles", result, given, ["slalom", "mujoco"])


if __name__ == "__main__":
    main()
