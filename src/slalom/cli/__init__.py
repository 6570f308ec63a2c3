"""Command line: run, list, decide, compare, convert, show, export-scenario, view, export and others.

Results on stdout, everything else on stderr.

Each module holds one or two commands. Heavy imports are inside the commands, so that `slalom --help` starts fast.
"""

import io
import sys
from collections.abc import Sequence

from slalom import __version__, kernels
from slalom.base.errors import Extra, SlalomError

with Extra("sim", "slalom"):
    from cyclopts import App, CycloptsError, UnusedCliTokensError

    from slalom.cli.comparing import compare
    from slalom.cli.console import BAD_INPUT, DONE, FAILED, discard_output, print_compiled, print_message
    from slalom.cli.files import convert, explain
    from slalom.cli.others import compile_, list_, reproduce, ros
    from slalom.cli.running import export_scenario, run, show
    from slalom.cli.viewing import animate, export, view

__all__ = ["BAD_INPUT", "DONE", "FAILED", "app", "call", "main"]

app = App(
    name="slalom",
    help="Reactive robot navigation with velocity and acceleration obstacles.",
    version=__version__,
    version_flags=["--version"],
    help_format="plaintext",
    result_action="return_value",
)
app.command(run, help_format="markdown")
app.command(list_, name="list", help_format="markdown")
app.command(explain, name=("explain", "decide"), help_format="markdown")
app.command(compare, help_format="markdown")
app.command(convert, help_format="markdown")
app.command(show, help_format="markdown")
app.command(export_scenario, name="export-scenario", help_format="markdown")
app.command(view, help_format="markdown")
app.command(export, help_format="markdown")
app.command(animate, help_format="markdown")
app.command(reproduce, help_format="markdown")
app.command(compile_, name="compile", help_format="markdown")
app.command(ros)


def main(tokens: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 0 success, 1 failure of the run, 2 invalid input."""
    sys.exit(call(tokens))


def call(tokens: Sequence[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # Names in files may hold what the encoding of the terminal does not.
            stream.reconfigure(errors="backslashreplace")
    kernels.when_compiling[:] = [print_message]
    kernels.while_compiling[:] = [print_compiled] if sys.stderr.isatty() else []
    try:
        code = app(tokens, exit_on_error=False, print_error=False)
    except UnusedCliTokensError as error:
        print_message(f"slalom: expected no further words, found {' '.join(error.unused_tokens or ())!r}")
        return BAD_INPUT
    except CycloptsError as error:
        print_message(f"slalom: {error}")
        return BAD_INPUT
    except SlalomError as error:
        print_message(str(error))
        return BAD_INPUT
    except BrokenPipeError:
        # The reader of stdout (head, less) has closed it: stop without output.
        discard_output()
        return FAILED
    except OSError as error:
        # Of a package: without space for temporary files, for example.
        print_message(f"slalom: expected folders that can be read and written, found {error}")
        return BAD_INPUT
    except MemoryError:
        print_message("slalom: expected a task that fits into the memory, found one that does not")
        return BAD_INPUT
    return code if isinstance(code, int) else DONE
