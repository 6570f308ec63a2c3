"""Environments of gymnasium and PettingZoo: `RobotEnv`, `RobotsEnv` for many worlds at once, `FleetEnv`.

gymnasium finds slalom/NAME-v0, for each scenario of SINGLE, by the entry point of an installed slalom; an import of this
package registers them too.
"""

from slalom.base.extras import Extra

with Extra("gym", __name__):
    from slalom.adapters.gym.environments import FleetEnv, RobotEnv, RobotsEnv
    from slalom.adapters.gym.filters import FleetSafetyFilter, SafetyFilter, VectorSafetyFilter
    from slalom.adapters.gym_names import SINGLE, register

__all__ = ["SINGLE", "FleetEnv", "FleetSafetyFilter", "RobotEnv", "RobotsEnv", "SafetyFilter", "VectorSafetyFilter"]

register()
