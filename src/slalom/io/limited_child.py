"""Program that runs readers of untrusted files within limits; `io.limited` runs it in a process of its own.

Libraries that read files do not check all of them: a malformed one can make them hang, crash or take all memory. Each
line of stdin is the arguments of `answer` as JSON. The answer is one line of JSON, followed by the bytes of the arrays
in the order of the line. The line holds `mistake`, a text, or `tree` and `arrays`, the type and shape of each array.
The program ends at the end of stdin, and after a mistake, since the state of the library is then unknown.

The program imports nothing of slalom, so that it starts fast.
"""

import gc
import json
import runpy
import signal
import sys
from functools import cache
from typing import Any

programs = cache(runpy.run_path)


def bound(seconds: float, memory: int) -> None:
    """Bound the processor time [s] from now on and the memory [B], where the operating system can; 0 s: no bound."""
    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (memory, resource.getrlimit(resource.RLIMIT_AS)[1]))
        # The signal ends the process, also inside of a library.
        signal.setitimer(signal.ITIMER_PROF, seconds)


def answer(program: str, function: str, arguments: list[Any], seconds: float, memory: int) -> bool:
    """Write the tree and the arrays that a function of a program returns to stdout; whether it could read the file."""
    read = programs(program)[function]
    # The imports of the program take time of their own.
    bound(seconds, memory)
    tree, arrays = None, []
    try:
        tree, arrays = read(*arguments)
        line = {"tree": tree, "arrays": [[a.dtype.str, a.shape] for a in arrays]}
    except MemoryError:
        line = {"mistake": f"one on which reading takes more than {memory / 1e6:.0f} MB"}
    except Exception as error:
        # Every error of a library for a malformed file is a reason why the file cannot be read.
        line = {"mistake": " ".join(str(error).split()) or type(error).__name__}
    sys.stdout.buffer.write(json.dumps(line).encode() + b"\n")
    for array in arrays:
        sys.stdout.buffer.write(array.tobytes())
    sys.stdout.buffer.flush()
    bound(0.0, memory)
    return tree is not None


def main() -> None:
    """Answer every line of stdin."""
    # Objects of a file are kept until the answer: a search for garbage among them takes most of the time.
    gc.disable()
    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for line in sys.stdin:
        if not answer(*json.loads(line)):
            return
        gc.collect()


if __name__ == "__main__":
    main()
