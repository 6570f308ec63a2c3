"""Checks of a release: `make release-check`. Needs PyPI; minutes for each Python.

Builds the sdist and from it the wheel, compares the wheel with the sources, and installs it into a clean environment
of every Python that is available. There it runs from another folder, without a home, and without the right to write
into the installation. With --compiled FILE it checks such a wheel alone: with an empty cache nothing compiles.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from email.parser import Parser
from importlib import metadata
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[1]
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
LARGEST = 1.5e6
"""[B] Largest wheel: the sources, a recording of 1.5 MB before compression, and the renderer of the view."""
LARGEST_COMPILED = 25e6
"""[B] Largest wheel with compiled kernels."""
EXPECTED = re.compile(r"slalom/[\w/]+\.(py|pyi)|slalom/py\.typed|slalom/data/[\w.]+|slalom/live/renderer/[\w.]+")
"""Files that belong into the wheel, besides its metadata."""
SMOKE = (
    (0, ["--version"]),
    (0, ["list", "--json"]),
    (0, ["export-scenario", "head_on"]),
    (0, ["decide", "sample:crossing.yaml", "--json"]),
    (0, ["run", "sample:crossing.yaml", "--out", "new/run.h5", "--figure", "new/run.svg"]),
    (0, ["show", "new/run.h5", "--json"]),
    (0, ["convert", "new/run.h5", "new/run.csv"]),
    (2, ["run", "none.yaml"]),
)
"""Exit codes and words of commands."""

CORE = """
import sys

import numpy as np

import slalom
from slalom import *

assert "sim" not in slalom.__all__ and "view" not in dir(slalom)
rock = Obstacle(Disc(0.5), Stationary((4.0, 0.1)))
robot = Navigator(method("nao"), Disc(0.4), Limits(2.0, 2.0))
decision = robot.decide(State((0.0, 0.0), (1.0, 0.0)), [rock], Goal(Stationary((8.0, 0.0))))
assert decision.safe
places = np.array([(-3.0, 0.0), (3.0, 0.0)])
fleet = Fleet(method("nao_shared"), Disc(0.3), Limits(2.0, 2.0), robots=2)
assert np.isfinite(fleet.step(0.0, places, 0.0 * places, -places).accelerations).all()
for name in ("sim", "view"):
    try:
        __import__(f"slalom.{name}")
    except MissingExtra as error:
        assert f"`pip install 'slalom[{name}]'`" in str(error), error
    else:
        sys.exit(f"slalom.{name}: expected MissingExtra, found none")
"""
"""Use of an installation without extras: it decides, moves a fleet, and names what is missing."""
BEGINNING = "import slalom as s\nstate, goal = s.State((0.0, 0.0), (1.0, 0.0)), s.Goal(s.Stationary((8.0, 0.0)))\n"
FIRST = {
    "decision": "s.Navigator(s.method('nao'), s.Disc(0.4), s.Limits(2.0, 2.0)).decide("
    "state, [s.Obstacle(s.Disc(0.5), s.Stationary((4.0, 0.1)))], goal)",
    "step of a fleet": "s.Fleet(s.method('nao'), s.Disc(0.3), s.Limits(2.0, 2.0), robots=2).step("
    "0.0, [(-3.0, 0.0), (3.0, 0.0)], [(0.0, 0.0)] * 2, [(3.0, 0.0), (-3.0, 0.0)])",
    "decision of a vehicle": "from slalom.vehicle import DifferentialDrive, Pose, VehicleNavigator\n"
    "robot = VehicleNavigator(DifferentialDrive(0.4, 1.0, 2.0), s.method('nao'), s.Rectangle(0.6, 0.4))\n"
    "robot.decide(Pose((0.0, 0.0), 0.2), [s.Obstacle(s.Disc(0.5), s.Stationary((5.0, 0.4)))], goal)",
    "slalom run sample:crossing.yaml": "from slalom.cli import call\nassert call(['run', 'sample:crossing.yaml']) == 0",
}
"""First uses of a process. The command needs `slalom[sim]`."""
REFUSING = """
from numba.core.event import Listener, register

class Refuse(Listener):
    def on_start(self, event):
        raise SystemExit(f"expected a compiled kernel, found none of {event.data['dispatcher'].__name__}")

    def on_end(self, event):
        pass

