"""Recordings: what is saved and loaded is the same to the bit, and anything else is refused."""

import json
import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, replace
from pathlib import Path

import h5py
import numpy as np
import parts
import pytest
from draws import draws_of
from parts import BOUNDS, PERIOD, disc_or_ball
from recorded_runs import every_kind, recorded, same_bits

from slalom import METHODS, Acceleration, Goal, InvalidFile, Manoeuvre, Obstacle, PathGoal, State, Velocity
from slalom.base.registry import from_plain, to_plain
from slalom.decision.document import RESPONSE_KINDS
from slalom.decision.objective import OBJECTIVES
from slalom.io import limited
from slalom.model.bounds import BOUNDS as BOUND_KINDS
from slalom.model.response.kinds import AccelerationSequence
from slalom.model.shape import SHAPES
from slalom.model.trajectory import TRAJECTORIES
from slalom.model.uncertainty import UNCERTAINTIES
from slalom.sim import Recording, metrics, simulate
from slalom.sim.gallery import build
from slalom.sim.measure.responses import RecordedResponses

ARRAYS = ("times", "positions", "velocities", "accelerations", "controls", "decision_times", "arrived", "appears")
PLAIN = (
    "scenario",
    "names",
    "method",
    "foresight",
    "seed",
    "dt",
    "parameters",
    "settings",
    "holds",
    "responses",
    "outcomes",
)


@pytest.fixture(scope="module", params=draws_of({"space": 3, "plane": 2}, "space"))
def saved(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Recording, Path]:
    """A recording and its file."""
    recording, path = recorded(request.param), tmp_path_factory.mktemp("runs") / "run.h5"
    recording.save(path)
    return recording, path


def test_arrays_and_texts_come_back(saved: tuple[Recording, Path]) -> None:
    recording, loaded = saved[0], Recording.load(saved[1])
    for name in ARRAYS:
        assert same_bits(getattr(recording, name), getattr(loaded, name)), name
    for name in PLAIN:
        assert getattr(recording, name) == getattr(loaded, name), name
        assert type(getattr(recording, name)) is type(getattr(loaded, name)), name
    assert loaded.digest() == recording.digest()
    assert loaded.dimension == recording.dimension
    assert {f.name for f in fields(Recording)} == {*ARRAYS, *PLAIN, "limits", "goals", "shapes", "obstacles", "tasks"}


def test_trajectories_come_back(saved: tuple[Recording, Path]) -> None:
    """Every kind: fields, and positions, velocities and accelerations at every time."""
    recording, loaded = saved[0], Recording.load(saved[1])
    assert len(loaded.obstacles) == len(recording.obstacles)
    times = np.linspace(0.0, 1.2, 77)
    for mine, theirs in zip(recording.obstacles, loaded.obstacles):
        assert theirs.name == mine.name
        assert same_bits(mine.shape, theirs.shape)
        assert same_bits(mine.trajectory, theirs.trajectory), mine.name
        for rate in ("position", "velocity", "acceleration"):
            a, b = (getattr(o.trajectory, rate)(times) for o in (mine, theirs))
            assert np.ascontiguousarray(a).tobytes() == np.ascontiguousarray(b).tobytes(), (mine.name, rate)


def test_limits_and_goals_come_back(saved: tuple[Recording, Path]) -> None:
    recording, loaded = saved[0], Recording.load(saved[1])
    assert same_bits(recording.goals, loaded.goals)
    for name in ("max_speed", "max_acceleration"):
        assert getattr(loaded.limits[0], name) == getattr(recording.limits[0], name)
    for name in ("velocity_bounds", "acceleration_bounds"):
        assert same_bits(getattr(recording.limits[0], name), getattr(loaded.limits[0], name)), name


@pytest.mark.parametrize("d", [2, 3])
def test_bounds_of_every_kind_come_back(d: int, tmp_path: Path) -> None:
    one = recorded(d, duration=0.1, replan=0.0)
    for name, bounds in BOUNDS.items():
        recording = replace(one, limits=(replace(one.limits[0], bounds=bounds(d)),))
        recording.save(tmp_path / "run.h5")
        assert same_bits(Recording.load(tmp_path / "run.h5").limits, recording.limits), name


