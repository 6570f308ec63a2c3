"""Time stamps that are late, early, repeated, of another clock or in other units: no robot drives blindly."""

from typing import Any

import numpy as np
import pytest
from draws import draws
from ros_messages import goal_pose, marker, odom, persons, pose
from test_driver import DRIVE, free, wheels

from slalom import Driver, DriveStatus as S, Goal, State, Stationary, Tracker
from slalom.adapters.ros.shell import NodeSettings
from slalom.vehicle import Pose

DT, MAX_AGE, SPEED, BRAKING = 0.1, 1.0, 1.0, 1.5
STEPS = 50
SEQUENCES = 50
"""Of each kind of robot in one draw."""


def wrong(rng: np.random.Generator, now: float, last: float) -> float:
    """A stamp at `now` [s] that is not the time: `last` is one that was sent before."""
    some = (now - 0.4, now - 3.0, now + 0.07, now + 0.3, now + 5.0, now + 1e6, 1000.0 * now + 1e4, now - 1e5, last)
    return float(rng.choice(some))


class Watch:
    """When a robot may drive, in true time, from the stamps that it was sent: apart from its own bookkeeping."""

    def __init__(self) -> None:
        self.sent: list[float] = []
        self.until = np.inf  # [s] true time; it may have no perception
        self.clock = self.t = -np.inf

    def blind(self, t: float, clock: float) -> bool:
        """Whether nothing was seen for `MAX_AGE` at a command at true time `t`, by a robot with this `clock` [s]."""
        valid = [t + stamp - clock + MAX_AGE for stamp in self.sent if stamp <= clock + DT + 1e-9]
        if self.sent and self.until == np.inf:
            self.until = -np.inf
        self.sent = []
        if np.isfinite(self.clock) and self.until < np.inf:
            self.until -= max((clock - self.clock) - (t - self.t), 0.0)
        self.until = max([*valid, self.until]) if self.until < np.inf else self.until
        back = clock < self.clock
        self.clock, self.t = clock, t
        if back and self.until < np.inf:
            self.until = -np.inf
        return t > self.until + 1e-6 or back


class Brakes:
    """The speed that a robot may have which brakes from now on, or has done so; a wrong stamp of a state is a delay."""

    def __init__(self, braking: float) -> None:
        self.braking, self.allowed = braking, np.inf

    def hold(self, must: bool, before: float, after: float) -> bool:
        """Whether the speed after a command is allowed; one that must not brake at it may go on as before."""
        step = self.braking * DT
        self.allowed = min(self.allowed, before + 2.0 * step) - 0.9 * step if must else np.inf
        # The last part of a stop takes two periods, and the speed may be known from before.
        return after <= max(self.allowed, 0.5 * before, 0.2 * step) + 1e-3


def driven(seed: int, on_wheels: bool) -> None:
    """A robot with a `Driver` whose clock may jump, and whose camera may die at any time."""
    rng, watch = np.random.default_rng([seed, on_wheels]), Watch()
    driver = Driver(wheels(DRIVE) if on_wheels else free(), Tracker(max_age=MAX_AGE))
    brakes = Brakes(3.0 if on_wheels else BRAKING)
    driver.head_for(Goal(Stationary((99.0, 0.0)), 0.2, stop=True))
    state: Any = Pose((0.0, 0.0), 0.0) if on_wheels else State((0.0, 0.0), (0.0, 0.0))
    dies, offset, last, jumps = rng.integers(5, STEPS), float(rng.choice([0.0, 1.7e9])), 0.0, rng.random() < 0.5
    for k in range(STEPS):
        jumped = jumps and rng.random() < 0.06
        if jumped:
            offset += float(rng.choice([-3.0, -0.25, -1e4, 3.0, 0.4]))
        now = DT * k + offset
        stamps = [now] if k < dies and rng.random() < 0.8 else []
        stamps += [wrong(rng, now, last)] if rng.random() < 0.4 else []
        for stamp in stamps:
            driver.see(stamp, [] if rng.random() < 0.5 else [("p", (50.0, 9.0))])
            watch.sent.append(stamp)
            last = stamp
        if rng.random() < 0.3:
            driver.locate(wrong(rng, now, now - DT), state)
        if jumped or rng.random() < 0.85:
            driver.locate(now, state)
        drive = driver.command(now)
        before = float(np.linalg.norm(state.velocity))
        if drive.decision is None:
            assert drive.status is S.WAITING
            continue
        if on_wheels:
            state = driver.navigator.vehicle.drive(state, drive.command)
        else:
            state = State(state.position + DT * 0.5 * (state.velocity + drive.command), drive.command)
        after = float(np.linalg.norm(state.velocity))
        assert after <= SPEED + 0.21
        back = now < watch.clock
        must = watch.blind(DT * k, now) or drive.status is S.NO_STATE
        assert brakes.hold(must, before, after), (k, drive.sentence)
        assert (drive.status is S.CLOCK_JUMPED) <= back, drive.sentence
        assert not back or drive.status in (S.CLOCK_JUMPED, S.NO_STATE)


