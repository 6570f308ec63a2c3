"""Facts that every benchmark writes with its numbers: the machine, the versions, and the speed at that moment."""

import json
import os
import platform
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

PACKAGES = ("slalom", "numpy", "numba", "llvmlite")


def describe() -> dict[str, Any]:
    """Machine and versions."""
    model = ""
    info = Path("/proc/cpuinfo")
    if info.exists():
        model = next((line.split(":")[1].strip() for line in info.read_text().splitlines() if "model name" in line), "")
    return {
        "machine": platform.machine(),
        "processor": model or platform.processor(),
        "cores": os.cpu_count(),
        "system": platform.system(),
        "python": platform.python_version(),
        **{name: version(name) for name in PACKAGES},
    }


def replace_text(file: Path, text: str) -> None:
    """Write a file at once: an interrupted program leaves the old text or the new one."""
    beside = file.with_name(file.name + ".part")
    beside.write_text(text)
    beside.replace(file)


def microseconds(call: Callable[[], Any], repeat: int = 30, share: float = 0.5) -> float:
    """Median time of one call [us], or another quantile (0: the fastest). The first call is not counted."""
    call()
    spent = []
    for _ in range(repeat):
        start = time.perf_counter()
        call()
        spent.append(time.perf_counter() - start)
    return float(np.quantile(spent, share)) * 1e6


def loop() -> float:
    """Time of a million additions in Python [ms]. Under load the same machine takes several times as long."""

    def add() -> None:
        total = 0
        for k in range(1_000_000):
            total += k

    return microseconds(add, 7) / 1e3


def write(name: str, result: dict[str, Any], folder: Path) -> Path:
    """Write the result with the description of the machine as JSON; return the path."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.json"
    path.write_text(json.dumps({"machine": describe(), "loop_ms": loop(), **result}, indent=2) + "\n")
    return path
