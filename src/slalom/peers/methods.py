"""Methods of other authors: libraries (RVO2, navground) and planners (DWA, MPPI, barrier functions)."""

from collections.abc import Callable, Mapping
from functools import partial
from inspect import signature
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np

from slalom.base.checks import Array, known, not_negative, positive, whole
from slalom.base.errors import InvalidInput
from slalom.peers.crowd import (
    Discs,
    Surroundings,
    Team,
    edges_of,
    imported,
    interaction_distances,
    nearest_point,
    surroundings,
)


class Rvo2:
    """Team in one RVO2 simulator (single precision). Other discs are agents in it that do not react.

    Robots consider the `neighbours` nearest agents that they could meet within `horizon` [s]. ORCA shares the avoidance
    with every one of them: with an agent that does not react, half of it is missing. Walls are avoided in full, within
    `wall_horizon` [s].

    Raises:
        InvalidInput: a horizon that is not above 0, no neighbour.
    """

    def __init__(self, team: Team, *, neighbours: int, horizon: float, wall_horizon: float) -> None:
        self._library = imported("pyrvo")
        self._team, self._neighbours = team, whole(neighbours, "neighbours", 1)
        self._horizon, self._wall_horizon = positive(horizon, "horizon"), positive(wall_horizon, "wall_horizon")
        self._radii = np.empty(0)
        self._simulator: Any = None

    def choose(self, positions: Array, velocities: Array, preferred: Array, others: Discs) -> Array:
        if self._simulator is None or not np.array_equal(others.radii, self._radii):
            self._begin(others.radii)
        simulator, n = self._simulator, len(positions)
        for k, (position, velocity) in enumerate(
            zip([*positions, *others.positions], [*velocities, *others.velocities])
        ):
            simulator.set_agent_position(k, tuple(position))
            simulator.set_agent_velocity(k, tuple(velocity))
        for k, (preferred_velocity, speed, distance) in enumerate(
            zip(preferred, self._team.max_speeds, interaction_distances(self._horizon, self._team, others))
        ):
            simulator.set_agent_pref_velocity(k, tuple(preferred_velocity))
            simulator.set_agent_max_speed(k, float(speed))
            simulator.set_agent_neighbor_dist(k, float(distance))
        simulator.do_step()
        return np.array([simulator.get_agent_velocity(k).to_tuple() for k in range(n)])

    def _begin(self, radii: Array) -> None:
        """Build a new simulator, because agents cannot be removed from one."""
        team = self._team
        horizon = self._horizon
        walls = self._wall_horizon
        simulator = self._library.RVOSimulator(team.period, 0.0, 0, horizon, walls, 0.0, 0.0)
        for radius, speed in zip(team.radii, team.max_speeds):
            simulator.add_agent((0.0, 0.0), 0.0, self._neighbours, horizon, walls, float(radius), float(speed))
        for radius in radii:
            simulator.add_agent((0.0, 0.0), 0.0, 0, horizon, walls, float(radius), 0.0)
        for wall in team.walls:
            simulator.add_obstacle([tuple(point) for point in wall])
        simulator.process_obstacles()
        self._simulator, self._radii = simulator, radii


# Behaviours of navground: ORCA, HRVO, human-like, social force.


