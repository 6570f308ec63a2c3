"""Exceptions of slalom: one base class with few subclasses, so that no exception of a backend reaches the caller."""


class SlalomError(Exception):
    """Base class of all errors that slalom raises deliberately."""


class InvalidInput(SlalomError, ValueError):
    """Invalid value; the message states what was expected, what was found, and where."""


class OutsideSpan(SlalomError, ValueError):
    """A trajectory was evaluated at a time at which its obstacle does not exist."""


class InvalidFile(SlalomError):
    """Invalid content of a file; one line per mistake, `file:line:column: expected, found`."""

    def __init__(self, mistakes: list[str]) -> None:
        super().__init__("\n".join(mistakes))
        self.mistakes = mistakes

    def __reduce__(self) -> tuple[type["InvalidFile"], tuple[list[str]]]:
        """Make the error picklable: it may come from another process."""
        return type(self), (self.mistakes,)
