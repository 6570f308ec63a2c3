"""The core of a ROS 2 node on plain messages: frames, obstacles, maps, commands. No package of ROS is needed."""

from types import SimpleNamespace as Message

import numpy as np
import pytest
import shapely
from hypothesis import given, strategies as st
from ros_messages import (
    about,
    an_object,
    an_obstacle,
    detection,
    goal_pose,
    grid,
    grid_update,
    header,
    marker,
    measured,
    odom,
    of_pose,
    persons,
    pose,
    transform,
    xyz,
)

from slalom import Disc, DriveStatus, Polygon, Polyline, Rectangle
from slalom.adapters.ros.messages import (
    Frames,
    detections,
    markers,
    objects,
    obstacles,
    occupancy_grid,
    odometry,
    people,
)
from slalom.adapters.ros.node import Node
from slalom.adapters.ros.shell import NodeSettings

KINDS = Message(Twist=Message, Accel=Message, Vector3=Message)
ANGLES = st.floats(-3.0, 3.0)
COMPONENTS = st.floats(-5.0, 5.0)


def placed_map(x: float = 2.0, y: float = -1.0, heading: float = 0.7) -> Frames:
    frames = Frames("odom")
    frames.update(transform("odom", "map", x, y, heading))
    return frames


@given(heading=ANGLES, tilt=st.floats(-0.5, 0.5), forward=COMPONENTS, left=COMPONENTS)
def test_the_twist_of_odometry_is_in_the_frame_of_the_body(heading, tilt, forward, left):
    """Against complex numbers; a robot on a ramp has the horizontal part of its velocity."""
    read = odometry(odom(at=pose(3.0, 4.0, heading), twist=(forward, left, 0.3)))
    velocity = complex(forward, left) * np.exp(1j * heading)
    assert np.allclose(read.velocity, (velocity.real, velocity.imag))
    assert read.heading == pytest.approx(heading)
    assert (read.speed, read.turn) == (pytest.approx(forward), 0.3)
    ramp = odometry(
        odom(at=Message(position=xyz(), orientation=about((0.0, 1.0, 0.0), tilt)), twist=(forward, 0.0, 0.0))
    )
    assert np.allclose(ramp.velocity, (forward * np.cos(tilt), 0.0))


@given(x=COMPONENTS, y=COMPONENTS, heading=ANGLES)
def test_frames_are_known_from_either_side(x, y, heading):
    """odom in map says the same as map in odom, which is its inverse."""
    frames, point = placed_map(x, y, heading), np.array([1.5, -2.5])
    inverse = frames.of("map", "").inverse
    other = Frames("odom")
    other.update(transform("map", "odom", *inverse.position, inverse.heading))
    assert np.allclose(frames.of("map", "").point(point), other.of("map", "").point(point))
    assert np.allclose(inverse.point(frames.of("map", "").point(point)), point)


def test_markers_become_discs_and_rectangles_in_the_fixed_frame():
    each = {"ns": "a", "header": header(frame="map")}
    shown = [
        marker(**each),
        marker(**each, id=8, type=2, scale=xyz(1.0, 2.0, 3.0)),
        marker(**each, id=9, type=1, scale=xyz(4.0, 2.0, 1.0), pose=pose(1.0, 0.0, 0.2)),
        marker(**each, id=10, action=2),
        marker(ns="text", type=9),
    ]
    person, ball, box = markers(Message(markers=shown), placed_map(), ["a"])
    assert np.allclose(person.position, (2.0 + 4.0 * np.cos(0.7), -1.0 + 4.0 * np.sin(0.7)))
    assert (person.id, person.velocity, person.shape, person.heading) == (("marker", "a", 7), None, Disc(0.3), None)
    assert ball.shape == Disc(1.0)
    assert (box.shape, box.heading) == (Rectangle(4.0, 2.0), pytest.approx(0.9))


@pytest.mark.parametrize(("kind", "reach"), [(1, np.sqrt(14.0) / 2), (2, 1.5), (3, np.hypot(1.0, 1.5))])
def test_a_tilted_body_is_the_disc_about_all_of_it(kind, reach):
    lying = Message(position=xyz(), orientation=about((1.0, 0.0, 0.0), 0.5 * np.pi))
    (seen,) = markers(Message(markers=[marker(type=kind, scale=xyz(1.0, 2.0, 3.0), pose=lying)]), Frames("odom"))
    assert seen.shape.radius == pytest.approx(reach)


