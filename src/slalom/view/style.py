"""Shared parts of the figures: fonts, colours, scale of times, marks, and saving."""

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import BoundaryNorm, ListedColormap, to_rgba
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from matplotlib.text import Text
from matplotlib.ticker import Locator
from matplotlib.transforms import ScaledTranslation

from slalom.base.checks import Array, positive
from slalom.base.errors import InvalidInput
from slalom.base.writing import write_file

COLUMN: Final = 3.5
"""[inch] Width of one column of a journal page."""

PAGE: Final = 7.16
"""[inch] Width of the page: two columns and the gap between them."""

BELOW: Final = -0.46
"""[inch] From the axis of a panel in a grid to its legend: the height of numbers and label."""

LEAST_PANEL: Final = 0.8
"""[inch] Least width of all panels of a figure side by side; narrower ones have no space for their ticks."""

RESOLUTION: Final = 300
"""[dots per inch] of bitmaps."""

WIDEST: Final = 200.0
"""[inch] Largest width of a figure, that of a page of PDF."""

MOST_DOTS: Final = 1e8
"""[1] Most dots of a bitmap; each takes four bytes of memory."""

ROBOT: Final = "#d55e00"
"""Colour of the robot and its choice: vermilion, in neither viridis nor grey, and distinct for the colour-blind."""

GOAL: Final = "#0072b2"
NEUTRAL: Final = "#cfcfcf"
INK: Final = "#222222"
FAINT: Final = "#8a8a8a"

FORMATS: Final[dict[str, dict[str, Any]]] = {
    ".svg": {"metadata": {"Date": None, "Creator": "slalom"}},
    ".pdf": {"metadata": {"CreationDate": None, "ModDate": None, "Creator": "slalom"}},
    ".png": {"metadata": {"Software": "slalom"}},
}
"""Options of `savefig` by suffix; without dates, so that equal figures give equal files."""

Colour = str | tuple[float, float, float, float]

_STYLE: Final[Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "mathtext.fontset": "dejavusans",
    "font.size": 7.5,
    "axes.titlesize": 8,
    "axes.labelsize": 8,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": 7,
    "figure.titlesize": 8.5,
    "axes.linewidth": 0.6,
    "axes.edgecolor": INK,
    "axes.facecolor": "white",
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "text.color": INK,
    "axes.labelcolor": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "axes.grid": False,
    "axes.unicode_minus": True,
    "lines.solid_capstyle": "round",
    "legend.frameon": False,
    "legend.handlelength": 2.0,
    "legend.columnspacing": 1.4,
    "legend.labelspacing": 0.35,
    "text.usetex": False,
    "path.simplify": False,
    "svg.hashsalt": "slalom",
    "svg.fonttype": "path",
    "pdf.fonttype": 42,
    "pdf.compression": 6,
    "savefig.bbox": "standard",
    "savefig.transparent": False,
}


