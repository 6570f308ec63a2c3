"""The figures: that they are built, saved and labelled, and that what they show is so."""

import itertools
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
import shapely
from draws import draws
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.path import Path as Ring

import slalom
from slalom import view
from slalom.io.table import sample_data
from slalom.sim import Row, compare_all, decision_at, gallery, load, simulate
from slalom.sim.explanation import beginning_of, drawn_controls, kind, known_at
from slalom.sim.scenario import Robot, Scenario
from slalom.view.control_space import admissible_region
from slalom.view.film import Film
from slalom.view.fleet import Picture
from slalom.view.style import NEUTRAL, time_levels, time_scale


def scene_in_plane() -> tuple[slalom.State, list[slalom.Obstacle], slalom.Goal]:
    obstacles = [
        slalom.Obstacle(slalom.Disc(1.0), slalom.ConstantVelocity((16.0, 0.4), (-4.0, 0.0)), "oncoming"),
        slalom.Obstacle(slalom.Disc(1.5), slalom.Circular((0.0, -8.0), 8.0, 4.0, 2.6), "circling"),
        slalom.Obstacle(slalom.Disc(0.7), slalom.Stationary((3.0, 12.0)), "aside"),
    ]
    return slalom.State((-8.0, 0.0), (4.0, 0.0)), obstacles, slalom.Goal(slalom.Stationary((20.0, 0.0)), 1.0)


def scene_in_space() -> tuple[slalom.State, list[slalom.Obstacle], slalom.Goal]:
    obstacles = [
        slalom.Obstacle(slalom.Ball(1.0), slalom.ConstantVelocity((12.0, 0.3, 0.2), (-3.0, 0.0, 0.0))),
        slalom.Obstacle(slalom.Ball(1.5), slalom.Circular((2.0, 1.0, 0.0), 7.0, 3.0, 0.5, (0.0, 0.3, 1.0))),
        slalom.Obstacle(slalom.Ball(1.2), slalom.Stationary((4.0, 1.0, -1.0))),
    ]
    goal = slalom.Goal(slalom.Stationary((14.0, 2.0, 2.0)), 1.0)
    return slalom.State((-8.0, 0.0, 0.0), (3.0, 0.0, 0.0)), obstacles, goal


SCENES = {2: scene_in_plane, 3: scene_in_space}


def navigator(name: str, dimension: int) -> slalom.Navigator:
    robot = slalom.Disc(0.8) if dimension == 2 else slalom.Ball(0.8)
    return slalom.Navigator(slalom.method(name), robot, slalom.Limits(6.0, 3.0))


def decide(name: str, dimension: int) -> tuple[slalom.Decision, slalom.Navigator, slalom.Goal]:
    state, obstacles, goal = SCENES[dimension]()
    robot = navigator(name, dimension)
    return robot.decide(state, obstacles, goal), robot, goal


def by_gid(axes: Axes | Figure, gid: str) -> list:
    return axes.findobj(lambda artist: artist.get_gid() == gid)


def one(axes: Axes | Figure, gid: str):
    (found,) = by_gid(axes, gid)
    return found


def inside(patch, points: np.ndarray) -> np.ndarray:
    """Whether points lie in the filled part of a patch: in an odd number of rings (`contains_points` fills holes)."""
    count = sum(Ring(ring).contains_points(points).astype(int) for ring in patch.get_path().to_polygons())
    return count % 2 == 1


def colour_of(ax: Axes, point: tuple[float, float]) -> tuple[int, ...]:
    """The colour (red, green, blue) of the pixel at a place in data units."""
    canvas = FigureCanvasAgg(ax.figure)
    canvas.draw()
    pixels = np.asarray(canvas.buffer_rgba())
    column, row = ax.transData.transform(point).astype(int)
    return tuple(int(c) for c in pixels[len(pixels) - 1 - row, column, :3])


def legend_texts(ax: Axes) -> list[str]:
    return [text.get_text() for text in ax.get_legend().get_texts()]


def acceleration_obstacle(dimension: int) -> slalom.ControlObstacle:
    state, obstacles, _ = SCENES[dimension]()
    shape = slalom.Disc(0.8) if dimension == 2 else slalom.Ball(0.8)
    return slalom.control_obstacle(slalom.Acceleration(), state, obstacles, shape, horizon=5.0)


@pytest.mark.parametrize("dimension", draws([2, 3]))
@pytest.mark.parametrize("name", ["vo", "nlvo", "avo", "ao", "nao"])
def test_a_decision_of_every_method_is_drawn_in_two_labelled_panels(name: str, dimension: int) -> None:
    decision, robot, goal = decide(name, dimension)
    figure = view.decision(decision, robot, goal, resolution=41)
    left, right = figure.axes[:2]
    letter, unit = ("v", "m/s") if name in ("vo", "nlvo", "avo") else ("a", "m/s²")
    assert left.get_xlabel().startswith("x [m]")
    assert left.get_ylabel() == "y [m]"
    assert right.get_xlabel().startswith(f"${letter}_x$ [{unit}]")
    assert right.get_ylabel() == f"${letter}_y$ [{unit}]"
    assert ("section at" in right.get_xlabel()) == (dimension == 3)
    assert ("seen along z" in left.get_xlabel()) == (dimension == 3)
    assert left.get_aspect() == right.get_aspect() == 1.0
    assert "time to collision [s]" in [ax.get_ylabel() for ax in figure.findobj(Axes)]
    assert name.upper() in figure.get_suptitle()
    figure.draw_without_rendering()


