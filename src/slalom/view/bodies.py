"""Shapes as they are drawn: circles for what is round, outlines of unions for everything else; in space, seen from
above.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path as Outline

from slalom.checks import Array
from slalom.shape import Part, Shape
from slalom.view.style import disc


def placed(shape: Shape, position: Array) -> list[Part]:
    """The parts of a shape that does not turn, where it is."""
    return [Part(position + part.corners, part.radius) for part in shape.parts]


def region_of(parts: Sequence[Part]) -> Any:
    """What rounded hulls cover, as a shapely geometry; circles have 256 corners."""
    hulls = [shapely.MultiPoint(part.corners[:, :2]).convex_hull for part in parts]
    return shapely.union_all([hull.buffer(part.radius, quad_segs=64) for hull, part in zip(hulls, parts)])


def outline(region: Any) -> Outline:
    """The rings of a polygon or of several, as one path; of lines, the lines."""
    rings = []
    for one in getattr(region, "geoms", [region]):
        if one.geom_type == "Polygon":
            rings += [Outline(np.asarray(ring.coords), closed=True) for ring in (one.exterior, *one.interiors)]
        elif not one.is_empty:
            rings.append(Outline(np.asarray(one.coords)))
    return Outline.make_compound_path(*rings)


def body(ax: Axes, parts: Sequence[Part], gid: str, **look: Any) -> Patch:
    """The outline of `parts`, whose corners (n, d) are where they are."""
    if len(parts) == 1 and len(parts[0].corners) == 1:
        return disc(ax, parts[0].corners[0], parts[0].radius, gid, **look)
    region = region_of(parts)
    if region.area == 0.0:
        # Walls without thickness are lines.
        look = {**look, "fill": False, "linewidth": max(1.0, float(look.get("linewidth", 1.0)))}
        region = shapely.union_all([shapely.LineString(part.corners[:, :2]) for part in parts])
    patch = PathPatch(outline(region), **look)
    patch.set_gid(gid)
    ax.add_patch(patch)
    return patch


def box_of(parts: Sequence[Part]) -> Array:
    """Lower and upper corner (2, 2) of the box about `parts`."""
    low = np.min([part.corners[:, :2].min(axis=0) - part.radius for part in parts], axis=0)
    high = np.max([part.corners[:, :2].max(axis=0) + part.radius for part in parts], axis=0)
    return np.array([low, high])