def served(seed: int) -> None:
    """A robot with a node, whose odometry has wrong stamps too, or stops."""
    rng, watch, node = np.random.default_rng([seed, 2]), Watch(), NodeSettings(max_acceleration=BRAKING).node()
    node.receive(goal_pose(99.0, 0.0))
    place, speed, dies, last, told = 0.0, 0.0, rng.integers(5, STEPS), 100.0, 0.0
    silent, brakes = rng.integers(10, 90), Brakes(BRAKING)
    for k in range(STEPS):
        t = DT * k
        now = 100.0 + t
        stamps = [now] if k < dies and rng.random() < 0.8 else []
        stamps += [max(wrong(rng, now, last), 1.0)] if rng.random() < 0.3 else []
        for stamp in stamps:
            seen = odom(stamp).header
            node.receive(
                persons(header=seen) if rng.random() < 0.5 else persons(("p", (50.0, 9.0), (0, 0)), header=seen)
            )
            watch.sent.append(stamp)
            last = stamp
        of_state = max(wrong(rng, now, now - DT), 1.0) if rng.random() < 0.1 else now
        made = list(node.overdue(round(1e9 * t)))
        if not silent <= k < silent + 9:
            command = node.receive(odom(of_state, pose(place), (speed, 0.0, 0.0)), round(1e9 * t))
            made += [] if command is None else [command]
        for command in made:
            after = float(np.linalg.norm(command.linear))
            must = command.status is S.NO_STATE or watch.blind(t - DT, command.stamp * 1e-9)
            assert brakes.hold(must, speed, after), (k, command.sentence)
            speed, told = after, t
        assert speed == 0.0 or t - told <= node.driver.state_timeout + 2 * DT + 1e-9, k
        place += DT * speed


@pytest.mark.parametrize("draw", draws(range(10)))
def test_no_stamp_keeps_a_robot_driving_that_sees_nothing(draw: int) -> None:
    """It brakes as hard as it may where nothing came for `max_age` with a time of its clock, and at each jump back."""
    for seed in range(SEQUENCES * draw, SEQUENCES * (draw + 1)):
        driven(seed, on_wheels=False)
        served(seed)
        if seed % 5 == 0:
            driven(seed, on_wheels=True)


def test_inputs_that_are_not_used_are_counted_and_said() -> None:
    """One bad detection is left out of its message, and its words are in the next sentence; so are early stamps."""
    driver = Driver(free())
    driver.head_for(Goal(Stationary((9.0, 0.0)), 0.2))
    driver.locate(0.0, State((0.0, 0.0), (0.0, 0.0)))
    bad = [("nan", (np.nan, 0.0)), ("space", (1.0, 1.0, 1.0)), ([], (1.0, 0.0)), ("short",), 5]
    assert driver.see(0.0, [*bad, ("good", (5.0, 5.0))]) == len(bad)
    driver.see(5.0, [("later", (4.0, 0.0))])
    driver.locate(7.0, State((1.0, 0.0), (0.0, 0.0)))
    drive = driver.command(0.0)
    assert driver.tracker.ids == ("good",)
    assert driver.unused == {"bad": 5, "early": 1, "early sets": 1, "early states": 1}
    for words in ("5 bad", "1 early sets", "detections[4]: expected (id, position)"):
        assert words in drive.sentence
    driver.see(0.0, [("good", (5.0, 5.0))])
    driver.locate(-1.0, State((0.0, 0.0), (0.0, 0.0)))
    assert "Not used" not in driver.command(0.0).sentence
    assert driver.unused["repeated"] == driver.unused["late states"] == 1
    # What a message would show of which every detection is refused is not known.
    blind = Driver(free())
    blind.head_for(Goal(Stationary((9.0, 0.0)), 0.2))
    blind.see(0.0, bad)
    blind.locate(0.0, State((0.0, 0.0), (0.0, 0.0)))
    assert blind.command(0.0).status is S.NO_DETECTIONS


