"""The kernels that Python calls, each once."""

from .compile_notice import (
    compiling as compiling,
    when_compiling as when_compiling,
    while_compiling as while_compiling,
)
from .crowd import avoiding_velocities as avoiding_velocities, similar_displacements as similar_displacements
from .decision.detours import (
    detour_lengths as detour_lengths,
    in_the_way as in_the_way,
    put_at_horizon as put_at_horizon,
)
from .decision.neighbours import build_cell_list as build_cell_list, independent_rounds as independent_rounds
from .decision.paths import predicted_points as predicted_points
from .decision.policy import decide_all as decide_all
from .decision.predicted_stops import stop_at_obstacles as stop_at_obstacles
from .decision.targets import (
    earliest_arrival as earliest_arrival,
    passing_velocity as passing_velocity,
    stopping_speed as stopping_speed,
    time_to_rest as time_to_rest,
)
from .decision.worlds import decide_worlds as decide_worlds, keep_tables as keep_tables
from .geometry.boundaries import axes_along as axes_along
from .geometry.hulls import distances as distances
from .guidance.priority_inheritance import give_way as give_way
from .guidance.traffic_circle import update_targets as update_targets, update_waypoints as update_waypoints
from .jit import threads as threads
from .relative_motion.clearance import contact_times as contact_times, least_clearances as least_clearances
from .relative_motion.window import (
    allowed_speed as allowed_speed,
    balls_near as balls_near,
    body_balls as body_balls,
    covered_at_rest as covered_at_rest,
    distances_now as distances_now,
    in_balls as in_balls,
    kept_margin as kept_margin,
    kept_radii as kept_radii,
    piece_balls as piece_balls,
    pieces_within as pieces_within,
    segments_of as segments_of,
)
from .selection.exchange import choose_many as choose_many, nearest_free as nearest_free
from .sequence_search.search import grow_tree as grow_tree, sequence_is_clear as sequence_is_clear
from .sequence_search.tree import add_node as add_node, breach as breach
from .vehicle.body import (
    contact_of as contact_of,
    first_clear as first_clear,
    least_left as least_left,
    pose_gaps as pose_gaps,
    window_costs as window_costs,
)
from .vehicle.driving import (
    actuated as actuated,
    along_way as along_way,
    drive as drive,
    executable as executable,
    follow as follow,
    held as held,
    on_arc as on_arc,
    sampled as sampled,
    turn_rate as turn_rate,
    within_limits as within_limits,
    wrapped as wrapped,
)