@contextmanager
def style() -> Iterator[None]:
    """Apply the settings of slalom's figures within the `with` block, independent of the settings outside."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE)
        yield


def time_levels(horizon: float) -> Array:
    """Return round times [s] from 0 to `horizon` [s], at most 16 steps; the last step may be shorter."""
    steps = (1.0, 2.0, 5.0)
    exponent = np.floor(np.log10(horizon)) - 2
    step_sizes = [m * 10.0 ** (exponent + k) for k in range(4) for m in steps]
    step = next(step for step in step_sizes if horizon / step <= 16.0)
    inner = np.arange(0.0, horizon - 0.25 * step, step)
    return np.append(inner, horizon)


def time_scale(horizon: float) -> ScalarMappable:
    """Return one colour per step of `time_levels` for times to collision from 0 to `horizon` [s]; earlier is darker."""
    levels = time_levels(horizon)
    bands = len(levels) - 1
    colours = ListedColormap(mpl.colormaps["viridis"](np.linspace(0.0, 0.97, bands)))
    return ScalarMappable(BoundaryNorm(levels, bands), colours)


def colour_at(scale: ScalarMappable, value: float) -> Colour:
    """Return the colour (red, green, blue, opacity) of one value."""
    red, green, blue, opacity = np.asarray(scale.to_rgba(np.array([value])))[0]
    return (float(red), float(green), float(blue), float(opacity))


def halo(width: float) -> list[patheffects.AbstractPathEffect]:
    """Return a path effect: a white border of `width` [pt], which keeps a line or text readable on any colour."""
    return [patheffects.withStroke(linewidth=width, foreground="white")]


def disc(ax: Axes, centre: Sequence[float] | Array, radius: float, gid: str, **properties: Any) -> Circle:
    """Draw a disc of `radius` around the first two components of `centre`, in data units."""
    patch = Circle((float(centre[0]), float(centre[1])), float(radius), **properties)
    patch.set_gid(gid)
    ax.add_patch(patch)
    return patch


def dot(face: Any, edge: Any, label: str) -> Line2D:
    """Return a legend entry for a disc."""
    return Line2D(
        [], [], linestyle="none", marker="o", markersize=5.5, markerfacecolor=face, markeredgecolor=edge, label=label
    )


def write_height(ax: Axes, center: Array, radius: float) -> None:
    """Write the height z [m] beside a ball."""
    text = ax.annotate(
        f"{center[2]:.1f}".replace("-", "−"),
        (center[0] + 0.75 * radius, center[1] + 0.75 * radius),
        xytext=(1, 1),
        textcoords="offset points",
        fontsize=6,
        color=INK,
        zorder=8,
    )
    text.set_path_effects(halo(1.6))
    text.set_gid("height")


def fading_line(ax: Axes, points: Array, colour: Any, *, width: float, min_opacity: float, zorder: float) -> None:
    """Draw a line through `points` (n, d), opaque at the first point and of `min_opacity` at the last."""
    pieces = np.stack([points[:-1, :2], points[1:, :2]], axis=1)
    colours = np.tile(to_rgba(colour), (len(pieces), 1))
    colours[:, 3] *= min_opacity + (1.0 - min_opacity) * np.linspace(1.0, 0.0, len(pieces)) ** 1.6
    lines = LineCollection(list(pieces), colors=colours, linewidths=width, capstyle="butt", zorder=zorder)
    ax.add_collection(lines, autolim=False)


def legend_below(ax: Axes, handles: Sequence[Any], columns: int) -> None:
    """Draw a legend below the axes; among others in a grid the figure is laid out so that they do not overlap."""
    place: dict[str, Any] = {"bbox_to_anchor": (0.5, -0.17)}
    figure, grid = ax.get_figure(root=True), ax.get_subplotspec()
    if figure is not None and grid is not None and grid.get_gridspec().nrows * grid.get_gridspec().ncols > 1:
        if figure.get_layout_engine() is None:
            figure.set_layout_engine("constrained")
        down = ScaledTranslation(0.0, BELOW, figure.dpi_scale_trans)
        place = {"bbox_to_anchor": (0.5, 0.0), "bbox_transform": ax.transAxes + down}
    ax.legend(handles=list(handles), loc="upper center", ncols=columns, borderaxespad=0.0, **place)


def colour_bar(
    scale: ScalarMappable, ax: Axes, label: str, ticks: Locator | None = None, *, height: float = 1.0
) -> None:
    """Draw a colour bar beside `ax`; its `ticks` are by default those of the scale, its `height` 1 that of `ax`."""
    figure = ax.get_figure(root=False)
    assert figure is not None
    bar = figure.colorbar(scale, cax=ax.inset_axes((1.02, 0.0, 0.04, height)), spacing="proportional", ticks=ticks)
    bar.set_label(label)
    bar.ax.tick_params(width=0.5, length=2)
    bar.outline.set_linewidth(0.5)


def save(figure: Figure | Axes, path: str | Path, *, resolution: float = RESOLUTION) -> Path:
    """Write a figure, or the figure of given axes, to .svg, .pdf or .png.

    Equal figures give equal bytes.

    Args:
        resolution: of a .png [dots per inch].

    Raises:
        InvalidInput: another suffix; a resolution that is not positive, or gives more than MOST_DOTS.
        InvalidFile: a file that cannot be written.
    """
    dots = positive(resolution, "resolution")
    target = Path(path)
    suffix = target.suffix.lower()
    if suffix not in FORMATS:
        found = repr(suffix) if suffix else "no suffix"
        raise InvalidInput(f"path: expected a name ending in {', '.join(FORMATS)}; found {found} in {str(path)!r}")
    whole = figure.get_figure(root=True) if isinstance(figure, Axes) else figure
    assert whole is not None
    width, height = whole.get_size_inches()
    if suffix == ".png" and width * height * dots**2 > MOST_DOTS:
        most = np.sqrt(MOST_DOTS / (width * height))
        raise InvalidInput(f"resolution: expected at most {most:.0f} dots per inch at this size, found {dots:g}")
    # The writer of PDF ends in an error of zlib on a full disk.
    memory = io.BytesIO()
    with style():
        whole.savefig(memory, format=suffix[1:], dpi=dots if suffix == ".png" else "figure", **FORMATS[suffix])
    write_file(target, memory.getvalue())
    return target


# Figures of another width or with other sizes of text: margins follow the text, panels take the rest.


def resized(figure: Figure, *, width: float | None = None, font_scale: float = 1.0) -> Figure:
    """Set the width of a figure of this package and the size of its text, and return it.

    Panels keep their shapes. Distances that hold text (margins, gaps between panels) grow with larger text.

    Args:
        width: of the figure [inch]; by default as it is. font_scale: factor of all sizes of text.

    Raises:
        InvalidInput: numbers that are not positive; a width that leaves no space for the panels or legends, or above
            WIDEST.
    """
    scale = positive(font_scale, "font_scale")
    old_width, old_height = (float(side) for side in figure.get_size_inches())
    wanted = old_width if width is None else positive(width, "width")
    if wanted > WIDEST:
        raise InvalidInput(f"width: expected at most {WIDEST:g} inch, found {wanted:g}")
    if wanted == old_width and scale == 1.0:
        return figure
    with style():
        _resize(figure, old_width, old_height, wanted, scale)
    return figure


def _resize(figure: Figure, old_width: float, old_height: float, wanted: float, scale: float) -> None:
    """Change width [inch] and size of text."""
    if figure.get_layout_engine() is not None:
        figure.set_size_inches(wanted, old_height * wanted / old_width)
        _scale_text(figure, scale)
        return
    anchors = _anchors(figure)
    boxes = np.array([ax.get_position().extents for ax in figure.axes])
    across, up = _covered(boxes[:, 0], boxes[:, 2]), _covered(boxes[:, 1], boxes[:, 3])
    panels = old_width * float(np.diff(across, axis=1).sum())
    # The marks of a legend do not become smaller with its text.
    margin_scale = max(1.0, scale)
    margins = margin_scale * (old_width - panels)
    if wanted < margins + LEAST_PANEL:
        raise InvalidInput(
            f"width: expected at least {margins + LEAST_PANEL:.2f} inch with text of this size, found {wanted:g}"
        )
    growth = (wanted - margins) / panels
    x, y = _Stretch(across, old_width, growth, margin_scale), _Stretch(up, old_height, growth, margin_scale)
    figure.set_size_inches(x.total, y.total)
    for ax, (left, low, right, high) in zip(figure.axes, boxes, strict=True):
        begin, end = (x.share(left), y.share(low)), (x.share(right), y.share(high))
        ax.set_position((*begin, end[0] - begin[0], end[1] - begin[1]))
    for text in figure.texts:
        at = text.get_position()
        text.set_position((x.share(at[0]), y.share(at[1])))
    _scale_text(figure, scale)
    _place(anchors, margin_scale)
    _refuse_crowded(figure, anchors, wanted)


def _refuse_crowded(figure: Figure, anchors: Sequence["_Anchor"], width: float) -> None:
    """Raise InvalidInput where a legend leaves the figure or overlaps the next one."""
    canvas: Any = FigureCanvasAgg(figure)
    renderer = canvas.get_renderer()
    boxes = sorted((one.legend.get_window_extent(renderer).intervalx for one in anchors), key=lambda box: float(box[0]))
    edges = [figure.bbox.x0, *(float(edge) for box in boxes for edge in box), figure.bbox.x1]
    if any(after < before for before, after in zip(edges[::2], edges[1::2], strict=True)):
        raise InvalidInput(
            f"width: expected a width in which the legends have space with text of this size, found {width:g} inch"
        )


def _covered(low: Array, high: Array) -> Array:
    """Return the union (n, 2) of intervals, in order."""
    found: list[list[float]] = []
    for begin, end in sorted(zip(low.tolist(), high.tolist(), strict=True)):
        if found and begin <= found[-1][1]:
            found[-1][1] = max(found[-1][1], end)
        else:
            found.append([begin, end])
    return np.array(found)


class _Stretch:
    """Places along one side: intervals that panels cover grow by one factor, the margins between them by another.

    Attributes:
        total: new length of the side [inch].
    """

    def __init__(self, covered: Array, length: float, growth: float, scale: float) -> None:
        self._old = np.concatenate([[0.0], covered.ravel(), [1.0]])
        factors = np.where(np.arange(len(self._old) - 1) % 2 == 1, growth, scale)
        self._new = np.concatenate([[0.0], np.cumsum(factors * np.diff(self._old))]) * length
        self.total = float(self._new[-1])

    def share(self, place: float) -> float:
        """Return the new place, as a share of the side, of an old one."""
        return float(np.interp(place, self._old, self._new)) / self.total


def _scale_text(figure: Figure, scale: float) -> None:
    texts = [(text, float(text.get_fontsize())) for text in figure.findobj(Text) if isinstance(text, Text)]
    for ax in figure.findobj(Axes):
        assert isinstance(ax, Axes)
        labels = [*ax.xaxis.get_ticklabels(), *ax.yaxis.get_ticklabels()]
        if labels:
            # Further ticks are made when the figure is drawn.
            ax.tick_params(which="both", labelsize=scale * float(labels[0].get_fontsize()))
    for text, size in texts:
        text.set_fontsize(scale * size)


class _Anchor(NamedTuple):
    """Place of a legend: share of the width of its axes, lower or upper edge (0 or 1), distance above it [inch]."""

    legend: Legend
    across: float
    edge: int
    above: float


def _anchors(figure: Figure) -> list[_Anchor]:
    """Return the places of all legends of a figure."""
    found = []
    for ax in figure.axes:
        legend = ax.get_legend()
        if legend is not None:
            x, y = ax.transAxes.inverted().transform(legend.get_bbox_to_anchor().p0)
            edge = int(y > 0.5)
            found.append(_Anchor(legend, float(x), edge, (float(y) - edge) * _height(legend.axes)))
    return found


def _place(anchors: Sequence[_Anchor], scale: float) -> None:
    """Put legends at the same distance from their axes, in terms of the size of text."""
    for legend, across, edge, above in anchors:
        place = (across, edge + scale * above / _height(legend.axes))
        legend.set_bbox_to_anchor(place, transform=legend.axes.transAxes)


def _height(ax: Axes) -> float:
    """Return the height of axes [inch]."""
    figure = ax.get_figure(root=True)
    assert figure is not None
    return float(figure.get_size_inches()[1]) * ax.get_position().height