@pytest.mark.parametrize("name", ["vo", "nao"])
def test_legends_lie_inside_the_figure_and_outside_the_panels(name: str) -> None:
    decision, robot, goal = decide(name, 2)
    figure = view.decision(decision, robot, goal, track=np.array([[-12.0, 0.0], [-8.0, 0.0]]), resolution=41)
    figure.draw_without_rendering()
    for ax in figure.axes[:2]:
        box = ax.get_legend().get_window_extent()
        assert figure.bbox.x0 <= box.x0
        assert box.x1 <= figure.bbox.x1
        assert figure.bbox.y0 <= box.y0
        assert box.y1 <= ax.get_window_extent().y0
    first, second = (ax.get_legend().get_window_extent() for ax in figure.axes[:2])
    assert first.x1 <= second.x0


def test_the_robot_the_goal_and_the_obstacles_are_where_and_as_large_as_they_are() -> None:
    state, obstacles, goal = scene_in_plane()
    decision, robot, goal = decide("nao", 2)
    figure = view.decision(decision, robot, goal, resolution=41)
    left = figure.axes[0]
    drawn = one(left, "robot")
    assert drawn.get_radius() == robot.robot.radius
    assert drawn.center == tuple(state.position)
    assert one(left, "goal").get_radius() == goal.tolerance
    for index, obstacle in enumerate(obstacles):
        patch = one(left, f"obstacle-{index}")
        assert patch.get_radius() == obstacle.shape.radius
        np.testing.assert_allclose(patch.center, obstacle.trajectory.position(0.0))
    path = np.column_stack(one(left, "manoeuvre-path").get_data())
    times = np.linspace(0.0, robot.horizon, len(path))
    np.testing.assert_allclose(path, decision.manoeuvre.position(times))
    left_most, right_most = left.get_xlim()
    assert left_most < -8.8
    assert right_most > 21.0


def test_obstacles_have_the_colour_of_their_time_to_collision_or_none() -> None:
    state, obstacles, _ = scene_in_plane()
    traffic = slalom.ObstacleWindow(obstacles, 0.0, 6.0)
    ax = Figure().add_subplot()
    times = [1.3, np.inf, 4.2]
    assert view.workspace(ax, traffic=traffic, state=state, robot=slalom.Disc(0.8), contact_times=times) is ax
    scale = time_scale(6.0)
    assert one(ax, "obstacle-0").get_facecolor() == pytest.approx(tuple(scale.to_rgba(1.3)))
    assert one(ax, "obstacle-1").get_facecolor() == pytest.approx(to_rgba(NEUTRAL))
    assert one(ax, "obstacle-2").get_facecolor() == pytest.approx(tuple(scale.to_rgba(4.2)))


def test_the_first_contact_of_the_preferred_control_is_a_contact() -> None:
    decision, robot, goal = decide("nao", 2)
    left = view.decision(decision, robot, goal, resolution=41).axes[0]
    own, other = one(left, "contact-robot"), one(left, "contact-obstacle")
    apart = np.hypot(*np.subtract(own.center, other.center))
    assert apart == pytest.approx(own.get_radius() + other.get_radius() + robot.margin, abs=1e-5)


def test_an_obstacle_that_is_not_there_yet_has_a_path_but_no_disc() -> None:
    late = slalom.Sampled([2.0, 3.0, 4.0], [[5.0, 0.0], [6.0, 0.0], [7.0, 1.0]])
    traffic = slalom.ObstacleWindow([slalom.Obstacle(slalom.Disc(1.0), late)], 0.0, 6.0)
    ax = Figure().add_subplot()
    view.workspace(ax, traffic=traffic, state=slalom.State((0, 0), (1, 0)), robot=slalom.Disc(0.5))
    assert not by_gid(ax, "obstacle-0")
    assert len(ax.collections) == 1


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_filled_region_is_the_control_obstacle(dimension: int) -> None:
    blocked = acceleration_obstacle(dimension)
    chosen = np.array([0.3, -0.2, 0.4])[:dimension]
    ax = Figure().add_subplot()
    admissible = slalom.admissible_ball(np.zeros(dimension), 3.0)
    assert view.control_space(ax, blocked=blocked, admissible=admissible, chosen=chosen, extent=(-4, 4, -4, 4)) is ax
    rng = np.random.default_rng(1)
    points = rng.uniform(-4.0, 4.0, (3000, 2))
    controls = points if dimension == 2 else np.column_stack([points, np.full(len(points), 0.4)])
    times = blocked.time_to_collision(controls)
    collides = np.isfinite(times)
    drawn = inside(one(ax, "blocked"), points)
    assert 0.05 < collides.mean() < 0.95
    # Only points as near to the border as the contour is inexact may differ.
    certain = np.abs(blocked.clearance(controls)) > 0.01
    assert np.mean(certain) > 0.95
    assert np.array_equal(drawn[certain], collides[certain])
    compared = 0
    for level in time_levels(5.0)[1:-1]:
        for patch in by_gid(ax, f"blocked-{level:g}"):
            assert np.mean(inside(patch, points) != (times < level)) < 0.003
            compared += 1
    assert compared > 2


