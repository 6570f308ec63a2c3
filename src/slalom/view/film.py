"""Pictures of a recorded run over time: robots, obstacles, goals and trails in the workspace."""

from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from itertools import pairwise
from math import ceil
from pathlib import Path
from textwrap import fill
from types import ModuleType
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.figure import Figure
from matplotlib.path import Path as Outline
from matplotlib.transforms import Affine2D

from slalom.base.checks import Array, flag, not_negative, positive, whole
from slalom.base.errors import Extra, InvalidInput
from slalom.base.writing import replacing
from slalom.decision import Decision
from slalom.kernels.arrays import Flags
from slalom.model.path_goal import PathGoal
from slalom.model.shape import Part
from slalom.obstacle import Obstacle
from slalom.obstacle.pieces import outline_parts
from slalom.sim import Recording
from slalom.sim.explanation import reasons_of
from slalom.sim.run.recorded import decisions, recorded
from slalom.view.figure import decision as draw_decision
from slalom.view.style import FAINT, GOAL, INK, NEUTRAL, ROBOT, style
from slalom.view.workspace import TIMES, body, draw_goal_path, drawn_box, silhouette

Pixels = npt.NDArray[np.uint8]
"""A picture (height, width, 3) as red, green and blue."""

COLOURS: Final = (ROBOT, "#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Colours of robots in turn, distinct for the colour-blind (Okabe and Ito)."""
DOTS: Final = 100
"""[dots per inch] Resolution of the pictures; fonts have 7 to 8 points."""
LEFT = 50
RIGHT = 12
BASE = 40
TOP = 30
"""[pixel] Margins around a panel; the left one is larger where the numbers of its axis are longer."""
NARROWEST, WIDEST = 320, 3840
"""[pixel] Limits of the width of a picture."""
FLATTEST, TALLEST = 0.12, 1.0
"""[1] Limits of the height of a panel, as a share of its width. A flatter one has no space for its label."""
LABEL_GAP: Final = 4
"""[pixel] Least distance of a label from the border of the picture."""
SLOWEST, FASTEST = 0.1, 60.0
"""[1/s] Limits of the pictures in a second of video."""
MOST_PICTURES: Final = 1_000_000
"""[1] Most pictures of a video: more than four hours at 60 a second."""
CROWD: Final = 60
"""[1] Number of robots above which neither velocities nor goals are drawn."""
HEAD, EMPTY = 0.46, 0.24
"""[inch] Height of the sentences above a decision, and of what its figure has in their place."""
LINE: Final = 118
"""[1] Letters in a line of the sentences."""
GRID: Final = 121
"""[1] Points of the control space of a picture along each axis. Larger: finer bands of time, slower pictures."""
VIEWS: Final = {2: ((0, 1, "x [m]", "y [m]"),), 3: ((0, 1, "x [m]", "y [m]"), (0, 2, "x [m]", "z [m]"))}
"""Panels by dimension: their axes and labels. In space they are seen from above, and from the side."""


class Film(Sequence[Pixels]):
    """Pictures of a recorded run, one for each moment of a video; each is drawn on use.

    Between two steps robots move with the constant acceleration of the step.

    Args:
        width: [pixel], even; the height follows from the run. speed: seconds of the run in a second of video.
        fps: [1/s] pictures in a second of video. trail: [s] of the run behind each robot that is drawn as a line.

    Attributes:
        times: (k,) [s] of the pictures, absolute. width, height: [pixel]. axes: of matplotlib, one for each panel.

    Raises:
        InvalidInput: a run without a step, or a setting outside its limits.
    """

    def __init__(
        self, recording: Recording, *, width: int = 720, fps: float = 25.0, speed: float = 1.0, trail: float = 3.0
    ) -> None:
        if len(recording.shapes) == 1:
            recording = recording.only()
        if not len(recording.accelerations):
            raise InvalidInput(
                "recording: expected a run with at least one step, found a robot that starts at its goal"
            )
        if not NARROWEST <= whole(width, "width") <= WIDEST or width % 2:
            raise InvalidInput(f"width: expected an even number from {NARROWEST} to {WIDEST}, found {width}")
        if positive(fps, "fps") > FASTEST:
            raise InvalidInput(f"fps: expected at most {FASTEST:g}, found {fps:g}")
        if fps < SLOWEST:
            raise InvalidInput(f"fps: expected at least {SLOWEST:g}, found {fps:g}")
        self.trail = not_negative(trail, "trail")
        start, end = float(recording.times[0]), float(recording.times[-1])
        if (end - start) * fps > MOST_PICTURES * positive(speed, "speed"):
            least = (end - start) * fps / MOST_PICTURES
            raise InvalidInput(f"speed: expected at least {least:.2g} for {MOST_PICTURES} pictures, found {speed:g}")
        self.times = np.append(np.arange(start, end - 1e-9, positive(speed, "speed") / fps), end)
        self.recording, self.width = recording, width
        with style():
            self._lay_out()

    def _lay_out(self) -> None:
        """Draw the bodies at rest, once."""
        run = self.recording
        low, high = self._box()
        canvas = self._drawn_panels(low, high, LEFT)
        cut = ceil(max(self._cut(k) for k in range(len(self.axes))))
        left = LEFT + max(0, cut)
        if cut > 0:
            canvas = self._drawn_panels(low, high, left)
        figure, base = canvas.figure, 1.0 - 0.5 * TOP / self.height
        figure.text(left / self.width, base, f"{run.scenario}, {run.method}", va="center", fontsize=8)
        self._clock = figure.text(1.0 - RIGHT / self.width, base, "", va="center", ha="right", fontsize=8)
        self._clock.set_animated(True)
        canvas.draw()
        self._canvas, self._still = canvas, canvas.copy_from_bbox(figure.bbox)

    def _box(self) -> tuple[Array, Array]:
        """Return the lower and upper corner (d,) [m] of what is drawn of the workspace."""
        run = self.recording
        ways = [g.points if isinstance(g, PathGoal) else g.position(self.times[0])[None] for g in run.goals]
        every = max(1, len(run.times) // TIMES)
        points = np.concatenate([run.positions[::every].reshape(-1, run.dimension), *ways])
        radius = max(shape.bounding_radius for shape in run.shapes)
        return drawn_box(points, radius, run.obstacles, float(self.times[0]), float(self.times[-1]))

    def _drawn_panels(self, low: Array, high: Array, margin: int) -> Any:
        """Return the canvas of a new figure with the panels of a box (d,) [m], with this left margin [pixel]."""
        run, views = self.recording, VIEWS[self.recording.dimension]
        across = self.width // len(views) - margin - RIGHT
        ratios = [(high[y] - low[y]) / (high[x] - low[x]) for x, y, *_ in views]
        tall = round(across * float(np.clip(max(ratios), FLATTEST, TALLEST)))
        self.height = 2 * ((tall + BASE + TOP) // 2)
        figure = Figure(figsize=(self.width / DOTS, self.height / DOTS), dpi=DOTS)
        canvas: Any = FigureCanvasAgg(figure)
        self._panels, self.axes = list[_Panel](), list[Axes]()
        for k, (x, y, *labels) in enumerate(views):
            left = k * self.width / len(views) + margin
            place = (left / self.width, BASE / self.height, across / self.width, tall / self.height)
            ax = figure.add_axes(place)
            ax.set(xlabel=labels[0], ylabel=labels[1])
            self.axes.append(ax)
            self._panels.append(_Panel(ax, run, (x, y), (low, high), tall / across))
        canvas.draw()
        return canvas

    def _cut(self, k: int) -> float:
        """Return the width [pixel] by which the vertical axis of panel k exceeds the space on its left."""
        ax = self.axes[k]
        drawn = ax.yaxis.get_tightbbox()
        space = k * self.width / len(self.axes) + LABEL_GAP
        return 0.0 if drawn is None else space - float(drawn.x0)

    def __len__(self) -> int:
        return len(self.times)

    def __getitem__(self, k: Any) -> Any:
        """Return the picture with number `k`, counted from 0."""
        if isinstance(k, slice):
            return [self[j] for j in range(*k.indices(len(self)))]
        return self.at(float(self.times[range(len(self))[k]]))

    def states(self, t: float) -> tuple[Array, Array, Flags]:
        """Return positions (n, d) [m], velocities (n, d) [m/s], and which robots are there (n,), at time t [s]."""
        run = self.recording
        i = min(int((t - run.times[0]) / run.dt + 1e-9), len(run.accelerations) - 1)
        h, a = t - run.times[i], run.accelerations[i]
        stays = np.array([goal.stop for goal in run.goals])
        there = (stays | (run.arrived >= t - 1e-9)) & (run.appeared <= t + 1e-9)
        return run.positions[i] + h * (run.velocities[i] + 0.5 * h * a), run.velocities[i] + h * a, there

    def at(self, t: float) -> Pixels:
        """Return the picture at time t [s], absolute."""
        run = self.recording
        positions, velocities, there = self.states(t)
        past = (run.times >= t - self.trail) & (run.times < t)
        trails = np.concatenate([run.positions[past], positions[None]])
        figure = self._canvas.figure
        self._canvas.restore_region(self._still)
        with style():
            for panel in self._panels:
                panel.draw_obstacles(t, past)
                panel.draw(t, np.where(there[:, None], positions, np.nan), velocities, trails[:, there], there)
            self._clock.set_text(f"{t - run.times[0]:.1f} s")
            figure.draw_artist(self._clock)
        return np.asarray(self._canvas.buffer_rgba())[..., :3].copy()


class DecisionFilm(Film):
    """Pictures of the decisions of a run of one robot: its workspace and its control space, as `view.decision`.

    A decision is drawn from its time until the next one. Its control space is the one from which its manoeuvre was
    chosen. The title is the reason of the decision.

    Raises:
        InvalidInput: a run of several robots or of a method without control space; as `Film`.
    """

    def _lay_out(self) -> None:
        run, found = self.recording, recorded(self.recording)
        if found.method is None or len(run.shapes) > 1:
            what = run.method if len(run.shapes) == 1 else f"{len(run.shapes)} robots"
            raise InvalidInput(f"control_space: expected a run of one robot by a method of slalom, found {what}")
        self._scenario, self._navigator = found.scenario, found.scenario.navigator(found.method)
        self._making, self._made = decisions(run, found.scenario, found.method), list[Decision]()
        low, high = self._box()
        middle, half = 0.5 * (low + high)[:2], 0.5 * float(np.max((high - low)[:2]))
        self._extent = (middle[0] - half, middle[0] + half, middle[1] - half, middle[1] + half)
        self._drawn: tuple[int, Pixels] = (0, self._picture(0))
        self.height = len(self._drawn[1])

    def at(self, t: float) -> Pixels:
        """Return the picture of the decision in force at time t [s], absolute."""
        run = self.recording
        step = min(int((t - run.times[0]) / run.dt + 1e-9), len(run.accelerations) - 1)
        number = step // self._scenario.steps_per_decision
        if number != self._drawn[0]:
            self._drawn = (number, self._picture(number))
        return self._drawn[1]

    def _picture(self, number: int) -> Pixels:
        """Return the picture of a decision, counted from 0."""
        while len(self._made) <= number:
            self._made.append(next(self._making))
        run, decision = self.recording, self._made[number]
        step = number * self._scenario.steps_per_decision
        past = run.positions[: step + 1, 0][run.times[: step + 1] >= run.times[step] - self.trail]
        reasons, _ = reasons_of(decision)
        figure = draw_decision(
            decision,
            self._navigator,
            self._scenario.robot.goal,
            track=past,
            title="",
            extent=self._extent,
            resolution=GRID,
        )
        about = f"{run.scenario}, {run.method}, {run.times[step] - run.times[0]:.1f} s. {' '.join(reasons.sentences)}"
        with style():
            words = Figure(figsize=(figure.get_figwidth(), HEAD))
            words.text(0.012, 0.9, fill(about, LINE), va="top", fontsize=7.5, linespacing=1.3)
        empty = round(EMPTY * self.width / figure.get_figwidth())
        pixels = np.concatenate([self._rendered(words), self._rendered(figure)[empty:]])
        return pixels[: len(pixels) - len(pixels) % 2]  # both sides of a video are even

    def _rendered(self, figure: Figure) -> Pixels:
        """Return a figure as pixels of the width of the film."""
        figure.set_dpi(self.width / figure.get_figwidth())
        canvas: Any = FigureCanvasAgg(figure)
        with style():
            canvas.draw()
        return np.asarray(canvas.buffer_rgba())[:, : self.width, :3]


class _Panel:
    """One view of a run along an axis."""

    def __init__(self, ax: Axes, run: Recording, axes: tuple[int, int], box: tuple[Array, Array], ratio: float) -> None:
        self._ax = ax
        self._axes = list(axes)
        self._run = run
        low, high = box[0][self._axes], box[1][self._axes]
        middle, sides = 0.5 * (low + high), high - low
        half = 0.5 * max(sides[0], sides[1] / ratio)
        ax.set(xlim=(middle[0] - half, middle[0] + half))
        ax.set(ylim=(middle[1] - ratio * half, middle[1] + ratio * half))
        ax.locator_params(min_n_ticks=3)
        self._scale = ax.bbox.width / (2.0 * half)
        self._moving = [o for o in run.obstacles if not o.at_rest]
        still = [o for o in run.obstacles if o.at_rest]
        n, start = len(run.shapes), float(run.times[0])
        colours = [COLOURS[k % len(COLOURS)] for k in range(n)]
        for number, obstacle in enumerate(still):
            parts = self._projected(outline_parts(obstacle, start))
            body(ax, parts, f"obstacle-{number}", facecolor=NEUTRAL, edgecolor=INK, linewidth=0.5, zorder=1.5)
        self._others = self._bodies([self._outline(o, start) for o in self._moving], [NEUTRAL] * len(self._moving), 0.5)
        self._paths = np.array([_places(obstacle, run.times) for obstacle in self._moving])
        self._passed = LineCollection([], colors=[FAINT], linewidths=1.0, alpha=0.45, zorder=2.5)
        few = n <= CROWD
        self._trails = LineCollection([], colors=colours, linewidths=1.4, alpha=0.45, zorder=4)
        self._robots = self._bodies(
            [silhouette(self._projected(shape.parts)) for shape in run.shapes], colours, 0.6 if few else 0.3, 5
        )
        self._arrows = LineCollection([], colors=[INK], linewidths=0.9, zorder=6)
        self._goals = self._bodies([], [], 1.0, 5.8) if few else None
        if self._goals is not None:
            ring = [Outline.circle(radius=goal.tolerance) for goal in run.goals]
            self._goals.set(paths=ring, edgecolors=colours if n > 1 else [GOAL], facecolors="none")
            for goal in run.goals:
                draw_goal_path(ax, goal, self._axes)
        drawn = (self._passed, self._others, self._trails, self._goals, self._robots, self._arrows)
        self._drawn = [artist for artist in drawn if artist is not None]
        for artist in self._drawn:
            artist.set_animated(True)
            if artist.axes is None:
                ax.add_collection(artist, autolim=False)

    def _projected(self, parts: Sequence[Part]) -> list[Part]:
        return [Part(part.corners[:, self._axes], part.radius) for part in parts]

    def _outline(self, obstacle: Obstacle, t: float) -> Outline:
        """The outline of an obstacle around its reference point, with the heading at time t [s]."""
        t = float(np.clip(t, *obstacle.trajectory.span))
        here = obstacle.trajectory.position(t)
        return silhouette(
            self._projected([Part(part.corners - here, part.radius) for part in outline_parts(obstacle, t)])
        )

    def _bodies(self, outlines: Sequence[Outline], colours: Sequence[str], line: float, zorder: float = 3) -> Any:
        """Add outlines in metres around positions that are set later."""
        found = PathCollection(
            outlines,
            facecolors=colours,
            edgecolors=[INK],
            linewidths=line,
            zorder=zorder,
            offsets=np.full((1, 2), np.nan),
            offset_transform=self._ax.transData,
        )
        found.set_transform(Affine2D().scale(self._scale))
        self._ax.add_collection(found, autolim=False)
        return found

    def draw_obstacles(self, t: float, past: Flags) -> None:
        """Set the obstacles at time t [s], and their paths at the `past` steps (T + 1,) of the run."""
        if not self._moving:
            return
        here = np.array([_places(obstacle, np.array([t])) for obstacle in self._moving])
        self._others.set_offsets(here[:, 0, self._axes])
        self._passed.set_segments(list(np.concatenate([self._paths[:, past], here], axis=1)[..., self._axes]))
        if any(obstacle.turns for obstacle in self._moving):
            self._others.set_paths([self._outline(obstacle, t) for obstacle in self._moving])

    def draw(self, t: float, positions: Array, velocities: Array, trails: Array, there: Flags) -> None:
        """Draw positions (n, d), nan where a robot is not there, velocities (n, d) and trails (k, m, d)."""
        axes = self._axes
        self._trails.set_segments(list(np.swapaxes(trails[..., axes], 0, 1)))
        self._trails.set_colors([COLOURS[k % len(COLOURS)] for k in np.flatnonzero(there).tolist()])
        self._robots.set_offsets(positions[:, axes])
        if len(positions) <= CROWD:
            ends = np.stack([positions, positions + velocities], axis=1)[there][..., axes]
            self._arrows.set_segments(list(ends))
        if self._goals is not None:
            appeared = self._run.appeared[:, None] <= t + 1e-9
            self._goals.set_offsets(np.where(appeared, [goal.position(t)[axes] for goal in self._run.goals], np.nan))
        for artist in self._drawn:
            self._ax.draw_artist(artist)


def _places(obstacle: Obstacle, times: Array) -> Array:
    """Positions (k, d) [m] of an obstacle at times (k,) [s], nan where it does not exist."""
    there = np.array([obstacle.exists(t) for t in times.tolist()], dtype=np.bool_)
    places = np.full((len(times), obstacle.dimension), np.nan)
    if there.any():
        places[there] = obstacle.trajectory.position(times[there])
    return places


FORMATS: Final[dict[str, dict[str, Any]]] = {
    ".mp4": {"codec": "libx264", "pix_fmt": "yuv420p", "options": {"crf": "23", "preset": "veryfast"}},
    ".gif": {"codec": "gif", "pix_fmt": "pal8", "options": {}},
}
"""Encoder, pixel format and options by suffix."""
PALETTE_FROM: Final = 12
"""[1] Pictures from which the 256 colours of a GIF are taken."""


def animate(
    recording: Recording,
    path: Path | str,
    *,
    width: int = 720,
    fps: float = 25.0,
    speed: float = 1.0,
    trail: float = 3.0,
    control_space: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Path:
    """Write a video of a run: robots, obstacles, goals and trails in the workspace.

    In space the run is seen from above and from the side. Robots are drawn from their appearance on. Those that need
    not stop leave the picture at their goal.

    Args:
        path: a name ending in .mp4 or .gif. width: [pixel], even; the height follows from the run.
        fps: [1/s] pictures in a second of video. speed: seconds of the run in a second of video.
        trail: [s] of the run behind each robot that is drawn as a line. progress: called with the share that is done.
        control_space: whether to draw each decision of the only robot, with its control space beside the workspace.

    Raises:
        InvalidInput: a run without a step, or with a control space one of several robots or of a peer; another suffix,
            a setting outside its limits, or PyAV is not installed (`pip install 'slalom[video]'`).
        InvalidFile: a file that cannot be written.
    """
    target = checked(path)
    kind = DecisionFilm if flag(control_space, "control_space") else Film
    return write_video(target, kind(recording, width=width, fps=fps, speed=speed, trail=trail), fps, progress)


def checked(path: Path | str) -> Path:
    """Return the path of a video. Raises InvalidInput for another suffix, or if PyAV is not installed."""
    target = Path(path)
    if target.suffix not in FORMATS:
        raise InvalidInput(f"path: expected a name ending in {' or '.join(FORMATS)}, found {str(path)!r}")
    _library()
    return target


def write_video(
    path: Path, pictures: Sequence[Pixels], fps: float, progress: Callable[[float], None] | None = None
) -> Path:
    """Write pictures (height, width, 3), both sides even and all of one size, at `fps` [1/s], see `animate`."""
    av, options = _library(), FORMATS[path.suffix]
    rate = Fraction(fps).limit_denominator(1000)
    flags = {"movflags": "+faststart"} if path.suffix == ".mp4" else {}
    with replacing(path) as part, av.open(str(part), "w", options=flags) as file:
        stream = file.add_stream(options["codec"], rate=rate, options=options["options"])
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt, stream.codec_context.time_base = options["pix_fmt"], 1 / rate
        frames = _frames(av, pictures, rate, progress)
        for frame in _with_palette(av, frames, pictures, rate) if path.suffix == ".gif" else frames:
            file.mux(stream.encode(frame))
        file.mux(stream.encode())
    return path


def _library() -> ModuleType:
    with Extra("video", "animate"):
        import av
        import av.filter
    return av


def _frames(
    av: ModuleType, pictures: Sequence[Pixels], rate: Fraction, progress: Callable[[float], None] | None
) -> Iterator[Any]:
    for k in range(len(pictures)):
        yield _frame(av, pictures[k], k, rate)
        if progress:
            progress((k + 1) / len(pictures))


def _frame(av: ModuleType, picture: Pixels, k: int, rate: Fraction) -> Any:
    frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
    frame.pts, frame.time_base = k, 1 / rate
    return frame


def _with_palette(av: ModuleType, frames: Iterator[Any], pictures: Sequence[Pixels], rate: Fraction) -> Iterator[Any]:
    """Frames in the 256 colours that fit some of the pictures best, without dithering, which would flicker."""
    some = np.unique(np.linspace(0, len(pictures) - 1, PALETTE_FROM).astype(int)).tolist()
    first = _frame(av, pictures[0], 0, rate)
    finding = av.filter.Graph()
    source = finding.add_buffer(width=first.width, height=first.height, format=first.format, time_base=1 / rate)
    sink = finding.add("buffersink")
    _link(source, finding.add("palettegen", "reserve_transparent=0"), sink)
    finding.configure()
    for number, k in enumerate(some):
        source.push(_frame(av, pictures[k], number, rate))
    source.push(None)
    palette = sink.pull()
    using = av.filter.Graph()
    source = using.add_buffer(width=first.width, height=first.height, format=first.format, time_base=1 / rate)
    colours = using.add_buffer(
        width=palette.width, height=palette.height, format=palette.format, time_base=palette.time_base
    )
    mapping, sink = using.add("paletteuse", "dither=none:diff_mode=rectangle"), using.add("buffersink")
    source.link_to(mapping, 0, 0)
    colours.link_to(mapping, 0, 1)
    mapping.link_to(sink)
    using.configure()
    colours.push(palette)
    colours.push(None)
    for frame in frames:
        source.push(frame)
        yield from _pulled(av, sink)
    source.push(None)
    yield from _pulled(av, sink)


def _link(*steps: Any) -> None:
    for before, after in pairwise(steps):
        before.link_to(after)


def _pulled(av: ModuleType, sink: Any) -> Iterator[Any]:
    """The frames that a graph has ready."""
    while True:
        try:
            yield sink.pull()
        except (av.error.BlockingIOError, av.error.EOFError):
            return
