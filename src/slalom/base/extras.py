"""Extras: what parts of slalom need besides the packages of a robot, and the one message where it is not installed."""

from collections.abc import Mapping
from importlib.util import find_spec
from types import TracebackType
from typing import Final

from slalom.base.errors import MissingExtra

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
