"""Code blocks of the documentation: executed while the site is built, with what they print and draw below them."""

import io
import re
import shlex
from collections.abc import Callable
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from slalom.cli import call

BLOCK = re.compile(r"^(```(python|console)\n(.*?)^```\n)(?:\n```text\n.*?^```\n)?", re.DOTALL | re.MULTILINE)
"""A block of code: Python, or commands after a `$`; and the stated output, which the real one replaces."""


def executed(text: str, folder: Path, save: Callable[[Figure], str]) -> str:
    """Return a page with the outputs of its blocks, which run in order in one namespace.

    Args:
        folder: in which they run. save: writes the `figure` that a block has made and returns its address.

    Raises:
        RuntimeError: a command that fails. Errors of Python blocks are raised as they are.
    """
    namespace: dict[str, Any] = {"__name__": "__documentation__"}

    def output(match: re.Match[str]) -> str:
        block, language, code = match.groups()
        namespace.pop("figure", None)
        said = io.StringIO()
        with chdir(folder), redirect_stdout(said):
            if language == "python":
                exec(compile(code, "a block of the documentation", "exec"), namespace)
            else:
                for command in commands_of(code):
                    _run(command)
        parts = [block]
        if said.getvalue():
            parts.append(f"```text\n{said.getvalue().rstrip()}\n```\n")
        drawn = [namespace["figure"]] if isinstance(namespace.get("figure"), Figure) else []
        parts += [f"![The figure of the block above]({save(figure)})\n" for figure in drawn]
        return "\n".join(parts)

    return BLOCK.sub(output, text)


def commands_of(code: str) -> list[list[str]]:
    """Return the words of each slalom command of a block of commands."""
    lines = [line.removeprefix("$ ") for line in code.splitlines()]
    return [shlex.split(line, comments=True) for line in lines if line.startswith("slalom ")]


def _run(command: list[str]) -> None:
    """Run a command; its file after > gets its output. Exit code 1 says that a robot did not arrive."""
    said = io.StringIO()
    words, target = (command[:-2], command[-1]) if ">" in command else (command, None)
    errors = io.StringIO()
    with redirect_stderr(errors), redirect_stdout(said):
        code = call(words[1:])
    if code == 2:
        raise RuntimeError(f"{shlex.join(command)}: expected a command that works, found {errors.getvalue()}")
    if target is None:
        print(said.getvalue(), end="")
    else:
        Path(target).write_text(said.getvalue())
