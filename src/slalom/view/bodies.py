"""Drawing of shapes: circles for discs and balls, outlines of unions for other shapes; in space, projected along z."""

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


def parts_at(shape: Shape, position: Array) -> list[Part]:
    """Return the parts of a shape that does not rotate, at `position` (d,) [m]."""
    return [Part(position + part.corners, part.radius) for part in shape.parts]


def region_of(parts: Sequence[Part]) -> Any:
    """Return the union of rounded convex hulls as a shapely geometry; circles have 256 corners."""
    hulls = [shapely.MultiPoint(part.corners[:, :2]).convex_hull for part in parts]
    return shapely.union_all([hull.buffer(part.radius, quad_segs=64) for hull, part in zip(hulls, parts)])


def outline(region: Any) -> Outline:
    """Return the boundaries of one or several polygons, or lines, as one matplotlib path."""
    rings = []
    for geometry in getattr(region, "geoms", [region]):
        if geometry.geom_type == "Polygon":
            rings += [
                Outline(np.asarray(ring.coords), closed=True) for ring in (geometry.exterior, *geometry.interiors)
            ]
        elif not geometry.is_empty:
            rings.append(Outline(np.asarray(geometry.coords)))
    return Outline.make_compound_path(*rings)


def silhouette(parts: Sequence[Part]) -> Outline:
    """Return the outline of `parts`, seen along the last axis in space; of walls without thickness, their lines."""
    region = region_of(parts)
    if region.area == 0.0:
        region = shapely.union_all([shapely.LineString(part.corners[:, :2]) for part in parts])
    return outline(region)


def body(ax: Axes, parts: Sequence[Part], gid: str, **properties: Any) -> Patch:
    """Draw the outline of `parts`, whose corners (n, d) [m] are in the world frame."""
    if len(parts) == 1 and len(parts[0].corners) == 1:
        return disc(ax, parts[0].corners[0], parts[0].radius, gid, **properties)
    drawn = silhouette(parts)
    if region_of(parts).area == 0.0:
        properties = {**properties, "fill": False, "linewidth": max(1.0, float(properties.get("linewidth", 1.0)))}
    patch = PathPatch(drawn, **properties)
    patch.set_gid(gid)
    ax.add_patch(patch)
    return patch


def box_of(parts: Sequence[Part]) -> Array:
    """Return the lower and upper corner (2, 2) [m] of the bounding box of `parts`."""
    low = np.min([part.corners[:, :2].min(axis=0) - part.radius for part in parts], axis=0)
    high = np.max([part.corners[:, :2].max(axis=0) + part.radius for part in parts], axis=0)
    return np.array([low, high])
