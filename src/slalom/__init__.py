"""slalom: reactive robot navigation with velocity and acceleration obstacles.

One concept: a control moves the robot by an affine map with a scalar gain (`response`). An obstacle (`shape` on a
`trajectory`) blocks the controls that lead into it (`ControlObstacle`). `select` finds the admissible control nearest
to the preferred one that collides with nothing. `Navigator` turns choices into safe motion. `slalom.sim` simulates,
records and measures; `slalom.view` draws.

The public names are in the stub beside this file. They are imported on first use: the command line starts
without numpy, `slalom.Disc` without numba. `slalom.sim` and `slalom.view` are extras, and no public names where their
packages are not installed.
"""

import _signal
import os
import sys

if sys.orig_argv[1:3] == ["-m", "slalom"] or os.path.basename((sys.argv or [""])[0]).partition(".")[0] == "slalom":
    # Of the command alone: after Ctrl-C it ends without a traceback also while it is imported, see `__main__`.
    # Not by the module `signal`, whose import takes longest.
    _signal.signal(_signal.SIGINT, lambda *_: os._exit(130))

import lazy_loader

from slalom.base.errors import MODULES, first_missing

__getattr__, _, _names = lazy_loader.attach_stub(__name__, __file__)
__all__ = [name for name in _names if name not in MODULES or first_missing(name) is None]
__version__ = "0.2.0"


def __dir__() -> list[str]:
    return list(__all__)
