"""One certified decision compared with a model predictive controller on the same task: casadi with IPOPT.

usage: python benchmarks/mpc.py [--scenes 40] [--quick] [--out FOLDER]

The controller uses multiple shooting with 20 steps over 6 s. The robot is a double integrator with limits on speed and
acceleration. At each step the distance to the true positions of the 30 obstacles is constrained. The objective is the
desired velocity with little effort. The controller is warm started from its own solution 0.1 s earlier, which is not
timed. The time of a scene is that of the fastest repeated call; the table gives the median over the scenes. Needs the
package casadi.
"""

import sys
from typing import Any

import numpy as np
from machine import microseconds
from program import finish, options, table, target
from tasks import HORIZON, LIMITS, OBSTACLES, Task, families

from slalom import select

STEPS, PERIOD, EFFORT, ITERATIONS = 20, 0.1, 0.1, 300
STEP = HORIZON / STEPS
OFTEN = 100
"""Calls of slalom per scene: together still faster than one call of the controller."""
TIMES = STEP * np.arange(STEPS + 1)


class Controller:
    """The nonlinear program, built once, and its solution for a task."""

    def __init__(self) -> None:
        import casadi as ca

        x, u = ca.SX.sym("x", 4, STEPS + 1), ca.SX.sym("u", 2, STEPS)
        start, desired = ca.SX.sym("start", 4), ca.SX.sym("desired", 2)
        near, others = ca.SX.sym("near", OBSTACLES), ca.SX.sym("others", 2, OBSTACLES * STEPS)
        cost, equal, bounded, apart = EFFORT * ca.sumsqr(u), [x[:, 0] - start], [], []
        for k in range(STEPS):
            position, velocity, acceleration = x[:2, k], x[2:, k], u[:, k]
            after = ca.vertcat(
                position + STEP * velocity + 0.5 * STEP**2 * acceleration, velocity + STEP * acceleration
            )
            equal.append(x[:, k + 1] - after)
            bounded += [ca.sumsqr(acceleration) - LIMITS.max_acceleration**2]
            bounded += [ca.sumsqr(x[2:, k + 1]) - LIMITS.max_speed**2]
            gaps = others[:, k * OBSTACLES : (k + 1) * OBSTACLES] - ca.repmat(x[:2, k + 1], 1, OBSTACLES)
            apart.append(near**2 - ca.sum1(gaps * gaps).T)
            cost += ca.sumsqr(x[2:, k + 1] - desired)
        rows = ca.vertcat(*equal, *bounded, *apart)
        self._most = np.zeros(rows.shape[0])
        self._least = np.where(np.arange(rows.shape[0]) < 4 * (STEPS + 1), 0.0, -np.inf)
        problem = {
            "x": ca.vertcat(ca.vec(x), ca.vec(u)),
            "f": cost,
            "g": rows,
            "p": ca.vertcat(start, desired, near, ca.vec(others)),
        }
        settings = {"print_level": 0, "sb": "yes", "max_iter": ITERATIONS, "warm_start_init_point": "yes"}
        self._solver = ca.nlpsol("mpc", "ipopt", problem, {"print_time": False, "ipopt": {**settings, "mu_init": 1e-2}})

    def solve(self, task: Task, before: float, last: dict[str, Any] | None = None) -> dict[str, Any]:
        """The solution `before` [s] before the time of the task, warm started from the `last` one."""
        values = parameters(task, before)
        if last is None:
            position, velocity = values[:2], values[2:4]
            states = np.column_stack([position + TIMES[:, None] * velocity, np.tile(velocity, (STEPS + 1, 1))])
            begin = {"x0": np.concatenate([states.ravel(), np.zeros(2 * STEPS)])}
        else:
            begin = {"x0": last["x"], "lam_x0": last["lam_x"], "lam_g0": last["lam_g"]}
        return dict(self._solver(**begin, p=values, lbg=self._least, ubg=self._most))

    @property
    def converged(self) -> bool:
        """Whether IPOPT converged."""
        return bool(self._solver.stats()["success"])

    @property
    def iterations(self) -> int:
        """Iterations of the last solution."""
        return int(self._solver.stats()["iter_count"])


def parameters(task: Task, before: float) -> np.ndarray:
    """Parameters of the program: the state, the desired velocity, the radii, the future positions of the obstacles."""
    s = task.situation
    position, now = s.state.position - before * s.state.velocity, s.now - before
    desired = s.goal.desired_velocity(position, s.state.velocity, now, s.limits)
    times = now + TIMES[1:]
    others = np.array([obstacle.trajectory.position(times) for obstacle in task.blocked.obstacles.obstacles])
    return np.concatenate([position, s.state.velocity, desired, task.radii, others.transpose(1, 0, 2).ravel()])


def measure(scenes: int, repeat: int) -> dict[str, Any]:
    """slalom and the controller on both families of scenes."""
    controller, rows, result = Controller(), [], {}
    for family, tasks in families(scenes).items():
        mine, theirs, iterations, converged, free = [], [], [], 0, 0
        for task in tasks:
            last = controller.solve(task, PERIOD)

            def again(task: Task = task, last: dict[str, Any] = last) -> object:
                return controller.solve(task, 0.0, last)

            theirs.append(microseconds(again, repeat, 0.0))
            converged += controller.converged
            iterations.append(controller.iterations)

            def decide(task: Task = task) -> object:
                return select(task.preferred, task.situation.admissible, task.fresh())

            mine.append(microseconds(decide, OFTEN, 0.0))
            free += select(task.preferred, task.situation.admissible, task.blocked).safe
        us, slow = float(np.median(mine)), float(np.median(theirs))
        result[family] = {
            "slalom_us": us,
            "mpc_us": slow,
            "ratio": slow / us,
            "converged": converged / scenes,
            "slalom_free": free / scenes,
            "iterations": float(np.median(iterations)),
        }
        rows.append([family, *result[family].values()])
    heads = ["scenes", "slalom median us", "MPC median us", "ratio", "share IPOPT converged", "share slalom finds one"]
    return {
        "question": "One certified decision compared with a model predictive controller with IPOPT",
        "parameters": {"scenes": scenes, "steps": STEPS, "horizon_s": HORIZON, "obstacles": OBSTACLES, "warm": True},
        "tables": [table("Time of one decision", [*heads, "median iterations"], rows)],
        "targets": [
            target("model predictive controller over slalom", min(r["ratio"] for r in result.values()), least=1.0)
        ],
        "results": result,
    }


def main() -> None:
    """Measure, print, write."""
    parser = options(__doc__)
    parser.add_argument("--scenes", type=int, default=40)
    arguments = parser.parse_args()
    try:
        import casadi  # noqa: F401
    except ImportError:
        sys.exit("benchmarks/mpc.py needs the package casadi, which is not installed: pip install 'slalom[bench]'")
    quick = arguments.quick
    finish("mpc", measure(2 if quick else arguments.scenes, 1 if quick else 3), arguments, ["casadi"])


if __name__ == "__main__":
    main()