def test_objects_have_a_velocity_once_they_are_tracked():
    seen = list(objects(Message(objects=[an_object(), an_object(detection_level=0)]), Frames("odom")))
    assert seen[0].velocity.tolist() == [1.0, 2.0]
    assert seen[1].velocity is None
    assert (seen[0].shape, seen[0].heading) == (Rectangle(4.0, 2.0), pytest.approx(0.5))
    round_ones = [an_object(shape=Message(type=k, dimensions=d)) for k, d in ((2, [0.4]), (3, [2.0, 0.5]))]
    assert [one.shape for one in objects(Message(objects=round_ones), Frames("odom"))] == [Disc(0.4), Disc(0.5)]


def test_obstacles_of_costmap_converter_have_corners_in_their_frame():
    corners = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 0.5)]
    given_ones = [an_obstacle(*corners[:n], radius=0.1, velocity=(1.0, 0.0)) for n in (1, 2, 4)]
    frames = placed_map()
    point, line, area = obstacles(Message(header=header(frame="map"), obstacles=given_ones), frames)
    assert (point.shape, point.heading) == (Disc(0.1), None)
    assert isinstance(line.shape, Polyline)
    assert isinstance(area.shape, Polygon)
    assert np.allclose(area.position + area.shape.corners, frames.of("map", "").point(np.array(corners)))
    assert np.allclose(area.velocity, (np.cos(0.7), np.sin(0.7)))


def test_people_have_names_velocities_and_the_shape_of_the_tracker():
    frames, here = placed_map(), header(frame="map")
    (one,) = people(persons(("anna", (4.0, 1.0), (1.0, 0.0)), header=here), frames)
    assert (one.id, one.shape, one.heading, one.covariance) == (("person", "anna"), None, None, None)
    assert np.allclose(one.position, frames.of("map", "").point(np.array([4.0, 1.0])))
    assert np.allclose(one.velocity, (np.cos(0.7), np.sin(0.7)))
    (seen,) = people(measured(covariance=[0.04, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 9.0], header=here), frames)
    assert (seen.id, seen.velocity) == (("person", "7"), None)
    turned = frames.of("map", "").axes
    assert np.allclose(seen.covariance, turned @ np.diag([0.04, 0.01]) @ turned.T)
    assert next(people(measured(id="", name=""), Frames("odom"))).id is None


def test_detections_are_boxes_with_the_covariance_of_their_result():
    frames = placed_map()
    (seen,) = detections(
        Message(**{**vars(detection(covariance=of_pose(x=0.04))), "header": header(frame="map")}), frames
    )
    assert (seen.id, seen.shape) == (("detection", "7"), Rectangle(0.6, 0.4))
    assert seen.heading == pytest.approx(1.0)
    assert np.allclose(seen.position, frames.of("map", "").point(np.array([4.0, 0.0])))
    assert np.allclose(np.linalg.eigvalsh(seen.covariance), (0.0, 0.04))
    # Without an id, a result or a known covariance.
    (bare,) = detections(detection(id="", results=[]), Frames("odom"))
    assert (bare.id, bare.covariance) == (None, None)
    assert next(detections(detection(covariance=of_pose()), Frames("odom"))).covariance is None


@pytest.mark.parametrize(
    "message", [persons(("a", (4.0, 0.0), (0.0, 0.0))), measured(), detection(), Message(markers=[marker()])]
)
def test_all_messages_of_obstacles_reach_the_decision(message):
    node = NodeSettings().node()
    node.receive(goal_pose(9.0, 0.0))
    node.receive(message)
    around = node.receive(odom()).decision.inputs.obstacles
    assert len(around) == 1


def test_an_update_of_a_map_gives_the_map_that_the_whole_grid_gives():
    cells, node = np.zeros((4, 6), np.int8), NodeSettings().node()
    first = grid(cells)
    node.receive(first)
    part = np.array([[100, 0], [100, 100]])
    node.receive(grid_update(part, 3, 1))
    node.receive(goal_pose(9.0, 0.0))
    node.receive(odom(10.0))
    cells[1:3, 3:5] = part
    whole = occupancy_grid(grid(cells), 65, False)
    assert np.array_equal(node.driver.walls.rectangles, whole.rectangles)
    node.receive(first)
    node.receive(odom(10.1))
    assert not len(node.driver.walls), "it is published again as it was before the update"


