"""A loop of your own that is killed and goes on, with the metrics and the video of a simulated run."""

import pickle
from pathlib import Path
from tempfile import mkdtemp

import numpy as np

import slalom
from slalom.sim import metrics, record
from slalom.view import animate

DT, STEPS = 0.1, 300
shelves = [slalom.Obstacle(slalom.Rectangle(4, 1), slalom.Stationary((x, 0)), f"shelf {x}") for x in (-4, 4)]
stations = np.array([(x, y) for x in (-6, -2, 2, 6) for y in (-3, 3)], float)
folder = Path(mkdtemp())


def drive(steps: int) -> dict:
    """Drive on from the last state that was kept, for some steps; each robot that arrives gets another station."""
    kept = folder / "kept.pickle"
    if kept.exists():
        at = pickle.loads(kept.read_bytes())
    else:
        fleet = slalom.Fleet(
            slalom.method("nao_shared"),
            slalom.Disc(0.3),
            slalom.Limits(1.5, 1.5),
            robots=6,
            obstacles=shelves,
            period=DT,
        )
        at = {"run": record(fleet), "random": np.random.default_rng(0), "k": 0, "done": 0, "to": np.arange(6)}
        at |= {"places": stations[[1, 0, 3, 2, 5, 4]], "moves": np.zeros((6, 2))}
    for _ in range(steps):
        decided = at["run"].step(DT * at["k"], at["places"], at["moves"], stations[at["to"]])
        at |= {"places": decided.positions, "moves": decided.velocities, "k": at["k"] + 1}
        for robot in np.flatnonzero(np.linalg.norm(at["places"] - stations[at["to"]], axis=1) < 0.2):
            at["to"][robot] = at["random"].choice(np.setdiff1d(np.arange(len(stations)), at["to"]))
            at["done"] += 1
    kept.write_bytes(pickle.dumps(at))
    return at


drive(STEPS // 2)  # here the program may be killed
found = drive(STEPS // 2)
recording = found["run"].recording
recording.save(folder / "run.h5")  # for slalom view, export, animate and convert --per-agent
animate(recording, folder / "run.gif", width=320, fps=2.0)
row = metrics.summary(recording)
print(f"{found['done']} stations reached in {DT * STEPS:.0f} s, {row['collisions']} collisions")