def test_the_outline_of_an_obstacle_has_no_clearance_to_it() -> None:
    blocked = acceleration_obstacle(2)
    ax = Figure().add_subplot()
    view.control_space(ax, blocked=blocked, admissible=slalom.admissible_ball((0, 0), 3.0), extent=(-4, 4, -4, 4))
    seen = 0
    for index in range(len(blocked.obstacles.obstacles)):
        for lines in by_gid(ax, f"outline-{index}"):
            points = np.concatenate([path.vertices for path in lines.get_paths()])
            # Beyond the panel the lines go on along the rim of the window that the boundary was asked for.
            points = points[np.abs(points).max(axis=1) < 4.0]
            assert np.abs(blocked.clearances(points)[:, index]).max() < 1e-3
            seen += len(points)
    assert seen > 200


def test_holes_stay_open() -> None:
    """Obstacles all around leave a free island in the middle."""
    ring = [
        slalom.Obstacle(slalom.Disc(1.2), slalom.Stationary((4 * np.cos(a), 4 * np.sin(a))))
        for a in np.linspace(0, 2 * np.pi, 16, endpoint=False)
    ]
    state = slalom.State((0.0, 0.0), (0.0, 0.0))
    blocked = slalom.control_obstacle(slalom.Velocity(), state, ring, slalom.Disc(0.3), horizon=2.0)
    ax = Figure().add_subplot()
    view.control_space(ax, blocked=blocked, admissible=slalom.admissible_ball((0, 0), 3.0), resolution=61)
    assert list(inside(one(ax, "blocked"), np.array([(0.3, 0.2), (2.2, 0.0)]))) == [False, True]
    assert colour_of(ax, (0.3, 0.2)) == (255, 255, 255)
    assert colour_of(ax, (2.2, 0.0)) != (255, 255, 255)


@pytest.mark.parametrize("height", [None, 0.5])
def test_the_admissible_region_is_bounded_where_the_excess_vanishes(height: float | None) -> None:
    d = 2 if height is None else 3
    centres = np.array([[0.0, 0.0, 0.0], [1.0, 0.5, -0.3]])[:, :d]
    normals = np.array([[0.6, 0.8, 0.0], [0.0, -0.6, 0.8], [1.0, 0.0, 0.0]])[:, :d]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    admissible = slalom.Admissible(centres, np.array([2.0, 1.8]), normals, np.array([1.1, 1.2, 1e6]))
    region = admissible_region(admissible, height)
    points = np.array(region.exterior.coords)
    lifted = points if height is None else np.column_stack([points, np.full(len(points), height)])
    assert len(points) > 100
    assert np.abs(admissible.excess(lifted)).max() < 1e-4


def test_an_empty_section_of_the_admissible_set_is_empty() -> None:
    ball = slalom.admissible_ball((0, 0, 0), 1.0)
    assert admissible_region(ball, 1.5).is_empty
    with pytest.raises(slalom.InvalidInput, match="bounded by a ball"):
        admissible_region(slalom.Admissible(np.empty((0, 2)), np.empty(0), np.array([[1.0, 0.0]]), np.array([1.0])))


def test_markers_are_at_the_controls_and_a_control_beyond_the_panel_is_named() -> None:
    blocked = acceleration_obstacle(2)
    ax = Figure().add_subplot()
    admissible = slalom.admissible_ball((0, 0), 3.0)
    view.control_space(
        ax, blocked=blocked, admissible=admissible, preferred=(40.0, -1.0), chosen=(1.0, 2.0), resolution=21
    )
    assert np.ravel(one(ax, "chosen").get_data()) == pytest.approx([1.0, 2.0])
    x, y = np.ravel(one(ax, "preferred").get_data())
    assert x < ax.get_xlim()[1] < 10.0
    assert y == pytest.approx(-1.0)
    contact = float(blocked.time_to_collision((40.0, -1.0)))
    assert "preferred (at 40, −1), hit" in legend_texts(ax)
    own = to_rgba(time_scale(blocked.horizon).to_rgba(contact))
    assert to_rgba(one(ax, "preferred").get_markerfacecolor()) == pytest.approx(own)


