"""The paper's figures and claims: all of them run, their numbers are right where the answer is known."""

import json
import re
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from slalom import METHODS, Circular, ControlObstacle, Disc, Obstacle, ObstacleWindow, State, Stationary, Velocity
from slalom.choice.selection import select
from slalom.cli import BAD_INPUT, DONE, call
from slalom.forecast.forecast import AtConstantAcceleration, AtConstantVelocity
from slalom.model.limits import admissible_ball
from slalom.paper import TITLES, controller, definitions, entries, findings, oscillation, road, roundabout
from slalom.paper.controller import RIM_RADIUS, CarLanes, Rules, decide, hits, latest_collision, run
from slalom.paper.entries import ENTRIES, page
from slalom.sim.gallery import build

pytestmark = pytest.mark.paper
DOCS = Path(__file__).parents[2] / "docs"
START = State((-RIM_RADIUS, 0.0), (5.0, 0.0))
GOAL = np.array([RIM_RADIUS, 0.0])
LONE = Obstacle(Disc(1.0), Circular((0.0, 0.0), 12.0, 1e-9, phase=np.pi))
"""A car that stands on the robot's straight way, for all that matters."""


def nothing(share: float) -> None:
    """Progress without an effect."""


# Everything runs.


@pytest.mark.parametrize("name", ENTRIES)
def test_every_entry_leaves_its_file_and_the_page(name: str, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    tokens = ["reproduce", name, "--quick", "--seeds", "2", "--jobs", "1", "--out", str(tmp_path / "new"), "--json"]
    assert call(tokens) == DONE
    said = json.loads(capsys.readouterr().out)
    entry = ENTRIES[name]
    kinds = [*(["svg"] if entry.draw else ["json"]), *(["svg"] if entry.plot else [])]
    files = [tmp_path / "new" / f"{name}.{kind}" for kind in kinds]
    assert said["entries"] == [name]
    assert said["files"] == [*(str(file) for file in files), str(tmp_path / "new" / "paper.md")]
    text = (tmp_path / "new" / "paper.md").read_text()
    for file in files:
        if file.suffix == ".svg":
            assert ElementTree.parse(file).getroot().tag.endswith("svg")
            assert file.stat().st_size < 2e6
        else:
            assert json.loads(file.read_text())
        assert f"({file.name})" in text
    assert entry.title in text
    assert "--quick" in text


@pytest.mark.parametrize("name", [name for name, entry in ENTRIES.items() if entry.draw])
def test_labels_hide_neither_each_other_nor_markers(name: str) -> None:
    """Such as v_B, and the marker of the exit. Labels outside the panels are not drawn."""
    draw = ENTRIES[name].draw
    assert draw is not None
    figure = draw()
    renderer = FigureCanvasAgg(figure).get_renderer()
    figure.canvas.draw()
    count = 0
    for ax in figure.axes:
        inside = [text for text in ax.texts if text.get_text() and ax.contains_point(ax.transData.transform(text.xy))]
        boxes = {text: text.get_window_extent(renderer) for text in inside}
        marked = [line.get_xydata() for line in ax.lines if line.get_marker() not in (None, "None", "", " ")]
        points = ax.transData.transform(np.concatenate([np.empty((0, 2)), *marked]))
        for one, box in boxes.items():
            assert not [other.get_text() for other in boxes if other is not one and box.overlaps(boxes[other])], one
            assert not [point for point in points if box.contains(*point)], one
        count += len(boxes) + len(points)
    assert count > 0


def test_the_roundabouts_label_their_marks_within_the_limit() -> None:
    """Every marker has a label that does not cross the circle; one colour bar serves all panels; cars stay visible."""
    for draw, names in ((roundabout.roundabout_exit, ["preferred", "chosen"]), (roundabout.roundabout_crossing, [])):
        figure = draw()
        FigureCanvasAgg(figure)
        figure.canvas.draw()
        below = [ax for ax in figure.axes if ax.get_xlabel().startswith("$a_x$")]
        for ax in below:
            assert set(names or ["chosen"]) == {text.get_text() for text in ax.texts}
            for text in ax.texts:
                corners = ax.transData.inverted().transform(Text.get_window_extent(text).corners())
                assert np.linalg.norm(corners, axis=1).max() < roundabout.LIMIT
        bars = [ax for ax in figure.findobj(Axes) if ax.get_ylabel() == "time to collision [s]"]
        assert len(bars) == 1
        for ax in figure.axes:
            path = [line for line in ax.lines if line.get_gid() == "manoeuvre-path"]
            cars = [patch for patch in ax.patches if str(patch.get_gid()).startswith("obstacle")]
            assert all(line.get_zorder() < car.get_zorder() for line in path for car in cars)


def test_a_figure_is_the_same_file_every_time(tmp_path: Path) -> None:
    for folder in ("a", "b"):
        entries.make(["curved_road"], tmp_path / folder, entries.Effort(), progress=nothing)
    assert (tmp_path / "a" / "curved_road.svg").read_bytes() == (tmp_path / "b" / "curved_road.svg").read_bytes()


def test_progress_grows_to_the_whole(tmp_path: Path) -> None:
    shares: list[float] = []
    entries.make(["cone", "curves", "temporal_element"], tmp_path, entries.Effort(1, 1, True), progress=shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert len(shares) > 5


def test_unknown_names_are_refused_with_the_known_ones(capsys: pytest.CaptureFixture, tmp_path: Path) -> None:
    assert call(["reproduce", "figure_7", "--out", str(tmp_path / "x")]) == BAD_INPUT
    said = capsys.readouterr().err
    assert all(name in said for name in ENTRIES)
    assert "'figure_7'" in said
    assert not (tmp_path / "x").exists()


def test_a_folder_that_is_a_file_is_refused(capsys: pytest.CaptureFixture, tmp_path: Path) -> None:
    (tmp_path / "x").write_text("")
    assert call(["reproduce", "cone", "--quick", "--out", str(tmp_path / "x")]) == BAD_INPUT
    assert "expected a file that can be written" in capsys.readouterr().err


def test_the_page_links_to_the_folder_of_the_files(tmp_path: Path) -> None:
    at, out = tmp_path / "docs" / "paper.md", tmp_path / "docs" / "images" / "paper"
    at.parent.mkdir()
    entries.make(["cone", "temporal_element"], out, entries.Effort(1, 1, True), page_path=at, progress=nothing)
    for target in re.findall(r"\]\(([^)#]+)\)", at.read_text()):
        assert (at.parent / target).exists(), target


def stored(name: str) -> dict:
    """The result of a claim that the page shows."""
    return json.loads((DOCS / "images" / "paper" / f"{name}.json").read_text())


def holds(rows: list[dict], made: dict) -> bool:
    """Whether one of the rows has the same values, numbers to rounding."""
    return any(
        all(pytest.approx(made[name], rel=1e-6) == row[name] for name in made if isinstance(row[name], float | int))
        and all(made[name] == row[name] for name in made if not isinstance(row[name], float | int))
        for row in rows
    )


def test_the_results_of_the_page_are_those_of_this_version() -> None:
    """One row of each claim whose runs are simulated, made again: the numbers of the page."""
    kept = stored("oscillation")
    cell = next(one for one in oscillation.cells() if one[:3] == ("nao", "both", 4))
    runs = [oscillation.run_metrics(cell, seed, kept["duration"]) for seed in range(kept["seeds"])]
    assert holds(kept["rows"], oscillation.aggregate(cell, runs))

    kept, setting = stored("smoothness"), roundabout.SETTINGS[-1]
    runs = [roundabout.run_metrics(setting, seed, kept["duration"]) for seed in range(kept["seeds"])]
    means = {name: float(np.mean([run[name] for run in runs])) for name in roundabout.NAMES[2:]}
    assert holds(kept["rows"], {**setting._asdict(), **means})

    kept, quick = stored("sweep"), controller.cells()[-1]
    assert holds(kept["rows"], controller.aggregate(quick, controller.metrics_of_seeds(quick, range(kept["seeds"]))))


def test_titles_are_those_of_the_entries() -> None:
    assert list(TITLES) == list(ENTRIES)
    assert all((entry.draw is None) != (entry.measure is None) for entry in ENTRIES.values())
    assert all(entry.measure is not None for entry in ENTRIES.values() if entry.plot is not None)


def test_the_committed_page_is_that_of_the_committed_numbers() -> None:
    """Every entry is on it, and the numbers in its text are those of the files beside it."""
    folder = DOCS / "images" / "paper"
    text = (DOCS / "paper.md").read_text()
    assert re.findall(r": `(\w+)`$", text, re.M) == list(ENTRIES)
    assert text == page(list(ENTRIES), entries.read_results(folder), False, "images/paper/")
    assert all((folder / f"{name}.svg").exists() for name, entry in ENTRIES.items() if entry.draw or entry.plot)
    assert entries.read_results(folder)["sweep"]["seeds"] == 100


# The figures show what their captions say.


def test_velocities_in_the_figures_are_inside_and_outside() -> None:
    v = definitions.ROBOT_VELOCITY
    kept = AtConstantVelocity()(definitions.CIRCLE, 0.0)
    assert definitions.obstacle_of(definitions.LINE, Velocity()).contains(v)
    assert definitions.obstacle_of(kept, Velocity()).contains(v)
    assert not definitions.obstacle_of(definitions.CIRCLE, Velocity()).contains(v)
    state = build("curved_road").robot.state
    flagged = [
        road.control_obstacle_of(build("curved_road"), method).times_to_collision(state.velocity)
        for method in ("vo", "nlvo")
    ]
    assert np.isfinite(flagged[0]).tolist() == [True, False, False]
    assert not np.isfinite(flagged[1]).any()


def test_the_robot_that_follows_its_lane_is_in_the_ao_only() -> None:
    acceleration = definitions.LANE.acceleration(0.0)
    assert definitions.LANE.velocity(0.0) == pytest.approx(definitions.CAR_ROBOT)
    for trajectory, inside in ((AtConstantAcceleration()(definitions.CAR, 0.0), True), (definitions.CAR, False)):
        horizon, radius = definitions.CAR_HORIZON, definitions.CAR_RADIUS
        blocked = definitions.obstacle_of(trajectory, controller.RESPONSE, horizon, definitions.CAR_ROBOT, radius)
        assert bool(blocked.contains(acceleration)) == inside


def test_the_drawn_crossing_is_clear_and_the_drawn_exit_hits_no_car() -> None:
    scenario = build("roundabout_crossing", seed=roundabout.CROSSING_SEED)
    chosen = roundabout.one_acceleration(scenario)
    assert roundabout.clearances(scenario.obstacles, chosen[None])[0] >= roundabout.DRAWN_CLEARANCE
    assert roundabout.crossing(chosen[None]).all()
    goal = np.array([0.0, RIM_RADIUS])
    rules = Rules("nao", roundabout.REPLAN, keep=False, horizon=roundabout.HORIZON)
    done = run(rules, build("roundabout_exit", seed=roundabout.EXIT_SEED).obstacles, START, goal)
    assert done.has_left
    assert hits(done.recording)[0] == 0
    assert np.linalg.norm(done.recording.positions[-1, 0] - goal) < 3.0


@pytest.mark.parametrize("method", ["ao", "nao"])
@pytest.mark.parametrize("now", [0.0, 1.7])
def test_fleet_sees_what_forecasts_see(method: str, now: float) -> None:
    """Least clearances among all cars are those of the forecasts' own trajectories."""
    cars = build("roundabout_crossing", {"speed": 1.5}, seed=4).obstacles
    forecast = METHODS[method].forecast
    seen = ObstacleWindow([replace(car, trajectory=forecast(car.trajectory, now)) for car in cars], now, 6.0)
    fleet = CarLanes(cars, known=method == "nao").traffic(now, 6.0, START.position)
    controls = np.random.default_rng(1).uniform(-4, 4, (50, 2))
    one, two = (ControlObstacle(controller.RESPONSE, START, t, Disc(1.0)).clearances(controls) for t in (seen, fleet))
    assert np.abs(one - two).max() < 1e-5


def test_fleet_takes_the_nearest() -> None:
    cars = build("roundabout_crossing", seed=0).obstacles
    position = np.array([3.0, -11.0])
    seen = CarLanes(cars, known=True).traffic(2.0, 3.0, position, 5)
    distances = sorted(float(np.linalg.norm(car.trajectory.position(2.0) - position)) for car in cars)
    found = sorted(float(np.linalg.norm(car.trajectory.position(2.0) - position)) for car in seen.obstacles)
    assert found == pytest.approx(distances[:5])


def test_alone_the_robot_drives_straight_to_the_other_side() -> None:
    done = run(Rules("nao", 0.5, keep=False), [], START, GOAL)
    record = done.recording
    assert set(done.statuses) == {"CLEAR"}
    assert np.all(record.positions[:, 0, 1] == 0.0)
    assert record.positions[-1, 0, 0] > RIM_RADIUS
    assert record.velocities[-1, 0, 0] == pytest.approx(controller.CRUISE_SPEED, rel=0.02)
    assert hits(record) == (0, np.inf)


def test_a_free_acceleration_is_kept_and_another_is_not() -> None:
    """The car stands on the straight way, so that straight on is not free and a turn is."""
    traffic = CarLanes([LONE], known=True).traffic(0.0, 6.0, START.position)
    preferred = np.array([1.0, 0.0])
    turn, straight = np.array([0.5, 1.5]), np.array([0.5, 0.0])
    for keep, present, expected in (
        (True, turn, "KEPT"),
        (False, turn, "CONSTRAINED"),
        (True, straight, "CONSTRAINED"),
    ):
        chosen, status = decide(START, traffic, Rules("nao", 0.5, keep=keep), preferred, present)
        assert status == expected
        assert (chosen is turn) == (status == "KEPT")


def test_hits_are_counted_by_car_in_continuous_time() -> None:
    """Straight through a standing car, at decisions so rare that no state at one of them is near it."""
    alone = run(Rules("nao", 4.0, keep=False), [], START, GOAL).recording
    count, clearance = hits(replace(alone, obstacles=(LONE, Obstacle(Disc(1.0), Stationary((0.0, 3.0))))))
    assert count == 1
    assert clearance == pytest.approx(-2.0, abs=1e-3)
    beside = hits(replace(alone, obstacles=(Obstacle(Disc(1.0), Stationary((0.0, 3.0))),)))
    assert beside == (0, pytest.approx(1.0, abs=1e-3))


def test_the_latest_collision_is_not_beaten_by_samples() -> None:
    """A wall of cars that no acceleration passes or escapes."""
    wall = [Obstacle(Disc(1.0), Circular((0.0, 0.0), 24.0, 1e-9, phase=np.pi + 0.08 * k)) for k in range(-2, 3)]
    state = State((-28.0, 0.3), (12.0, 0.0))
    blocked = ControlObstacle(controller.RESPONSE, state, ObstacleWindow(wall, 0.0, 6.0), Disc(1.0))
    ball = admissible_ball((0.0, 0.0), 2.0)
    assert not select((0.0, 0.0), ball, blocked).safe
    chosen = latest_collision(np.zeros(2), ball, blocked)
    samples = np.random.default_rng(0).normal(size=(500, 2))
    samples *= 2.0 / np.linalg.norm(samples, axis=1, keepdims=True)
    found = float(blocked.time_to_collision(chosen))
    assert found >= float(blocked.time_to_collision(samples).max()) - 0.02
    assert bool(ball.contains(chosen))


def test_jobs_do_not_change_the_sweep() -> None:
    rows = controller.cells(quick=True)[:2]
    one, two = (controller.table(rows, 12, jobs, nothing) for jobs in (1, 2))
    assert json.dumps(one) == json.dumps(two)
    assert [row["runs"] for row in one] == [12, 12]


def test_the_sweep_has_every_row_of_the_issue_once() -> None:
    rows = controller.cells()
    assert len(rows) == len(set(rows)) == 2 * 5 * 2 * 2 * 2


def test_rows_are_aggregated() -> None:
    """Two runs by hand: one leaves on the far side, the other hits two cars and stays."""
    run_of = {"mean_acceleration": 1.0, "mean_jerk": 2.0}
    runs = [
        run_of
        | {"hits": 0, "clearance": 0.5, "adjustments": 1, "decisions": 10, "delayed": 0}
        | {"time": 5.0, "out": True, "far_side": True},
        run_of
        | {"hits": 2, "clearance": -1.0, "adjustments": 4, "decisions": 30, "delayed": 10}
        | {"time": 15.0, "out": False, "far_side": False},
    ]
    row = controller.aggregate(controller.cells()[0], runs)
    assert (row["runs"], row["runs_with_collision"], row["cars_hit"]) == (2, 1, 2)
    assert (row["left_the_ring"], row["far_side"], row["time"]) == (1, 1, 5.0)
    assert (row["adjustments"], row["adjustments_per_second"]) == (2.5, 0.25)
    assert (row["without_free_control"], row["least_clearance"]) == (0.25, -1.0)


@pytest.mark.parametrize(
    ("acceleration", "crosses"),
    [((0.0, 0.0), True), ((2.0, 0.5), True), ((-4.0, 0.0), False), ((0.0, 4.0), False), ((0.0, -4.0), False)],
)
def test_which_accelerations_cross(acceleration: tuple[float, float], crosses: bool) -> None:
    """Straight on and nearly so; not back, not to the sides."""
    assert roundabout.crossing(np.array([acceleration])).tolist() == [crosses]


def test_crossings_past_a_standing_car() -> None:
    """Straight on hits it; a bend clears it by what geometry says."""
    found = roundabout.clearances([LONE], np.array([[0.0, 0.0], [0.0, 4.0]]))
    t = np.linspace(0, 12, 200001)
    away = np.column_stack([-RIM_RADIUS + 5.0 * t, 2.0 * t * t]) - (-12.0, 0.0)
    assert found[0] == pytest.approx(-2.0, abs=1e-5)
    assert found[1] == pytest.approx(np.linalg.norm(away, axis=1).min() - 2.0, abs=1e-5)


def test_jobs_do_not_change_the_crossings() -> None:
    one, two = (roundabout.measure_crossing(3, jobs, True, nothing) for jobs in (1, 2))
    assert json.dumps(one) == json.dumps(two)


def test_alarms_on_a_road_known_by_hand() -> None:
    """A car right behind on the inner lane points at the robot's way; one on the far side of the circle does not."""
    question = road.QUESTIONS["velocity"]
    cars = road.cars(20.0, 8.0, -1.0, [-8.0, 60.0], [1.3])
    found = road.alarms(question, 20.0, 8.0, cars, 3.0)
    for k, car in enumerate(cars):
        t = np.linspace(0.0, 3.0, 3001)[:, None]
        own = np.array([20.0, 0.0]) + t * (0.0, 8.0)
        straight = car.trajectory.position(0.0) + t * car.trajectory.velocity(0.0)
        along = car.trajectory.position(t[:, 0])
        for forecast, path in enumerate((straight, along)):
            assert bool(found[forecast, k]) == bool((np.linalg.norm(path - own, axis=1) < 2.5).any())
    assert road.counted(np.array([[True, True, False], [True, False, True]])) == {
        "cases": 3,
        "first": 2,
        "second": 2,
        "only_first": 1,
        "only_second": 1,
    }


def test_cars_that_follow_their_lanes_do_not_collide() -> None:
    """So that every alarm is a false one."""
    least = road.LANE - road.ROBOT_DISC.bounding_radius - road.CAR.bounding_radius
    assert least > 0.0


def test_the_cone_by_hand_and_the_claim() -> None:
    apex, position = np.array([1.0, 1.0]), np.array([2.0, 0.0])
    points = np.array([[3.0, 1.0], [0.0, 1.0], [2.0, 1.5], [2.0, 1.7]])
    # Half-angle 30 degrees: at 1 ahead of the apex it is tan 30 = 0.577 wide.
    assert definitions.in_cone(points, position, 1.0, apex).tolist() == [True, False, True, False]
    rows = definitions.measure_cone(quick=True)["rows"]
    assert rows[0]["judged_differently"] == 0
    assert min(row["judged_differently"] for row in rows[1:]) > 0


@pytest.fixture(scope="module")
def swaps() -> dict:
    """A coarse study."""
    return oscillation.measure(1, 1, True, nothing)


def test_the_study_of_oscillations_has_every_row_once() -> None:
    cells = oscillation.cells()
    methods, selections = oscillation.NAMES, oscillation.SELECTIONS
    assert len(cells) == len(set(cells)) == len(methods) * (4 * len(selections) - 1)
    assert {cell.robots for cell in cells} == {2, 4, 8, 20}
    assert not any(METHODS[cell.method].shared for cell in cells)


@pytest.mark.parametrize("selection", oscillation.SELECTIONS)
def test_selections_are_what_they_are_called(selection: str) -> None:
    """Nothing but patience and guidance differs from the gallery; both are on by default."""
    cell = oscillation.Cell("nao", selection, 2)
    made = oscillation.run(cell, 3, 1.0).parameters
    default = build("circle")
    given = {"patience": made.get("patience", default.patience), "guided": made.get("guided", default.guided)}
    assert (given["patience"] > 0.0) == (selection in ("kept", "both"))
    assert (given["guided"] > 0.0) == (selection in ("agreed", "both"))
    assert set(made) - set(default.parameters) <= {"duration", "patience", "guided"}


def test_jobs_do_not_change_the_study_of_oscillations(swaps: dict) -> None:
    assert json.dumps(oscillation.measure(1, 2, True, nothing)) == json.dumps(swaps)


def test_runs_of_the_study_are_aggregated() -> None:
    """Two runs of two robots by hand, of which one does not arrive."""
    cell = oscillation.Cell("vo", "greedy", 2)
    each = {"pairs_that_pass": 1, "pairs_that_flip": 1, "changed": 0.5}
    runs = [
        each | {"side_flips": 2.0, "heading_variation": 1.0, "collisions": 0, "arrived": 2, "time": 21.0},
        each | {"side_flips": 4.0, "heading_variation": 3.0, "collisions": 1, "arrived": 1, "time": 100.0},
    ]
    row = oscillation.aggregate(cell, runs)
    assert (row["side_flips"], row["heading_variation"], row["changed"]) == (3.0, 2.0, 0.5)
    assert (row["runs"], row["arrived"], row["collisions"], row["time"]) == (2, 3, 1, 21.0)
    assert (row["pairs_that_pass"], row["pairs_that_flip"]) == (2, 2)
    assert oscillation.aggregate(cell, runs[1:])["time"] is None


def test_the_verdict_follows_the_numbers(swaps: dict) -> None:
    """With flips that stay by default, the claim does not hold, or for few robots only."""

    def verdict(flips: dict[str, float], of_many: dict[str, float] | None = None) -> str:
        rows = [row | {"side_flips": flips[row["selection"]]} for row in swaps["rows"]]
        if of_many:
            rows += [row | {"robots": swaps["many"], "side_flips": of_many[row["selection"]]} for row in swaps["rows"]]
        return " ".join(" ".join(findings.oscillation(swaps | {"rows": rows})).split())

    assert "The claim holds" in verdict({"greedy": 8.0, "both": 0.5})
    assert "leaves 6 % of the side flips" in verdict({"greedy": 8.0, "both": 0.5})
    assert "The claim does not hold. " in verdict({"greedy": 8.0, "both": 4.0})
    assert "The claim holds. " in verdict({"greedy": 8.0, "both": 0.0}, {"greedy": 8.0, "both": 0.5})
    few = verdict({"greedy": 8.0, "both": 0.0}, {"greedy": 8.0, "both": 4.0})
    assert f"The claim holds with fewer than {swaps['many']} robots. " in few
    assert f"variation, with {swaps['many']} robots 50 % and " in few


def test_the_conclusion_on_smoothness_follows_the_numbers() -> None:
    """Each effect is compared at the same interval: that of the control with the same forecast, and the reverse."""

    def conclusion(**jerk: float) -> str:
        rows = [
            {
                "method": name,
                "replan": 0.1,
                "mean_jerk": value,
                "mean_acceleration": 2.0 if name in ("ao", "nao") else 1.0,
            }
            for name, value in jerk.items()
        ]
        return findings._effects(rows)

    lower = conclusion(vo=10.0, nlvo=4.0, ao=8.0, nao=3.0)
    assert "mean jerk is lower if accelerations are chosen. With the same forecast, AO and NAO have 75 to 80 %" in lower
    assert "NLVO and NAO have 38 to 40 %" in lower
    assert "Known trajectories have the larger effect." in lower
    assert "**Correction:** the mean acceleration is not always lower. AO and NAO have 200 to 200 %" in lower
    higher = conclusion(vo=10.0, nlvo=4.0, ao=3.0, nao=5.0)
    assert "**Correction:** the mean jerk is not always lower if accelerations are chosen." in higher
    assert "larger effect" not in higher
    assert conclusion(nao=1.0) == ""


def test_the_figure_of_the_study_shows_its_numbers(swaps: dict) -> None:
    """A line for each selection in each plot, through the numbers of its rows."""
    drawn = oscillation.figure(swaps)
    for measure, words in oscillation.MEASURES:
        plots = [ax for ax in drawn.axes if any(line.get_gid() == f"{measure}-greedy" for line in ax.lines)]
        assert len(plots) == 2
        assert plots[0].get_ylabel() == words
        for name, ax in zip(("vo", "nao"), plots):
            for line in ax.lines:
                rows = [
                    r for r in swaps["rows"] if (r["method"], f"{measure}-{r['selection']}") == (name, line.get_gid())
                ]
                assert line.get_xdata().tolist() == [row["robots"] for row in rows]
                assert line.get_ydata().tolist() == [row[measure] for row in rows]
