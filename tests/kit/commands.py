"""Commands of the command line, run in this process."""

import json
from collections.abc import Callable
from typing import Any, NamedTuple

import pytest

from slalom import kernels
from slalom.cli import call


class Said(NamedTuple):
    """What a command did."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> dict[str, Any]:
        """The one object on stdout, with nothing on stderr."""
        assert self.err == ""
        return self.noted_json

    @property
    def noted_json(self) -> dict[str, Any]:
        """The one object on stdout, with notes on stderr."""
        assert self.out.endswith("\n")
        assert len(self.out.splitlines()) == 1
        found = json.loads(self.out, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))
        assert isinstance(found, dict)
        return found


Say = Callable[..., Said]


def but_notice(err: str) -> str:
    """What was said on stderr but that kernels compile: whether they do depends on the tests before."""
    return err.replace(kernels.compiling(kept=True) + "\n", "")


def saying(capsys: pytest.CaptureFixture[str]) -> Say:
    """A function that runs a command."""

    def run(*tokens: object) -> Said:
        capsys.readouterr()
        code = call([str(token) for token in tokens])
        out, err = capsys.readouterr()
        return Said(code, out, but_notice(err))

    return run