@pytest.mark.parametrize("speeds", [None, 1.5, [1.0, 2.0, 0.0]])
def test_the_path_to_a_goal_comes_back(speeds: object, tmp_path: Path) -> None:
    goal = PathGoal([(0, 0), (4, 1), (9, 1)], speeds, 0.4, lookahead=1.7)  # type: ignore[arg-type]
    replace(recorded(2), goals=(goal,)).save(tmp_path / "run.h5")
    (loaded,) = Recording.load(tmp_path / "run.h5").goals
    assert isinstance(loaded, PathGoal)
    for name in ("points", "speeds", "tolerance", "stop", "lookahead"):
        np.testing.assert_array_equal(getattr(loaded, name), getattr(goal, name))


@pytest.mark.parametrize("d", [2, 3])
def test_a_goal_of_every_kind_comes_back(d: int, tmp_path: Path) -> None:
    one = recorded(d, duration=0.1, replan=0.0)
    for name, place in every_kind(d).items():
        recording = replace(one, goals=(Goal(place, 1 / 3, stop=True),))
        recording.save(tmp_path / "run.h5")
        assert same_bits(Recording.load(tmp_path / "run.h5").goals, recording.goals), name


def test_metrics_of_the_file_are_those_of_the_run(saved: tuple[Recording, Path]) -> None:
    recording, loaded = saved[0], Recording.load(saved[1])
    for name, metric in metrics.METRICS.items():
        assert metric(loaded) == metric(recording), name
    assert metrics.summary(loaded) == metrics.summary(recording)


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_files_are_read_after_one_that_is_not(saved: tuple[Recording, Path], tmp_path: Path) -> None:
    """By the same process as long as each is read, by another one afterwards; threads and forks read the same."""
    (tmp_path / "text.h5").write_text("text")
    assert Recording.load(saved[1]).digest() == saved[0].digest()
    reader = limited.READER.process
    assert Recording.load(saved[1]).digest() == saved[0].digest()
    assert reader is limited.READER.process
    with pytest.raises(InvalidFile):
        Recording.load(tmp_path / "text.h5")
    with ThreadPoolExecutor(4) as pool:
        assert {run.digest() for run in pool.map(Recording.load, [saved[1]] * 8)} == {saved[0].digest()}
    assert limited.READER.process is not reader
    child = os.fork()
    if child == 0:
        os._exit(Recording.load(saved[1]).digest() != saved[0].digest())
    assert os.waitpid(child, 0)[1] == 0
    assert Recording.load(saved[1]).digest() == saved[0].digest()


def test_saving_again_gives_the_same_recording(saved: tuple[Recording, Path], tmp_path: Path) -> None:
    """And over an older file."""
    loaded = Recording.load(saved[1])
    (tmp_path / "again.h5").write_text("an older file")
    loaded.save(tmp_path / "again.h5")
    assert Recording.load(tmp_path / "again.h5").digest() == saved[0].digest()


@pytest.mark.parametrize("name", ["empty", "head_on", "curved_road", "roundabout_exit"])
def test_gallery_runs_come_back(name: str, tmp_path: Path) -> None:
    recording = simulate(build(name, {"duration": 1.0}, seed=1), METHODS["ao"], seed=1)
    recording.save(str(tmp_path / "run.h5"))
    loaded = Recording.load(str(tmp_path / "run.h5"))
    assert loaded.digest() == recording.digest()
    assert same_bits(loaded.obstacles, recording.obstacles)
    assert loaded.parameters == recording.parameters


@pytest.mark.parametrize("d", [2, 3])
def test_parts_of_every_kind_come_back_from_json(d: int) -> None:
    """To the bit, by the codec of all formats; nothing but numbers, texts, lists and mappings is in between."""
    each: list[tuple[object, Mapping[str, type]]] = [
        *((part, TRAJECTORIES) for part in every_kind(d).values()),
        *((parts.SHAPES[name](0.7, d), SHAPES) for name in parts.served(d)),
        *((bound, BOUND_KINDS) for make in BOUNDS.values() for bound in make(d)),
        *((part, UNCERTAINTIES) for part in parts.UNCERTAINTIES.values()),
        *((make(d), OBJECTIVES) for make in parts.OBJECTIVES.values()),
        *((part, RESPONSE_KINDS) for part in (parts.RESPONSES | parts.PLANE_RESPONSES).values()),
    ]
    found = 0
    for part, kinds in each:
        if type(part) in kinds.values():
            found += 1
            again = from_plain(json.loads(json.dumps(to_plain(part, kinds))), kinds)
            assert same_bits(again, part), part
    assert found > 25