def test_a_node_leaves_out_what_it_cannot_read() -> None:
    node = NodeSettings().node()
    node.receive(goal_pose(9.0, 0.0))
    markers = [marker(type=9), marker(id=1, pose=pose(0.0, 5.0)), marker(id=2, pose=pose(np.nan))]
    node.receive(type("MarkerArray", (), {"markers": markers})())
    told = node.receive(odom())
    assert told.status is S.DRIVING
    assert node.unused == {"bad": 2}
    assert node.driver.tracker.ids == (("marker", "people", 1),)
    assert "Not used: 2 bad (marker 'people' 2: position: expected finite" in told.sentence


def test_a_clock_that_jumps_back_gives_one_status_and_all_begins_anew() -> None:
    """The robot brakes once, rests until it sees again, and its path goes on where it was."""
    driver, state = Driver(free()), State((0.0, 0.0), (0.0, 0.0))
    driver.head_for(Goal(Stationary((9.0, 0.0)), 0.2, stop=True))
    statuses = []
    for k in range(40):
        now = 50.0 + DT * k if k < 20 else DT * k
        if k not in range(20, 23):
            driver.see(now, [("p", (4.0, 8.0))])
        driver.locate(now, state)
        drive = driver.command(now)
        state = State(state.position + DT * 0.5 * (state.velocity + drive.command), drive.command)
        statuses.append(drive.status)
    assert statuses == [*[S.DRIVING] * 20, S.CLOCK_JUMPED, *[S.NO_DETECTIONS] * 2, *[S.DRIVING] * 17]
    assert driver.tracker.ids == ("p",)
    driver.see(900.0)
    driver.locate(900.0, state)
    assert driver.command(900.0).status is S.DRIVING, "a jump ahead is no time without progress"


def test_a_clock_that_is_ahead_only_while_no_state_comes_feeds_no_timeout() -> None:
    """The commands to brake may be later than the next state; stamps of that time count no more after it."""
    driver, state = Driver(free()), State((0.0, 0.0), (0.0, 0.0))
    driver.head_for(Goal(Stationary((9.0, 0.0)), 0.2, stop=True))
    driver.see(0.0)
    driver.locate(0.0, state)
    assert driver.command(0.0).status is S.DRIVING
    driver.see(8.0)
    assert driver.command(8.0).status is S.NO_STATE
    driver.locate(0.1, state)
    assert driver.command(0.1).status is S.NO_DETECTIONS
    driver.locate(8.0, state)
    driver.command(0.2)
    assert driver.command(0.7).status is S.NO_STATE


def test_a_tracker_alone_drops_stamps_of_the_far_future_and_can_begin_anew() -> None:
    tracker = Tracker(max_age=1.0)
    for t in (0.0, 0.1, 0.9, 5.0, 1e6):
        tracker.update(t, "a", (t, 0.0))
    assert tracker.at(0.1)[0].ids == ("a",)
    assert tracker.unused == {"early": 2}
    assert tracker.at(0.2, ahead=0.0)[0].ids == ("a",)
    assert tracker.unused == {"early": 3}
    tracker.forget()
    assert tracker.at(-9.0) == ()
    assert tracker.update(-9.0, "a", (0.0, 0.0))
    assert tracker.at(-9.0)[0].ids == ("a",)
