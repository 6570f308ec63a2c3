"""Test cases of gym-collision-avoidance: read as they stand, and scenarios of them."""

import os
from pathlib import Path

import numpy as np
import pytest

from slalom import METHODS, InvalidFile
from slalom.io.pedestrians import Case, read_cases
from slalom.sim import metrics, simulate
from slalom.sim.gallery.fleets import cadrl

PEERS = Path(os.environ.get("SLALOM_DATA", Path(__file__).parents[3] / "shared" / "data")) / "peers"
HEADER = "case,agent,x,y,goal_x,goal_y,pref_speed,radius\n"
ROWS = """\
4,1,0.0,3.0,0.5,-3.0,0.8,0.4
4,0,-3.0,0.0,3.0,0.0,1.25,0.5
2,0,1.0,1.0,2.0,2.0,1.0,0.3
"""


def read(folder: Path, text: str) -> list[Case]:
    """The cases of a file of this content."""
    path = folder / "cases.csv"
    path.write_text(text)
    return read_cases(path)


def test_cases_and_robots_are_ordered_by_their_numbers(tmp_path: Path) -> None:
    two, four = read(tmp_path, HEADER + ROWS + "\n")
    assert (two.number, four.number) == (2, 4)
    assert (len(two.radii), len(four.radii)) == (1, 2)
    assert four.starts.tolist() == [[-3.0, 0.0], [0.0, 3.0]]
    assert four.goals.tolist() == [[3.0, 0.0], [0.5, -3.0]]
    assert four.speeds.tolist() == [1.25, 0.8]
    assert four.radii.tolist() == [0.5, 0.4]


def test_columns_may_come_in_any_order(tmp_path: Path) -> None:
    rows = [line.split(",") for line in (HEADER + ROWS).splitlines()]
    turned = "\n".join(",".join(reversed(row)) for row in rows)
    for case, other in zip(read(tmp_path, HEADER + ROWS), read(tmp_path, turned), strict=True):
        assert all(np.array_equal(a, b) for a, b in zip(case, other, strict=True))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("case,agent,x,y\n", r"cases\.csv:1: expected a header with case,agent,x,.*, found 'case,agent,x,y'"),
        (HEADER, r"cases\.csv: expected rows, found none"),
        (HEADER + ROWS.replace("0.8", "0"), r"cases\.csv:2: pref_speed: expected a number above 0, found 0"),
        (HEADER + ROWS.replace("0.3", "-0.3"), r"cases\.csv:4: radius: expected a number above 0, found -0\.3"),
        (HEADER + ROWS.replace("4,1,", "4.5,1,"), r"cases\.csv:2: case: expected a whole number, found '4\.5'"),
        (HEADER + ROWS.replace("-3.0,0.8", "left,0.8"), r"cases\.csv:2: goal_y: expected a number, found 'left'"),
        (
            HEADER + ROWS + ROWS[-28:],
            r"cases\.csv:5: agent: expected each agent once in a case, found 0 again in case 2",
        ),
    ],
)
def test_what_does_not_fit_is_refused(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InvalidFile, match=message):
        read(tmp_path, text)


def test_a_scenario_is_the_case(tmp_path: Path) -> None:
    case = read(tmp_path, HEADER + ROWS)[1]
    scenario = cadrl(case, 3.0)
    for k, robot in enumerate(scenario.robots):
        assert robot.shape.radius == case.radii[k]
        assert (robot.limits.max_speed, robot.limits.max_acceleration) == (case.speeds[k], 3.0)
        assert np.array_equal(robot.state.position, case.starts[k])
        assert not np.any(robot.state.velocity)
        assert np.array_equal(robot.goal.position(0.0), case.goals[k])
        assert (robot.goal.tolerance, robot.goal.stop) == (0.2, True)
    # 6.02 m at 0.8 m/s take longer than 6 m at 1.25 m/s.
    assert scenario.duration == pytest.approx(8.0 * np.hypot(0.5, 6.0) / 0.8, abs=0.1)
    assert dict(scenario.parameters) == {"case": 4.0, "max_acceleration": 3.0}
    result = metrics.summary(simulate(scenario, METHODS["nao_shared"]))
    assert (result["arrived"], result["collisions"]) == (2, 0)


@pytest.mark.parametrize("robots", [2, 3])
def test_the_suites_of_the_project(robots: int) -> None:
    """Five hundred cases each, of that many robots, none on another at the start or at the goals."""
    path = PEERS / f"cadrl_{robots}_agents_500_cases.csv"
    if not path.is_file():
        pytest.skip(f"{path.name} is not here: it is no part of the project")
    cases = read_cases(path)
    assert [case.number for case in cases] == list(range(500))
    for case in cases:
        assert case.starts.shape == case.goals.shape == (robots, 2)
        scenario = cadrl(case)
        goals = np.linalg.norm(case.goals[:, None] - case.goals, axis=2) - case.radii[:, None] - case.radii
        assert np.all(goals[np.triu_indices(robots, 1)] >= 0.0)
        assert scenario.duration > 8.0
