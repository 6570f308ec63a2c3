"""Table of the reproduced figures and the measured claims, and production of them and their page."""

import json
from collections.abc import Callable, Mapping, Sequence
from os.path import relpath
from pathlib import Path
from typing import Any, Final, NamedTuple

from matplotlib.figure import Figure

from slalom import view
from slalom.base.checks import known
from slalom.base.errors import InvalidInput
from slalom.base.writing import write_file
from slalom.paper import TITLES, controller, definitions, oscillation, road, roundabout
from slalom.paper.findings import CLAIMS, Result, paragraph
from slalom.view.style import FORMATS

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
        definitions.moving_obstacle,
        "A robot A, and an obstacle B that moves along a known curve c(t).",
        "B now (grey) and at later times, coloured by time. B is grown by the robot's radius, so the robot is a "
        "point. Arrows are displacements in 1 s at the present velocities.",
    ),
    _figure(
        "linear_vo",
        definitions.linear_vo,
        "B keeps its velocity. The velocities of A that lead to a collision form a cone with its apex at the "
        "velocity of B. The union of the temporal elements fills the cone.",
        "Left: workspace. Right: velocities. The VO of the next 10 s is grey, with some of its elements coloured by "
        "time. The dashed lines bound the part that a longer horizon would add, up to the apex.",
    ),
    _figure(
        "temporal_element",
        definitions.temporal_element,
        "The velocities that lead into B at one time t are a copy of B(t), scaled by 1/t about A. Erratum 2: the "
        "paper prints the inverse ratio.",
        "Obstacle at 2 s and at 6 s, and its two elements between the same tangents from A.",
    ),
    _figure(
        "nlvo_circular",
        definitions.nlvo_circular,
        "On a curve the union of the elements is a warped cone. Its border consists of velocities that graze the "
        "obstacle, not of the tangents from A.",
        "Obstacle on a circle, and its NLVO of the next 10 s with some of its elements.",
    ),
    _figure(
        "vo_beside_nlvo",
        definitions.vo_beside_nlvo,
        "VO and NLVO of the same obstacle; the VO assumes that the obstacle keeps its velocity.",
        "Obstacle of the preceding figure. The robot's velocity is in the VO, which predicts a collision after 3 s. "
        "It is outside the NLVO, because the obstacle turns away.",
    ),
    _figure(
        "ao_nao",
        definitions.ao_nao,
        "Accelerations that lead to a collision with an obstacle that keeps its acceleration (AO) or follows a known "
        "path (NAO). They are unions of elements whose size decreases with the square of time.",
        "Car on the inner lane of a curve (16 m, 9.2 m/s) beside the robot's lane (20 m, 8 m/s; dashed). The AO "
        "extrapolates the present acceleration to a parabola that enters the robot's lane (dashed blue); the NAO "
        "uses the lane. The acceleration that keeps the robot on its own lane is in the AO and not in the NAO.",
    ),
    _figure(
        "ao_cone",
        definitions.ao_cone,
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
        lambda effort, advance: road.measure_curves(effort.quick, advance),
        "VO flags the car in the middle lane, NLVO does not; AO flags a car on the inner lane of a curve, NAO does "
        "not.",
        "Robot and car follow neighbouring lanes without end and never collide, so every alarm is false. Is the "
        "robot's present velocity in the VO or NLVO, its present acceleration in the AO or NAO?",
        5.0,
    ),
    _claim(
        "crossing",
        lambda effort, advance: roundabout.measure_crossing(effort.seeds, effort.jobs, effort.quick, advance),
        "One acceleration chosen on the NAO map at the beginning crosses the roundabout without a collision.",
        "How often such an acceleration exists, and how often the first choice, if held, collides.",
        25.0,
    ),
    _claim(
        "sweep",
        lambda effort, advance: controller.measure_sweep(effort.seeds, effort.jobs, effort.quick, advance),
        "With NAO the roundabout is crossed without collisions. With AO the robot keeps adjusting its acceleration "
        "to avoid the nearest vehicles, and collides several times.",
        "The paper's controller: at every decision one constant acceleration, found exactly, outside the NAO or AO.",
        300.0,
    ),
    _claim(
        "smoothness",
        lambda effort, advance: roundabout.measure_smoothness(effort.full_runs, effort.jobs, effort.quick, advance),
        "AO and NAO account for the constraints of the robot's dynamics better than the NLVO can.",
        "Acceleration and jerk of slalom's navigator with each method in the same roundabout, all limited to 4 m/s² "
        "and 8 m/s. Is motion smoother if accelerations are chosen instead of velocities?",
        25.0,
    ),
    _claim(
        "cone",
        lambda effort, advance: definitions.measure_cone(effort.quick),
        "For zero relative velocity the AO is a straight cone.",
        "Random accelerations: are they in the AO, and in the cone?",
        1.0,
    ),
    _claim(
        "oscillation",
        lambda effort, advance: oscillation.measure(effort.fleet_runs, effort.jobs, effort.quick, advance),
        "Oscillations between robots come from inconsistent selection, not from velocity obstacles themselves.",
        "Robots that all use the same method swap positions on a circle, with the same obstacles and four ways of "
        "selection. How often do they change the passing side, the heading and the chosen manoeuvre?",
        20.0,
        oscillation.figure,
    ),
)

ENTRIES: Final[dict[str, Entry]] = {entry.name: entry for entry in (*_FIGURES, *_CLAIMS)}
"""Figures and claims by name."""


# Markdown page of the reproduction: every figure with its caption, every claim with its numbers.


