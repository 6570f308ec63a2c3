"""Exceptions of slalom: one base class with few subclasses, so that no exception of a backend reaches the caller."""

from slalom.tolerances import MESSAGE_LINE


class SlalomError(Exception):
    """Base class of all errors that slalom raises deliberately."""


class InvalidInput(SlalomError, ValueError):
    """Invalid value; the message states the expected value, the found one, and its place."""


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


def _line(text: str) -> str:
    """Return a text as one line that can be printed."""
    shown = text if len(text) <= MESSAGE_LINE else f"{text[:MESSAGE_LINE]}... ({len(text)} characters)"
    return shown if shown.isprintable() else "".join(c if c.isprintable() else repr(c)[1:-1] for c in shown)
