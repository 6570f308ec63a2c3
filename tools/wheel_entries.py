"""Hook of the build: a wheel with the compiled kernels of a folder, which SLALOM_WHEEL_ENTRIES names.

Without that variable the wheel is pure.
"""

import os
import platform
import sys
import sysconfig
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class CompiledEntries(BuildHookInterface):  # type: ignore[type-arg]
    """Add the folder `slalom/kernels/compiled`, and the tags of Python and platform."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        folder = os.environ.get("SLALOM_WHEEL_ENTRIES")
        if not folder:
            return
        build_data["force_include"][folder] = "slalom/kernels/compiled"
        build_data["pure_python"] = False
        # Kernels use no system library but the loader's, so any glibc will do that numba has.
        own = sysconfig.get_platform().replace("-", "_").replace(".", "_")
        place = f"manylinux_2_17_{platform.machine()}" if sys.platform == "linux" else own
        build_data["tag"] = f"cp{sys.version_info.major}{sys.version_info.minor}-none-{place}"
