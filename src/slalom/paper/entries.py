"""Table of the reproduced figures of the paper and the measured claims."""

from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple

from matplotlib.figure import Figure

from slalom.paper import (
    claims_crossing,
    claims_oscillation,
    claims_road,
    claims_shape,
    claims_smooth,
    obstacles,
    oscillation,
    road,
    roundabout,
    sweep,
)
from slalom.paper.titles import TITLES

Advance = Callable[[float], None]


class Effort(NamedTuple):
    """Amount of computation.

    Attributes:
        seeds: runs of each row of the sweep, and of the claim `crossing`.
        jobs: processes; -1 for one per core. The results do not depend on it.
        quick: coarse grids and short runs: for tests, not for publication.
    """

    seeds: int = 100
    jobs: int = 2
    quick: bool = False

    @property
    def full_runs(self) -> int:
        """Seeds for slalom's navigator, which has many decisions in a run: 20 of 100."""
        return max(1, self.seeds // 5)

    @property
    def fleet_runs(self) -> int:
        """Seeds for runs of several robots, each of which decides at every step with its own navigator: 3 of 100."""
        return max(1, self.seeds // 33)


class Entry(NamedTuple):
    """A figure, or a claim and its measurement.

    Attributes:
        name: name on the command line and of its file.
        title: heading.
        paper: description or claim of the paper.
        shown: caption of the figure, or description of the measurement.
        draw: function that draws the figure; None for a claim.
        measure: function that measures the claim; None for a figure.
        plot: function that draws the numbers of a claim; None without a figure.
        weight: approximate computing time [s], for progress bars.
    """

    name: str
    title: str
    paper: str
    shown: str
    draw: Callable[[], Figure] | None = None
    measure: Callable[[Effort, Advance], Mapping[str, Any]] | None = None
    weight: float = 1.0
    plot: Callable[[Mapping[str, Any]], Figure] | None = None


def _figure(name: str, draw: Callable[[], Figure], paper: str, shown: str, weight: float = 1.0) -> Entry:
    return Entry(name, TITLES[name], paper, shown, draw=draw, weight=weight)


def _claim(
    name: str,
    measure: Callable[[Effort, Advance], Mapping[str, Any]],
    paper: str,
    shown: str,
    weight: float,
    plot: Callable[[Mapping[str, Any]], Figure] | None = None,
) -> Entry:
    return Entry(name, TITLES[name], paper, shown, measure=measure, weight=weight, plot=plot)


_FIGURES: Final = (
    _figure(
        "moving_obstacle",
        obstacles.moving_obstacle,
        "A robot A, and an obstacle B that moves along a known curve c(t).",
        "B now (grey) and at later times, coloured by time. B is grown by the robot's radius, so the robot is a "
        "point. Arrows are displacements in 1 s at the present velocities.",
    ),
    _figure(
        "linear_vo",
        obstacles.linear_vo,
        "B keeps its velocity. The velocities of A that lead to a collision form a cone with its apex at the "
        "velocity of B. The union of the temporal elements fills the cone.",
        "Left: workspace. Right: velocities. The VO of the next 10 s is grey, with some of its elements coloured by "
        "time. The dashed lines bound the part that a longer horizon would add, up to the apex.",
    ),
    _figure(
        "temporal_element",
        obstacles.temporal_element,
        "The velocities that lead into B at one time t are a copy of B(t), scaled by 1/t about A. Erratum 2: the "
        "paper prints the inverse ratio.",
        "Obstacle at 2 s and at 6 s, and its two elements between the same tangents from A.",
    ),
    _figure(
        "nlvo_circular",
        obstacles.nlvo_circular,
        "On a curve the union of the elements is a warped cone. Its border consists of velocities that graze the "
        "obstacle, not of the tangents from A.",
        "Obstacle on a circle, and its NLVO of the next 10 s with some of its elements.",
    ),
    _figure(
        "vo_beside_nlvo",
        obstacles.vo_beside_nlvo,
        "VO and NLVO of the same obstacle; the VO assumes that the obstacle keeps its velocity.",
        "Obstacle of the preceding figure. The robot's velocity is in the VO, which predicts a collision after 3 s. "
        "It is outside the NLVO, because the obstacle turns away.",
    ),
    _figure(
        "ao_nao",
        obstacles.ao_nao,
        "Accelerations that lead to a collision with an obstacle that keeps its acceleration (AO) or follows a known "
        "path (NAO). They are unions of elements whose size decreases with the square of time.",
        "Car on the inner lane of a curve (16 m, 9.2 m/s) beside the robot's lane (20 m, 8 m/s; dashed). The AO "
        "extrapolates the present acceleration to a parabola that enters the robot's lane (dashed blue); the NAO "
        "uses the lane. The acceleration that keeps the robot on its own lane is in the AO and not in the NAO.",
    ),
    _figure(
        "ao_cone",
        obstacles.ao_cone,
        "The AO is a straight cone with its apex at the obstacle's acceleration if the relative velocity w is zero, "
        "and bent otherwise.",
        "The same obstacle (at 7 m, 4 m, radius 1.6 m) for w = 0 and two other relative velocities, horizon 8 s. "
        "The dashed lines extend the cone to its apex.",
    ),
    _figure(
        "curved_road",
        road.curved_road,
        "Four vehicles on a curved road. The VO of the car in the middle lane contains the robot's velocity, its "
        "NLVO does not.",
        "Scenario `curved_road`: the robot (vermilion, 8 m/s) in the outer lane of 38 m. Car 1 (10.4 m/s) is behind it "
        "in the middle lane, cars 2 and 3 are ahead. Circles are the cars after 1 s and 2 s. Right: velocities that "
        "collide within 6 s, coloured by time to collision, and the robot's maximum speed (circle). Numbers identify "
        "the cars.",
        2.0,
    ),
    _figure(
        "roundabout_crossing",
        roundabout.roundabout_crossing,
        "30 vehicles in three circular lanes, each lane with its own speed. One constant acceleration, chosen once "
        "on the NAO map, crosses all lanes; it stays outside the NAO to the end.",
        f"Seed {roundabout.CROSSING_SEED}, robot from the left at 5 m/s. Above: cars and robot now, and the chosen "
        "path with a dot per second. Below: accelerations that collide within 6 s, coloured by time to collision. "
        "The free set is white within the circle (4 m/s²); it contains the chosen acceleration at both times.",
        4.0,
    ),
    _figure(
        "roundabout_exit",
        roundabout.roundabout_exit,
        "The robot enters on the left and leaves at the top, without a collision. The acceleration is chosen again "
        "on the NAO map at given intervals.",
        f"Seed {roundabout.EXIT_SEED}, a decision every {roundabout.REPLAN:g} s. Each decision takes the free "
        "acceleration (chosen) nearest to the preferred one (hollow). That one turns the velocity to 8 m/s towards the "
        "exit within 1 s. Cars are coloured by the time at which the preferred acceleration would hit them. Thin: "
        "path so far; thick: path under the chosen acceleration, if held.",
        6.0,
    ),
)

_CLAIMS: Final = (
    _claim(
        "curves",
        lambda effort, advance: claims_road.measure_curves(effort.quick, advance),
        "VO flags the car in the middle lane, NLVO does not; AO flags a car on the inner lane of a curve, NAO does "
        "not.",
        "Robot and car follow neighbouring lanes without end and never collide, so every alarm is false. Is the "
        "robot's present velocity in the VO or NLVO, its present acceleration in the AO or NAO?",
        5.0,
    ),
    _claim(
        "crossing",
        lambda effort, advance: claims_crossing.measure_crossing(effort.seeds, effort.jobs, effort.quick, advance),
        "One acceleration chosen on the NAO map at the beginning crosses the roundabout without a collision.",
        "How often such an acceleration exists, and how often the first choice, if held, collides.",
        25.0,
    ),
    _claim(
        "sweep",
        lambda effort, advance: sweep.measure_sweep(effort.seeds, effort.jobs, effort.quick, advance),
        "With NAO the roundabout is crossed without collisions. With AO the robot keeps adjusting its acceleration "
        "to avoid the nearest vehicles, and collides several times.",
        "The paper's controller: at every decision one constant acceleration, found exactly, outside the NAO or AO.",
        300.0,
    ),
    _claim(
        "smoothness",
        lambda effort, advance: claims_smooth.measure_smoothness(effort.full_runs, effort.jobs, effort.quick, advance),
        "AO and NAO account for the constraints of the robot's dynamics better than the NLVO can.",
        "Acceleration and jerk of slalom's navigator with each method in the same roundabout, all limited to 4 m/s² "
        "and 8 m/s. Is motion smoother if accelerations are chosen instead of velocities?",
        25.0,
    ),
    _claim(
        "cone",
        lambda effort, advance: claims_shape.measure_cone(effort.quick),
        "For zero relative velocity the AO is a straight cone.",
        "Random accelerations: are they in the AO, and in the cone?",
        1.0,
    ),
    _claim(
        "oscillation",
        lambda effort, advance: claims_oscillation.measure(effort.fleet_runs, effort.jobs, effort.quick, advance),
        "Oscillations between robots come from inconsistent selection, not from velocity obstacles themselves.",
        "Robots that all use the same method swap positions on a circle, with the same obstacles and four ways of "
        "selection. How often do they change the passing side, the heading and the chosen manoeuvre?",
        20.0,
        oscillation.figure,
    ),
)

ENTRIES: Final[dict[str, Entry]] = {entry.name: entry for entry in (*_FIGURES, *_CLAIMS)}
"""Figures and claims by name."""
