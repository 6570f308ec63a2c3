"""How often the radius of `slalom.Tracker` holds people that walk straight, stop or turn.

usage: python benchmarks/tracked_walkers.py [--quick] [--seeds 20] [--first 1000] [--people 1 8] [--out FOLDER]

People walk at 0.5 to 1.4 m/s. Every 2 to 5 s each one stops for 1 to 3 s, or turns by 0.5 to 1.6 rad. They accelerate
by 3 m/s^2 and turn by 2.5 rad/s. Positions are measured at 12 Hz with 0.05 m of noise; one of ten is missed, and all
arrive 0.1 s late. Predictions are made at 10 Hz, from 10 s after the first measurement on, by a tracker with calibrated
radii and by one with the radii of its filter. A prediction is held if the person is within the radius of 95 % at its
time. The seeds below 1000 served to choose the constants.
"""

from typing import Any

import numpy as np
from program import finish, options, table, target

import slalom

STEP, RATE, NOISE, MISSED, LATE = 0.025, 12.0, 0.05, 0.1, 0.1
LEADS = np.array([0.5, 1.0, 2.0])
KINDS = {"straight": (), "stop": ("stop",), "turn": ("turn",), "stop and turn": ("stop", "turn")}
PROMISED, NEAR, WARM = 0.95, 0.03, 10.0


def walk(kinds: tuple[str, ...], duration: float, rng: np.random.Generator) -> np.ndarray:
    """Positions (n, 2) [m] of one person every STEP."""
    heading, speed = rng.uniform(-np.pi, np.pi), rng.uniform(0.5, 1.4)
    place, wanted, until, standing = rng.uniform(-20.0, 20.0, 2), heading, rng.uniform(0.0, 5.0), False
    velocity, found = speed * np.array([np.cos(heading), np.sin(heading)]), []
    for k in range(round(duration / STEP)):
        found.append(place)
        if kinds and k * STEP >= until:
            standing, turns = not standing and rng.choice(kinds) == "stop", standing
            if not standing and not turns:
                wanted = heading + rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 1.6)
            until = k * STEP + (rng.uniform(1.0, 3.0) if standing else rng.uniform(2.0, 5.0))
        heading += float(np.clip(wanted - heading, -2.5 * STEP, 2.5 * STEP))
        change = (0.0 if standing else speed) * np.array([np.cos(heading), np.sin(heading)]) - velocity
        velocity = velocity + change * min(1.0, 3.0 * STEP / max(float(np.linalg.norm(change)), 1e-12))
        place = place + STEP * velocity
    return np.array(found)


def judged(kinds: tuple[str, ...], people: int, seed: int, duration: float) -> dict[str, list[np.ndarray]]:
    """Distances from the prediction and radii, both (predictions, leads) [m], of both trackers."""
    rng = np.random.default_rng(seed)
    walks = [walk(kinds, duration + LEADS[-1], rng) for _ in range(people)]
    motion = slalom.ConstantVelocityFilter(position=NOISE)
    trackers = {
        "calibrated": slalom.Tracker(filter=motion, growth=np.inf),
        "filter": slalom.Tracker(filter=motion, calibration=None, growth=np.inf),
    }
    coming = [
        (k * STEP, name, places[k] + rng.normal(0.0, NOISE, 2))
        for k in range(0, round(duration / STEP), round(1.0 / RATE / STEP))
        for name, places in enumerate(walks)
        if rng.random() >= MISSED
    ]
    found: dict[str, list[np.ndarray]] = {name: [] for name in trackers}
    for k in range(0, round(duration / STEP), round(0.1 / STEP)):
        now = k * STEP
        arrived = [one for one in coming if one[0] + LATE <= now]
        coming = coming[len(arrived) :]
        for label, tracker in trackers.items():
            for one in arrived:
                tracker.update(*one)
            for tracks in tracker.at(now):
                later = k + np.rint(LEADS / STEP).astype(int)
                for id, place, velocity, error in zip(
                    tracks.ids, tracks.positions, tracks.velocities, tracks.uncertainties
                ):
                    if now >= WARM and isinstance(id, int):
                        ahead = place + LEADS[:, None] * velocity
                        distance = np.linalg.norm(ahead - walks[id][later], axis=1)
                        found[label].append(np.stack([distance, error.radius(LEADS, 2)]))
    return found


def main() -> None:
    """Measure and write."""
    parser = options(__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=1000, help="the first seed")
    parser.add_argument("--people", type=int, nargs="+", default=[1, 8])
    arguments = parser.parse_args()
    seeds, duration = (1, 11.0) if arguments.quick else (arguments.seeds, 40.0)
    rows, targets = [], []
    for people in arguments.people:
        for name, kinds in KINDS.items():
            runs = [judged(kinds, people, arguments.first + k, duration) for k in range(seeds)]
            for label in ("calibrated", "filter"):
                distance, radius = np.concatenate([one for run in runs for one in run[label]], axis=1).reshape(2, -1, 3)
                shares = np.mean(distance <= radius, axis=0)
                rows.append([f"{people}, {name}", label, *shares.tolist(), *np.median(radius, axis=0).tolist()])
                if kinds and label == "calibrated" and people > 1:
                    worst = float(np.abs(shares - PROMISED).max())
                    targets.append(target(f"{people}, {name}: share beside {PROMISED:g}", worst, most=NEAR))
    heads = [f"{what} {lead:g} s" for what in ("held", "radius m") for lead in LEADS]
    result: dict[str, Any] = {
        "question": "The share of predictions within the radius of 95 %.",
        "parameters": {"seeds": seeds, "first": arguments.first, "duration": duration},
        "tables": [table(f"from {WARM:g} s to {duration:g} s, {seeds} seeds:", ["people", "radii", *heads], rows)],
        "targets": targets,
    }
    finish("tracked_walkers", result, arguments)


if __name__ == "__main__":
    main()