def test_without_odometry_the_node_brakes_to_rest():
    """By times of receipt, whose clock is another one: a robot at 1 m/s."""
    node, clock = NodeSettings().node(), 77 * 10**9
    node.receive(goal_pose(9.0, 0.0))
    for k in range(20):
        state = odom(10.0 + 0.1 * k, pose(0.1 * k), (1.0, 0.0, 0.0))
        assert not node.overdue(clock + 10**8 * k)
        node.receive(state, clock + 10**8 * k)
    last = clock + 19 * 10**8
    assert not node.overdue(last + 5 * 10**8)
    told = [command for k in range(30) for command in node.overdue(last + 5 * 10**8 + 7 * 10**7 * k)]
    assert {command.status for command in told} == {DriveStatus.NO_STATE}
    speeds = [float(command.linear[0]) for command in told]
    assert np.allclose(np.diff(speeds)[:-1], -0.1, atol=0.02), "as hard as its limits allow"
    assert speeds[-1] == pytest.approx(0.0, abs=1e-6)
    assert "(the last one is 0.50 s old, 0.5 s are allowed; it can rest within" in told[0].sentence
    assert node.receive(odom(13.5, pose(3.0)), last + 16 * 10**8).status is DriveStatus.DRIVING


def test_the_node_rests_when_nothing_more_is_seen():
    node = NodeSettings().node()
    node.receive(goal_pose(9.0, 0.0))
    node.receive(Message(markers=[marker(pose=pose(0.0, 5.0))]))
    _, commands = drive(node, 25)
    assert [command.status.name for command in commands] == 11 * ["DRIVING"] + 14 * ["NO_DETECTIONS"]


@pytest.mark.parametrize("sigmas", [0.0, 2.0])
def test_the_margin_grows_with_the_covariance_of_odometry(sigmas):
    node = NodeSettings(sigmas=sigmas).node()
    node.receive(goal_pose(9.0, 0.0))
    told = node.receive(odom(pose=Message(pose=pose(), covariance=of_pose(x=0.0025, y=0.0009, xy=0.0015))))
    most = np.sqrt(np.linalg.eigvalsh([[0.0025, 0.0015], [0.0015, 0.0009]])[1])
    margin = told.decision.inputs.navigator.margin
    assert 0.05 + sigmas * most - 1e-9 <= margin <= 0.05 + sigmas * most + 0.02


def test_a_map_is_placed_turned_and_read_by_its_values():
    cells = [[100, 0, -1], [65, 64, 0]]
    at = pose(1.0, 2.0, 0.5 * np.pi)
    known = occupancy_grid(grid(cells, 0.5, at), 65, False)
    assert known.origin == pytest.approx((1.0, 2.0, 0.5 * np.pi))
    ((x, y),) = [one.trajectory.position(0.0) for one in known]
    assert (x, y) == pytest.approx((0.5, 2.25))
    assert occupancy_grid(grid(cells, 0.5, at), 65, True).cells.sum() == 3


def drive(node: Node, steps: int, people: tuple[Message, ...] = ()) -> tuple[np.ndarray, list]:
    """Positions and commands of a robot that does exactly as it is told, in every direction."""
    place, velocity, commands, path = np.zeros(2), np.zeros(2), [], []
    heading = 0.4
    axes = np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]])
    for k in range(steps):
        t = 10.0 + 0.1 * k
        for each in people:
            node.receive(Message(markers=[Message(**{**vars(each), "header": header(t)})]))
        command = node.receive(odom(t, pose(*place, heading), (*(velocity @ axes), 0.0)))
        commands.append(command)
        after = axes @ command.linear
        place, velocity = place + 0.05 * (velocity + after), after
        path.append(place)
    return np.array(path), commands


