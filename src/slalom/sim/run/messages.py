"""Messages between robots that share their manoeuvres, where they arrive late or are lost."""

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np

from slalom.base.checks import Array
from slalom.base.tolerances import WHOLE_COUNT
from slalom.decision.methods import Method
from slalom.fleet.observation import Information
from slalom.fleet.settings import Policy
from slalom.kernels.arrays import Flags, Indices
from slalom.kernels.decision.tables import RobotTable
from slalom.sim.scenario import Scenario

FRESH: Final = 3.0
"""[1] A robot never waits for a message newer than one that is no older than this many times the largest delay. Larger:
pairs count as far only at larger distances, so more pairs need their right. Smaller: a robot waits more often after
lost messages. It has no part in safety."""


class Message(NamedTuple):
    """m messages that arrive at the same step, and their contents beside the committed manoeuvres; each (m,)."""

    sent: Indices  # the step at which a message was sent
    sender: Indices
    receiver: Indices
    handovers: Indices  # how often the right of the pair has changed hands
    decided: Indices  # the step of the sender's last decision


class Messages(Information):
    """Which robot has received which messages, and which robot may change its manoeuvre (docs/theory.md, 17).

    Of each pair of robots one holds the right to change. Every message contains the committed manoeuvre of the sender
    and a count of handovers of that right: the largest one that the sender received or made. If the count is even, the
    first of the two holds the right.

    Robot i may change its manoeuvre if for every other robot j

    1. i holds the right of the pair, or the two are farther than `far` from each other; and
    2. i holds the right, and the two have stayed within `far` since the last message of j that i received was sent. Or
       they are farther than `apart`, and no manoeuvre of one meets any manoeuvre of the other.

    Robot i takes the least distance that the last message of j leaves possible. It hands a right over once j, by the
    messages that i received, has waited longer for a decision. A lost message needs no repeat, since the next one
    contains as much.

    Steps are those at which robots decide; a message arrives at the next step at the earliest. Arrays (n, n) have a row
    for the receiver and a column for the sender of the information.

    Attributes:
        max_speed: (n,) [m/s]. apart, far: (n, n) [m], see above.
        handovers: (n, n) of the right of each pair. received: (n, n) step at which the last message was sent.
        was_far: (n, n) last step at which the two were farther than `far`.
        decided: (n,) step of the last decision. waits: (n,) [steps] from the decision before it.
        known_decisions: (n, n) the same as `decided`, by the last message.
        step: the present step, -1 before the first. sent: how many messages were sent.
    """

    def __init__(self, scenario: Scenario, method: Method, seed: int) -> None:
        robots, n = scenario.robots, len(scenario.robots)
        self.period = scenario.dt * scenario.steps_per_decision
        self.delay, self.loss = scenario.message_delay, scenario.message_loss
        self.random = np.random.default_rng([seed, n])
        speeds = [max(r.limits.max_speed, float(np.linalg.norm(r.state.velocity))) for r in robots]
        ends = [longest_manoeuvre(scenario, method, k) for k in range(n)]
        ranges = np.array([v * end + r.shape.bounding_radius for v, end, r in zip(speeds, ends, robots, strict=True)])
        self.max_speed = np.array(speeds)
        self.apart = ranges[:, None] + ranges[None, :] + scenario.margin
        # If i and j are within `apart` by a message no older than FRESH * delay, their distance has stayed below `far`
        # since: with v the maximum speed it was at most apart + 2 v * age. Condition 2 then holds with the right.
        self.far = self.apart + 3.0 * self.max_speed.max() * (FRESH * self.delay + self.period)
        self.first = np.arange(n)[:, None] < np.arange(n)[None, :]
        self.handovers = np.zeros((n, n), np.int64)
        self.received = np.full((n, n), -1)
        self.was_far = np.full((n, n), -1)
        self.decided, self.waits = np.full(n, -1), np.zeros(n, np.int64)
        self.known_decisions = np.full((n, n), -1)
        self.step, self.sent = -1, 0
        self._positions: dict[int, Array] = {}
        self._sent: dict[int, tuple[Array, Array]] = {}
        self._in_transit: dict[int, list[Message]] = {}

    def receive(self, table: RobotTable, now: float) -> None:
        if not self._sent:
            self._sent[-1] = table.committed.times.copy(), table.committed.points.copy()
        self.deliver(table.each["position"])

    def groups(
        self, table: RobotTable, d: int, policy: Policy, due: Indices, now: float
    ) -> Iterator[tuple[Indices, float]]:
        """Each robot that may decide, with the received manoeuvres in the table.

        It expects its next decision after the same time as since its last one.
        """
        rows = np.arange(len(table.each))
        for k in due.tolist():
            if not self.may_decide(k, table.each["present"]):
                continue
            for j in rows[rows != k]:
                times, points = self._sent[int(self.received[k, j])]
                table.observed.times[j], table.observed.points[j] = times[j], points[j]
            yield due[due == k], self.waited(k)
        self._sent[self.step] = table.committed.times.copy(), table.committed.points.copy()
        self.send()
        for step in [step for step in self._sent if step < self.oldest]:
            del self._sent[step]

    def holds(self) -> Flags:
        """Whether robot i, by its messages, holds the right of the pair (i, j); (n, n)."""
        return np.asarray((self.handovers % 2 == 0) == self.first)

    def deliver(self, positions: Array) -> None:
        """Begin a new step, with robots at `positions` (n, 3) [m], and deliver the messages that are due."""
        self.step += 1
        if self.step == 0:
            self._positions[-1] = positions.copy()
        for sent, sender, receiver, handovers, decided in self._in_transit.pop(self.step, []):
            for known, news in ((self.handovers, handovers), (self.known_decisions, decided), (self.received, sent)):
                known[receiver, sender] = np.maximum(known[receiver, sender], news)
        distance = np.linalg.norm(positions[:, None] - positions[None, :], axis=-1)
        self.was_far[distance > self.far] = self.step
        np.fill_diagonal(self.received, self.step)
        self._positions[self.step] = positions.copy()

    def may_decide(self, i: int, present: Flags) -> bool:
        """Whether robot i may change its manoeuvre now. If so, its decision is noted."""
        distance, holds = self._least_distance(i), self.holds()[i]
        known = holds & (self.was_far[i] <= self.received[i])
        free = (holds | (distance > self.far[i])) & (known | (distance > self.apart[i])) | ~present
        free[i] = True
        if not free.all():
            return False
        self.waits[i], self.decided[i] = self.step - self.decided[i], self.step
        return True

    def waited(self, i: int) -> float:
        """The time [s] that robot i waited for its last decision."""
        return float(self.period * self.waits[i])

    def hand_over(self) -> None:
        """Hand over the rights of pairs in which the other robot has waited longer, or as long and is the first.

        The robot that has waited longest receives all rights and hands none over, so always some robot may decide.
        """
        known, decided = self.known_decisions, self.decided[:, None]
        longer = (known < decided) | ((known == decided) & self.first.T)
        self.handovers += self.holds() & longer & ~np.eye(len(self.handovers), dtype=bool)

    def send(self) -> None:
        """Send a message from every robot to every other one, at the end of the step."""
        self.hand_over()
        n = len(self.handovers)
        chance, late = self.random.random((2, n, n))
        steps = np.maximum(np.ceil(self.delay * late / self.period - WHOLE_COUNT).astype(int), 1)
        sender, receiver = np.nonzero(~np.eye(n, dtype=bool) & (chance >= self.loss))
        self.sent += n * (n - 1)
        for wait in np.unique(steps[sender, receiver]):
            some = steps[sender, receiver] == wait
            i, j = sender[some], receiver[some]
            message = Message(np.full(len(i), self.step), i, j, self.handovers[i, j], self.decided[i])
            self._in_transit.setdefault(self.step + int(wait), []).append(message)
        for step in [step for step in self._positions if step < self.oldest]:
            del self._positions[step]

    @property
    def oldest(self) -> int:
        """The oldest step whose messages are still the last that some robot received."""
        return int(self.received[~np.eye(len(self.received), dtype=bool)].min())

    def _least_distance(self, i: int) -> Array:
        """Lower bounds (n,) [m] of the distances from robot i, by the last messages that it received."""
        last = np.array([self._positions[int(step)][j] for j, step in enumerate(self.received[i])])
        age = self.step - self.received[i]
        distance = np.linalg.norm(self._positions[self.step][i] - last, axis=-1)
        return np.asarray(distance - self.max_speed * self.period * age)


def longest_manoeuvre(scenario: Scenario, method: Method, robot: int) -> float:
    """The duration [s] of the longest manoeuvre of a robot, whose manoeuvres all end at rest."""
    navigator = scenario.navigator(method, robot)
    responses = method.responses(navigator.limits, navigator.period, navigator.holds)
    return max(float(response.knots(1e6, 1.0)[-2]) for response in responses)


def messages_of(scenario: Scenario, method: Method, seed: int) -> Messages | None:
    """The messages of a run with a shared method in which they arrive late or are lost; else None."""
    needed = method.shared and (scenario.message_delay > 0.0 or scenario.message_loss > 0.0)
    return Messages(scenario, method, seed) if needed else None