def test_responses_come_back(tmp_path: Path) -> None:
    """Also those of a search, whose texts are rounded, texts of a peer, and those of kinds that files do not have."""

    class Own(Acceleration):
        pass

    one = recorded(2)
    sequences = [AccelerationSequence(1 / 3, ((1 / 7, (0.1, 1 / 9 + 1e-12 * k)),)) for k in range(2)]
    parts = [*sequences, "orca", Own(), Velocity(1 / 3), Velocity(1 / 3)] * 2
    rows = [(part,) for part in parts]
    recording = replace(one, responses=RecordedResponses.of(rows, 1))
    assert len(recording.responses.parts) == 5
    recording.save(tmp_path / "run.h5")
    loaded = Recording.load(tmp_path / "run.h5")
    assert loaded.digest() == recording.digest()
    assert loaded.responses.texts == recording.responses.texts
    found = [row[0] for row in loaded.responses.rows]
    assert found == [repr(part) if isinstance(part, Own) else part for part in parts]


def test_files_with_responses_as_text_are_read(saved: tuple[Recording, Path], tmp_path: Path) -> None:
    """As responses; text that determines none stays as it is."""
    recording = saved[0]
    texts = recording.responses.texts
    for changed in (
        texts,
        (("Jump(height=1.0)",), ("orca",), ("Velocity(ramp=-1)",), ("__import__('os')",), *texts[4:]),
    ):
        (tmp_path / "run.h5").write_bytes(saved[1].read_bytes())
        with h5py.File(tmp_path / "run.h5", "r+") as file:
            file.attrs["format"] = "slalom recording 2"
            del file["run_0/responses"], file["run_0/response_parts"]
            file["run_0/responses"] = np.array(changed, dtype=h5py.string_dtype())
        loaded = Recording.load(tmp_path / "run.h5")
        assert loaded.responses.texts == changed
        assert loaded.responses.rows[4:] == recording.responses.rows[4:]
    assert recording.responses != loaded.responses


def test_a_run_without_steps_comes_back(tmp_path: Path) -> None:
    recording = simulate(build("empty", {"distance": 0.0}), METHODS["nao"])
    recording.save(tmp_path / "run.h5")
    loaded = Recording.load(tmp_path / "run.h5")
    assert loaded.accelerations.shape == recording.accelerations.shape == (0, 1, 2)
    assert loaded.digest() == recording.digest()


def test_more_than_ten_obstacles_keep_their_order(tmp_path: Path) -> None:
    """HDF5 lists "10" before "2"."""
    recording = simulate(build("roundabout_crossing", {"duration": 0.1}), METHODS["nlvo"])
    recording.save(tmp_path / "run.h5")
    names = [o.name for o in Recording.load(tmp_path / "run.h5").obstacles]
    assert names == [o.name for o in recording.obstacles]
    assert len(names) == 30


def test_a_file_keeps_that_contacts_at_rest_do_not_count(saved: tuple[Recording, Path], tmp_path: Path) -> None:
    """For each obstacle; in a file that does not say it, all contacts count."""
    recording = saved[0]
    passive = tuple(replace(o, contact_at_rest=k % 2 == 0) for k, o in enumerate(recording.obstacles))
    replace(recording, obstacles=passive).save(tmp_path / "run.h5")
    found = [o.contact_at_rest for o in Recording.load(tmp_path / "run.h5").obstacles]
    assert found == [o.contact_at_rest for o in passive]
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        for group in file["run_0/obstacles"].values():
            del group.attrs["contact_at_rest"]
    assert all(o.contact_at_rest for o in Recording.load(tmp_path / "run.h5").obstacles)


def test_the_digest_sees_every_bit(saved: tuple[Recording, Path]) -> None:
    """Of everything but the wall clock."""
    recording = saved[0]
    for name in ("times", "positions", "velocities", "accelerations", "controls", "arrived"):
        changed = getattr(recording, name).copy()
        changed.flat[-1] = np.nextafter(changed.flat[-1], -1.0) if np.isfinite(changed.flat[-1]) else 3.0
        assert replace(recording, **{name: changed}).digest() != recording.digest(), name
    assert replace(recording, seed=8).digest() != recording.digest()
    assert replace(recording, decision_times=recording.decision_times + 1.0).digest() == recording.digest()


