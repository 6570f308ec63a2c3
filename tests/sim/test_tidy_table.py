"""Runs as tables that other programs read: pandas, CSV, Parquet, and the units in HDF5 files."""

import csv
from pathlib import Path

import h5py
import numpy as np
import pytest
from recorded_runs import recorded

from slalom import method
from slalom.cli import call
from slalom.sim import Recording, gallery, simulate
from slalom.sim.measure.hdf5 import ARRAYS, units_of
from slalom.sim.measure.tidy_table import COLUMNS, columns_of, write_table

pandas = pytest.importorskip("pandas")


@pytest.fixture(scope="module", params=["fleet", "space"])
def run(request: pytest.FixtureRequest) -> Recording:
    """Several robots in the plane, or one in space."""
    if request.param == "space":
        return recorded(3)
    return simulate(gallery.build("circle", {"robots": 3, "duration": 1.0}), method("nao_shared"), seed=1)


def test_every_row_is_a_robot_at_a_time(run: Recording) -> None:
    """The values are those of the arrays, found by time and robot."""
    frame = run.to_pandas()
    d, names = run.dimension, run.names
    axes = "xyz"[:d]
    assert list(frame.columns) == [
        name for group in COLUMNS for name in group.split() if d == 3 or name not in ("z", "vz", "az", "control_z")
    ]
    assert len(frame) == len(run.times) * len(names)
    for k, name in enumerate(names):
        rows = frame[frame.robot == name]
        assert rows.time.to_numpy().tolist() == run.times.tolist()
        assert rows[list(axes)].to_numpy().tolist() == run.positions[:, k].tolist()
        assert rows[["v" + a for a in axes]].to_numpy().tolist() == run.velocities[:, k].tolist()
        for prefix, values in (("a", run.accelerations), ("control_", run.controls)):
            found = rows[[prefix + a for a in axes]].to_numpy()
            assert found[:-1].tolist() == values[:, k].tolist()
            assert np.isnan(found[-1]).all()
        assert [*rows.outcome] == [*(row[k] for row in run.outcomes), ""]
        assert [*rows.response] == [*(row[k] for row in run.responses.texts), ""]
        assert [*rows.arrived] == [t >= run.arrived[k] for t in run.times]
    assert frame.attrs["digest"] == run.digest()
    assert frame.attrs["method"] == run.method


def test_files_hold_the_same_table(run: Recording, tmp_path: Path) -> None:
    """Numbers are read back to the bit, by pandas and by the standard library."""
    pytest.importorskip("pyarrow")
    frame = run.to_pandas()
    for name in ("run.csv", "run.parquet"):
        write_table(run, tmp_path / name)
    read = pandas.read_csv(tmp_path / "run.csv", keep_default_na=False, na_values={})
    for name in columns_of(run):
        if frame[name].dtype == float:
            found = pandas.to_numeric(read[name], errors="coerce").to_numpy()
            assert np.array_equal(found, frame[name].to_numpy(), equal_nan=True), name
        else:
            assert [*read[name]] == [*frame[name]], name
    with (tmp_path / "run.csv").open(newline="") as file:
        rows = [*csv.DictReader(file)]
    assert [float(row["x"]) for row in rows] == [*frame.x]
    whole = pandas.read_parquet(tmp_path / "run.parquet")
    pandas.testing.assert_frame_equal(whole, frame, check_dtype=False, check_exact=True)


def test_parquet_states_units(run: Recording, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    write_table(run, tmp_path / "run.parquet")
    schema = parquet.read_schema(tmp_path / "run.parquet")
    units = {axis: column.unit for names, column in COLUMNS.items() for axis in names.split()}
    assert {field.name: field.metadata[b"unit"].decode() for field in schema} == {
        name: units[name] for name in columns_of(run)
    }
    assert schema.metadata[b"scenario"].decode() == run.scenario


def test_convert_writes_runs_as_tables(run: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """As the library does; folders are made."""
    run.save(tmp_path / "run.h5")
    for name in ("run.csv", "run.parquet"):
        assert call(["convert", str(tmp_path / "run.h5"), str(tmp_path / "new" / name), "--json"]) == 0
        write_table(run, tmp_path / name)
        assert (tmp_path / "new" / name).read_bytes() == (tmp_path / name).read_bytes()
        assert f'"rows": {len(run.times) * len(run.names)}' in capsys.readouterr().out


def test_every_array_of_a_file_has_its_unit(run: Recording, tmp_path: Path) -> None:
    """Also those of trajectories, shapes and bounds; only texts have none."""
    run.save(tmp_path / "run.h5")
    found: dict[str, str] = {}
    with h5py.File(tmp_path / "run.h5") as file:
        file["run_0"].visititems(
            lambda name, member: found.update({name: member.attrs["units"]}) if hasattr(member, "shape") else None
        )
    assert {name for name, unit in found.items() if not unit} == {"responses", "response_parts", "outcomes"}
    assert found["poses"] == "m, rad"
    assert found["robots/0/goal/position"] == "m"
    assert Recording.load(tmp_path / "run.h5").digest() == run.digest()


def test_units_of_parts_are_those_of_their_keys() -> None:
    assert units_of("robots/0/bounds/1/corners", "convex_polygon") == "m/s^2"
    assert units_of("obstacles/3/shape/corners", "polygon") == "m"
    assert units_of("obstacles/3/trajectory/of_another_package", "swarm") == ""
    assert units_of("robots/12/velocity_bounds") == "1, m/s"
    assert all(unit or name in ("responses", "response_parts", "outcomes") for name, (unit, _) in ARRAYS.items())


def test_files_without_units_are_read(run: Recording, tmp_path: Path) -> None:
    """As those of former versions."""
    run.save(tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        file["run_0"].visititems(
            lambda name, member: member.attrs.__delitem__("units") if hasattr(member, "shape") else None
        )
    assert Recording.load(tmp_path / "run.h5").digest() == run.digest()
