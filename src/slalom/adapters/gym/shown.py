"""Shared parts of environments with one world: pictures, and the values of `info` after a step."""

from typing import Any

import numpy as np
import numpy.typing as npt

from slalom.adapters.gym.worlds import OUTCOMES, Worlds
from slalom.checks import known
from slalom.view.scene import Picture

RENDER_MODES = ("rgb_array", "human")


class Shown:
    """Pictures of the only world of an environment."""

    worlds: Worlds
    render_mode: str | None
    _picture: Picture | None = None

    def render(self) -> npt.NDArray[np.uint8] | None:
        """Picture (height, width, 3) with render_mode "rgb_array"; with "human" it is shown at each step."""
        return self._drawn().pixels() if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._picture is not None:
            self._picture.close()
            self._picture = None

    def _show(self) -> None:
        if self.render_mode == "human":
            self._drawn().show()

    def _drawn(self) -> Picture:
        if self._picture is None:
            self._picture = Picture(self.worlds.scenarios[0], window=self.render_mode == "human")
        self._picture.draw(self.worlds.position[0], self.worlds.velocity[0], self.worlds.there[0], self.worlds.now())
        return self._picture


def checked_mode(render_mode: str | None) -> str | None:
    """The render mode. Raises InvalidInput for an unknown one."""
    return None if render_mode is None else known(render_mode, "render_mode", RENDER_MODES)


def information(outcome: int, clearance: float, time: float) -> dict[str, Any]:
    """The values of `info` after a step, see `RobotEnv`."""
    name = OUTCOMES[outcome]
    return {"outcome": name, "is_success": name == "arrived", "clearance": clearance, "time": time}
