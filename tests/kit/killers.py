"""Work that kills the process it is done in; in a module of its own, so that other processes find it."""

import os
import signal
import time
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple


class Job(NamedTuple):
    """An item of work: `kills` times the process that does it is killed, after `after` [s], and then it is done.

    What happens is noted in `folder`: NAME.begun holds a letter for each time it was begun.
    """

    name: str
    folder: str
    kills: int = 0
    after: float = 0.0


def work(job: Job) -> str:
    """The name of the job twice."""
    begun = Path(job.folder, f"{job.name}.begun")
    with begun.open("a") as file:
        file.write("x")
    time.sleep(job.after)
    if begun.stat().st_size <= job.kills:
        os.kill(os.getpid(), signal.SIGKILL)
    return 2 * job.name


def kept(job: Job) -> str:
    """The same, and the result is kept in the folder."""
    result = work(job)
    Path(job.folder, f"{job.name}.kept").write_text(result)
    return result


def recalled(jobs: Iterable[Job]) -> dict[str, str]:
    """What is kept of these jobs."""
    places = {job.name: Path(job.folder, f"{job.name}.kept") for job in jobs}
    return {name: place.read_text() for name, place in places.items() if place.exists()}


def begun(job: Job) -> int:
    """How often it was begun."""
    place = Path(job.folder, f"{job.name}.begun")
    return place.stat().st_size if place.exists() else 0
