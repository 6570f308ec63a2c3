"""The table of what is reproduced: every figure of the paper and every claim that is measured."""

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
    """How much is measured.

    Attributes:
        seeds: runs of each row of the sweep, and crossings that are looked at.
        jobs: processes; -1 for one per core. The results do not depend on it.
        quick: coarse grids and short runs: to see that it works, not to quote.
    """

    seeds: int = 300
    jobs: int = 2
    quick: bool = False

    @property
    def full_runs(self) -> int:
        """Seeds for slalom's own navigator, whose runs take about a hundred times as long."""
        return max(1, self.seeds // 15)

    @property
    def fleet_runs(self) -> int:
        """Seeds for several robots that decide at every step, each with its own navigator."""
        return max(1, self.seeds // 100)


class Entry(NamedTuple):
    """A figure, or a claim and how it is measured.

    Attributes:
        name: what the command line calls it, and its file.
        title: a heading.
        paper: what the paper describes, or claims.
        shown: what is drawn, or asked.
        draw: makes the figure. measure: makes the numbers. One of them is None.
        plot: makes a figure of the numbers of a claim, if it has one.
        weight: roughly its share of the time [s].
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
        "A robot A, and an obstacle B that moves along a curve c(t) which is known.",
        "B now (grey) and at later times, by colour. B has been grown by the robot's radius, so the robot is a point. "
        "Arrows are velocities, as far as they lead in 1 s.",
    ),
    _figure(
        "linear_vo",
        obstacles.linear_vo,
        "B keeps its velocity. The velocities of A that lead to a collision form a cone with its apex at the velocity "
        "of B; the union of the temporal elements fills it.",
        "Left the workspace. Right the velocities: grey the VO of the next 10 s with some of its elements, coloured by "
        "their time; dashed what a longer horizon would add, up to the apex.",
    ),
    _figure(
        "temporal_element",
        obstacles.temporal_element,
        "The velocities that lead into B at one time t are a copy of B(t), scaled by 1/t about A (erratum 2: the paper "
        "prints the inverse ratio).",
        "The obstacle at 2 s and at 6 s, and its two elements between the same tangents from A.",
    ),
    _figure(
        "nlvo_circular",
        obstacles.nlvo_circular,
        "On a curve the union of the elements is a warped cone; its border is where velocities graze the obstacle, not "
        "where the tangents from A touch it.",
        "The obstacle on a circle, and its NLVO of the next 10 s with some of its elements.",
    ),
    _figure(
        "vo_beside_nlvo",
        obstacles.vo_beside_nlvo,
        "The same obstacle as VO, which assumes that it keeps its velocity, and as NLVO.",
        "The obstacle of the figure before. The robot's velocity is in the VO, which foresees a meeting after 3 s; it "
        "is outside the NLVO, since the obstacle turns off.",
    ),
    _figure(
        "ao_nao",
        obstacles.ao_nao,
        "The accelerations that lead to a collision with an obstacle that keeps its acceleration (AO), or follows any "
        "known path (NAO): unions of elements that shrink with the square of time.",
        "A car on the inner lane of a curve (16 m, 9.2 m/s) beside the robot's lane (20 m, 8 m/s; dashed). From the "
        "acceleration of this moment the AO extrapolates a parabola that runs into the robot's lane (dashed blue); the "
        "NAO knows the lane. The acceleration with which the robot follows its own lane is in the AO and not in the "
        "NAO.",
    ),
    _figure(
        "ao_cone",
        obstacles.ao_cone,
        "The AO is a straight cone with its apex at the obstacle's acceleration if the relative velocity w is zero, "
        "and bent otherwise.",
        "The same obstacle (7 m, 4 m away, radius 1.6 m) for w = 0 and two others, over 8 s; dashed the cone up to its "
        "apex.",
    ),
    _figure(
        "curved_road",
        road.curved_road,
        "Four vehicles on a curved road. The VO of the car in the middle lane holds the robot's velocity, its NLVO "
        "does not.",
        "The scenario `curved_road`: the robot (vermilion, 8 m/s) in the outer lane of 38 m, car 1 (10.4 m/s) behind "
        "it in the middle lane, cars 2 and 3 ahead; circles are the cars after 1 s and 2 s. Right the velocities that "
        "collide within 6 s, by the time of it, and the robot's top speed (circle). Numbers name the cars.",
        2.0,
    ),
    _figure(
        "roundabout_crossing",
        roundabout.roundabout_crossing,
        "30 vehicles in three circular lanes, each lane with its own speed. One constant acceleration, chosen once on "
        "the NAO map, leads through all of them; it stays outside the NAO to the end.",
        f"Seed {roundabout.CROSSED}, robot from the left at 5 m/s. Above everybody now and the chosen path, a dot for "
        "each second; below the accelerations that collide within 6 s, by the time of it. White within the circle (4 "
        "m/s²) is the free set; the chosen acceleration is in it at both moments.",
        4.0,
    ),
    _figure(
        "roundabout_exit",
        roundabout.roundabout_exit,
        "The robot enters on the left and leaves at the top; the acceleration is chosen again on the NAO map at "
        "given intervals, and nothing is hit.",
        f"Seed {roundabout.LEFT}, a decision every {roundabout.REPLAN:g} s, each the free acceleration (filled) "
        "nearest to the one that turns the velocity to 8 m/s towards the exit within 1 s (hollow). Coloured cars are "
        "those that the latter would hit, by when; thin the way driven so far, thick the path of the acceleration if "
        "it were held.",
        6.0,
    ),
)

_CLAIMS: Final = (
    _claim(
        "curves",
        lambda effort, advance: claims_road.measure(effort.quick, advance),
        "VO flags the car in the middle lane, NLVO does not; AO flags a car on the inner lane of a curve, NAO does "
        "not.",
        "Robot and car follow neighbouring lanes for ever and never meet: every alarm is false. Is the robot's present "
        "velocity in the VO or NLVO, its present acceleration in the AO or NAO?",
        5.0,
    ),
    _claim(
        "crossing",
        lambda effort, advance: claims_crossing.measure(effort.seeds, effort.jobs, effort.quick, advance),
        "One acceleration chosen on the NAO map at the beginning crosses the roundabout without a collision.",
        "How often such an acceleration exists, and what becomes of the first choice if it is held.",
        40.0,
    ),
    _claim(
        "sweep",
        lambda effort, advance: sweep.measure(effort.seeds, effort.jobs, effort.quick, advance),
        "With NAO the roundabout is crossed without collisions; with AO the robot keeps adjusting its acceleration to "
        "avoid the nearest vehicles, and collides several times.",
        "The paper's own way of driving: at every decision one constant acceleration, found exactly, outside the NAO "
        "or AO.",
        300.0,
    ),
    _claim(
        "smoothness",
        lambda effort, advance: claims_smooth.measure(effort.full_runs, effort.jobs, effort.quick, advance),
        "AO and NAO account for the constraints of the robot's dynamics better than the NLVO can.",
        "Acceleration and jerk of slalom's own navigator with each method in the same roundabout, all limited to 4 "
        "m/s² and 8 m/s: is motion smoother if accelerations are chosen and not velocities?",
        60.0,
    ),
    _claim(
        "cone",
        lambda effort, advance: claims_shape.measure(effort.quick),
        "For zero relative velocity the AO is a straight cone.",
        "Random accelerations: are they in the AO, and are they in the cone?",
        1.0,
    ),
    _claim(
        "oscillation",
        lambda effort, advance: claims_oscillation.measure(effort.fleet_runs, effort.jobs, effort.quick, advance),
        "Oscillations between robots come from inconsistent selection, not from velocity obstacles themselves.",
        "Robots that all use the same method swap places on a circle. The same obstacles, four ways of selecting: do "
        "robots change the side on which they pass, their heading, their choice?",
        270.0,
        oscillation.figure,
    ),
)

ENTRIES: Final[dict[str, Entry]] = {entry.name: entry for entry in (*_FIGURES, *_CLAIMS)}
"""Every figure and claim by name."""
