"""Compilation of kernels where numba, the cache or the names of modules are not as usual."""

import ast
import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from pages import blocks

from slalom import kernels
from slalom.kernels import entries, jit


def test_no_kernel_has_the_name_of_a_module() -> None:
    """An import of the module would replace the kernel in the package."""
    modules = {path.stem for path in Path(kernels.__file__).parent.glob("*.py")}
    assert not modules & set(kernels.__all__)


EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.py"))
KERNELS = sorted(Path(kernels.__file__).parent.rglob("*.py"))


def inside(*paths: Path) -> set[str]:
    """Return paths relative to the package."""
    return {path.relative_to(entries.ROOT / "slalom").as_posix() for path in paths}


@pytest.mark.parametrize("file", KERNELS, ids=lambda file: file.stem)
def test_kernels_import_at_their_heads(file: Path) -> None:
    """Above the first two blank lines, which is all that the key of the cache reads; and nothing above `kernels`."""
    nodes = [node for node in ast.walk(ast.parse(file.read_text())) if isinstance(node, ast.ImportFrom)]
    every = {node.module for node in nodes if node.module and node.module.startswith("slalom.")}
    read = {
        path.relative_to(entries.ROOT).with_suffix("").as_posix().replace("/", ".") for path in entries.imported(file)
    }
    assert every <= read | {name.rpartition(".")[0] for name in read}
    assert all(path in KERNELS or "tolerances" in path.name for path in entries.made_from(file))


def test_the_key_of_a_kernel_is_the_content_of_its_files(tmp_path: Path) -> None:
    """An edit elsewhere compiles nothing: of the view, and of the guidance for decisions."""
    shutil.copytree(entries.ROOT / "slalom", tmp_path / "slalom", ignore=shutil.ignore_patterns("__pycache__"))
    policy, guidance = (
        tmp_path / "slalom" / "kernels" / name for name in ("decision/policy.py", "guidance/traffic_circle.py")
    )

    def digests() -> list[str]:
        for function in (entries.imported, entries.made_from, entries.sources_digest):
            function.cache_clear()
        return [entries.sources_digest(file, tmp_path) for file in (policy, guidance)]

    def changed(name: str) -> list[bool]:
        before = digests()
        with (tmp_path / "slalom" / name).open("a") as file:
            file.write("\n")
        return [one != other for one, other in zip(before, digests())]

    assert changed("view/style.py") == [False, False]
    assert changed("kernels/decision/policy.py") == [True, False]
    assert changed("kernels/guidance/traffic_circle.py") == [False, True]
    assert changed("kernels/guidance/priority_inheritance.py") == [False, False]
    assert changed("kernels/selection/exchange.py") == [True, False]
    assert changed("kernels/jit.py") == [True, True]
    assert inside(*entries.made_from(entries.ROOT / "none.py")) >= inside(*KERNELS)


def halved(x: float) -> float:
    return 0.5 * x


def test_kernels_compile_with_a_numba_that_parts_are_not_known_to_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jit, "FITS", False)
    half = jit.kernel(halved)

    @jit.kernel
    def twice_halved(x: float) -> float:
        return half(half(x))

    assert twice_halved(3.0) == 0.75


@pytest.mark.slow
def test_kernels_compile_where_nothing_can_be_written() -> None:
    """In a read-only installation without a writable home kernels compile in every process, and a notice says so."""
    program = """
import numpy as np
from numba.core.caching import FunctionCache

def refuse(locator):
    raise OSError("read-only")

for locator in FunctionCache._impl_class._locator_classes:
    locator.ensure_cache_path = refuse

from slalom.kernels.decision.targets import earliest_arrival
print(earliest_arrival(np.array([3.0, 0.0]), np.zeros(2), 1.0, 1.0, 0.1) > 0.0)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout == "True\n", done.stderr
    assert done.stderr == kernels.compiling(kept=False) + "\n"


@pytest.mark.slow
def test_nothing_is_compiled_after_compile(tmp_path: Path) -> None:
    """No scenario, method, sample, export, example or block of the documentation needs a kernel that it did not make.

    Nor does a driver whose goal is taken away in front of a person, or a vehicle without a goal. `compile` loads each
    kernel that it makes: what is looked for later would be compiled, wherever it is kept.
    """
    program = """
import json
from pathlib import Path

import slalom
from slalom.cli import call
from slalom.io.table import SAMPLES
from slalom.kernels.entries import Entries
from slalom.sim import gallery, simulate
from slalom.vehicle import DifferentialDrive, Pose, VehicleNavigator

if __name__ == "__main__":
    slalom.compile(jobs=2)
    needed, use, load = [], "", Entries.load_overload

    def noted(self, *args):
        needed.append((use, self._function.__name__))
        return load(self, *args)

    Entries.load_overload = noted
    crowd = slalom.AvoidingCrowd(0.1)
    for k in range(3):
        crowd.predict(slalom.Tracks([(-3.0, 0.1 * k), (3.0, 0.0)], [(0.0, 1.0), (-1.0, 0.0)], 0.3, 0.1 * k))
    use = "no arrival found"
    navigator = slalom.Navigator(slalom.method("nao_ahead"), slalom.Disc(0.3), slalom.Limits(2.0, 2.0))
    goal = slalom.Goal(slalom.Stationary((9.0, 0.0)))
    rock = slalom.Obstacle(slalom.Disc(1.0), slalom.Stationary((4.0, 0.1)))
    begun = slalom.LookAhead(navigator, budget=1.0).decide(slalom.State((0.0, 0.0), (1.0, 0.0)), [rock], goal)
    assert begun.outcome.name == "BEGUN"
    use = "driver"
    car = DifferentialDrive(0.4, 1.2, 3.0, period=0.1, lag=0.15, delay=0.02)
    robot = VehicleNavigator(car, slalom.METHODS["nao"], slalom.Disc(0.3))
    driver, pose = slalom.Driver(robot, slalom.Tracker(slalom.Disc(0.3))), Pose((0.0, 0.0), 0.0, 1.0)
    for k in range(12):
        driver.head_for(goal if k < 5 else None)
        driver.see(0.1 * k, [("person", (pose.position[0] + 1.0, 0.1))] if k >= 5 else [])
        driver.locate(0.1 * k, pose)
        pose = car.drive(pose, driver.command(0.1 * k).command)
    for use in gallery.GALLERY:
        for method in ("nao", "vo", "nao_shared", "avo", "rvo", "nao_ahead"):
            try:
                simulate(gallery.build(use, {"duration": 0.3}), slalom.METHODS[method])
            except slalom.InvalidInput:
                # Not every method is for every scenario.
                continue
    for use in set(SAMPLES) - {"study.yaml"}:
        call(["run", f"sample:{use}", "--out", "run.h5"])
        call(["export", "run.h5", "page.html", "--force"])
    for use, code in json.loads(Path("blocks.json").read_text()):
        try:
            exec(compile(code, use, "exec"), {"__name__": "__documentation__"})
        except (ImportError, SystemExit):
            # The block is about an extra that is not installed, or needs arguments of its command line.
            continue
    Path("needed.json").write_text(json.dumps(needed))
"""
    script = tmp_path / "program.py"
    script.write_text(program)
    examples = [(path.name, path.read_text()) for path in EXAMPLES]
    (tmp_path / "blocks.json").write_text(json.dumps([*blocks("python"), *examples]))
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert json.loads((tmp_path / "needed.json").read_text()) == []
