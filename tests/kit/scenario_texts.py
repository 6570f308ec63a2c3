"""Scenario files that say all that such files can say."""

EVERYTHING = """\
# A comment.
name: everything
start: 1.5
duration: 12
dt: 0.05
replan: 0.2
horizon: 4.0
margin: 0.1
patience: 0.3
guided: false
early: true
sight_range: 9
field_of_view: 4
sight_near: 1
occlusion: 2
hidden_speed: 1.2
passive_safety: 1
entry_time: 2
holds: [0.5, 1]
robot:
  position: [0, 0]
  velocity: [1.0, -1]
  radius: 0.4
  max_speed: 2.5
  max_acceleration: 1.5
  velocity_bounds:
    - {normal: [-2, 0], offset: 1}
  acceleration_bounds:
    - {normal: [0, 1], offset: 1.25}
  bounds:
    - {kind: friction, forward: 1, braking: 1.5, lateral: 0.75, heading: [0, 2]}
    - {kind: box, half_widths: [1, 2], frame: body}
    - {kind: convex_polygon, corners: [[1, 0], [0, 1], [-2, 0], [0, -1]]}
    - {kind: heading_cone, half_angle: 1.5}
    - {kind: turning_radius, least: 0.5}
    - {kind: least_speed, least: 0.25}
  goal:
    trajectory: {kind: constant_velocity, position: [20, 0], velocity: [0, 0.1]}
    tolerance: 0.3
    stop: true
obstacles:
  - {name: rock, radius: 1, trajectory: {kind: stationary, position: [5, 5]}}
  - {radius: 0.5, trajectory: {kind: constant_velocity, position: [9, 0], velocity: [-1, 0], at: 2}}
  - radius: 0.6
    trajectory:
      kind: constant_acceleration
      position: [3, -9]
      velocity: [0, 1]
      acceleration: [0.1, 0]
      at: -1
  - {radius: 0.7, trajectory: {kind: circular, center: [10, 0], radius: 3, speed: -1, phase: 0.5}}
  - {radius: 0, trajectory: {kind: sampled, times: [0, 1, 4], positions: [[7, 7], [8, 7], [8, 8]]}}
  - {radius: 1, trajectory: {kind: sampled, times: [0, 1], positions: [[7, 0], [8, 0]], interpolation: linear}}
recording: {file: tracks.csv, radius: 0.25, interpolation: linear}
"""

GROUP = """\
duration: 2
robots:
  - {name: guard, position: [0, -9], radius: 0.4, max_speed: 1, max_acceleration: 1, goal: {position: [0, -3]}}
  - name: courier
    count: 4
    method: rvo
    radius: {first: 0.2, last: 0.5}
    priority: {first: 4, last: 1}
    max_speed: 1.5
    max_acceleration: 2
    bounds: [{kind: turning_radius, least: 0.5}]
    positions: {kind: line, first: [0, 0], last: [0, 9]}
    goals: {kind: displaced, by: [8, 1]}
    goal: {stop: true, tolerance: 0.25}
    overrides:
      - {robot: 2, name: slow, shape: {kind: rectangle, length: 0.6, width: 0.4}, max_speed: 0.75,
         goal: {position: [8, 8]}}
"""

TASKS = """\
duration: 5
robots:
  - {name: cart, count: 3, radius: 0.3, max_speed: 1.5, max_acceleration: 2, goal: {stop: true, tolerance: 0.2},
     positions: {kind: line, first: [-2, -4], last: [2, -4]}, goals: {kind: line, first: [-2, -4], last: [2, -4]}}
tasks:
  stations:
    - {name: a, at: [0, 0], service: {first: 1, last: 3, seed: 1}}
    - {name: b, at: [8, 0], places: 2, service: 2}
  listed: [{time: 1, origin: a, destination: b, robot: cart 1}]
  rate: 20
  seed: 5
  origins: [a, b]
  destinations: [b, a]
"""
