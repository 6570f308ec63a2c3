"""Work in fixed scenes is that of tools/counts.toml; kernels as Python decide the same bits; ratios of times."""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

TOOLS = Path(__file__).parents[2] / "tools"
sys.path.insert(0, str(TOOLS))

import budget  # noqa: E402
import counts  # noqa: E402
import speed  # noqa: E402


def output_of(script: str, *words: str) -> str:
    """What a script prints. It must succeed."""
    done = subprocess.run([sys.executable, TOOLS / script, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_work_in_fixed_scenes_is_that_of_the_file() -> None:
    assert "roundabout, by decision: " in output_of("counts.py")


@pytest.mark.slow
def test_kernels_as_python_decide_the_same_bits() -> None:
    pytest.importorskip("coverage")
    assert " digests, 0 differ as Python" in output_of("debug_test.py", "--each", "30")


@pytest.mark.parametrize(
    ("today", "said"),
    [(20, ""), (21, "searches: expected at most 20, found 21;"), (19, "searches: expected a limit near 19, found 20;")],
)
def test_a_count_that_differs_is_named_until_it_is_written_with_its_reason(today: int, said: str) -> None:
    file, scenes, found = {"fleet": {"searches": [20]}}, {"fleet": counts.filtered}, {"fleet.searches": today}
    mistakes = list(budget.breaches(counts.expanded(file, scenes), found))
    assert len(mistakes) == bool(said)
    assert all(one.startswith(f"fleet.{said}") for one in mistakes)
    text = "\n".join(counts.written(counts.renewed(file, found)))
    for reason in ("", "safer turns"):
        again = tomllib.loads(text.replace('bought = ""', f'bought = "{reason}"'))
        unexplained = today > 20 and not reason
        assert len(list(budget.breaches(counts.expanded(again, scenes), found))) == unexplained


def test_ratios_and_their_noise() -> None:
    tables = [{"heads": ["what", "median us", "runs"], "rows": [["step", 4.0, 3], ["other", "-", 3]]}]
    one = speed.times_in({"tables": tables})
    assert one == {"step, median us": 4.0}
    turns = [{"step, median us": 5.0}, {"step, median us": 6.0}]
    assert list(speed.ratios([one, one], turns)) == [("step, median us", 4.0, 5.5, 1.375, 1.2)]
