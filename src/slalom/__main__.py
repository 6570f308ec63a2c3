"""The command `slalom`, also `python -m slalom`: the command line, if its extra is installed."""

import atexit
import os
import signal
import sys
from typing import Final

from slalom.base.errors import MissingExtra

INTERRUPTED: Final = 130
"""Exit code after Ctrl-C, as that of shells."""


def main() -> None:
    """Run the command line and exit; without its packages, name the extra with exit code 2; after Ctrl-C with 130."""
    # Imports and the end of the process have nothing to clean up. Interrupted there, Python prints where it was.
    signal.signal(signal.SIGINT, lambda *_: os._exit(INTERRUPTED))
    # After its own clean-up Python would take this handler away and die by the signal.
    atexit.register(signal.signal, signal.SIGINT, signal.SIG_IGN)
    sys.exit(_code())


def _code() -> int:
    """The exit code of the command line."""
    try:
        from slalom.cli import call
    except MissingExtra as error:
        sys.stderr.write(f"{error}\n")
        return 2
    ending = signal.getsignal(signal.SIGINT)
    try:
        # A command removes what it began to write.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        return call()
    except KeyboardInterrupt:
        return INTERRUPTED
    finally:
        signal.signal(signal.SIGINT, ending)


if __name__ == "__main__":
    main()
