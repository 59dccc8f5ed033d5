"""A chunk costs the same however many there are, and dying at any step leaves every chunk old or new, and whole."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr

from lambent.core.errors import UserError
from lambent.store import chunk_files
from lambent.store import store as store_module
from lambent.store.store import Store, Writer

needs_fork = pytest.mark.skipif(not hasattr(os, "fork"), reason="fork")


def begun(folder: Path, rows: int, **how: Any) -> Writer:
    return Store.create(folder, {}).begin("a", "a", (rows, 4), (1, 4), "float32", key="k", **how)


def filled(folder: Path, rows: int, **how: Any) -> Writer:
    """Finished, row r full of r + 1."""
    writer = begun(folder, rows, **how)
    for chunk in writer.missing:
        writer.write(chunk, np.float32(chunk[0] + 1))
    writer.finish()
    return writer


def chunk_names(folder: Path) -> set[str]:
    return {str(path.relative_to(folder / "a/c")) for path in (folder / "a/c").rglob("*") if path.is_file()}


def work_per_chunk(folder: Path, rows: int, monkeypatch: pytest.MonkeyPatch) -> tuple[float, float]:
    """(calls of functions, bytes written to files) per chunk, of writing and finishing an array of `rows` chunks."""
    counts = {"calls": 0, "bytes": 0}
    write_text = store_module.write_text

    def weighed(path: Path, text: str) -> None:
        counts["bytes"] += len(text) + sum(p.stat().st_size for p in (folder / "a").glob("journal"))
        write_text(path, text)

    def count(frame: Any, event: str, arg: Any) -> None:
        counts["calls"] += event in ("call", "c_call")

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", lambda handle: None)
        patch.setattr(store_module, "write_text", weighed)
        writer = begun(folder, rows)
        before = sys.getprofile()
        sys.setprofile(count)
        try:
            for chunk in writer.missing:
                writer.write(chunk, np.float32(1))
            writer.finish()
        finally:
            sys.setprofile(before)
    return counts["calls"] / rows, counts["bytes"] / rows


@pytest.mark.long
def test_a_thousand_chunks_cost_no_more_each_than_forty(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    few = work_per_chunk(tmp_path / "few", 40, monkeypatch)
    many = work_per_chunk(tmp_path / "many", 1000, monkeypatch)
    assert many[0] <= 1.5 * few[0] and many[1] <= 1.5 * few[1], (few, many)
    assert few[0] > 10 and few[1] > 10, "the work was counted"
    np.testing.assert_array_equal(Store.open(tmp_path / "many").read("a"), np.ones((1000, 4)))


def test_the_manifest_takes_the_journal_over(tmp_path: Path) -> None:
    journal, manifest = tmp_path / "s/a/journal", tmp_path / "s/manifest.json"
    writer = begun(tmp_path / "s", 3)
    before = manifest.read_bytes()
    writer.write((1, 0), np.float32(7))
    assert manifest.read_bytes() == before and journal.exists()
    assert set(Store.open(tmp_path / "s").artefact("a").done) == {"1.0"}
    writer = begun(tmp_path / "s", 3)
    assert manifest.read_bytes() != before and not journal.exists()
    for chunk in writer.missing:
        writer.write(chunk, np.float32(7))
    assert journal.exists()
    writer.finish()
    assert not journal.exists() and (Store.open(tmp_path / "s").read("a") == 7).all()


def test_half_a_line_of_the_journal_neither_counts_nor_spoils_the_next(tmp_path: Path) -> None:
    writer = begun(tmp_path / "s", 4)
    writer.write((0, 0), np.float32(1))
    whole = (tmp_path / "s/a/journal").read_bytes()
    writer.write((1, 0), np.float32(2))
    line = (tmp_path / "s/a/journal").read_bytes()[len(whole) :]
    for length in range(len(line)):
        (tmp_path / "s/a/journal").write_bytes(whole + line[:length])
        assert set(Store.open(tmp_path / "s").artefact("a").done) == {"0.0"}, line[:length]
        writer.write((2, 0), np.float32(3))  # as after a full disk
        assert set(Store.open(tmp_path / "s").artefact("a").done) == {"0.0", "2.0"}, line[:length]
    (tmp_path / "s/a/journal").write_bytes(whole + line + b"\n9.0 0 1;")
    assert set(Store.open(tmp_path / "s").artefact("a").done) == {"0.0", "1.0"}, "unknown chunk 9"
    (tmp_path / "s/a/journal").write_bytes(whole + b"\n0 0 1;")
    with pytest.raises(UserError, match="manifest is damaged"):
        Store.open(tmp_path / "s")


def test_a_rewritten_chunk_is_a_new_file(tmp_path: Path) -> None:
    writer = filled(tmp_path / "s", 2)
    for value in (5, 0, 6, 7):
        reader = Store.open(tmp_path / "s")
        before = reader.read("a")[1, 0]
        writer.write((1, 0), np.float32(value))
        assert (reader.read("a")[1] == (value if before else 0)).all(), "the old file is gone; zeros have none"
        reader.refresh()
        assert (reader.read("a")[1] == value).all()
        assert (Store.open(tmp_path / "s").read("a")[:, 0] == [1, value]).all()
    assert chunk_names(tmp_path / "s") == {"0/0", "1/0.4"}
    assert "a" in Store.open(tmp_path / "s"), "complete all the time"
    (tmp_path / "s/a/c/1/.0.died.9").write_bytes(b"part")
    writer.finish()
    assert chunk_names(tmp_path / "s") == {"0/0", "1/0.4"}
    assert (Store.open(tmp_path / "s").read("a")[:, 0] == [1, 7]).all()
    assert '"version": 2' in (tmp_path / "s/manifest.json").read_text(), "older readers say so"


def test_a_file_that_died_before_its_name_does_not_stand_for_zeros(tmp_path: Path) -> None:
    writer = begun(tmp_path / "s", 1)
    writer.write((0, 0), np.float32(1))
    (tmp_path / "s/a/c/0/0.1").write_bytes((tmp_path / "s/a/c/0/0").read_bytes())
    writer.write((0, 0), np.float32(0))
    assert not Store.open(tmp_path / "s").read_region("a", ()).any()


def test_other_programs_read_what_was_not_rewritten(tmp_path: Path) -> None:
    writer = filled(tmp_path / "s", 3, growing=True)
    writer.extend(2)
    writer.write((3, 0), np.float32(0))
    writer.write((4, 0), np.float32(5))
    writer.finish()
    assert zarr.open_array(tmp_path / "s/a", mode="r")[:, 1].tolist() == [1, 2, 3, 0, 5]
    assert '"version": 1' in (tmp_path / "s/manifest.json").read_text()


def test_an_array_grows_by_batches_and_is_refined_later(tmp_path: Path) -> None:
    filled(tmp_path / "s", 2, growing=True)
    writer = begun(tmp_path / "s", 0, growing=True)
    assert writer.artefact.complete and writer.artefact.shape == (2, 4)
    writer.extend(2)
    writer.write((2, 0), np.float32(3))
    reader = Store.open(tmp_path / "s")
    assert reader.availability("a") == ("partial", 0.75) and "a" not in reader
    array, written = reader.read_partial("a")
    assert array[:, 0].tolist() == [1, 2, 3, 0] and written[:, 0].tolist() == [True, True, True, False]
    with pytest.raises(AssertionError, match="1 chunks missing"):
        writer.finish()
    writer = begun(tmp_path / "s", 5, growing=True)
    assert writer.missing == [(3, 0), (4, 0)]
    for chunk in writer.missing:
        writer.write(chunk, np.float32(9))
    writer.finish(samples=5)
    store = Store.open(tmp_path / "s")
    assert store.read("a")[:, 0].tolist() == [1, 2, 3, 9, 9] and store.artefact("a").meta == {"samples": 5}
    assert begun(tmp_path / "s", 5).missing == [], "the same shape is the same array"
    assert len(begun(tmp_path / "s", 4).missing) == 4, "another is another, unless it may grow"
    with pytest.raises(UserError, match="impossible shape"):
        begun(tmp_path / "s", 4, growing=True).extend(1 << 40)
    assert Store.open(tmp_path / "s").artefact("a").shape == (4, 4)


FORKER = """
import os, sys
import numpy as np
import zarr.codecs
from lambent.store.store import Store

