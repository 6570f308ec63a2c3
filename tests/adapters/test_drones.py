"""Setpoints of MAVLink: frames, mask and bytes; a rigid body that follows them among moving balls."""

import sys
from pathlib import Path
from types import SimpleNamespace as Message

import numpy as np
import pytest
from draws import examples
from hypothesis import given, strategies as st

from slalom import Ball, ConstantVelocity, Goal, Limits, Navigator, Obstacle, State, Stationary, method
from slalom.adapters.mavlink import Drone, measured, ned, setpoint
from slalom.base.errors import InvalidInput

ROOT = Path(__file__).parents[2]
NUMBERS = st.floats(-50.0, 50.0)
VECTORS = st.tuples(NUMBERS, NUMBERS, NUMBERS)


def decision(position=(0.0, 0.0, 5.0), velocity=(1.0, 0.5, 0.0)):
    drone = Navigator(method("nao"), Ball(0.3), Limits(2.0, 1.5))
    ball = Obstacle(Ball(0.5), ConstantVelocity((6.0, 0.5, 5.2), (-1.0, 0.0, 0.0)))
    return drone.decide(State(position, velocity), [ball], Goal(Stationary((9.0, 0.0, 6.0))))


@given(vectors=st.lists(VECTORS, min_size=1, max_size=4))
def test_frames_are_turned_without_mirroring(vectors):
    """East is y of the local frame, north x, up its negative z; twice is the identity, and the determinant is 1."""
    assert np.array_equal(ned(ned(vectors)), vectors)
    assert ned((1.0, 0.0, 0.0)).tolist() == [0.0, 1.0, 0.0]
    assert ned((0.0, 0.0, 2.0)).tolist() == [0.0, 0.0, -2.0]
    assert np.linalg.det(ned(np.eye(3))) == pytest.approx(1.0)


@examples(20)
@given(heading=st.floats(-20.0, 20.0), t=st.floats(0.0, 3.0))
def test_a_setpoint_is_the_manoeuvre_at_its_time(heading, t):
    made = decision()
    told = setpoint(made, t, heading)
    assert np.array_equal(ned(told.position), made.manoeuvre.position(t))
    assert np.array_equal(ned(told.velocity), made.manoeuvre.velocity(t))
    assert np.array_equal(ned(told.acceleration), made.manoeuvre.acceleration(t))
    north_east = np.cos(told.yaw), np.sin(told.yaw)
    assert np.allclose(north_east, (np.sin(heading), np.cos(heading)))
    assert abs(told.yaw) <= np.pi


def test_a_drone_decides_from_its_plan_while_it_is_on_it():
    drone, made = Drone(0.25, 0.2), decision()
    plan = made.manoeuvre.position(0.5)
    for off, planned in ((0.19, True), (0.21, False)):
        x, y, z = ned(plan + np.array([0.0, off, 0.0])).tolist()
        state = drone.state(Message(x=x, y=y, z=z, vx=0.0, vy=0.0, vz=0.0), made, 0.5)
        assert np.array_equal(state.position, plan) == planned
        assert np.any(state.velocity) == planned
    assert drone.shape.radius == pytest.approx(0.45)
    with pytest.raises(InvalidInput, match="message: expected LOCAL_POSITION_NED, found 3"):
        measured(3)


@pytest.mark.adapters
@pytest.mark.parametrize("heading", [None, 0.4])
def test_the_bytes_say_what_is_used(heading):
    """Read by pymavlink, with its names of the bits of the mask."""
    mavlink = pytest.importorskip(
        "pymavlink.dialects.v20.common", reason="the package pymavlink is not installed: pip install 'slalom[mavlink]'"
    )
    written, told = bytearray(), setpoint(decision(), 0.3, heading)
    link = mavlink.MAVLink(Message(write=written.extend), srcSystem=255)
    told.send(Message(mav=link), 4294967.3, system=7)
    (read,) = mavlink.MAVLink(None).parse_buffer(bytes(written))
    assert read.get_type() == "SET_POSITION_TARGET_LOCAL_NED"
    assert (read.coordinate_frame, read.target_system, read.time_boot_ms) == (mavlink.MAV_FRAME_LOCAL_NED, 7, 4)
    ignored = {
        name.removeprefix("POSITION_TARGET_TYPEMASK_").removesuffix("_IGNORE")
        for name in vars(mavlink)
        if name.startswith("POSITION_TARGET_TYPEMASK")
        and name.endswith("_IGNORE")
        and getattr(mavlink, name) & read.type_mask
    }
    assert ignored == ({"YAW", "YAW_RATE"} if heading is None else {"YAW_RATE"})
    assert not read.type_mask & mavlink.POSITION_TARGET_TYPEMASK_FORCE_SET
    assert np.allclose((read.x, read.y, read.z, read.vx, read.vy, read.vz), [*told.position, *told.velocity], rtol=1e-6)
    assert np.allclose((read.afx, read.afy, read.afz), told.acceleration, rtol=1e-6)


@pytest.mark.adapters
@pytest.mark.parametrize("seed", range(2))
def test_a_quadrotor_flies_by_bytes_among_moving_balls_without_a_collision(seed):
    pytest.importorskip("pymavlink", reason="the package pymavlink is not installed: pip install 'slalom[mavlink]'")
    pytest.importorskip("rotorpy", reason="the package rotorpy is not installed: pip install rotorpy")
    sys.path.insert(0, str(ROOT / "benchmarks"))
    import drones

    flight = drones.fly(seed)
    assert flight.arrived
    assert flight.clearance > 0.0
    assert flight.met > 3
    assert 0.0 < flight.off <= drones.DRONE.error
    assert flight.unsafe == 0
