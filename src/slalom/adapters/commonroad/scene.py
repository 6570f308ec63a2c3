"""What a car meets in a scenario of CommonRoad: borders of the road, static obstacles, recorded vehicles."""

from typing import Any

import shapely

from slalom.errors import InvalidInput
from slalom.obstacle import Headings, Obstacle
from slalom.obstacle.table import ObstacleTable
from slalom.shape import Disc, Polygon, Polyline, Rectangle, Shape
from slalom.trajectory import Sampled, Stationary

GAP = 0.05
"""[m] Lanelets nearer than twice this are one road. Smaller: walls between neighbours remain. Larger: gaps close."""


def surroundings(scenario: Any) -> list[ObstacleTable]:
    """Tables of the walls, and of all obstacles on their recorded trajectories.

    Raises:
        InvalidInput: obstacles that are neither rectangles, discs nor polygons.
    """
    return [ObstacleTable(_walls(scenario)), ObstacleTable([*_at_rest(scenario), *_moving(scenario)])]


def _walls(scenario: Any) -> list[Obstacle]:
    lanes = [lanelet.polygon.shapely_object.buffer(GAP) for lanelet in scenario.lanelet_network.lanelets]
    road = shapely.union_all(lanes).buffer(-GAP)
    rings = [r for part in shapely.get_parts(road) for r in (part.exterior, *part.interiors)]
    return [Obstacle(Polyline(ring.coords), Stationary((0, 0)), "border") for ring in rings]


def _at_rest(scenario: Any) -> list[Obstacle]:
    found = [(o, o.initial_state) for o in scenario.static_obstacles]
    return [Obstacle(_shape(o), Stationary(s.position), str(o.obstacle_id), heading=s.orientation) for o, s in found]


def _moving(scenario: Any) -> list[Obstacle]:
    found, dt = list[Obstacle](), float(scenario.dt)
    for o in scenario.dynamic_obstacles:
        states = [o.initial_state, *o.prediction.trajectory.state_list]
        times, places = [dt * s.time_step for s in states], [s.position for s in states]
        path = Sampled(times, places)
        heading = Headings(times, [s.orientation for s in states])
        found.append(Obstacle(_shape(o), path, str(o.obstacle_id), heading, after_end="leaves"))
    return found


def _shape(obstacle: Any) -> Shape:
    shape, kind = obstacle.obstacle_shape, type(obstacle.obstacle_shape).__name__
    if kind == "Rectangle":
        return Rectangle(shape.length, shape.width)
    if kind == "Circle":
        return Disc(shape.radius)
    if kind == "Polygon":
        return Polygon(shape.shapely_object.exterior.coords[:-1])
    raise InvalidInput(f"obstacle {obstacle.obstacle_id}: expected a rectangle, disc or polygon, found {kind}")
