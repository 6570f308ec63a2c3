"""Colours of the view: contrast in light and dark, and outcomes as colour-blind people see them."""

import itertools
import re

import numpy as np
import pytest
from live_views import WEB

from slalom import Outcome

THEME, STYLE = ((WEB / "src" / name).read_text() for name in ("theme.ts", "style.css"))
SIGHT = {
    "normal": np.eye(3),
    "deuteranopia": np.array([[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]]),
    "protanopia": np.array([[0.152, 1.053, -0.205], [0.115, 0.786, 0.099], [-0.004, -0.048, 1.052]]),
}
"""Linear RGB as seen (Machado, Oliveira and Fernandes, 2009, severity 1)."""


def linear(colour: str) -> np.ndarray:
    """Linear RGB of a colour such as "#d55e00"."""
    c = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def contrast(one: str, other: str) -> float:
    """Ratio of the relative luminances, from 1 to 21 (WCAG 2.1)."""
    low, high = sorted(float(np.array([0.2126, 0.7152, 0.0722]) @ linear(colour)) for colour in (one, other))
    return (high + 0.05) / (low + 0.05)


def perceived(rgb: np.ndarray) -> np.ndarray:
    """Coordinates in OKLab, in which distances are about those that are seen."""
    cones = np.array([[0.4122, 0.5363, 0.0514], [0.2119, 0.6807, 0.1074], [0.0883, 0.2817, 0.6300]])
    axes = np.array([[0.2105, 0.7936, -0.0041], [1.9780, -2.4286, 0.4506], [0.0259, 0.7828, -0.8087]])
    return axes @ np.cbrt(cones @ np.clip(rgb, 0.0, 1.0))


@pytest.mark.parametrize("name", ["LIGHT", "DARK"])
def test_text_and_marks_stand_out(name: str) -> None:
    drawn = dict(re.findall(r'(\w+): "(#\w{6})"', THEME.split(f"{name}: Theme = {{")[1].split("}")[0]))
    block = STYLE.split('[data-theme="dark"]')[name == "DARK"]
    styled = dict(re.findall(r"--(\w+): (#\w{6})", block))
    for text in ("ink", "faint", "goal"):
        assert contrast(drawn[text], drawn["paper"]) >= 4.5
    for text in ("ink", "faint", "alert"):
        assert contrast(styled[text], styled["page"]) >= 4.5
        assert contrast(styled[text], styled["paper"]) >= 4.5
    assert contrast(drawn["robot"], drawn["paper"]) >= 3.0
    assert {key: drawn[key] for key in ("paper", "ink", "robot", "goal")} == {
        key: styled[key] for key in ("paper", "ink", "robot", "goal")
    }


@pytest.mark.parametrize("sight", SIGHT)
def test_outcomes_differ_for_the_colour_blind(sight: str) -> None:
    outcomes = sorted(set(re.findall(r'colour: "(#\w{6})", label', THEME)))
    assert len(outcomes) == 5
    for one, other in itertools.combinations(outcomes, 2):
        seen = [perceived(SIGHT[sight] @ linear(colour)) for colour in (one, other)]
        assert np.linalg.norm(seen[0] - seen[1]) > 0.08


def test_every_outcome_has_a_colour() -> None:
    block = THEME.split("export const OUTCOMES")[1].split("\n};")[0]
    assert {outcome.name for outcome in Outcome} <= set(re.findall(r"^  (\w+): \{ colour", block, re.M))