def test_the_file_has_the_names_of_navground(saved: tuple[Recording, Path]) -> None:
    """Group `run_0` with `poses` and `twists` (x, y, heading), `time_step`, `steps`, `seed`."""
    recording, path = saved
    d, steps = recording.dimension, len(recording.accelerations)
    with h5py.File(path) as file:
        run = file["run_0"]
        assert file.attrs["format"] == "slalom recording 3"
        assert run.attrs["time_step"] == PERIOD
        assert run.attrs["steps"] == steps
        assert run.attrs["seed"] == 7
        assert run.attrs["final_sim_time"] == recording.times[-1]
        assert run.attrs["digest"] == recording.digest()
        assert run["poses"].shape == run["twists"].shape == (steps + 1, 1, d + 1)
        np.testing.assert_array_equal(run["poses"][..., :d], recording.positions)
        np.testing.assert_array_equal(run["twists"][..., :d], recording.velocities)
        v = recording.velocities
        np.testing.assert_array_equal(run["poses"][..., d], np.arctan2(v[..., 1], v[..., 0]))
        assert not np.any(run["twists"][..., d])


def damaged(path: Path, target: Path, what: str) -> Path:
    """A copy of the file in which something is missing or wrong."""
    target.write_bytes(path.read_bytes())
    with h5py.File(target, "r+") as file:
        run = file["run_0"]
        if what == "no run":
            del file["run_0"]
        elif what == "no format":
            del file.attrs["format"]
        elif what == "another format":
            file.attrs["format"] = "slalom recording 99"
        elif what == "no seed":
            del run.attrs["seed"]
        elif what == "an unknown kind":
            run["obstacles/0/trajectory"].attrs["kind"] = "zigzag"
        elif what == "a group for an array":
            del run["times"]
            run.create_group("times")
        elif what == "a negative radius":
            run["obstacles/0/shape"].attrs["radius"] = -1.0
        else:
            del run[what]
    return target


@pytest.mark.parametrize(
    "what",
    [
        "no run",
        "no format",
        "another format",
        "no seed",
        "an unknown kind",
        "a group for an array",
        "a negative radius",
        "poses",
        "times",
        "outcomes",
        "robots/0/goal",
        "obstacles/0/trajectory/position",
    ],
)
def test_a_damaged_file_is_refused(what: str, saved: tuple[Recording, Path], tmp_path: Path) -> None:
    path = damaged(saved[1], tmp_path / "damaged.h5", what)
    with pytest.raises(InvalidFile, match=r"damaged\.h5: expected ") as caught:
        Recording.load(path)
    assert len(caught.value.mistakes) == 1


def test_a_trajectory_of_another_kind_is_saved_as_its_pieces(saved: tuple[Recording, Path], tmp_path: Path) -> None:
    """Anything may be a trajectory, a manoeuvre for example; what is not plain numbers is written within its error."""
    d = saved[0].dimension
    other = Manoeuvre(Acceleration(), State(np.zeros(d), np.zeros(d)), np.zeros(d), 0.0)
    recording = replace(saved[0], obstacles=(Obstacle(disc_or_ball(1.0, d), other, "other robot"),))
    recording.save(tmp_path / "run.h5")
    back = Recording.load(tmp_path / "run.h5").obstacles[0].trajectory
    times = recording.times[(recording.times >= back.span[0]) & (recording.times <= back.span[1])]
    assert len(times) > 1
    np.testing.assert_allclose(back.position(times), other.position(times), atol=1e-6)


def test_a_file_that_does_not_say_its_foresight(tmp_path: Path) -> None:
    """As files were before; the others say it."""
    path = tmp_path / "run.h5"
    simulate(build("empty", {"duration": 0.2}), METHODS["nao"].with_foresight("present")).save(path)
    assert Recording.load(path).foresight == "present"
    with h5py.File(path, "a") as file:
        del file["run_0"].attrs["foresight"]
    assert Recording.load(path).foresight == ""


def test_files_of_format_1_are_read() -> None:
    """Fields of trajectories had other names there; the values are those that were written."""
    loaded = Recording.load(Path(__file__).parents[1] / "data" / "recording_format_1.h5")
    pole, walker, cyclist, car = (obstacle.trajectory for obstacle in loaded.obstacles)
    assert pole.initial_position.tolist() == [5.0, 2.0]
    assert (walker.initial_position.tolist(), walker.initial_velocity.tolist(), walker.at) == ([12, -1], [-1, 0.2], 0.5)
    assert cyclist.initial_acceleration.tolist() == [0.1, -0.2]
    assert car.speed == 1.0
    assert loaded.goals[0].position(1.0).tolist() == [9.1, 1.0]
