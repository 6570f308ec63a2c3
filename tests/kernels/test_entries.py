"""Compiled entries in files: what they are used for, and what is refused."""

import pickle
from collections import namedtuple
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import llvmlite.binding as llvm
import numpy as np
import pytest
from commands import saying

from slalom.kernels import compile_notice, entries, jit, numba_extensions


def halved(x: float) -> float:
    return 0.5 * x


def doubled(x: float) -> float:
    return 2.0 * x


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder in which entries are kept."""
    monkeypatch.setattr(entries, "OWN", tmp_path / "own")
    monkeypatch.setattr(entries, "GIVEN", ())
    monkeypatch.setattr(entries, "refused", [])
    return tmp_path / "own"


def hits(function: Callable[[float], float], x: Any = 3.0) -> int:
    """How many entries a new kernel takes from files for its first call."""
    entry: Any = jit.kernel(function)
    assert entry(x) == function(x)
    return sum(entry.stats.cache_hits.values())


@pytest.fixture
def kept(own: Path) -> Path:
    """The file of the entry of `halved`."""
    assert hits(halved) == 0
    assert hits(halved) == 1
    (path,) = own.glob("*.entry")
    return path


def changed(at: int) -> Callable[[bytes, bytes], bytes]:
    return lambda one, _: one[:at] + bytes([one[at] ^ 1]) + one[at + 1 :]


DAMAGE: dict[str, Callable[[bytes, bytes], bytes]] = {
    "empty": lambda one, _: b"",
    "cut": lambda one, _: one[:-1],
    "longer": lambda one, _: one + b"\0",
    "hash": changed(0),
    "payload": changed(40),
    "end": changed(-2),
    "no hash": lambda one, _: pickle.dumps(print),
    "of another function": lambda _, other: other,
}


@pytest.mark.parametrize("damage", DAMAGE.values(), ids=DAMAGE)
def test_what_does_not_have_its_hash_is_compiled_anew(
    damage: Callable[[bytes, bytes], bytes], kept: Path, own: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing of it is unpickled, and a sentence names the file."""
    whole = kept.read_bytes()
    assert hits(doubled) == 0
    (other,) = set(own.glob("*.entry")) - {kept}
    kept.write_bytes(damage(whole, other.read_bytes()))
    with monkeypatch.context() as patch:
        patch.setattr(pickle, "loads", lambda _: pytest.fail("a damaged entry was unpickled"))
        assert hits(halved) == 0
    assert entries.why_none_fits() == f"{kept} is damaged"
    assert hits(halved) == 1


def test_classes_that_are_no_longer_there_are_no_error(kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(numba_extensions, "EntryLibrary")
    kept.write_bytes(entries.content(kept.name, b"cslalom.kernels.numba_extensions\nEntryLibrary\n."))
    assert hits(halved) == 0
    assert entries.why_none_fits().startswith(f"{kept} needs what is not there: ")


class Pair(NamedTuple):
    """A table."""

    first: float
    second: float


def difference(pair: Pair) -> float:
    return pair.first - pair.second


def test_the_key_holds_the_fields_of_tables(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A table of the same name with other fields has another entry."""
    swapped: Any = namedtuple("Pair", "second first")
    for pair in (Pair(1.0, 3.0), swapped(1.0, 3.0)):
        entry: Any = jit.kernel(difference)
        assert entry(pair) == difference(pair)
    assert len([*own.glob("*.entry")]) == 2


def test_folders_that_are_only_read_serve_all(kept: Path, own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(entries, "GIVEN", (own / "none", own))
    monkeypatch.setattr(entries, "OWN", None)
    assert hits(halved) == 1


@pytest.mark.parametrize("name", ["MADE_FOR", "sources_digest"])
def test_the_key_holds_versions_sources_and_types(name: str, kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert hits(halved, np.int64(3)) == 0
    monkeypatch.setattr(entries, name, "numba 0.1" if name == "MADE_FOR" else lambda _: "0" * 64)
    assert hits(halved) == 0
    assert kept.exists() == (name == "MADE_FOR")  # entries of former sources are removed


def test_the_notice_says_for_what_shipped_entries_are(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert entries.why_none_fits() == ""
    own.mkdir()
    monkeypatch.setattr(entries, "GIVEN", (own, own))
    assert entries.why_none_fits() == "SLALOM_ENTRIES: expected folders of exported kernels, found none"
    monkeypatch.setattr(entries, "GIVEN", (own,))
    (own / entries.LABEL).write_text("numba 0.1\n")
    why = entries.why_none_fits()
    assert why == f"expected kernels for {entries.MADE_FOR}, found those for numba 0.1"
    assert compile_notice.compiling(True, why).endswith(f"; {why}")
    (own / entries.LABEL).write_text(entries.MADE_FOR)
    assert entries.why_none_fits() == "no shipped kernel is of these sources and for these arguments"


def test_a_processor_without_avx2_has_entries_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(llvm, "get_host_cpu_features", lambda: llvm.FeatureMap({"sse4.2": True}))
    name, _ = numba_extensions._processor()
    assert name == llvm.get_host_cpu_name()


def test_exported_entries_are_imported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Those that are damaged are named; a folder without any that fits is refused."""
    say, folder, own = saying(capsys), tmp_path / "exported", tmp_path / "own"
    say("compile", "figures", "--jobs", "1", "--export", str(folder))
    files = sorted(folder.glob("*.entry"))
    assert files
    assert (folder / entries.LABEL).read_text() == entries.MADE_FOR + "\n"
    whole = [path.read_bytes() for path in files]
    files[0].write_bytes(whole[0][:-1])
    monkeypatch.setattr(entries, "OWN", own)
    said = say("compile", "figures", "--jobs", "1", "--import", str(folder))
    assert said.code == 0
    first, second, *_ = said.err.splitlines()
    assert first == f"slalom: {len(files) - 1} compiled kernels from {folder}"
    assert second == f"slalom: {files[0]} is damaged, it is compiled anew"
    assert [(own / path.name).read_bytes() for path in files[1:]] == whole[1:]
    (tmp_path / "other").mkdir()
    for other, found in ((tmp_path / "other", "none"), (tmp_path / "other", "those for numba 0.1")):
        said = say("compile", "--import", str(other))
        expected = f"expected compiled kernels of these sources for {entries.MADE_FOR}"
        assert (said.code, said.err) == (2, f"{other}: {expected}, found {found}\n")
        (other / entries.LABEL).write_text("numba 0.1\n")
    monkeypatch.setattr(entries, "OWN", None)
    said = say("compile", "--import", str(folder))
    assert said.err == "import: expected a folder that can be written, found none: NUMBA_CACHE_DIR names one\n"