EVENTS = {"open", "os.rename", "os.remove", "os.chmod", "os.mkdir", "os.rmdir", "os.truncate"}

os.fsync = lambda handle: None  # the process dies, not the machine

def die_before(step):
    left = [step]
    def count(event, arguments):
        if event in EVENTS:
            left[0] -= 1
            if left[0] == 0:
                os.kill(os.getpid(), 9)
    sys.addaudithook(count)

for line in sys.stdin:
    step, folder = int(line), sys.argv[1]
    child = os.fork()
    if child == 0:
        die_before(step)
        WORK
        os._exit(0)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""

REWRITE = """
        writer = Store.create(folder, {}).begin("a", "a", (2, 4), (1, 4), "float32", key="k")
        for chunk in writer.artefact.chunk_grid:
            writer.write(chunk, (writer.read_chunk(chunk) + 1) % 3)
        writer.finish()
"""
GROW = """
        writer = Store.create(folder, {}).begin("a", "a", (0, 4), (1, 4), "float32", key="k", growing=True)
        for more in (0, 2):
            if more:
                writer.extend(more)
            for chunk in writer.missing:
                writer.write(chunk, np.float32(chunk[0] + 1))
        writer.finish()
"""
ANEW = """
        writer = Store.create(folder, {}).begin("a", "a", (2, 4), (1, 4), "float32", key=str(step))
        for chunk in writer.missing:
            writer.write(chunk, np.float32(step))
        writer.finish()
"""


