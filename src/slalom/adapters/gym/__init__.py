"""Environments of gymnasium and PettingZoo: `RobotEnv`, `RobotsEnv` for many worlds at once, `FleetEnv`.

`import slalom.adapters.gym` registers slalom/NAME-v0 in gymnasium for each scenario of SINGLE. gymnasium itself does so
for `gymnasium.make("slalom.adapters.gym:slalom/NAME-v0")`.
"""

from slalom.base.errors import Extra

with Extra("gym", __name__):
    import gymnasium

    from slalom.adapters.gym.environments import FleetEnv, RobotEnv, RobotsEnv
    from slalom.adapters.gym.filters import FleetSafetyFilter, SafetyFilter, VectorSafetyFilter

__all__ = ["SINGLE", "FleetEnv", "FleetSafetyFilter", "RobotEnv", "RobotsEnv", "SafetyFilter", "VectorSafetyFilter"]

SINGLE = (
    *("empty", "head_on", "curved_road", "roundabout_crossing", "roundabout_exit", "merging", "drones_crossing"),
    *("corridor", "crowdnav", "recorded_roundabout"),
)
"""Scenarios of the gallery with one robot and unlimited sight."""

for _name in SINGLE:
    gymnasium.register(
        f"slalom/{_name}-v0",
        entry_point="slalom.adapters.gym.environments:RobotEnv",
        vector_entry_point="slalom.adapters.gym.environments:RobotsEnv",
        kwargs={"scenario": _name},
    )
