"""Shared parts of the figures: fonts, colours, scale of times, marks, and saving."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import BoundaryNorm, ListedColormap, to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from matplotlib.ticker import Locator

from slalom.checks import Array, positive
from slalom.errors import InvalidInput

COLUMN: Final = 3.5
"""[inch] Width of one column of a journal page."""

PAGE: Final = 7.16
"""[inch] Width of the page: two columns and the gap between them."""

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
    """Draw a legend below the axes."""
    ax.legend(handles=list(handles), loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=columns, borderaxespad=0.0)


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
    with style():
        whole.savefig(target, format=suffix[1:], dpi=dots if suffix == ".png" else "figure", **FORMATS[suffix])
    return target
