"""Behaviours of navground, which finds them by the entry point group `navground_behaviors`."""

from typing import Any, Final

from navground import core

from slalom.adapters.navground.group import Group

PROPERTIES: Final[dict[str, tuple[Any, str]]] = {
    "method": ("nao", "A method of several robots, see `slalom list methods`"),
    "max_acceleration": (0.0, "Largest acceleration [m/s^2]; 0: the desired speed within 0.3 s"),
    "time_horizon": (3.0, "Time up to which collisions count [s]"),
    "keep_right": (0.25, "Angle [rad] from the target to the desired velocity, to the right"),
    "lead": (0.0, "Distance of the controlled point ahead of the axle [m]; 0: a tenth of that of the wheels"),
    "world_period": ([0.0, 0.0], "Period of a world that repeats [m], 0 where it does not"),
}
"""Registered properties with their default values and descriptions."""


def _registered(name: str) -> Any:
    default, text = PROPERTIES[name]
    kind = "vector" if isinstance(default, list) else type(default).__name__
    values = core.register(default, text, scalar_type_name=kind)(lambda self: self.values[name])
    return property(values, lambda self, value: self.values.update({name: value}))


class SlalomFleet(core.Behavior, name="SlalomFleet"):
    """An agent that decides together with all others of this behaviour that have the same `world_period`.

    navground 0.7 does not read the properties of members of its own groups of behaviours; hence `Group`.
    """

    method, max_acceleration, time_horizon, keep_right, lead, world_period = map(_registered, PROPERTIES)

    def __init__(self, kinematics: core.Kinematics | None = None, radius: float = 0.0) -> None:
        self.values = {name: default for name, (default, _) in PROPERTIES.items()}
        self._state, self._group = core.GeometricState(), Group()
        super().__init__(kinematics, radius)

    def get_environment_state(self) -> core.GeometricState:
        return self._state

    def prepare(self) -> None:
        self._group = _GROUPS.setdefault(tuple(self.world_period), Group())
        self._group.members.append(self)

    def close(self) -> None:
        self._group.members.remove(self)
        if not self._group.members:
            _GROUPS.pop(tuple(self.world_period), None)

    def compute_cmd_internal(self, time_step: Any) -> core.Twist2:
        return self._group.command(self, float(time_step))


class Slalom(SlalomFleet, name="Slalom", include_properties_of=["SlalomFleet"]):
    """An agent that decides alone, and expects of no neighbour that it avoids the agent."""

    def prepare(self) -> None:
        self._group = Group()
        self._group.members.append(self)


_GROUPS: dict[tuple[float, ...], Group] = {}
"""Agents of the running world that decide together, by the period of the world."""