def test_a_robot_drives_around_a_person_to_its_goal_behind_a_wall_of_the_map():
    node = NodeSettings(position_error=0.01, acceleration_error=0.01).node()
    node.receive(grid(np.full((1, 4), 100), 0.5, pose(5.0, 0.4)))
    node.receive(goal_pose(9.0, 0.0))
    path, commands = drive(node, 170, (marker(pose=pose(3.0)),))
    assert node.arrived
    assert np.array_equal(path[-1], path[-20])
    assert np.linalg.norm(path[-1] - (9.0, 0.0)) < 0.2
    assert np.linalg.norm(path - (3.0, 0.0), axis=1).min() > 0.6
    wall = shapely.box(5.0, 0.4, 7.0, 0.9)
    assert min(wall.distance(shapely.Point(each)) for each in path) > 0.3
    # The velocity of the person is not known at first.
    assert all(command.decision.safe for command in commands[5:])


def test_the_date_changes_no_bit():
    """A stamp in 2026 has too many digits for a float in seconds."""
    told = []
    for begin in (10, 1_780_000_000):
        node = NodeSettings().node()
        node.receive(goal_pose(6.0, 1.0))
        for k in range(3):
            now = Message(stamp=Message(sec=begin, nanosec=100_000_000 * k), frame_id="odom")
            node.receive(Message(markers=[marker(header=now)]))
            told.append(node.receive(odom(header=now)).linear.tobytes())
    assert told[:3] == told[3:]
    assert len(set(told)) > 1


def test_decisions_are_made_once_a_period_and_with_a_goal():
    node = NodeSettings().node()
    assert node.receive(odom(10.0)) is None
    node.receive(goal_pose(6.0, 1.0))
    made = [node.receive(odom(t)) is not None for t in (10.0, 10.02, 10.05, 10.095, 10.19)]
    assert made == [True, False, False, True, True]
    assert node.receive(odom(9.0)).status is DriveStatus.CLOCK_JUMPED


def test_commands_of_wheels_and_of_a_body_that_moves_in_every_direction():
    """Sideways, the one turns, the other moves sideways; both accelerate towards the goal in the frame of the body."""
    free, wheels = NodeSettings().node(), NodeSettings(track=0.4).node()
    for node in (free, wheels):
        node.receive(goal_pose(0.0, 5.0, 0.5 * np.pi))
    moved, turned = (node.receive(odom()).twist(KINDS) for node in (free, wheels))
    assert moved.linear.y > 0.05 > abs(moved.linear.x)
    assert (moved.angular.z, turned.linear.y) == (0.0, 0.0)
    assert turned.angular.z > 0.1
    back = NodeSettings().node()
    back.receive(goal_pose(0.0, 5.0))
    wanted = back.receive(odom(at=pose(heading=np.pi))).accel(KINDS)
    assert wanted.linear.y == pytest.approx(-1.0, abs=0.05)
    assert wanted.angular.z == 0.0


def test_a_map_and_a_goal_follow_the_transform_of_their_frame():
    node = NodeSettings().node()
    node.frames.update(transform("odom", "map", 0.0, 0.0, 0.0))
    shown = grid(np.full((1, 1), 100))
    shown.header = header(frame="map")
    node.receive(shown)
    node.receive(goal_pose(5.0, 0.0, frame="map"))
    before, first = node.receive(odom(10.0)), node.driver.walls
    assert node.receive(odom(10.1)).decision.inputs.obstacles[0] is first
    node.receive(transform("odom", "map", 0.0, 3.0, 0.0))
    after = node.receive(odom(10.2))
    goals = [each.decision.inputs.goal.position(0.0).tolist() for each in (before, after)]
    assert goals == [[5.0, 0.0], [5.0, 3.0]]
    assert node.driver.walls.given[0].trajectory.initial_position.tolist() == [0.25, 3.25]


def test_a_new_path_begins_at_its_own_start():
    node = NodeSettings().node()
    for points in (((0.0, 0.0), (5.0, 0.0), (5.0, 0.0)), ((0.0, 0.0), (0.0, 5.0))):
        node.receive(Message(header=header(), poses=[Message(pose=pose(*each)) for each in points]))
        command = node.receive(odom(10.0 if points[1][0] else 10.1))
        assert command.decision.progress == pytest.approx(0.0, abs=1e-6)
        assert np.argmax(np.abs(command.acceleration)) == int(points[1][1] > 0.0)


def test_measurements_that_come_again_are_counted():
    node = NodeSettings().node()
    for _ in range(3):
        node.receive(Message(markers=[marker()]))
    node.receive(goal_pose(9.0, 0.0))
    node.receive(odom())
    assert node.unused == {"repeated": 2}