def test_a_free_control_beyond_the_panel_is_white() -> None:
    blocked = acceleration_obstacle(2)
    ax = Figure().add_subplot()
    free = (-40.0, 0.0)
    assert np.isinf(blocked.time_to_collision(free))
    view.control_space(ax, blocked=blocked, admissible=slalom.admissible_ball((0, 0), 3.0), preferred=free)
    assert "preferred (at −40, 0)" in legend_texts(ax)
    assert to_rgba(one(ax, "preferred").get_markerfacecolor()) == to_rgba("white")


def test_temporal_elements_are_drawn_where_they_are() -> None:
    for dimension in (2, 3):
        blocked = acceleration_obstacle(dimension)
        ax = Figure().add_subplot()
        admissible = slalom.admissible_ball(np.zeros(dimension), 3.0)
        view.control_space(ax, blocked=blocked, admissible=admissible, elements=(2.5,), resolution=21)
        expected = blocked.element(2.5)
        squares = expected.radii**2 - (0.0 if dimension == 2 else expected.centers[:, 2] ** 2)
        drawn = sorted(patch.get_radius() for patch in by_gid(ax, "element-2.5"))
        assert drawn == pytest.approx(sorted(np.sqrt(squares[squares > 0.0])))
        assert "temporal elements" in legend_texts(ax)


def test_a_kept_manoeuvre_is_drawn_in_the_control_space_from_which_it_was_chosen() -> None:
    state, obstacles, goal = scene_in_plane()
    robot = slalom.Navigator(slalom.method("nao"), slalom.Disc(0.8), slalom.Limits(6.0, 3.0), patience=100.0)
    first = robot.decide(state, obstacles, goal)
    acceleration = first.manoeuvre.mean_acceleration(0.0, robot.period)
    later = slalom.advance(slalom.Acceleration(), state, acceleration, robot.period)
    kept = robot.decide(later, obstacles, goal, now=robot.period, previous=first)
    assert kept.outcome is slalom.Outcome.KEPT
    figure = view.decision(kept, robot, goal, track=[state.position, later.position], resolution=41)
    right = figure.axes[1]
    assert right.get_title().endswith(f", {robot.period:.1f} s ago")
    assert kind(first.manoeuvre.response).description in right.get_title()
    assert np.ravel(one(right, "chosen").get_data()) == pytest.approx(first.manoeuvre.control)
    assert np.ravel(one(right, "preferred").get_data()) == pytest.approx(first.preferred)
    # Of a file the beginning is not known: nothing is drawn as chosen.
    unknown = replace(kept, begun=None)
    assert not by_gid(view.decision(unknown, robot, goal, resolution=41).axes[1], "chosen")
    assert np.column_stack(one(figure.axes[0], "track").get_data())[-1] == pytest.approx(later.position)


