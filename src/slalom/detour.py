"""The rule of the road: how robots that will meet go around each other, all on the same side."""

import numpy as np

from slalom.checks import Array

MEETING = 8.0
"""[s] Meetings that are farther ahead are left to later."""


def way_round(place: Array, goal: Array, centers: Array, radii: Array) -> Array:
    """By how much [m] the shortest way from `place` to `goal` (d,) around each disc (n, d), (n,) is longer than
    straight: (n,).

    Two tangents and an arc; 0 for a disc that is not in the way. A place or goal inside a disc counts as on its border.
    """
    to_place, to_goal = place - centers, goal - centers
    first = np.maximum(np.linalg.norm(to_place, axis=1), radii)
    second = np.maximum(np.linalg.norm(to_goal, axis=1), radii)
    lengths = np.linalg.norm(to_place, axis=1) * np.linalg.norm(to_goal, axis=1)
    cosine = np.sum(to_place * to_goal, axis=1) / np.maximum(lengths, 1e-12)
    angle = np.arccos(np.clip(cosine, -1.0, 1.0)) - np.arccos(radii / first) - np.arccos(radii / second)
    tangents = np.sqrt(first**2 - radii**2) + np.sqrt(second**2 - radii**2)
    longer = tangents + radii * angle - np.linalg.norm(goal - place)
    return np.asarray(np.where(angle > 0.0, np.maximum(longer, 0.0), 0.0))


def keep_right(
    position: Array, goal: Array, speed: float, reach: float, places: Array, velocities: Array, reaches: Array
) -> Array | None:
    """A place (2,) to head for instead of the goal, or None where nobody is met on the way.

    A robot that goes straight at `speed` [m/s] meets those others whose present velocities bring them within reach. It
    passes the middle of these meetings on the right, at a distance at which so many robots have room on a circle about
    it. As all do the same they go around it as around a roundabout, counter-clockwise.
    """
    away = goal - position
    distance = float(np.linalg.norm(away))
    if distance < reach:
        return None
    ahead = away / distance
    relative, motion = places - position, velocities - speed * ahead
    square = np.maximum(np.sum(motion * motion, axis=1), 1e-9)
    when = np.clip(-np.sum(relative * motion, axis=1) / square, 0.0, distance / speed)
    near = np.linalg.norm(relative + when[:, None] * motion, axis=1)
    touch = reach + reaches
    # Who comes by at the goal itself is waited for, not gone around.
    meets = (near < 1.3 * touch) & (when > 0.0) & (when < np.minimum(MEETING, 0.999 * distance / speed))
    # Who goes the same way is followed or passed, not gone around.
    meets &= velocities @ ahead <= 0.7 * np.linalg.norm(velocities, axis=1)
    if not np.any(meets):
        return None
    center = position + float(when[meets].mean()) * speed * ahead
    center = 0.5 * (center + (places[meets] + when[meets, None] * velocities[meets]).mean(axis=0))
    room = max(float(touch[meets].max()), float(2.2 * (reach + reaches[meets].sum()) / (2.0 * np.pi))) * 1.3
    to_center = center - position
    far = float(np.linalg.norm(to_center))
    if to_center @ ahead < 0.0 or far < 1e-6 or distance < far + room:
        return None
    angle = -np.arcsin(room / far) if far > room else -0.6 * np.pi
    direction = np.array(
        [
            np.cos(angle) * to_center[0] - np.sin(angle) * to_center[1],
            np.sin(angle) * to_center[0] + np.cos(angle) * to_center[1],
        ]
    )
    return np.asarray(position + direction * max(far, 2.0 * room) / far)