_HEAD: Final = (
    "This page is for readers of the paper. It has all figures of the paper and all claims that can be measured, "
    "produced by one command:",
    "The paper (Stern and Shiller, *From NLVO to NAO*, arXiv:2506.06255v1, 2025) gives no radii, speeds, limits, "
    "intervals, horizons or counts for its examples. All parameters are choices of this project and are stated with "
    "each result. Seeds are 0, 1, 2 and so on. The same command gives the same numbers and figures for any number of "
    "processes. Symbols, and the errata by number, are defined on the theory page of the documentation "
    "(`docs/theory.md`).",
)
_QUICK: Final = "**Made with `--quick`: coarse grids and short runs, for tests only.**"


def page(names: Sequence[str], results: Mapping[str, Result], quick: bool, links: str) -> str:
    """Render the page for the entries of these names as Markdown.

    Args:
        results: results of the claims by name. quick: whether they are of a quick run.
        links: prefix of links to files.
    """
    suffixes = names_of(names)
    chosen = [ENTRIES[name] for name in suffixes]
    parts = ["# The paper, reproduced", paragraph(_HEAD[0]), "```\nslalom reproduce --out out/paper\n```"]
    parts += [paragraph(_HEAD[1])] + ([_QUICK] if quick else [])
    parts += ["## Contents", "\n".join(f"- [{entry.title}](#{entry.name}): `{entry.name}`" for entry in chosen)]
    if any(entry.draw for entry in chosen):
        parts.append("## Figures")
        parts += [text for entry in chosen if entry.draw for text in _drawn(entry, links, suffixes[entry.name])]
    if results:
        parts.append("## Claims")
        for entry in chosen:
            if entry.name in results:
                parts += [*_heading(entry), *([_picture(entry, links, suffixes[entry.name])] if entry.plot else [])]
                parts += CLAIMS[entry.name](results[entry.name])
                parts.append(f"All numbers: [{entry.name}.json]({links}{entry.name}.json).")
    return "\n\n".join(parts) + "\n"


def _heading(entry: Entry) -> list[str]:
    return [
        f'### <a id="{entry.name}"></a>{entry.title}',
        paragraph(f"*Paper:* {entry.paper}"),
        paragraph(f"*{'Shown' if entry.draw else 'Measured'}:* {entry.shown}"),
    ]


def _drawn(entry: Entry, links: str, suffix: str) -> list[str]:
    heading, *caption = _heading(entry)
    return [heading, _picture(entry, links, suffix), *caption]


def _picture(entry: Entry, links: str, suffix: str) -> str:
    # Browsers do not show a PDF as a picture.
    return f"{'' if suffix == '.pdf' else '!'}[{entry.title}]({links}{entry.name}{suffix})"


SUFFIX: Final = ".svg"
"""Format of figures that are named without one."""


def names_of(names: Sequence[str]) -> dict[str, str]:
    """Return the entries to produce, by default all, and the suffix of the figure of each: of NAME.pdf it is .pdf.

    Raises:
        InvalidInput: an unknown name, or another suffix than those of figures.
    """
    found = {}
    for given in names or ENTRIES:
        name, dot, kind = given.partition(".")
        known(name, "figure or claim", list(ENTRIES))
        found[name] = f".{kind}" if dot else SUFFIX
        if found[name] not in FORMATS:
            raise InvalidInput(f"figure or claim: expected {name}, or with {', '.join(FORMATS)}; found {given!r}")
    return found


def make(
    names: Sequence[str],
    out: Path,
    effort: Effort,
    *,
    page_path: Path | None = None,
    save: Callable[[Figure, Path], Path] = view.save,
    progress: Callable[[float], None],
    begin: Callable[[str], None] = lambda name: None,
) -> list[Path]:
    """Draw and measure the entries of these names.

    Args:
        names: as of `names_of`. out: folder for figures and for NAME.json of each claim, created if needed.
        page_path: file of the page, by default `out` / paper.md. save: writes a figure.
        progress: called with the share done. begin: called with the name of each entry before it is made.

    Returns:
        The written files, the page last.

    Raises:
        InvalidInput: an unknown name, no seed, or no job.
    """
    suffixes = names_of(names)
    chosen = [ENTRIES[name] for name in suffixes]
    if effort.seeds < 1 or effort.jobs == 0:
        raise InvalidInput(
            f"seeds, jobs: expected seeds of 1 or more and jobs not 0, found {effort.seeds} and {effort.jobs}"
        )
    out.mkdir(parents=True, exist_ok=True)
    total, done = sum(entry.weight for entry in chosen), 0.0
    written, results = [], {}
    for entry in chosen:
        begin(entry.name)

        def advance(share: float, done: float = done, weight: float = entry.weight) -> None:
            progress((done + share * weight) / total)

        if entry.draw is not None:
            written.append(save(entry.draw(), out / f"{entry.name}{suffixes[entry.name]}"))
        if entry.measure is not None:
            target = out / f"{entry.name}.json"
            text = json.dumps(entry.measure(effort, advance), indent=1, allow_nan=False)
            write_file(target, text + "\n")
            results[entry.name] = json.loads(text)
            written.append(target)
            if entry.plot is not None:
                written.append(save(entry.plot(results[entry.name]), out / f"{entry.name}{suffixes[entry.name]}"))
        done += entry.weight
        progress(done / total)
    paper = page_path or out / "paper.md"
    write_file(paper, page(names, results, effort.quick, links_from(paper, out)))
    return [*written, paper]


def links_from(paper: Path, out: Path) -> str:
    """Return the prefix of links from the page to files in `out`."""
    folder = relpath(out, paper.parent).replace("\\", "/")
    return "" if folder == "." else f"{folder}/"


def read_results(folder: Path) -> dict[str, Any]:
    """Read the results of an earlier run from a folder, by name."""
    return {name: json.loads(path.read_text()) for name in ENTRIES if (path := folder / f"{name}.json").exists()}
