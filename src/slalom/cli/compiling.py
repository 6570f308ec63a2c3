"""`slalom compile`."""

from typing import Annotated

from cyclopts import Parameter

from slalom.cli.console import Whole, print_message


def compile_(
    *uses: Annotated[str, Parameter(help="robot, polygons, fleets, space, ahead, crowd, figures; all by default.")],
    jobs: Annotated[Whole, Parameter(help="Number of processes.")] = 2,
) -> None:
    """Compile all kernels, once after an installation; decisions after it compile nothing.

    Without it, the first use compiles the kernels that it needs. The result is kept on disk for this user. Each process
    loads kernels when it first uses them; `slalom.compile()` in Python loads all.
    """
    from slalom.checks import known, whole
    from slalom.precompile import USES, compile as compile_uses

    for name in uses:
        known(name, "uses", list(USES))
    whole(jobs, "jobs", 1)
    print_message("slalom: compiling, one to two minutes after an installation, seconds later on")
    compile_uses(*uses, jobs=jobs, progress=lambda name, seconds: print_message(f"{name}: {seconds:.1f} s"))