def check_rewritten(store: Store, before: dict[str, int]) -> dict[str, int]:
    """Every chunk is whole, its value belongs to its generation, and none is older than it was."""
    array, now = store.read("a"), {}
    for row in range(2):
        version = store.artefact("a").version((row, 0))
        assert version is not None
        now[f"{row}.0"] = version.generation
        assert (array[row] == (row + 1 + version.generation) % 3).all()
    assert all(now[name] >= before.get(name, 0) for name in now)
    return now


def check_grown(store: Store, before: dict[str, int]) -> dict[str, int]:
    """The array has whole pairs of batches; all that are named have their values, and none was lost."""
    array, written = store.read_partial("a")
    assert len(array) % 2 == 0 and len(array) >= before.get("rows", 0)
    assert (array == np.where(written, np.arange(1, len(array) + 1)[:, None], 0)).all()
    assert ("a" not in store) or written.all()
    assert written.sum() >= before.get("written", 0)
    return {"rows": len(array), "written": int(written.sum())}


def check_anew(store: Store, before: dict[str, int]) -> dict[str, int]:
    """What there is belongs to the key that the manifest has."""
    if store.availability("a")[0] != "absent":
        array, written = store.read_partial("a")
        value = 1 if store.artefact("a").key == "k" else int(store.artefact("a").key)
        expected = np.array([[1.0], [2.0]]) if store.artefact("a").key == "k" else np.full((2, 1), value)
        assert (array == np.where(written, expected, 0)).all()
    return {}


@needs_fork
@pytest.mark.parametrize(
    ("work", "check", "least"), [(REWRITE, check_rewritten, 15), (GROW, check_grown, 20), (ANEW, check_anew, 20)]
)
def test_kill_9_before_every_step_on_the_disk(
    tmp_path: Path, work: str, check: Callable[[Store, dict[str, int]], dict[str, int]], least: int
) -> None:
    """A process dies before its first, second... change of a file, each time on what the last one left."""
    filled(tmp_path / "s", 2, growing=True)._store.close()
    program = FORKER.replace("        WORK", work)
    seen: dict[str, int] = {}
    with subprocess.Popen(
        [sys.executable, "-c", program, str(tmp_path / "s")], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdin is not None and process.stdout is not None
        for step in range(1, 1000):
            process.stdin.write(f"{step}\n")
            process.stdin.flush()
            code = process.stdout.readline().strip()
            assert code in ("-9", "0"), code
            seen = check(Store.open(tmp_path / "s"), seen)
            if code == "0":
                break
        process.stdin.close()
    assert least <= step < 999
    assert Store.open(tmp_path / "s").availability("a") == ("complete", 1.0)
    assert not (tmp_path / "s/a/journal").exists()
    assert len(chunk_names(tmp_path / "s")) <= Store.open(tmp_path / "s").artefact("a").shape[0], "nothing lies around"


def test_a_reader_beside_a_process_that_rewrites(tmp_path: Path) -> None:
    """Each chunk that is read is one of its writings, whole, while another process replaces them as fast as it can."""
    filled(tmp_path / "s", 2)._store.close()
    program = """
import sys
import numpy as np
from lambent.store.store import Store
writer = Store.create(sys.argv[1], {}).begin("a", "a", (2, 4), (1, 4), "float32", key="k")
print("ready", flush=True)
for value in range(2, 100_000):
    for chunk in writer.artefact.chunk_grid:
        writer.write(chunk, np.float32(value))
    if value % 20 == 0:
        writer.finish()
"""
    process = subprocess.Popen([sys.executable, "-c", program, str(tmp_path / "s")], stdout=subprocess.PIPE)
    try:
        assert process.stdout is not None and process.stdout.readline() == b"ready\n"
        store, seen, end_s = Store.open(tmp_path / "s"), {1.0}, time.monotonic() + 30
        while len(seen) < 12 and time.monotonic() < end_s:
            array = store.read("a")
            assert (array == array[:, :1]).all() and array[0, 0] >= max(seen) - 1
            seen |= set(array[:, 0].tolist())
            store.refresh()
    finally:
        process.kill()
        process.wait()
        if process.stdout is not None:
            process.stdout.close()
    assert len(seen) >= 12, "it was rewritten meanwhile"


def test_a_journal_that_a_writer_makes_anew_meanwhile_is_read_as_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    filled(tmp_path / "s", 2)._store.close()
    journal = tmp_path / "s/a/journal"
    store, found = Store.open(tmp_path / "s"), chunk_files.read_bytes

    def read(path: Path, limit_bytes: int) -> bytes:
        try:
            return found(path, limit_bytes)
        finally:
            if path == journal:
                journal.write_bytes(b"")

    monkeypatch.setattr(chunk_files, "read_bytes", read)
    store.refresh()
    assert store.availability("a") == ("complete", 1.0)
