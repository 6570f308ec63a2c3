"""Packages whose names are imported when they are first asked for, so that nobody waits for what is not used."""

import sys
from collections.abc import Mapping, Sequence
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType
from typing import Any


class Late(ModuleType):
    """A package that offers names of its modules, and its modules.

    A class, where a `__getattr__` of the package would do: type checkers take one that has it to offer every name.
    """

    homes: dict[str, str]

    def __getattr__(self, name: str) -> Any:
        home = self.__dict__["homes"].get(name)
        if home:
            value = getattr(import_module(f"{self.__name__}.{home}"), name)
            setattr(self, name, value)
            return value
        if not name.startswith("_") and find_spec(f"{self.__name__}.{name}"):
            return import_module(f"{self.__name__}.{name}")
        raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")

    def __setattr__(self, name: str, value: Any) -> None:
        # Python binds every module to its package; a function of the same name is what is offered.
        inner = isinstance(value, ModuleType) and name in self.__dict__["homes"]
        super().__setattr__(name, getattr(value, name) if inner else value)

    def __dir__(self) -> list[str]:
        modules = (k for k, v in vars(self).items() if isinstance(v, ModuleType) and v.__name__.startswith("slalom."))
        return sorted({*self.__all__, *(name for name in vars(self) if name.startswith("__")), *modules})


def offer(package: str, names: Mapping[str, Sequence[str]]) -> None:
    """Let a package offer names, by the modules that they are in."""
    module = sys.modules[package]
    module.__dict__["homes"] = {name: home for home, offered in names.items() for name in offered}
    module.__class__ = Late
