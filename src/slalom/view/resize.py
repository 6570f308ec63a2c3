"""Figures of another width or with other sizes of text: margins follow the text, panels take the rest."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.text import Text

from slalom.checks import Array, positive
from slalom.errors import InvalidInput
from slalom.view.style import LEAST_PANEL, WIDEST, style


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