class Behaviours:
    """Team of robots with one navground behaviour each (single precision), of the registered `kind`.

    `time_horizon` [s] times max_speed is the horizon of navground, which is 5 m at any speed by default. `margin` [m]
    is the safety margin; `settings` are other properties of that kind. Other discs are neighbours like the rest of the
    team.

    A robot whose preferred velocity is 0 gets a stop target, because HRVO returns NaN for that velocity.

    Raises:
        InvalidInput: a setting that is not a property of the kind, because navground ignores unknown names; a time
            horizon that is not above 0.
    """

    def __init__(
        self,
        team: Team,
        kind: str,
        *,
        time_horizon: float,
        margin: float = 0.0,
        settings: Mapping[str, Any] = MappingProxyType({}),
    ) -> None:
        self._library = library = imported("navground", "navground.core")
        known = library.Behavior.type_properties[kind]
        unknown = [name for name in settings if name not in known]
        if unknown:
            raise InvalidInput(f"setting of {kind}: expected one of {', '.join(sorted(known))}; found {unknown[0]!r}")
        self._team = team
        self._time_horizon = positive(time_horizon, "time_horizon")
        self._behaviours = []
        self._speeds = team.max_speeds.copy()
        for radius, speed in zip(team.radii, team.max_speeds):
            behaviour = library.Behavior.make_type(kind)
            behaviour.kinematics = library.kinematics.OmnidirectionalKinematics(float(speed))
            behaviour.radius, behaviour.optimal_speed = float(radius), float(speed)
            behaviour.horizon, behaviour.safety_margin = time_horizon * float(speed), margin
            for name, value in settings.items():
                behaviour.set(name, value)
            # The human-like behaviour sets its horizon in its first call, which always returns a velocity along x.
            behaviour.target = library.Target.Velocity((1.0, 0.0))
            behaviour.compute_cmd(team.period)
            self._behaviours.append(behaviour)
        edges = [edge for wall in team.walls for edge in edges_of(wall)]
        self._walls = [library.LineSegment(start, end) for start, end in edges]

    def choose(self, positions: Array, velocities: Array, preferred: Array, others: Discs) -> Array:
        library, period = self._library, self._team.period
        all_positions = np.concatenate([positions, others.positions])
        all_velocities = np.concatenate([velocities, others.velocities])
        radii = np.concatenate([self._team.radii, others.radii])
        neighbours = [
            library.Neighbor(p, float(r), v, k) for k, (p, r, v) in enumerate(zip(all_positions, radii, all_velocities))
        ]
        chosen = []
        for k, (behaviour, distance) in enumerate(
            zip(self._behaviours, interaction_distances(self._time_horizon, self._team, others))
        ):
            indices = np.flatnonzero(np.linalg.norm(all_positions - all_positions[k], axis=1) <= distance)
            behaviour.position, behaviour.velocity = positions[k], velocities[k]
            if self._team.max_speeds[k] != self._speeds[k]:
                speed = self._speeds[k] = self._team.max_speeds[k]
                behaviour.kinematics.max_speed = behaviour.optimal_speed = float(speed)
            # The command is not the motion of the robot: set the latter, from which the behaviour continues.
            behaviour.actuated_twist = library.Twist2(velocities[k], 0.0, library.Frame.absolute)
            preferred_velocity = preferred[k]
            behaviour.target = (
                library.Target.Velocity(preferred_velocity) if np.any(preferred_velocity) else library.Target.Stop()
            )
            # The human-like behaviour considers all directions except the one straight behind its orientation.
            behaviour.orientation = float(np.arctan2(preferred_velocity[1], preferred_velocity[0]))
            behaviour.environment_state.neighbors = [neighbours[j] for j in indices if j != k]
            # Set again: the behaviour drops obstacles that were out of range at its last call.
            behaviour.environment_state.line_obstacles = self._walls
            # Social force may take the root of a rounding error below 0, if one robot is straight ahead of another.
            with np.errstate(invalid="ignore", divide="ignore"):
                chosen.append(behaviour.compute_cmd(period, library.Frame.absolute).velocity)
        return np.array(chosen, dtype=np.float64)


# The dynamic window approach for robots that accelerate in every direction.


STEP = 0.1
"""[s] Between tests of a predicted motion. Smaller: thin walls are not jumped over at higher speeds, more time."""


