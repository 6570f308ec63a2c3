"""A robot that crosses a roundabout of SUMO with live traffic; overlaps of the bodies are computed by shapely."""

from pathlib import Path

import pytest

pytest.importorskip("libsumo", reason="libsumo is not installed: pip install 'slalom[sumo]'")

from sumo_roundabout import cross

pytestmark = [pytest.mark.adapters, pytest.mark.slow, pytest.mark.filterwarnings("ignore")]


def test_no_car_is_hit_where_a_robot_that_ignores_cars_hits_some(tmp_path: Path) -> None:
    seen = cross(tmp_path, 6, seed=3)
    assert (seen.arrived, seen.overlaps, seen.reported) == (6, 0, 0)
    blind = cross(tmp_path, 20, seed=3, straight=True)
    assert min(blind.overlaps, blind.reported) > 0
