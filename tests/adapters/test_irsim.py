"""The behaviour for ir-sim, judged by ir-sim's own flags of collision and arrival, beside its own behaviours."""

import logging
from pathlib import Path

import numpy as np
import pytest
import shapely

pytest.importorskip("irsim", reason="the package ir-sim is not installed: pip install 'slalom[irsim]'")

from irsim_worlds import SHAPE, WORLDS, ran, robot

from slalom.adapters import irsim

pytestmark = [pytest.mark.adapters, pytest.mark.filterwarnings("ignore")]
QUICK = {("corridor", "acker"), ("crossing", "diff"), ("swap", "omni"), ("grid", "omni")}
RUNS = [
    pytest.param(world, kind, marks=() if (world, kind) in QUICK else pytest.mark.slow)
    for world in WORLDS
    for kind in SHAPE
]


@pytest.mark.parametrize(("world", "kind"), RUNS)
def test_no_robot_is_hit_where_dash_is(tmp_path: Path, world: str, kind: str) -> None:
    result = ran(tmp_path, world, kind, "name: slalom")
    assert (result.hit, result.arrived) == (0, result.robots)
    assert ran(tmp_path, world, kind, "name: dash").hit > 0


@pytest.mark.slow
def test_equal_worlds_give_equal_runs(tmp_path: Path) -> None:
    assert ran(tmp_path, "swap", "diff", "name: slalom") == ran(tmp_path, "swap", "diff", "name: slalom")


def test_settings_of_the_behaviour_count(tmp_path: Path) -> None:
    slow = ran(tmp_path, "crossing", "omni", "name: slalom, max_acceleration: 0.3")
    assert slow.hit == 0
    assert slow.time > ran(tmp_path, "crossing", "omni", "name: slalom").time


def test_a_robot_without_a_goal_stands_and_a_reset_begins_anew(tmp_path: Path) -> None:
    import irsim as simulator

    world = tmp_path / "world.yaml"
    robots = robot("omni", "name: slalom", [1, 5, 0], [9, 5, 0]) + robot("omni", "name: slalom", [5, 1, 0], [9, 1, 0])
    world.write_text(f"world: {{height: 10, width: 12, step_time: 0.1}}\nrobot:\n{robots}")
    env = simulator.make(str(world), display=False, log_level="ERROR")
    runs = []
    for _ in range(2):
        env.robot_list[1].set_goal(None)
        for _ in range(20):
            env.step()
        runs.append([r.state.copy() for r in env.robot_list])
        env.reset()
    assert np.array_equal(runs[0], runs[1])
    assert runs[0][0][0, 0] > 1.5
    assert np.array_equal(runs[0][1][:2, 0], [5.0, 1.0])
    env.end(0)
    logging.shutdown()


def test_polygons_of_a_map_contain_what_irsim_takes_as_occupied() -> None:
    """A disc of half the longer side of a cell about the middle of each."""
    rng = np.random.default_rng(3)
    cells, size, corner = 100.0 * (rng.uniform(size=(12, 9)) < 0.3), np.array([0.2, 0.3]), (1.0, -2.0)
    area = irsim.occupied(cells, size, corner)
    middles = (np.argwhere(cells > 50) + 0.5) * size + corner
    discs = shapely.union_all(shapely.buffer(shapely.points(middles), 0.15))
    assert area.buffer(1e-9).contains(discs)
    assert area.area <= 0.3**2 * len(middles) + 1e-9
