"""Compilation of kernels where numba, the cache or the names of modules are not as usual."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from slalom import kernels
from slalom.kernels import jit


def test_no_kernel_has_the_name_of_a_module() -> None:
    """An import of the module would replace the kernel in the package."""
    modules = {path.stem for path in Path(kernels.__file__).parent.glob("*.py")}
    assert not modules & set(kernels.__all__)


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

from slalom.kernels.decision.time_to_go import earliest_arrival
print(earliest_arrival(np.array([3.0, 0.0]), np.zeros(2), 1.0, 1.0, 0.1) > 0.0)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout == "True\n", done.stderr
    assert done.stderr == kernels.compiling(kept=False) + "\n"


@pytest.mark.slow
def test_nothing_is_compiled_after_compile(tmp_path: Path) -> None:
    """No scenario of the gallery, no method, no figure needs a kernel that `slalom.compile` did not make."""
    program = """
from numba.core.event import Listener, register

import slalom
from slalom.sim import gallery, simulate

if __name__ == "__main__":
    slalom.compile(jobs=2)

    class Noted(Listener):
        def on_start(self, event):
            print(event.data["dispatcher"].__name__)

        def on_end(self, event):
            pass

    register("numba:compile", Noted())
    crowd = slalom.AvoidingCrowd(0.1)
    for k in range(3):
        crowd.predict(slalom.Tracks([(-3.0, 0.1 * k), (3.0, 0.0)], [(0.0, 1.0), (-1.0, 0.0)], 0.3, 0.1 * k))
    for name in gallery.GALLERY:
        for method in ("nao", "vo", "nao_shared", "avo", "rvo", "nao_ahead"):
            try:
                simulate(gallery.build(name, {"duration": 0.3}), slalom.METHODS[method])
            except slalom.InvalidInput:
                # Not every method is for every scenario.
                continue
"""
    script = tmp_path / "program.py"
    script.write_text(program)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    assert done.stdout == ""
