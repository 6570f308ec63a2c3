"""Settings and fixtures of all tests."""

import os

import pytest
from draws import USUAL_EXAMPLES, runs, turns
from hypothesis import HealthCheck, Phase, settings

# Reproducible and quick by default. `--hypothesis-profile=long` looks harder, with new examples every time, and
# shrinks what it finds.
settings.register_profile(
    "slalom",
    derandomize=True,
    deadline=None,
    max_examples=USUAL_EXAMPLES,
    phases=(Phase.explicit, Phase.generate),
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)
settings.register_profile(
    "long", deadline=None, max_examples=500, suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much]
)
settings.register_profile("first", settings.get_profile("slalom"), max_examples=4)
settings.load_profile("slalom")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the choice of draws, which the environment may set."""
    parser.addoption(
        "--draws",
        default=os.environ.get("SLALOM_DRAWS", "all"),
        help="first: the first draws of each law; 0 to 7: those, slow tests and an eighth of the others; "
        "commit: the turn of this commit; all (default)",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Draw fewer examples of each property where only the first draws run."""
    if turns(config.getoption("draws")) is None and not config.getoption("hypothesis_profile"):
        settings.load_profile("first")


def pytest_report_header(config: pytest.Config) -> str:
    """Name the draws of this run."""
    selected = turns(config.getoption("draws"))
    return f"draws: first{'' if selected is None else f', slow, turns {sorted(selected)}'}"


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Deselect the draws of other commits."""
    selected = turns(config.getoption("draws"))
    kept = [item for item in items if runs(item, selected)]
    config.hook.pytest_deselected(items=[item for item in items if not runs(item, selected)])
    items[:] = kept
