"""Peers: other projects' methods in the same runs, and what becomes of what they cannot do."""

import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import shapely
from draws import draws

from slalom import (
    METHODS,
    BoundedError,
    Capsule,
    ConstantVelocity,
    Disc,
    Goal,
    InvalidInput,
    Limits,
    Obstacle,
    PathGoal,
    Polygon,
    Polyline,
    Rectangle,
    State,
    Stationary,
    Union,
)
from slalom.cli import BAD_INPUT, DONE, call
from slalom.peers import PEERS, Discs, Peer, Team, contender, discs, outlines
from slalom.peers.methods import Behaviours
from slalom.sim import Recording, Robot, Scenario, compare, metrics, simulate
from slalom.sim.gallery import build
from slalom.sim.measure.closest_approach import closest_approaches, single_robot_view
from slalom.sim.measure.metrics import COLLISION

NO_DISCS = Discs(np.empty((0, 2)), np.empty((0, 2)), np.empty(0))
AVOIDING = [name for name in PEERS if not name.startswith("social_force")]  # to that others are points
SEEING_WALLS = [name for name in AVOIDING if PEERS[name].walls]
PLANNERS = ["dwa", "mppi", "cbf"]
GOING_AROUND = [name for name in AVOIDING if name not in ("dwa", "cbf")]  # these stand before others


def peer(name: str) -> Peer:
    """A peer that is there: pyrvo has no wheel for every Python."""
    pytest.importorskip(PEERS[name].package)
    return PEERS[name]


def robot(x: float, y: float, goal: tuple[float, float], name: str = "robot", *, stop: bool = True, **limits) -> Robot:
    """A disc of half a metre at rest."""
    most = Limits(**{"max_speed": 1.5, "max_acceleration": 2.0, **limits})
    return Robot(Disc(0.5), most, State((x, y), (0.0, 0.0)), Goal(Stationary(goal), 0.3, stop=stop), name)


def crowd_of(count: int = 5, seed: int = 3, **settings) -> Scenario:
    """Some robots at random places for some seconds."""
    return build("random_goals", {"robots": count, "duration": 8.0, **settings}, seed=seed)


def least_clearance(run: Recording) -> float:
    """Between all robots, and to all obstacles, in continuous time."""
    each = [closest_approaches(single_robot_view(run, k)) for k in range(len(run.shapes))]
    return min(closest.clearance for row in each for closest in row)


class Answering:
    """A crowd that always says the same, and what it was told."""

    def __init__(self, team: Team, answer=None) -> None:
        self.team, self.answer = team, answer

    def choose(self, positions, velocities, preferred, others):
        self.told = positions, velocities, preferred, others
        return preferred if self.answer is None else np.broadcast_to(self.answer, preferred.shape).copy()


def fake(answer=None, **fields) -> tuple[Peer, list[Answering]]:
    """A peer of which nothing is installed, and the crowds that it began."""
    begun: list[Answering] = []

    def begin(team: Team) -> Answering:
        begun.append(Answering(team, answer))
        return begun[-1]

    return Peer("fake", begin, "Fake.", "Nobody 2000", "nothing", **fields), begun


# The table and the extra.


@pytest.mark.parametrize("name", PEERS)
def test_rows(name):
    row = PEERS[name]
    assert row.name == name
    assert name not in METHODS
    assert row.sentence.endswith(".")
    assert re.search(r"\b(19|20)\d\d$", row.source)
    assert row.limited == (name.endswith(("_limited", "_inflated")) or name in PLANNERS)
    assert (row.inflation > 0.0) == name.endswith("_inflated")
    assert peer(name) is contender(name)


def test_contenders_are_methods_and_peers():
    assert all(contender(name) is METHODS[name] for name in METHODS)
    with pytest.raises(InvalidInput) as caught:
        contender("best")
    assert str(caught.value) == f"method: expected one of {', '.join([*METHODS, *PEERS])}; found 'best'"