class DynamicWindow:
    """Team in which each robot takes the best velocity of its window (Fox, Burgard and Thrun, IEEE RAM 4(1), 1997).

    The window holds the velocities that one period of acceleration reaches, on a grid of `grid` x `grid`. Each is held
    while the discs keep theirs. It is admissible if the robot can brake before it comes nearer than `margin` [m] to a
    body. This is tested up to `horizon` [s] or the time of the braking. Among these the robot maximises

        heading (1 - angle to the preferred velocity / pi) + distance (free share of the longest way)
        + speed (1 - difference to the preferred speed / max_speed)

    with the weights `heading`, `distance` and `speed`. The authors had circular arcs of a synchro-drive and obstacles
    at rest; here motions are straight. Without an admissible velocity the robot brakes as hard as it can.

    Raises:
        InvalidInput: a weight or margin below 0, a horizon not above 0, a grid of fewer than 3.
    """

    def __init__(
        self,
        team: Team,
        *,
        heading: float = 2.0,
        distance: float = 0.2,
        speed: float = 0.2,
        margin: float = 0.0,
        horizon: float,
        grid: int = 15,
    ) -> None:
        self._team = team
        self._weights = tuple(
            not_negative(w, n) for w, n in ((heading, "heading"), (distance, "distance"), (speed, "speed"))
        )
        self._margin, self._horizon = not_negative(margin, "margin"), positive(horizon, "horizon")
        ticks = np.linspace(-1.0, 1.0, whole(grid, "grid", 3))
        square = np.stack(np.meshgrid(ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 2)
        self._window = square[np.hypot(*square.T) <= 1.0]

    def choose(self, positions: Array, velocities: Array, preferred: Array, others: Discs) -> Array:
        around = surroundings(self._team, positions, velocities, others, self._horizon)
        return np.array([self._best(k, *row) for k, row in enumerate(zip(positions, velocities, preferred, around))])

    def _best(self, k: int, position: Array, velocity: Array, preferred: Array, around: Surroundings) -> Array:
        max_speed, most = float(self._team.max_speeds[k]), float(self._team.max_accelerations[k])
        period = self._team.period
        candidates = velocity + period * most * self._window
        wanted = preferred - velocity
        within = wanted / max(float(np.hypot(*wanted)) / (period * most), 1.0)
        candidates = np.vstack([candidates, velocity + within])
        speeds = np.hypot(*candidates.T)
        candidates, speeds = candidates[speeds <= max_speed], speeds[speeds <= max_speed]
        if not len(candidates):  # faster than max_speed by more than a period can brake
            return np.asarray(velocity * max(0.0, 1.0 - period * most / float(np.hypot(*velocity))))
        horizon = max(self._horizon, period + 0.5 * max_speed / most)
        times: Array = STEP * np.arange(1.0, np.ceil(horizon / STEP) + 1.0)
        ramp = np.minimum(times, period)
        way = ramp[:, None] * velocity + (0.5 * ramp**2 / period)[:, None] * (candidates - velocity)[:, None]
        places = position + way + (times - ramp)[:, None] * candidates[:, None]
        hit = around.clearance(places, times) < self._margin
        first = np.where(hit.any(axis=1), hit.argmax(axis=1), hit.shape[1])
        distance = speeds * STEP * first
        admissible = (first == hit.shape[1]) | (distance >= speeds * period + 0.5 * speeds**2 / most)
        if not admissible.any():
            return np.asarray(candidates[np.argmin(speeds)])
        share = np.where(first == hit.shape[1], 1.0, distance / (max_speed * horizon))
        size = float(np.hypot(*preferred))
        cosine = candidates @ preferred / np.maximum(speeds * size, np.finfo(float).tiny)
        facing = 1.0 - np.arccos(np.clip(cosine, -1.0, 1.0)) / np.pi
        terms = (facing, share, 1.0 - np.abs(speeds - size) / max_speed)
        value = sum(weight * term for weight, term in zip(self._weights, terms))
        return np.asarray(candidates[np.argmax(np.where(admissible, value, -np.inf))])


# Model predictive path integral control (MPPI) of robots that accelerate in every direction.


class PathIntegral:
    """Team in which each robot averages random sequences of accelerations by their costs.

    Williams, Aldrich and Theodorou, Journal of Guidance, Control, and Dynamics 40(2), 2017, and Williams et al., ICRA
    2017: a sequence over the `horizon` [s] is kept and shifted by a period at each decision. `samples` sequences differ
    from it by normal noise, whose standard deviation is the share `deviation` of the maximum acceleration, constant
    over `hold` [s] each. The new sequence is their mean with the weights exp(-(cost - least cost) / `temperature`).
    Accelerations and speeds are cut to the limits in the prediction. The costs are, summed over the steps,

        |velocity - preferred|^2 / max_speed^2 + `collision` (if the clearance to discs at constant velocities, or to
        walls, is below `margin` [m])

    The cost of control is 0, a choice that Williams et al. leave open. The noise comes from `seed`: runs are the same
    every time.

    Raises:
        InvalidInput: a horizon, hold, deviation or temperature not above 0; a margin or a cost below 0; no sample.
    """

    def __init__(
        self,
        team: Team,
        *,
        margin: float = 0.0,
        horizon: float = 4.0,
        samples: int = 256,
        deviation: float = 0.7,
        hold: float = 0.5,
        temperature: float = 0.5,
        collision: float = 100.0,
        seed: int = 1,
    ) -> None:
        self._team, self._margin = team, not_negative(margin, "margin")
        self._horizon, self._temperature = positive(horizon, "horizon"), positive(temperature, "temperature")
        self._collision, self._samples = not_negative(collision, "collision"), whole(samples, "samples", 1)
        self._deviation = positive(deviation, "deviation")
        self._steps = max(1, round(self._horizon / team.period))
        self._repeats = max(1, round(positive(hold, "hold") / team.period))
        self._generator = np.random.default_rng(whole(seed, "seed"))
        self._sequences = np.zeros((len(team.radii), self._steps, 2))

    def choose(self, positions: Array, velocities: Array, preferred: Array, others: Discs) -> Array:
        around = surroundings(self._team, positions, velocities, others, self._horizon)
        blocks = -(-self._steps // self._repeats)
        shape = (len(positions), self._samples, blocks, 2)
        noise = np.repeat(self._generator.standard_normal(shape), self._repeats, axis=2)[:, :, : self._steps]
        noise[:, 0] = 0.0
        return np.array(
            [self._next(k, *row) for k, row in enumerate(zip(positions, velocities, preferred, around, noise))]
        )

    def _next(
        self, k: int, position: Array, velocity: Array, preferred: Array, around: Surroundings, noise: Array
    ) -> Array:
        max_speed, most = float(self._team.max_speeds[k]), float(self._team.max_accelerations[k])
        sampled = cut(self._sequences[k] + self._deviation * most * noise, most)
        places, speeds = self._predicted(position, velocity, sampled, max_speed)
        times: Array = self._team.period * np.arange(1.0, self._steps + 1.0)
        costs = np.square(speeds - preferred).sum(axis=-1) / max_speed**2
        costs += self._collision * (around.clearance(places, times) < self._margin)
        total = costs.sum(axis=1)
        weights = np.exp((total.min() - total) / self._temperature)
        sequence = np.tensordot(weights / weights.sum(), sampled, axes=1)
        self._sequences[k] = np.vstack([sequence[1:], np.zeros((1, 2))])
        return cut(velocity + self._team.period * sequence[0], max_speed)

    def _predicted(
        self, position: Array, velocity: Array, accelerations: Array, max_speed: float
    ) -> tuple[Array, Array]:
        """Positions [m] and velocities [m/s] (K, H, 2) at the ends of the steps."""
        period = self._team.period
        velocities = np.empty_like(accelerations)
        before = np.broadcast_to(velocity, accelerations[:, 0].shape)
        for step in range(accelerations.shape[1]):
            before = velocities[:, step] = cut(before + period * accelerations[:, step], max_speed)
        starts = np.concatenate([np.broadcast_to(velocity, (len(velocities), 1, 2)), velocities[:, :-1]], axis=1)
        return position + np.cumsum(0.5 * period * (starts + velocities), axis=1), velocities


def cut(vectors: Array, longest: float) -> Array:
    """Vectors (..., 2), shortened to the length `longest` where they are longer."""
    length = np.hypot(vectors[..., 0], vectors[..., 1])
    return np.asarray(vectors / np.maximum(length / longest, 1.0)[..., None])


SIDES = 32
"""[1] Sides of the polygons within the discs of accelerations and velocities. More: less is lost (0.5 %), more time."""
SLACK = 1e6
"""[1] Cost of the squared violation [m^2/s^4] of barriers that cannot all be kept, beside that of the difference to
the preferred acceleration. Larger: rounding decides; smaller: barriers are violated that could be kept."""
ROOT = 1e-9
"""[m, m/s] Least distance or speed that is divided by. Larger: barriers of robots in contact are less exact."""


class BarrierFilter:
    """Team in which each robot solves one quadratic program for its acceleration (Wang, Ames and Egerstedt, T-RO 2017).

    A pair at distance d [m] with the relative velocity s [m/s] along the line between the centres has the barrier

        h = sqrt(2 A (d - r)) + s >= 0,

    A: sum of both maximum accelerations, 0 for discs and walls, which do not brake for the robot; r: sum of the radii
    and `margin` [m]. It is kept by h' >= -min(`gain` h^3, h / period). Each robot of a team does the part a / A of it,
    with its own maximum acceleration a. The program is that of Ames, Xu, Grizzle and Tabuada, IEEE TAC 62(8), 2017. The
    second bound is for accelerations that are held over a period. Where not all barriers can be kept the largest
    violation is least. Others are expected to keep their velocity but for their share.

    Raises:
        InvalidInput: a gain not above 0, a margin below 0; daqp is not installed.
    """

    def __init__(self, team: Team, *, margin: float = 0.0, horizon: float, gain: float = 1.0) -> None:
        self._solver = imported("daqp")
        self._team, self._margin = team, not_negative(margin, "margin")
        self._horizon, self._gain = positive(horizon, "horizon"), positive(gain, "gain")
        angles = 2.0 * np.pi * np.arange(SIDES) / SIDES
        self._directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)

    def choose(self, positions: Array, velocities: Array, preferred: Array, others: Discs) -> Array:
        around = surroundings(self._team, positions, velocities, others, self._horizon)
        return np.array([self._next(k, *row) for k, row in enumerate(zip(positions, velocities, preferred, around))])

    def _next(self, k: int, position: Array, velocity: Array, preferred: Array, around: Surroundings) -> Array:
        period, max_speed = self._team.period, float(self._team.max_speeds[k])
        most, inside = float(self._team.max_accelerations[k]), np.cos(np.pi / SIDES)
        wanted = cut((preferred - velocity) / period, most)
        normals, least = self._barriers(k, position, velocity, around)
        # Variables: acceleration and violation. The last rows are soft by the violation alone.
        none, one = np.zeros((SIDES, 1)), np.ones((len(least), 1))
        rows = np.vstack(
            [
                np.hstack([self._directions, none]),
                np.hstack([self._directions, none]),
                np.hstack([-normals, -one]),
                [[0.0, 0.0, -1.0]],
            ]
        )
        speeds = np.maximum(max_speed * inside - self._directions @ velocity, -most * inside * period) / period
        upper = np.concatenate([np.full(SIDES, most * inside), speeds, -least, [0.0]])
        cost, linear = np.diag([1.0, 1.0, SLACK]), np.array([-wanted[0], -wanted[1], 0.0])
        acceleration, _, found, _ = self._solver.solve(cost, linear, rows, upper, np.full(len(upper), -1e30))
        if found <= 0:
            return np.full(2, np.nan)
        return np.asarray(velocity + period * np.asarray(acceleration)[:2])

    def _barriers(self, k: int, position: Array, velocity: Array, around: Surroundings) -> tuple[Array, Array]:
        """Unit vectors (m, 2), and least accelerations (m,) [m/s^2] along them."""
        own = float(self._team.max_accelerations[k])
        edges = list(zip(around.starts, around.ends))
        points = np.array([nearest_point(position, *edge) for edge in edges]).reshape(-1, 2)
        faces = [not any(np.array_equal(point, end) for end in edge) for point, edge in zip(points, edges)]
        still = np.zeros_like(points)
        offsets = position - np.concatenate([around.positions, points])
        relative = velocity - np.concatenate([around.velocities, still])
        radii = np.concatenate([around.radii, np.zeros(len(points))]) + around.radius + self._margin
        members = np.where(around.members >= 0, self._team.max_accelerations[around.members], 0.0)
        both = own + np.concatenate([members, np.zeros(len(points))])
        distances = np.hypot(*offsets.T)
        normals = offsets / np.maximum(distances, ROOT)[:, None]
        closing = np.einsum("ij,ij->i", normals, relative)
        root = np.sqrt(2.0 * both * np.maximum(distances - radii, 0.0))
        barrier = root + closing
        turning = (np.square(relative).sum(axis=1) - closing**2) / np.maximum(distances, ROOT)
        # The distance to a face does not change with the motion along it.
        turning[len(around.radii) :][np.array(faces, dtype=bool)] = 0.0
        decay = np.minimum(self._gain * barrier**3, barrier / self._team.period)
        # A robot that is too near and comes nearer brakes, and moves away at most twice as hard.
        braking = np.clip(-closing / np.maximum(root, ROOT), -1.0, 2.0) * both
        return normals, (own / both) * np.minimum(braking - turning - decay, 2.0 * both)


Made = TypeVar("Made")


def parameters_of(crowd: Callable[..., Any]) -> dict[str, float]:
    """The numbers that `crowd` takes besides a team, with their values: keywords, and entries of `settings`."""
    if not isinstance(crowd, partial):
        return {}
    given = {name: one.default for name, one in signature(crowd.func).parameters.items()} | crowd.keywords
    given |= given.pop("settings", {})
    return {name: value for name, value in given.items() if _is_number(value)}


def with_parameters(crowd: Callable[..., Made], values: Mapping[str, float], name: str) -> Callable[..., Made]:
    """The same crowd with other parameters; `name` is that of the method, for messages.

    Raises:
        InvalidInput: a parameter that the method does not have; a value below 0, or not whole where the present one is.
    """
    present = parameters_of(crowd)
    if values and not present:
        raise InvalidInput(f"method: expected {name} alone, which has no parameters; found {next(iter(values))!r}")
    if not isinstance(crowd, partial):
        return crowd
    keywords, settings = dict(crowd.keywords), dict(crowd.keywords.get("settings", {}))
    for key, value in values.items():
        number: float = not_negative(value, key)
        if isinstance(present[known(key, f"parameter of {name}", list(present))], int):
            number = whole(int(number) if number.is_integer() else number, key)
        if key in settings:
            settings[key] = number
        if key in keywords or key not in settings:
            keywords[key] = number
    return partial(crowd.func, **(keywords | ({"settings": settings} if settings else {})))


def parsed(text: str, name: str) -> dict[str, float]:
    """The parameters of PARAMETER=VALUE:PARAMETER=VALUE after the name of a method.

    Raises:
        InvalidInput: a text of another form.
    """
    found: dict[str, float] = {}
    for item in text.split(":"):
        key, equals, value = item.partition("=")
        try:
            found[key.strip()] = float(value)
        except ValueError:
            equals = ""
        if not equals:
            raise InvalidInput(f"method: expected {name}:PARAMETER=VALUE with a number, found {item!r}")
    return found


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
