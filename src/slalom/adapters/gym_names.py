"""Names of environments for gymnasium: its entry point, which imports no other part of slalom."""

SINGLE = (
    *("empty", "head_on", "curved_road", "roundabout_crossing", "roundabout_exit", "merging", "drones_crossing"),
    *("corridor", "crowdnav", "recorded_roundabout"),
)
"""Scenarios of the gallery with one robot and unlimited sight."""


def register() -> None:
    """Register slalom/NAME-v0 in gymnasium for each scenario of SINGLE."""
    from gymnasium.envs.registration import register as registered, registry

    for name in SINGLE:
        if f"slalom/{name}-v0" not in registry:
            registered(
                f"slalom/{name}-v0",
                entry_point="slalom.adapters.gym.environments:RobotEnv",
                vector_entry_point="slalom.adapters.gym.environments:RobotsEnv",
                kwargs={"scenario": name},
            )