@pytest.mark.parametrize(("name", "by"), [("roundabout_crossing", "nao"), ("roundabout_crossing", "nao_ahead")])
def test_the_chosen_control_of_a_safe_decision_is_drawn_outside_of_the_colour(name: str, by: str) -> None:
    """Read back from the drawn figure, of new and kept manoeuvres."""
    scenario, chosen_by = gallery.build(name), slalom.method(by)
    run = simulate(scenario, chosen_by)
    told = [k for k, outcomes in enumerate(run.outcomes) if outcomes[0] and slalom.Outcome[outcomes[0]].safe]
    kept = 0
    for k in told[:: max(1, len(told) // 12)]:
        decision = decision_at(run, scenario, chosen_by, k)
        figure = view.decision(decision, scenario.navigator(chosen_by), scenario.robot.goal, resolution=21)
        left, right = figure.axes[:2]
        assert one(left, "robot").center == pytest.approx(run.positions[k, 0])
        mark = shapely.Point(np.ravel(one(right, "chosen").get_data()))
        coloured = shapely.Polygon()
        for patch in by_gid(right, "blocked"):
            for ring in patch.get_path().to_polygons():
                coloured = coloured.symmetric_difference(shapely.make_valid(shapely.Polygon(ring)))
        assert not coloured.contains(mark) or coloured.boundary.distance(mark) < 1e-3
        kept += decision.begun is not None
    assert kept > 2


def test_a_path_is_drawn_and_the_preferred_control_leads_to_a_point_on_it() -> None:
    """The point is 1 s ahead; a decision that keeps its manoeuvre prefers what one without any would prefer."""
    state, obstacles, _ = scene_in_plane()
    goal = slalom.PathGoal([(-12, 0), (8, 4), (12, 9), (20, 9)], tolerance=1.0)
    robot = slalom.Navigator(slalom.method("nao"), slalom.Disc(0.8), slalom.Limits(6.0, 3.0), patience=100.0)
    first = robot.decide(state, obstacles, goal)
    acceleration = first.manoeuvre.mean_acceleration(0.0, robot.period)
    later = slalom.advance(slalom.Acceleration(), state, acceleration, robot.period)
    kept = robot.decide(later, obstacles, goal, now=robot.period, previous=first)
    assert kept.outcome is slalom.Outcome.KEPT
    figure = view.decision(kept, robot, goal, resolution=41)
    left = figure.axes[0]
    np.testing.assert_array_equal(np.transpose(one(left, "goal-path").get_data()), goal.points)
    assert np.ravel(one(left, "target").get_data()) == pytest.approx(goal.point(kept.progress + 6.0))
    assert {"goal and path", "point ahead on the path"} <= set(legend_texts(left))
    anew = robot.decide(later, obstacles, goal, now=robot.period)
    assert anew.blocked.response == kept.blocked.response
    assert drawn_controls(known_at(kept)).preferred == pytest.approx(anew.preferred)
    assert drawn_controls(beginning_of(kept)).preferred == pytest.approx(first.preferred)
    assert np.linalg.norm(robot.decide(later, obstacles, slalom.Goal(goal.trajectory)).preferred - anew.preferred) > 1.0
    for x, y in goal.points:
        assert left.viewLim.contains(x, y)
    run = simulate(path_scenario(goal), slalom.method("nao"))
    picture = Picture(path_scenario(goal))
    picture.draw(run.positions[0], run.velocities[0], np.array([True]), 0.0)
    for ax in (
        view.paths(run.times, run.positions[:, 0], (), robot=run.shapes[0], goal=goal),
        view.fleet(run).axes[0],
        picture.figure.axes[0],
    ):
        np.testing.assert_array_equal(np.transpose(one(ax, "goal-path").get_data()), goal.points)
        assert all(ax.viewLim.contains(x, y) for x, y in goal.points)


def path_scenario(goal: slalom.PathGoal) -> Scenario:
    """A robot alone that follows a path for some steps."""
    start = slalom.State((-8.0, 0.0), (4.0, 0.0))
    return Scenario("path", (Robot(slalom.Disc(0.8), slalom.Limits(6.0, 3.0), start, goal),), (), duration=0.5)


def test_a_kept_velocity_with_a_lag_still_is_a_control_of_the_panel() -> None:
    state, obstacles, goal = scene_in_plane()
    robot = slalom.Navigator(slalom.method("avo"), slalom.Disc(0.8), slalom.Limits(6.0, 3.0), patience=100.0)
    first = robot.decide(state, obstacles, goal)
    later = first.manoeuvre.advance(robot.period)
    kept = robot.decide(later, obstacles, goal, now=robot.period, previous=first)
    assert kept.outcome is slalom.Outcome.KEPT
    right = view.decision(kept, robot, goal, resolution=41).axes[1]
    assert np.ravel(one(right, "chosen").get_data()) == pytest.approx(first.manoeuvre.control)


def test_an_overlap_and_an_empty_world_are_drawn_too() -> None:
    state, _, goal = scene_in_plane()
    robot = navigator("nao", 2)
    on_top = [slalom.Obstacle(slalom.Disc(1.0), slalom.Stationary(state.position + 0.1))]
    for seen in (on_top, []):
        decision = robot.decide(state, seen, goal)
        assert (decision.outcome is slalom.Outcome.ESCAPING) == bool(seen)
        figure = view.decision(decision, robot, goal, resolution=31)
        assert len(by_gid(figure.axes[1], "blocked")) == len(seen)


@pytest.mark.parametrize(
    ("away", "label"), [(0.0, "blocked by an obstacle"), (36.0, "no control blocked"), (1e3, "no control blocked")]
)
def test_the_legend_names_blocked_controls_where_there_are_some(away: float, label: str) -> None:
    """Its colour without a region of that colour in the panel would be looked for in vain."""
    post = slalom.Obstacle(slalom.Disc(1.0), slalom.Stationary((6.0 + away, 0.0)))
    state = slalom.State((0.0, 0.0), (1.0, 0.0))
    blocked = slalom.control_obstacle(slalom.Acceleration(), state, [post], slalom.Disc(0.5), horizon=5.0)
    ax = Figure().add_subplot()
    view.control_space(ax, blocked=blocked, admissible=slalom.admissible_ball((0, 0), 2.0))
    controls = np.stack(np.meshgrid(*(np.linspace(*limits, 99) for limits in (ax.get_xlim(), ax.get_ylim()))), -1)
    assert np.isfinite(blocked.time_to_collision(controls.reshape(-1, 2))).any() == (not away)
    assert [text for text in legend_texts(ax) if "blocked" in text] == [label]


def test_a_small_admissible_set_is_enlarged() -> None:
    decision, robot, goal = decide("vo", 2)
    right = view.decision(decision, robot, goal, resolution=41).axes[1]
    enlarged = next(ax for ax in right.child_axes if by_gid(ax, "admissible"))
    chosen = one(enlarged, "chosen")
    assert np.ravel(chosen.get_data()) == pytest.approx(decision.manoeuvre.control)
    width = np.ptp(one(enlarged, "admissible").get_path().vertices[:, 0])
    assert width > 0.4 * np.diff(enlarged.get_xlim())[0]


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_run_is_drawn_with_the_robot_at_equally_spaced_times(dimension: int) -> None:
    state, obstacles, goal = SCENES[dimension]()
    times = np.linspace(0.0, 4.0, 41)
    positions = state.position + times[:, None] * state.velocity
    shape = slalom.Disc(0.8) if dimension == 2 else slalom.Ball(0.8)
    ax = view.paths(times, positions, obstacles, robot=shape, goal=goal, snapshots=3)
    for k, t in enumerate((0.0, 2.0, 4.0)):
        disc = one(ax, f"robot-{k}")
        assert disc.get_radius() == shape.radius
        assert disc.center == pytest.approx((state.position + t * state.velocity)[:2])
        assert one(ax, f"time-{k}").get_text().startswith(f"{t:.1f} s")
        other = one(ax, f"obstacle-1-{k}")
        assert other.center == pytest.approx(obstacles[1].trajectory.position(t)[:2])
    assert ax.get_xlabel().startswith("x [m]")
    assert "time [s]" in [a.get_ylabel() for a in ax.figure.findobj(Axes)]
    mine = Figure().add_subplot()
    assert view.paths(times, positions, obstacles, robot=shape, goal=goal, ax=mine) is mine


MAGIC = [(".svg", b"<?xml"), (".pdf", b"%PDF"), (".png", b"\x89PNG")]
"""How files of each format begin."""


@pytest.mark.parametrize(("suffix", "magic"), draws(pytest.param(*one) for one in MAGIC))
def test_equal_figures_are_equal_files(tmp_path: Path, suffix: str, magic: bytes) -> None:
    found = []
    for name in ("first", "second"):
        decision, robot, goal = decide("nao", 2)
        figure = view.decision(decision, robot, goal, resolution=31)
        path = view.save(figure, tmp_path / f"{name}{suffix}")
        found.append(path.read_bytes())
    assert found[0].startswith(magic)
    assert found[0] == found[1]
    assert view.save(figure, tmp_path / f"third{suffix.upper()}").read_bytes() == found[0]


def test_the_users_settings_neither_change_nor_matter(tmp_path: Path) -> None:
    decision, robot, goal = decide("nao", 2)
    plain = view.save(view.decision(decision, robot, goal, resolution=31), tmp_path / "plain.svg").read_bytes()
    with mpl.rc_context({"font.size": 20.0, "axes.facecolor": "black", "svg.fonttype": "none"}):
        before = dict(mpl.rcParams)
        figure = view.decision(decision, robot, goal, resolution=31)
        assert view.save(figure, tmp_path / "set.svg").read_bytes() == plain
        assert dict(mpl.rcParams) == before


def test_no_window_system_is_touched() -> None:
    code = "import sys, slalom.view; sys.exit('matplotlib.pyplot' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_fleet_is_drawn_alike(tmp_path: Path) -> None:
    """A track, both ends and a goal for each robot; a legend and a title inside the figure; names on wish, no times."""
    run = simulate(gallery.build("circle", {"robots": 6}), slalom.method("nao_shared"))
    figure = view.fleet(run, names=True)
    (ax,) = figure.axes
    gids = [artist.get_gid() for artist in (*ax.patches, *ax.lines, *ax.collections, *ax.texts)]
    for part in ("track", "start", "end", "goal", "name"):
        assert sorted(gid for gid in gids if gid and gid.startswith(part)) == [f"{part}-{k}" for k in range(6)]
    assert [text.get_text() for text in ax.texts] == list(run.names)
    assert len({(track.get_linewidth()[0], track.cmap.name) for track in ax.collections if track.get_gid()}) == 1
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["track", "start", "end", "goal"]
    (heading,) = figure.texts
    assert heading.get_text() == "circle, nao_shared"
    view.save(figure, tmp_path / "fleet.svg")
    boxes = [heading.get_window_extent(), ax.get_legend().get_window_extent(), ax.get_window_extent()]
    assert all(above.y0 >= below.y1 for above, below in itertools.pairwise(boxes))
    assert boxes[0].y1 <= figure.bbox.y1
    assert not view.fleet(run, title="").axes[0].texts
    assert view.fleet(run, title="").texts[0].get_text() == ""


def test_names_of_robots_side_by_side_cover_no_other_name() -> None:
    """Four robots 2 m apart with names of more than 2 m; a robot without neighbours has its name above it."""
    run = simulate(load(str(sample_data("fleet.yaml")), {"duration": 0.1}), slalom.method("nao_shared"))
    (ax,) = view.fleet(run, names=True).axes
    boxes = {text.get_text(): text.get_window_extent() for text in ax.texts}
    assert len(boxes) == len(run.names)
    for one, other in itertools.combinations(boxes.values(), 2):
        assert not one.overlaps(other)
    alone = run.names.index("courier 2")
    assert boxes["courier 2"].y0 > ax.transData.transform(run.positions[0, alone])[1]


def wide(figure: Figure) -> np.ndarray:
    """Width and height [inch] of the panels of a figure."""
    return np.array([ax.get_position().size * figure.get_size_inches() for ax in figure.axes])


@pytest.mark.parametrize(("width", "scale"), [(9.0, 1.0), (None, 0.8), (11.0, 1.5)])
def test_a_resized_figure_has_that_width_text_and_panels_of_the_same_shape(width: float | None, scale: float) -> None:
    """Margins hold the text, so that they grow with it, and legends keep their distance below."""
    figure = view.decision(*decide("nao", 2))
    before, panels, size = wide(figure), figure.axes[0].get_position().extents, figure.get_size_inches().copy()
    label = figure.axes[0].xaxis.label.get_fontsize()
    tick = figure.axes[0].xaxis.get_ticklabels()[0].get_fontsize()
    assert view.resized(figure, width=width, font_scale=scale) is figure
    after = wide(figure)
    assert figure.get_size_inches()[0] == pytest.approx(width or size[0])
    assert np.allclose(after / before, (after / before)[0, 0])
    assert figure.axes[0].xaxis.label.get_fontsize() == pytest.approx(scale * label)
    assert figure.axes[0].xaxis.get_ticklabels()[0].get_fontsize() == pytest.approx(scale * tick)
    left = figure.axes[0].get_position().extents[0] * figure.get_size_inches()[0]
    assert left == pytest.approx(max(1.0, scale) * panels[0] * size[0])
    renderer = FigureCanvasAgg(figure).get_renderer()
    for ax in figure.axes:
        box = ax.get_legend().get_window_extent(renderer)
        assert figure.bbox.y0 <= box.y0
        assert box.y1 < ax.xaxis.get_tightbbox(renderer).y0


def test_every_kind_of_figure_can_be_resized() -> None:
    recording = simulate(gallery.build("circle", {"duration": 1.0}), slalom.method("nao"))
    for figure in (view.fleet(recording), rows_of_panels()):
        panels = wide(figure)
        view.resized(figure, width=8.0, font_scale=1.2)
        assert np.allclose(wide(figure) / panels, (wide(figure) / panels)[0, 0])
    whole = Figure(figsize=(7.0, 3.0), layout="constrained")
    whole.add_subplot()
    assert view.resized(whole, width=3.5).get_size_inches() == pytest.approx((3.5, 1.5))


def rows_of_panels() -> Figure:
    """Two rows of three panels."""
    figure = Figure(figsize=(7.0, 5.0))
    for x, y in itertools.product((0.1, 0.4, 0.7), (0.1, 0.55)):
        figure.add_axes((x, y, 0.2, 0.3))
    return figure


def test_uncertainty_is_drawn_on_wish() -> None:
    """The body grown by the radius, now and later; the legend says the times."""
    state, (first, *others), goal = scene_in_plane()
    bound = slalom.BoundedError(0.2, 0.5)
    uncertain = replace(first, uncertainty=bound)
    robot = navigator("nao", 2)
    decision = robot.decide(state, [uncertain, *others], goal, now=0.0)
    assert not [patch for patch in view.decision(decision, robot, goal).axes[0].patches if is_uncertain(patch)]
    left = view.decision(decision, robot, goal, uncertainty=True).axes[0]
    drawn = {patch.get_gid(): patch for patch in left.patches if is_uncertain(patch)}
    times = np.linspace(0.0, robot.horizon, 4)
    assert set(drawn) == {f"uncertainty-0-{t:g}" for t in times}
    for t in times:
        radius = drawn[f"uncertainty-0-{t:g}"].get_radius()
        assert radius == pytest.approx(first.shape.bounding_radius + float(bound.radius(t, 2)))
    assert any(text.startswith("uncertainty, 0, ") for text in legend_texts(left))
    plain = robot.decide(state, [first, *others], goal, now=0.0)
    left = view.decision(plain, robot, goal, uncertainty=True).axes[0]
    assert "no obstacle has an uncertainty" in legend_texts(left)


def is_uncertain(patch: Patch) -> bool:
    """Whether a patch is the region of an uncertain obstacle."""
    return str(patch.get_gid()).startswith("uncertainty")


def test_heights_do_not_hide_each_other() -> None:
    """Of drones close to each other one height is written, and always that of the robot."""
    figure, ax = Figure(), None
    ax = figure.add_subplot()
    robot = slalom.State((0, 0, 5), (1, 0, 0))
    swarm = [slalom.Obstacle(slalom.Ball(0.2), slalom.Stationary((3 + 0.01 * k, 0, 5 + 0.1 * k))) for k in range(5)]
    view.workspace(ax, traffic=slalom.ObstacleWindow(swarm, 0.0, 2.0), state=robot, robot=slalom.Ball(0.3))
    heights = [text.get_text() for text in ax.texts if text.get_gid() == "height"]
    assert len(heights) == 2
    assert heights[0] == "5.0"


def test_control_spaces_in_a_grid_do_not_overlap() -> None:
    """With their labels, legends and colour bars, on a page and in a square."""
    robot = slalom.State((0.0, 0.0), (1.0, 0.0))
    car = slalom.Obstacle(slalom.Disc(1.0), slalom.ConstantVelocity((6.0, 1.0), (-1.0, 0.0)), "car")
    blocked = slalom.control_obstacle(slalom.Acceleration(), robot, [car], slalom.Disc(0.5), horizon=5.0)
    for size in ((7.16, 6.5), (7.0, 7.0), (3.5, 7.0)):
        figure = Figure(figsize=size)
        panels = figure.subplots(2, 2) if size[0] > 4.0 else figure.subplots(3, 1)
        for ax in panels.flat:
            view.control_space(ax, blocked=blocked, admissible=slalom.admissible_ball((0, 0), 2.0), resolution=21)
        FigureCanvasAgg(figure).draw()
        boxes = [ax.get_tightbbox() for ax in panels.flat]
        for one, other in itertools.combinations(boxes, 2):
            assert not one.overlaps(other)
        assert all(box.x0 >= 0.0 and box.y0 >= 0.0 for box in boxes)
        assert all(ax.get_legend().get_window_extent().y1 < ax.xaxis.get_tightbbox().y0 + 1.0 for ax in panels.flat)


@pytest.mark.parametrize("columns", [1, 2])
def test_the_sets_of_methods_are_those_of_their_definitions_and_nothing_overlaps(columns: int) -> None:
    state, obstacles, goal = scene_in_plane()
    robot = Robot(slalom.Disc(0.8), slalom.Limits(6.0, 3.0), state, goal)
    names = ("vo", "nlvo", "avo", "ao", "nao")
    figure = view.sets(Scenario("scene", (robot,), obstacles, margin=0.0), methods=names, columns=columns)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    drawn = [ax.get_tightbbox() for ax in figure.axes] + [figure.legends[0].get_window_extent()]
    assert all(not one.overlaps(other) for one, other in itertools.combinations(drawn, 2))
    assert all(one.x0 >= 0.0 and one.x1 <= figure.bbox.width and one.y1 <= figure.bbox.height for one in drawn)
    t = np.linspace(0.01, 6.0, 6000)[:, None]
    for name, ax in zip(names, figure.axes):
        assert ax.get_title() == name.upper()
        shown = [
            tick for axis in (ax.get_xticks(), ax.get_yticks()) for tick in axis if 0.0 < abs(tick) < ax.viewLim.x1
        ]
        assert len(shown) >= 4
        if name not in ("nlvo", "nao"):
            continue
        region = Ring.make_compound_path(*(p.get_path() for p in ax.patches if str(p.get_gid()) == "blocked"))
        own, gain = (np.zeros(2), t) if name == "nlvo" else (t * state.velocity, 0.5 * t**2)
        for control in np.random.default_rng(0).uniform(-3.0, 3.0, (40, 2)):
            away = [
                np.linalg.norm(o.trajectory.position(t[:, 0]) - state.position - own - gain * control, axis=1).min()
                - o.shape.bounding_radius
                - 0.8
                for o in obstacles
            ]
            if abs(min(away)) > 0.05:
                assert region.contains_point(control) == (min(away) < 0.0)


def figures() -> dict[str, Figure]:
    """A figure of each kind, of runs in flat scenes too."""
    run = simulate(gallery.build("head_on", {"duration": 4.0}), slalom.method("nao"))
    state, obstacles, goal = scene_in_plane()
    scene = Scenario("scene", (Robot(slalom.Disc(0.8), slalom.Limits(6.0, 3.0), state, goal),), obstacles)
    rows = [Row("empty", {"margin": margin, "duration": 12.0}, ["nao"], 1) for margin in (0.1, 0.2)]
    robot = {"robot": run.shapes[0], "goal": run.goals[0]}
    return {
        "decision": view.decision(*decide("nao", 2), resolution=41),
        "paths": view.paths(run.times, run.positions[:, 0], run.obstacles, **robot).get_figure(root=True),
        "fleet": view.fleet(simulate(gallery.build("circle", {"duration": 2.0}), slalom.method("nao"))),
        "film": Film(run, width=480).axes[0].get_figure(root=True),
        "sets of a page": view.sets(scene, resolution=41),
        "sets of a column": view.sets(scene, columns=1, resolution=41),
        "study": compare_all(rows).figure(),
        "study of a column": view.resized(compare_all(rows).figure(), width=3.5),
    }


def test_every_axis_has_two_numbers_besides_0() -> None:
    """And its label lies inside the figure."""
    for name, figure in figures().items():
        FigureCanvasAgg(figure).draw()
        for ax in (one for one in figure.axes if one.get_xlabel()):
            for axis, limits in ((ax.xaxis, ax.get_xlim()), (ax.yaxis, ax.get_ylim())):
                ticks = zip(axis.get_ticklabels(), axis.get_ticklocs())
                shown = {text.get_text() for text, at in ticks if limits[0] <= at <= limits[1]}
                assert len({text for text in shown if text.strip("0.")}) >= 2, (name, shown)
                box = axis.label.get_window_extent()
                assert figure.bbox.x0 <= box.x0 < box.x1 <= figure.bbox.x1, name
                assert figure.bbox.y0 <= box.y0 < box.y1 <= figure.bbox.y1, name