register("numba:compile", Refuse())
"""
"""After it nothing can compile."""
NO_COMMAND = "slalom: expected the packages of `pip install 'slalom[sim]'`, found no "
"""What the command says without extras."""


class Failed(SystemExit):
    """A check that did not hold; its text is printed, and the exit code is 1."""


def run(command: Sequence[str | Path], **settings: object) -> subprocess.CompletedProcess[str]:
    """Run a program and return what it said."""
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False, **settings)  # type: ignore[call-overload]


def required(command: Sequence[str | Path], **settings: object) -> str:
    """Return the output of a program that must succeed."""
    done = run(command, **settings)
    if done.returncode:
        raise Failed(f"{' '.join(map(str, command))}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def built(folder: Path) -> tuple[Path, Path]:
    """Return the sdist, and the wheel that is built from it."""
    required([sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, ROOT])
    (sdist,), (wheel,) = folder.glob("*.tar.gz"), folder.glob("*.whl")
    return sdist, wheel


def check_contents(sdist: Path, wheel: Path) -> None:
    """Print and check what is in both files."""
    with zipfile.ZipFile(wheel) as file:
        sizes = {info.filename: info.file_size for info in file.infolist()}
        described = Parser().parsestr(file.read(next(name for name in sizes if name.endswith("METADATA"))).decode())
    inside = {name for name in sizes if ".dist-info/" not in name}
    strange = sorted(name for name in inside if not EXPECTED.fullmatch(name))
    tracked = required(["git", "ls-files", "src/slalom"], cwd=ROOT).splitlines()
    missing = sorted({name.removeprefix("src/") for name in tracked} - inside)
    with tarfile.open(sdist) as file:
        shipped = {name.partition("/")[2] for name in file.getnames()}
    needed = {"README.md", "CHANGELOG.md", "SECURITY.md", "LICENSE", "CITATION.cff", "pyproject.toml", "docs/conf.py"}
    print(f"{sdist.name}: {sdist.stat().st_size / 1e6:.2f} MB, {len(shipped)} files")
    print(f"{wheel.name}: {wheel.stat().st_size / 1e6:.2f} MB, {len(sizes)} files, of which the largest are")
    for name in sorted(sizes, key=lambda name: -sizes[name])[:6]:
        print(f"  {sizes[name] / 1e3:8.1f} kB  {name}")
    for what, found in (("unexpected", strange), ("missing", missing), ("missing in the sdist", needed - shipped)):
        if found:
            raise Failed(f"{wheel.name}: {what}: {', '.join(sorted(found))}")
    if wheel.stat().st_size > LARGEST:
        raise Failed(f"{wheel.name}: expected at most {LARGEST / 1e6:g} MB, found {wheel.stat().st_size / 1e6:.2f}")
    for name in (
        "Summary",
        "Keywords",
        "Requires-Python",
        "License-Expression",
        "Description-Content-Type",
        "Project-URL",
    ):
        if not described.get(name):
            raise Failed(f"{wheel.name}: expected {name} in the metadata, found none")


def interpreters() -> dict[str, str]:
    """Return the available Pythons by version: on the path, and those that pyenv has installed."""
    found: dict[str, str] = {}
    for version in PYTHONS:
        kept = sorted(Path.home().glob(f".pyenv/versions/{version}.*/bin/python{version}"))
        candidates = [shutil.which(f"python{version}"), *map(str, kept)]
        works = [path for path in candidates if path and not run([path, "-c", "import venv"]).returncode]
        if works:
            found[version] = works[-1]
    return found


def check_installed(python: str, wheel: Path, folder: Path) -> None:
    """Install the wheel into a clean environment, without extras and with all, and use it there."""
    environment, other = folder / "environment", folder / "elsewhere"
    required([python, "-m", "venv", environment])
    program = environment / "bin" / "python"
    pip = [program, "-m", "pip", "--disable-pip-version-check"]
    other.mkdir()
    settings = {"PATH": os.defpath, "HOME": "/nonexistent", "PYTHONDONTWRITEBYTECODE": "1", "MPLCONFIGDIR": str(other)}
    cache = {"NUMBA_CACHE_DIR": str(other / "kernels")}
    required([*pip, "install", "--quiet", wheel])
    print(f"  without extras: {required([*pip, 'check']).strip()}")
    required([program, "-c", CORE], cwd=other, env=settings | cache)
    command = run([environment / "bin" / "slalom", "--version"], cwd=other, env=settings)
    if command.returncode != 2 or not re.fullmatch(re.escape(NO_COMMAND) + r"\w+\n", command.stderr):
        raise Failed(f"slalom: expected {NO_COMMAND}..., found {command.returncode}\n{command.stderr}")
    required([*pip, "install", "--quiet", f"{wheel}[all]"])
    print(f"  with all: {required([*pip, 'check']).strip()}")
    with read_only(environment) as prefix:
        for code, words in SMOKE:
            # One command compiles in memory, as where no folder can be written; the others keep what they compile.
            kept = {} if words[0] == "decide" else cache
            done = run([*prefix, environment / "bin" / "slalom", *words], cwd=other, env=settings | kept)
            if done.returncode != code or not (done.stdout or code):
                said = f"found {done.returncode}\n{done.stdout}{done.stderr}"
                raise Failed(f"slalom {' '.join(words)}: expected exit code {code}, {said}")
            print(f"  slalom {' '.join(words)}: {done.returncode}")


def check_compiled(wheel: Path) -> None:
    """Install a wheel with compiled kernels into a clean environment: it compiles nothing."""
    if (size := wheel.stat().st_size) > LARGEST_COMPILED:
        raise Failed(f"{wheel.name}: expected at most {LARGEST_COMPILED / 1e6:g} MB, found {size / 1e6:.2f}")
    with TemporaryDirectory() as folder:
        program = Path(folder, "environment", "bin", "python")
        required([sys.executable, "-m", "venv", Path(folder, "environment")])
        pip = [program, "-m", "pip", "install", "--quiet", f"numba=={metadata.version('numba')}"]
        settings = {"PATH": os.defpath, "HOME": "/nonexistent", "NUMBA_CACHE_DIR": str(Path(folder, "empty"))}
        required([*pip, wheel])
        required([program, "-c", REFUSING + CORE], cwd=folder, env=settings)
        required([*pip, f"{wheel}[sim]"])
        print(f"{wheel.name}: {size / 1e6:.2f} MB; nothing compiles. Processor time:")
        for what, code in FIRST.items():
            before = sum(os.times()[2:4])
            required([program, "-c", REFUSING + BEGINNING + code], cwd=folder, env=settings)
            print(f"  {sum(os.times()[2:4]) - before:.1f} s  first {what}")


@contextmanager
def read_only(folder: Path) -> Iterator[list[str]]:
    """Take the right to write into a folder away; yield the beginning of commands for which that holds.

    For root it holds only without capabilities, which setpriv drops.
    """
    prefix = ["setpriv", "--bounding-set=-all", "--inh-caps=-all"] if os.getuid() == 0 else []
    paths = [folder, *folder.rglob("*")]
    modes = {path: path.stat().st_mode for path in paths if not path.is_symlink()}
    try:
        for path, mode in modes.items():
            path.chmod(mode & ~0o222)
        if not run([*prefix, "touch", folder / "written"]).returncode:
            raise Failed(f"{folder}: expected a folder that cannot be written, found one that can")
        yield prefix
    finally:
        for path, mode in modes.items():
            path.chmod(mode)


def main() -> None:
    """Make every check; print what was seen."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pythons", nargs="*", default=PYTHONS, help="versions to install into, if available")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "dist", help="folder for sdist and wheel")
    parser.add_argument("--compiled", type=Path, help="check this wheel with compiled kernels, and nothing else")
    options = parser.parse_args()
    if options.compiled:
        check_compiled(options.compiled)
        return
    shutil.rmtree(options.out, ignore_errors=True)
    sdist, wheel = built(options.out)
    check_contents(sdist, wheel)
    available = interpreters()
    for version in options.pythons:
        if version not in available:
            print(f"Python {version}: not available here, not checked")
            continue
        print(f"Python {version}:")
        with TemporaryDirectory() as folder:
            check_installed(available[version], wheel, Path(folder))
    print(f"The release is in {options.out}.")


if __name__ == "__main__":
    main()
