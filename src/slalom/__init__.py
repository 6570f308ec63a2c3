"""slalom: reactive robot navigation with velocity and acceleration obstacles.

One concept: a control moves the robot by an affine map with a scalar gain (`response`). An obstacle (`shape` on a
`trajectory`) blocks the controls that lead into it (`ControlObstacle`). `select` finds the admissible control nearest
to the preferred one that collides with nothing. `Navigator` turns choices into safe motion. `slalom.sim` simulates,
records and measures; `slalom.view` draws.

The public names are in the stub beside this file. They are imported on first use: the command line starts
without numpy, `slalom.Disc` without numba.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
__version__ = "0.2.0"
