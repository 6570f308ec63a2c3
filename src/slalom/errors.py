"""What slalom raises: one base class and few members, so that nothing of a backend leaks."""


class SlalomError(Exception):
    """Base of every error that slalom raises on purpose."""


class InvalidInput(SlalomError, ValueError):
    """A value does not fit: the message says what was expected, what was found, and where."""


class OutsideSpan(SlalomError, ValueError):
    """A trajectory was asked for a time at which its obstacle does not exist."""


class InvalidFile(SlalomError):
    """A file does not hold what it should; one line per mistake, `file:line:column: expected, found`."""

    def __init__(self, mistakes: list[str]) -> None:
        super().__init__("\n".join(mistakes))
        self.mistakes = mistakes

    def __reduce__(self) -> tuple[type["InvalidFile"], tuple[list[str]]]:
        """Errors come from other processes too."""
        return type(self), (self.mistakes,)
