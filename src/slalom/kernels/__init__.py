"""Compiled functions on plain arrays and floats; no slalom types.

Importing this package does not import numba: the first use of a kernel does. `slalom --help` stays quick.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
