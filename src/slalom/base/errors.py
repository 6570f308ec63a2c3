"""Exceptions of slalom: one base class with few subclasses, so that no exception of a backend reaches the caller."""

import errno
import re
from collections.abc import Mapping
from importlib.util import find_spec
from types import TracebackType
from typing import Final

MESSAGE_LINE: Final = 1000
"""[1] Characters of a line about a mistake in a file; a longer line is cut there.

Larger: messages flood the terminal. Smaller: the list of formats, or of the keys of a part, is cut.
"""


REASONS: Final = {
    errno.ENOENT: "no such file or folder",
    errno.EACCES: "no permission",
    errno.EPERM: "no permission",
    errno.EROFS: "a folder that cannot be written",
    errno.EEXIST: "a file of that name",
    errno.ENOTDIR: "a file in place of a folder",
    errno.EISDIR: "a folder",
    errno.ENOSPC: "no space left",
    errno.ENAMETOOLONG: "a name that is too long",
}
"""Causes of errors of the operating system, as the end of "expected ..., found"."""


class SlalomError(Exception):
    """Base class of all errors that slalom raises deliberately."""


class InvalidInput(SlalomError, ValueError):
    """Invalid value; the message states the expected value, the found one, and its place."""


class MissingExtra(InvalidInput, ModuleNotFoundError):
    """Use of a part of slalom whose packages are not installed; the message names the extra to install.

    It is an ImportError too, as of every import that fails.
    """

    def __init__(self, extra: str, where: str, found: str, module: str | None = None) -> None:
        self._given = (extra, where, found, module)
        super().__init__(f"{where}: expected the packages of `pip install 'slalom[{extra}]'`, found {found}")
        self.name = module

    def __reduce__(self) -> tuple[type["MissingExtra"], tuple[str, str, str, str | None]]:
        """Make the error picklable: it may come from another process."""
        return type(self), self._given


class OutsideSpan(SlalomError, ValueError):
    """A trajectory was evaluated at a time at which its obstacle does not exist."""


class InvalidFile(SlalomError):
    """Invalid content of a file; one line per mistake, `file:line:column: expected, found`.

    A line shows at most MESSAGE_LINE characters of its mistake, and those that cannot be printed as escape sequences.
    """

    def __init__(self, mistakes: list[str]) -> None:
        self.mistakes = [_line(mistake) for mistake in mistakes]
        super().__init__("\n".join(self.mistakes))

    def __reduce__(self) -> tuple[type["InvalidFile"], tuple[list[str]]]:
        """Make the error picklable: it may come from another process."""
        return type(self), (self.mistakes,)


def reason(error: Exception) -> str:
    """The cause of an error of a file in words; of an unknown one its own text.

    The HDF5 library states the number of the operating system in its text only.
    """
    in_text = re.search(r"errno = (\d+)", str(error))
    number = int(in_text[1]) if in_text else getattr(error, "errno", None)
    return REASONS.get(number or 0, getattr(error, "strerror", None) or str(error))


def _line(text: str) -> str:
    """Return a text as one line that can be printed."""
    shown = text if len(text) <= MESSAGE_LINE else f"{text[:MESSAGE_LINE]}... ({len(text)} characters)"
    return shown if shown.isprintable() else "".join(c if c.isprintable() else repr(c)[1:-1] for c in shown)


# Extras.


SIMULATOR: Final = ("h5py", "joblib", "pydantic", "ruamel.yaml")
MODULES: Final[Mapping[str, tuple[str, ...]]] = {
    "sim": SIMULATOR,
    "view": (*SIMULATOR, "contourpy", "matplotlib"),
    "tracks": ("scipy",),
    "gym": ("gymnasium", "pettingzoo"),
}
"""Modules without which `slalom.sim`, `slalom.view`, trackers without ids and environments do not work, by extra."""


def first_missing(extra: str) -> str | None:
    """The first module of an extra of `MODULES` that is not installed; None if all are. It imports none of them."""
    return next((name for name in MODULES[extra] if not _is_installed(name)), None)


def _is_installed(module: str) -> bool:
    try:
        return find_spec(module) is not None
    except (ModuleNotFoundError, ValueError):
        # The package of a module is missing, or the module is hidden by None in sys.modules.
        return False


def require(extra: str, where: str) -> None:
    """Refuse to go on without an extra of `MODULES`. Raises MissingExtra, which begins with `where`."""
    missing = first_missing(extra)
    if missing is not None:
        raise MissingExtra(extra, where, f"no {missing}", missing)


class Extra:
    """Context for the imports of an extra: an import that fails raises MissingExtra, which begins with `where`.

    An error in a module of slalom itself is raised as it is.
    """

    def __init__(self, name: str, where: str) -> None:
        self.name, self.where = name, where

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if not isinstance(error, ImportError) or isinstance(error, MissingExtra):
            return
        if (error.name or "").partition(".")[0] != "slalom":
            found = f"no {error.name}" if isinstance(error, ModuleNotFoundError) else " ".join(str(error).split())
            raise MissingExtra(self.name, self.where, found, error.name) from None