@pytest.mark.parametrize("name", ["orca", "hl"])
def test_a_package_that_is_not_there_is_named(name, monkeypatch, capsys):
    """A use of the peer names the package to install; everything else works."""
    for module in ("pyrvo", "navground", "navground.core"):
        monkeypatch.setitem(sys.modules, module, None)
    message = rf"^method: expected the packages of `pip install 'slalom\[peers\]'`, found no {PEERS[name].package}"
    for ask in (
        lambda: contender(name),
        lambda: simulate(crowd_of(), PEERS[name]),
        lambda: compare("empty", ["nao", name], 1),
    ):
        with pytest.raises(InvalidInput, match=message):
            ask()
    assert call(["run", "circle", "--method", name]) == BAD_INPUT
    assert "pip install 'slalom[peers]'" in capsys.readouterr().err
    assert call(["list", "methods"]) == DONE
    assert PEERS[name].sentence in capsys.readouterr().out
    assert simulate(build("empty", {"duration": 0.2}), contender("nao")).method == "nao"


def test_nothing_is_imported_before_it_is_asked_for():
    code = (
        "import sys, slalom.cli, slalom.peers, slalom.sim, slalom.view\n"
        "slalom.cli.call(['list', 'methods'])\n"
        "print({'pyrvo', 'navground', 'irsim'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "set()"


@pytest.mark.parametrize("name", draws(PEERS, len(PEERS) // 2))
def test_runs_are_the_same_every_time(name):
    one, two = (simulate(crowd_of(), peer(name), seed=3) for _ in range(2))
    assert one.digest() == two.digest()
    assert one.method == name
    assert {text for row in one.responses.texts for text in row} == {name}


@pytest.mark.parametrize("name", PEERS)
@pytest.mark.parametrize("replan", draws([0.3, 0.0]))
def test_limits_are_obeyed(name, replan):
    """By all the speed, by limited peers the acceleration; by the others the velocity is there after a step."""
    run = simulate(crowd_of(replan=replan), peer(name))
    for k, limits in enumerate(run.limits):
        assert np.linalg.norm(run.velocities[:, k], axis=1).max() <= limits.max_speed * (1 + 1e-12)
        size = np.linalg.norm(run.accelerations[:, k], axis=1)
        assert (size.max() <= limits.max_acceleration * (1 + 1e-12)) == PEERS[name].limited
    if not PEERS[name].limited:
        np.testing.assert_allclose(run.velocities[1:], run.controls, atol=1e-12)
    # Between decisions nothing new is chosen.
    every = max(1, round(replan / run.dt))
    for k, row in enumerate(run.outcomes):
        assert set(row) == ({"CHOSEN"} if k % every == 0 else {""})
        assert np.all((run.decision_times[k] > 0.0) == (k % every == 0))
        assert k % every == 0 or np.array_equal(run.controls[k], run.controls[k - 1])


@pytest.mark.parametrize("name", draws(PEERS, len(PEERS) // 2))
def test_order_of_robots_does_not_matter(name):
    """To the bit, but for social force: it adds forces up in the order in which it is told of them.

    The noise of mppi belongs to places in the team.
    """
    if name == "mppi":
        pytest.skip("each robot has the noise of its place in the team")
    scenario, order = crowd_of(), [3, 0, 4, 2, 1]
    run = simulate(scenario, peer(name))
    mixed = simulate(replace(scenario, robots=tuple(scenario.robots[k] for k in order)), peer(name))
    least = 1e-5 if name.startswith("social_force") else 0.0
    np.testing.assert_allclose(mixed.positions, run.positions[:, order], rtol=0.0, atol=least)


@pytest.mark.parametrize("name", PEERS)
def test_a_robot_alone_goes_straight_to_its_goal(name):
    """3 m at up to 1.5 m/s; at the goal it stays, as the goal says."""
    run = simulate(Scenario("alone", (robot(0.0, 0.0, (3.0, 0.0)),), duration=8.0), peer(name))
    assert np.isfinite(run.arrived[0])
    assert 2.0 <= run.arrived[0] < 5.0
    assert np.abs(run.positions[:, 0, 1]).max() < (0.1 if name == "mppi" else 1e-3)
    # mppi is told the preferred velocity of now, not the goal, and averages noise: it passes the goal and comes back.
    assert run.positions[:, 0, 0].max() < (3.8 if name == "mppi" else 3.3)


@pytest.mark.parametrize("name", AVOIDING)
@pytest.mark.parametrize("noise", draws([0.0, 1e-3]))
def test_two_robots_head_on_do_not_collide(name, noise):
    run = simulate(build("circle", {"robots": 2, "radius": 6, "robot_radius": 0.5, "noise": noise}), peer(name))
    assert least_clearance(run) >= -COLLISION
    assert np.all(np.isfinite(run.arrived)) or name not in GOING_AROUND
    assert metrics.summary(run)["statuses"] == {"CHOSEN": 2 * len(run.outcomes)}


@pytest.mark.parametrize("name", [name for name in AVOIDING if name != "dwa"])
def test_an_obstacle_that_comes_is_avoided(name):
    """They think that it does its half: a disc that is slow and far away leaves time to see that it does not."""
    rock = Obstacle(Disc(0.5), ConstantVelocity((8.0, 0.1), (-0.3, 0.0)), "rock")
    run = simulate(Scenario("rock", (robot(0.0, 0.0, (10.0, 0.0)),), (rock,), duration=30.0), peer(name))
    assert np.isfinite(run.arrived[0])
    assert metrics.min_clearance(run) >= -1e-4


WALLS = {
    "a line": Obstacle(Polyline([(5, -1), (5, 4)]), Stationary((0, 0)), "line"),
    "a thick line": Obstacle(Polyline([(0, -1), (0, 4), (3, 4)], 0.2), Stationary((5, 0)), "thick line"),
    "a turned box": Obstacle(Rectangle(1.0, 5.0), Stationary((5, 1.5)), "box", heading=0.3),
    "a union": Obstacle(Union((Capsule((0, 0), (0, 3), 0.3), Disc(0.5))), Stationary((5.2, -0.4)), "union"),
    "a polygon": Obstacle(Polygon([(4, -1), (6, -1), (6, 4), (5, 1), (4, 4)], 0.1), Stationary((0, 0)), "polygon"),
}


@pytest.mark.parametrize("name", SEEING_WALLS)
@pytest.mark.parametrize("wall", draws(WALLS))
def test_walls_are_not_run_into(name, wall):
    """On the way to a goal behind them; a robot without a way round stops before them."""
    run = simulate(Scenario("wall", (robot(0.0, 0.0, (10.0, 0.0)),), (WALLS[wall],), duration=15.0), peer(name))
    assert run.positions[-1, 0, 0] > 2.0
    assert metrics.min_clearance(run) >= -2e-3


CHANGED = {
    "orca_limited": {"horizon": 2.0, "neighbours": 3},
    "hrvo": {"time_horizon": 2.0, "max_neighbors": 2},
    "hl_limited": {"time_horizon": 2.0, "tau": 0.5},
    "social_force": {"v_a": 4.0},
    "navground_orca": {"time_horizon": 1.5},
    "dwa": {"horizon": 2.0, "heading": 1.0},
    "mppi": {"samples": 32, "temperature": 0.1},
    "cbf": {"gain": 0.2},
}


@pytest.mark.parametrize("name", draws(CHANGED, len(CHANGED) - 2))
def test_parameters_belong_to_the_name(name):
    """They change the run; with the values of the table nothing changes but the name."""
    plain, given = peer(name), ":".join(f"{key}={value:g}" for key, value in CHANGED[name].items())
    other = contender(f"{name}:{given}")
    assert contender(f"{name}:{given}") is other
    assert other.name == f"{name}:{given}"
    assert other.parameters == plain.parameters | CHANGED[name]
    same = contender(":".join([name, *(f"{key}={plain.parameters[key]:.12g}" for key in CHANGED[name])]))
    runs = [simulate(crowd_of(), one) for one in (plain, same, other)]
    assert np.array_equal(runs[0].positions, runs[1].positions)
    assert not np.array_equal(runs[0].positions, runs[2].positions)
    assert runs[2].method == other.name


def test_a_time_horizon_of_navground_is_that_of_its_orca_too():
    """It is both that of the neighbours that count and a property of the behaviour."""
    crowd = peer("navground_orca").with_parameters({"time_horizon": 3.0}).crowd
    assert (crowd.keywords["time_horizon"], crowd.keywords["settings"]["time_horizon"]) == (3.0, 3.0)


# Paths.

AROUND = PathGoal([(0, 0), (0, 4), (8, 4), (8, 0)], [1.5, 1.5, 0.8, 0.8], 0.3)


def on_path(goal: PathGoal = AROUND, *obstacles: Obstacle) -> Scenario:
    """A robot with a path, at its start."""
    start = replace(robot(*goal.points[0], (0.0, 0.0)), goal=goal)
    return Scenario("path", (start,), obstacles, duration=40.0)


@pytest.mark.parametrize("name", PEERS)
def test_a_path_is_followed_at_its_speeds(name):
    """Three sides of a rectangle, whose end lies 8 m beside the start; corners are cut by less than 1 m."""
    run = simulate(on_path(), peer(name))
    assert np.isfinite(run.arrived[0])
    off = [np.linalg.norm(AROUND.point(AROUND.nearest(p, 0.0, AROUND.length)) - p) for p in run.positions[:, 0]]
    assert max(off) < 1.0
    assert run.positions[:, 0, 1].max() > 3.0
    # The last side permits 0.8 m/s, and half of the braking suffices to slow down before it.
    speeds, (x, y) = np.linalg.norm(run.velocities[:, 0], axis=1), run.positions[:, 0].T
    assert speeds[(x > 7.0) & (y < 3.5)].max() <= 0.81
    assert speeds.max() > 1.2


def test_the_target_on_a_path_is_that_of_its_step():
    """At the start 1 s ahead, beside a disc at rest that covers the path there; then as the robot moves on."""
    willing, begun = fake()
    parked = Obstacle(Disc(0.4), Stationary((0.0, 1.5)), "parked")
    for obstacles in ((), (parked,)):
        simulate(replace(on_path(AROUND, *obstacles), duration=0.1), willing)
    free, beside = (crowd.told[2][0] for crowd in begun)
    # To pass the target 1.5 m ahead from rest: sqrt(2 m/s^2 1.5 m / 2).
    assert free == pytest.approx([0.0, 1.5**0.5])
    assert np.linalg.norm(beside) <= 1.5 + 1e-12
    assert beside[0] > 0.3


def test_what_a_peer_is_told():
    """Inflated radii, present obstacles as they are now, preferred velocities of goals; the margin is 0."""
    larger, begun = fake(inflation=0.3)
    passing = Obstacle(Disc(1.0), ConstantVelocity((4.0, 9.0), (0.0, -1.0)), "car", uncertainty=BoundedError(0.2, 1.0))
    scenario = Scenario("told", (robot(0.0, 0.0, (10.0, 0.0)),), (passing, WALLS["a line"]), duration=0.2, replan=0.2)
    simulate(replace(scenario, margin=0.0), larger)
    ((crowd),) = begun
    assert crowd.team.radii == pytest.approx([0.65])
    assert crowd.team.max_speeds == pytest.approx([1.5])
    assert crowd.team.period == pytest.approx(0.2)
    assert [wall.tolist() for wall in crowd.team.walls] == [[[5, -1], [5, 4]]]
    positions, velocities, preferred, others = crowd.told
    assert positions.tolist() == velocities.tolist() == [[0.0, 0.0]]
    assert preferred.tolist() == [[1.5, 0.0]]
    assert [x.tolist() for x in others] == [[[4.0, 9.0]], [[0.0, -1.0]], [1.2]]


def test_half_of_a_margin_is_that_of_each_robot_and_obstacle():
    """Besides the inflation; obstacles have half of the largest margin, so that no robot comes nearer than its own."""
    larger, begun = fake(inflation=0.3)
    rock = Obstacle(Disc(1.0), Stationary((4.0, 9.0)), "rock")
    robots = robot(0.0, 0.0, (10.0, 0.0), "one"), replace(robot(0.0, 5.0, (10.0, 5.0), "two"), margin=0.4)
    simulate(Scenario("told", robots, (rock, WALLS["a line"]), duration=0.1, margin=0.2), larger)
    ((crowd),) = begun
    assert crowd.team.radii == pytest.approx([0.65 + 0.1, 0.65 + 0.2])
    assert crowd.told[3].radii == pytest.approx([1.0 + 0.2])
    (wall,) = crowd.team.walls
    assert shapely.Polygon(wall).equals(shapely.box(4.8, -1.2, 5.2, 4.2))


@pytest.mark.parametrize("margin", draws([0.3, 0.0, 0.05]))
@pytest.mark.parametrize("name", AVOIDING)
def test_the_margin_is_kept_between_two_robots(name, margin):
    """By every method that considers radii, as by slalom's; the collisions are those of the true radii."""
    settings = {"robots": 2, "radius": 6, "robot_radius": 0.5, "margin": margin}
    clearance = least_clearance(simulate(build("circle", settings), peer(name)))
    # The dynamic window is tested at samples.
    assert clearance >= margin - (0.02 if name == "dwa" else 5e-3)
    # Half of the inflation, or what samples of the prediction and the part of the other robot add.
    assert clearance <= margin + (0.35 if name in (*PLANNERS, "orca_inflated") else 0.1)


@pytest.mark.parametrize("name", [name for name in SEEING_WALLS if name != "dwa"])
def test_the_margin_is_kept_from_walls(name):
    scenario = Scenario("wall", (robot(0.0, 0.0, (10.0, 0.0)),), (WALLS["a line"],), duration=15.0, margin=0.3)
    # The human-like behaviour considers 101 headings.
    least = 0.25 if name.startswith("hl") else 0.3 - 5e-3
    assert metrics.min_clearance(simulate(scenario, peer(name))) >= least


@pytest.mark.parametrize("limited", [False, True])
def test_no_answer_keeps_the_velocity_and_is_recorded(limited):
    silent, _ = fake((np.nan, 1.0), limited=limited)
    start = robot(0.0, 0.0, (10.0, 0.0))
    run = simulate(Scenario("silent", (replace(start, state=State((0, 0), (1, 0))),), duration=1.0), silent)
    assert {name for row in run.outcomes for name in row} == {"UNANSWERED"}
    np.testing.assert_allclose(run.velocities[:, 0], np.broadcast_to([1.0, 0.0], (11, 2)))
    assert metrics.without_safe_choice(run) == 0.0


def test_an_answer_beyond_the_largest_speed_is_cut():
    fast, _ = fake((0.0, 30.0))
    run = simulate(Scenario("fast", (robot(0.0, 0.0, (10.0, 0.0)),), duration=0.3), fast)
    assert run.velocities[1:, 0].tolist() == [[0.0, 1.5]] * 3


def test_robots_that_pass_their_goals_leave_the_scene():
    """The first passes its goal in the way of the second, which then has no neighbour."""
    willing, begun = fake()
    scenario = Scenario(
        "passing",
        (robot(0.0, 0.0, (2.0, 0.0), "first", stop=False), robot(-4.0, 0.0, (6.0, 0.0), "second", stop=False)),
        duration=15.0,
    )
    run = simulate(scenario, willing)
    assert [len(crowd.team.radii) for crowd in begun] == [2, 1]
    assert np.all(np.isfinite(run.arrived))
    gone = run.times[:-1] >= run.arrived[0]
    assert not np.any(run.velocities[1:, 0][gone])
    assert {row[0] for row, there in zip(run.outcomes, gone) if there} == {""}
    orca = simulate(scenario, peer("orca"))
    assert np.abs(orca.positions[:, 1, 1]).max() < 1e-6
    assert orca.arrived[1] == pytest.approx(run.arrived[1], abs=0.5)


# Obstacles as they are seen.


def rows(array: np.ndarray) -> list[list[float]]:
    """Sorted, for comparison as a set."""
    return sorted(np.round(array, 9).tolist())


@pytest.mark.parametrize("wall", WALLS)
def test_outlines_hold_what_they_stand_for(wall):
    """Every part lies in its outline, which goes around it counter-clockwise and is not much larger."""
    obstacle = WALLS[wall]
    found = outlines([obstacle], walls=True)
    x, y = obstacle.direction(0.0)
    turn = np.array([[x, y], [-y, x]])
    parts = [part for part in obstacle.shape.parts if len(part.corners) > 1]
    for part, outline in zip(parts, found, strict=True):
        position = part.corners @ turn + obstacle.trajectory.position(0.0)
        hull = shapely.convex_hull(shapely.multipoints(position)).buffer(part.radius)
        if len(outline) == 2:
            assert rows(outline) == rows(position)
            continue
        ring = shapely.LinearRing(outline)
        assert shapely.is_ccw(ring)
        assert shapely.Polygon(ring).buffer(1e-9).contains(hull)


def test_discs_are_where_they_are_now():
    """Parts of standing unions too; what is not there yet or has a corner is none."""
    pair = Obstacle(Union((Capsule((5, 0), (5, 3), 0.3), Disc(0.5))), Stationary((1, 2)), "pair", heading=np.pi / 2)
    bar = Obstacle(Union((Disc(0.5), Capsule((1, 0), (1, 0), 0.25))), ConstantVelocity((3, 0), (1, 0), 0), "bar")
    found = discs([pair, bar], 2.0)
    np.testing.assert_allclose(found.positions, [[1, 2], [5, 0], [6, 0]], atol=1e-12)
    np.testing.assert_allclose(found.velocities, [[0, 0], [1, 0], [1, 0]])
    np.testing.assert_allclose(found.radii, [0.5, 0.5, 0.25])
    assert outlines([bar], walls=False) == ()
    assert all(len(each) == 0 for each in discs([WALLS["a line"]], 0.0))


# What is known of navground.


@pytest.mark.parametrize("kind", ["ORCA", "HRVO", "HL", "SocialForce"])
def test_a_wish_to_stand_is_answered(kind):
    """Told a velocity of 0, HRVO says NaN."""
    pytest.importorskip("navground.core")
    crowd = Behaviours(Team(np.array([0.5]), np.array([1.5]), np.array([2.0]), 0.1), kind, time_horizon=10.0)
    chosen = crowd.choose(np.zeros((1, 2)), np.zeros((1, 2)), np.zeros((1, 2)), NO_DISCS)
    np.testing.assert_allclose(chosen, 0.0, atol=1e-6)


def test_social_force_has_no_answer_on_the_way_of_another():
    """Rounding makes it take the root of a negative number; that is no answer, and no warning."""
    pytest.importorskip("navground.core")
    crowd = Behaviours(Team(np.array([0.5]), np.array([2.0]), np.array([2.0]), 0.1), "SocialForce", time_horizon=10.0)
    comes = Discs(np.array([[0.59, 0.0]]), np.array([[-1.64, 0.0]]), np.array([0.5]))
    chosen = crowd.choose(np.zeros((1, 2)), np.zeros((1, 2)), np.array([[1.0, 0.0]]), comes)
    assert np.isnan(chosen).any()


@pytest.mark.parametrize("kind", ["ORCA", "HRVO", "HL", "SocialForce"])
@pytest.mark.parametrize("angle", [0.0, 0.5, 2.0, np.pi, -np.pi, -1.0])
def test_a_robot_alone_gets_its_wish_from_the_first_step_on(kind, angle):
    """The human-like behaviour looks along x at first, and never straight behind."""
    pytest.importorskip("navground.core")
    crowd = Behaviours(Team(np.array([0.5]), np.array([1.5]), np.array([2.0]), 0.1), kind, time_horizon=10.0)
    preferred = 1.5 * np.array([[np.cos(angle), np.sin(angle)]])
    chosen = crowd.choose(np.zeros((1, 2)), np.zeros((1, 2)), preferred, NO_DISCS)[0]
    assert chosen @ preferred[0] > 0.0
    assert chosen[0] * preferred[0, 1] - chosen[1] * preferred[0, 0] == pytest.approx(0.0, abs=1e-5)
