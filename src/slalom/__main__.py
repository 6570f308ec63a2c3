"""The command `slalom`, also `python -m slalom`: the command line, if its extra is installed."""

import _thread
import atexit
import os
import signal
import sys
import threading
from typing import Final

from slalom.base.errors import MissingExtra

INTERRUPTED: Final = 130
"""Exit code after Ctrl-C, as that of shells."""


def main() -> None:
    """Run the command line and exit: with code 2 without its packages, with 130 after Ctrl-C, 143 after SIGTERM."""
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
    former = {signal.SIGINT: signal.getsignal(signal.SIGINT)}
    # Those that end a process by default; `nohup` has one ignored.
    ending = (getattr(signal, name, None) for name in ("SIGTERM", "SIGHUP"))
    former |= {each: signal.SIG_DFL for each in ending if each and signal.getsignal(each) is signal.SIG_DFL}
    try:
        # A command removes what it began to write.
        for number in former:
            signal.signal(number, signal.default_int_handler if number == signal.SIGINT else _stop)
        sys.unraisablehook = _unraisable
        with _Interruptible():
            return call()
        return INTERRUPTED
    finally:
        sys.unraisablehook = sys.__unraisablehook__
        for number, before in former.items():
            signal.signal(number, before)


class _Interruptible:
    """Ends at an interrupt; one that comes while a class is made is the cause of a RuntimeError."""

    def __enter__(self) -> None: ...

    def __exit__(self, _: object, error: BaseException | None, at: object) -> bool:
        return isinstance(error, KeyboardInterrupt) or isinstance(getattr(error, "__cause__", None), KeyboardInterrupt)


def _unraisable(ignored: "sys.UnraisableHookArgs") -> None:
    """Send a signal again: Python drops what its handler raises in a callback, such as that of a weak reference."""
    code = ignored.exc_value.code if isinstance(ignored.exc_value, SystemExit) else None
    # In a tenth of a second the callback has ended: in this function it would be dropped again.
    if ignored.exc_type is KeyboardInterrupt:
        threading.Timer(0.1, _thread.interrupt_main).start()
    elif isinstance(code, int) and code - 128 in signal.valid_signals():
        threading.Timer(0.1, _thread.interrupt_main, [code - 128]).start()
    else:
        sys.__unraisablehook__(ignored)


def _stop(number: int, _: object) -> None:
    sys.exit(128 + number)


if __name__ == "__main__":
    main()
