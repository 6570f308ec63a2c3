"""Messages between robots that share their manoeuvres, when they come late or not at all."""

from typing import NamedTuple

import numpy as np

from slalom.checks import Array
from slalom.kernels.arrays import Flags, Indices
from slalom.methods import Method
from slalom.sim.periodic import to_nearest
from slalom.sim.scenario import Scenario


class Message(NamedTuple):
    """Messages that arrive at the same step, and what they say beside what their senders are committed to."""

    step: Indices  # at which they were sent
    sender: Indices
    receiver: Indices
    passed: Indices  # how often the right of the pair has changed hands
    decided: Indices  # the step of the sender's last decision


FRESH = 3.0
"""[1] News of up to so many times the largest delay never make a robot wait for newer ones."""


class Messages:
    """Who has heard what of whom, and who may change its manoeuvre (docs/theory.md, 17).

    Of each pair of robots one holds the right to change. With every message a robot says what it is committed to and
    how often the right of that pair has changed hands as far as it knows: even, and the first of the two holds it.
    A robot changes its manoeuvre only while it holds the rights of all pairs, and passes each on to the other once
    that one has waited longer, as far as it knows. A pair needs none while the two are `far` from each other, wherever
    the other has gone since it was last heard. What was heard of the other counts while it cannot have been so since;
    it need not count where the two are so far `apart` that no manoeuvre of one meets any of the other. A message that
    is lost is made good by the next one, which says as much and more.

    Steps are those at which robots decide; what is sent in one is heard in the next at the earliest.
    """

    def __init__(self, scenario: Scenario, method: Method, seed: int) -> None:
        robots, n = scenario.robots, len(scenario.robots)
        self.period = scenario.dt * scenario.steps_per_decision
        self.delay, self.loss = scenario.message_delay, scenario.message_loss
        self.random = np.random.default_rng([seed, n])
        fast = [max(r.limits.max_speed, float(np.linalg.norm(r.state.velocity))) for r in robots]
        ends = [longest(scenario, method, k) for k in range(n)]
        ranges = np.array([v * end + r.shape.bounding_radius for v, end, r in zip(fast, ends, robots, strict=True)])
        self.top, self.world = np.array(fast), scenario.period
        self.apart = ranges[:, None] + ranges[None, :] + scenario.margin
        # Who is not apart by news of at most this age has not been far since.
        self.far = self.apart + 3.0 * self.top.max() * (FRESH * self.delay + self.period)
        self.first = np.arange(n)[:, None] < np.arange(n)[None, :]
        self.passed = np.zeros((n, n), np.int64)
        self.heard = np.full((n, n), -1)
        self.was_far = np.full((n, n), -1)
        self.decided, self.waits = np.full(n, -1), np.zeros(n, np.int64)
        self.news = np.full((n, n), -1)
        self.step, self.sent = -1, 0
        self._places: dict[int, Array] = {}
        self._on_the_way: dict[int, list[Message]] = {}

    def holds(self) -> Flags:
        """Whether robot i, as far as it knows, holds the right of the pair (i, j); (n, n)."""
        return np.asarray((self.passed % 2 == 0) == self.first)

    def deliver(self, places: Array) -> None:
        """A new step, in which robots are at `places` (n, 3): what is due arrives."""
        self.step += 1
        if self.step == 0:
            self._places[-1] = places.copy()
        for step, sender, receiver, passed, decided in self._on_the_way.pop(self.step, []):
            for known, told in ((self.passed, passed), (self.news, decided), (self.heard, step)):
                known[receiver, sender] = np.maximum(known[receiver, sender], told)
        away = self._away(places[:, None] - places[None, :])
        self.was_far[away > self.far] = self.step
        np.fill_diagonal(self.heard, self.step)
        self._places[self.step] = places.copy()

    def may_decide(self, i: int, present: Flags) -> bool:
        """Whether robot i may change its manoeuvre now; it is taken to do so then."""
        away, mine = self._least(i), self.holds()[i]
        known = mine & (self.was_far[i] <= self.heard[i])
        free = (mine | (away > self.far[i])) & (known | (away > self.apart[i])) | ~present
        free[i] = True
        if not free.all():
            return False
        self.waits[i], self.decided[i] = self.step - self.decided[i], self.step
        return True

    def waited(self, i: int) -> float:
        """How long [s] robot i waited for its last decision."""
        return float(self.period * self.waits[i])

    def pass_on(self) -> None:
        """All give up the rights of pairs in which the other has waited longer, or as long and is the first of the two.

        Whoever has waited longest of all is given all rights and gives up none, so somebody always may decide.
        """
        longer = (self.news < self.decided[:, None]) | ((self.news == self.decided[:, None]) & self.first.T)
        self.passed += self.holds() & longer & ~np.eye(len(self.passed), dtype=bool)

    def send(self) -> None:
        """Every robot tells every other one, at the end of the step."""
        self.pass_on()
        n = len(self.passed)
        lost, late = self.random.random((2, n, n))
        steps = np.maximum(np.ceil(self.delay * late / self.period - 1e-9).astype(int), 1)
        sender, receiver = np.nonzero(~np.eye(n, dtype=bool) & (lost >= self.loss))
        self.sent += n * (n - 1)
        for wait in np.unique(steps[sender, receiver]):
            some = steps[sender, receiver] == wait
            i, j = sender[some], receiver[some]
            letters = Message(np.full(len(i), self.step), i, j, self.passed[i, j], self.decided[i])
            self._on_the_way.setdefault(self.step + int(wait), []).append(letters)
        for step in [step for step in self._places if step < self.oldest]:
            del self._places[step]

    @property
    def oldest(self) -> int:
        """The oldest step of which somebody still has what was sent."""
        return int(self.heard[~np.eye(len(self.heard), dtype=bool)].min())

    def _away(self, apart: Array) -> Array:
        """How far [m] places are that are so far `apart` (..., 3), or their nearest images."""
        nearest = apart if self.world is None else apart + to_nearest(apart, self.world)
        return np.asarray(np.linalg.norm(nearest, axis=-1))

    def _least(self, i: int) -> Array:
        """How far [m] the others are from robot i at least, by what it has heard of them; (n,)."""
        last = np.array([self._places[int(step)][j] for j, step in enumerate(self.heard[i])])
        since = self.step - self.heard[i]
        away = self._away(self._places[self.step][i] - last)
        return np.asarray(away - self.top * self.period * since)


def longest(scenario: Scenario, method: Method, robot: int) -> float:
    """How long [s] the longest manoeuvre of a robot takes that ends at rest."""
    navigator = scenario.navigator(method, robot)
    responses = method.responses(navigator.limits, navigator.period, navigator.holds)
    return max(float(response.knots(1e6, 1.0)[-2]) for response in responses)


def messages_of(scenario: Scenario, method: Method, seed: int) -> Messages | None:
    """The post of a run, if there is one: of a method that shares manoeuvres, where messages are late or lost."""
    needed = method.shared and (scenario.message_delay > 0.0 or scenario.message_loss > 0.0)
    return Messages(scenario, method, seed) if needed else None
