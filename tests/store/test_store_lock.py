"""One process writes a store at a time, another is told at once, and nobody waits to read."""

from __future__ import annotations

import gc
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from threading import Event, Thread

import numpy as np
import pytest

from lambent.core import files
from lambent.core.errors import UserError
from lambent.store.contract import SceneRecord, write_scene_record
from lambent.store.kept.views import change_views, read_views
from lambent.store.lock import FILE, WriterLock
from lambent.store.store import Store

ONE = np.ones(3, np.float32)
RECORD = SceneRecord(name="s", objects=(), materials={}, cameras=(), bounds=((0, 0, 0), (1, 1, 1)))
HOLD = """
import sys
import numpy as np
from lambent.store.store import Store
store = Store.create(sys.argv[1], {})
writer = store.begin("theirs", "a", (4, 3), (1, 3), "float32", key="k")
writer.write((0, 0), np.ones(3))
print("ready", flush=True)
sys.stdin.read()
"""


def refused_elsewhere(folder: Path) -> bool:
    """Whether another thread, which counts like another process, may not write now."""
    found: list[bool] = []

    def attempt() -> None:
        try:
            WriterLock(folder).release()
            found.append(False)
        except UserError:
            found.append(True)

    thread = Thread(target=attempt)
    thread.start()
    thread.join()
    return found[0]


def test_a_second_process_is_told_who_writes_and_damages_nothing(tmp_path: Path) -> None:
    folder = tmp_path / "s"
    Store.create(folder, {"scene": "hash"}).put("mine", "a", ONE, key="k")
    reader = Store.open(folder)
    process = subprocess.Popen([sys.executable, "-c", HOLD, str(folder)], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert process.stdout is not None and process.stdout.readline() == b"ready\n"
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    attempts: list[Callable[[], object]] = [
        lambda: Store.create(folder, {}),
        lambda: reader.set_document("timings", {}),
        lambda: reader.put("mine", "a", ONE, key="another"),
        lambda: reader.begin("theirs", "a", (4, 3), (1, 3), "float32", key="another"),
        reader.forget_all,
        lambda: write_scene_record(reader, RECORD),
    ]
    for attempt in attempts:
        with pytest.raises(
            UserError, match=rf"is locked by another writer; found process {process.pid}; .*wait"
        ) as caught:
            attempt()
        assert str(folder) in str(caught.value)
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before
    assert reader.read("mine").tolist() == [1, 1, 1] and Store.open(folder).availability("theirs") == ("partial", 0.25)
    assert change_views(folder, lambda views: views) == read_views(folder), "views have a lock of their own"
    process.kill()
    process.communicate()
    reader.set_document("timings", {"a": 1})
    assert reader.availability("theirs") == ("partial", 0.25), "who writes knows what was written before"
    store = Store.open(folder)
    assert store.documents == {"timings": {"a": 1}} and store.availability("theirs") == ("partial", 0.25)


def test_the_file_of_the_lock_holds_the_writer_alone(tmp_path: Path) -> None:
    (tmp_path / FILE).write_text("1234567890, left by a process that died\n")
    lock = WriterLock(tmp_path)
    assert (tmp_path / FILE).read_text() == f"{os.getpid()} {platform.node()}\n" and lock.held


def test_a_writer_on_another_machine_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    here = platform.node()
    monkeypatch.setattr(platform, "node", lambda: "attic")
    lock = WriterLock(tmp_path)
    monkeypatch.setattr(platform, "node", lambda: here)
    found: list[str] = []

    def attempt() -> None:
        with pytest.raises(UserError) as caught:
            WriterLock(tmp_path)
        found.append(str(caught.value))

    thread = Thread(target=attempt)
    thread.start()
    thread.join()
    assert f"found process {os.getpid()} on attic; " in found[0]
    lock.release()
    WriterLock(tmp_path).release()


def test_clocks_that_jump_lock_nothing_and_lose_nothing(tmp_path: Path) -> None:
    """Files of a dead writer and of another machine, from a year ahead and from 1970."""
    with Store.create(tmp_path / "s", {}) as store:
        store.put("a", "x", ONE, key="k")
    dead = subprocess.run([sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True, text=True)
    left = tmp_path / "s" / f"{files._MACHINE}{dead.stdout.strip()}-00000000-0"
    elsewhere = left.with_name(left.name.replace(files._MACHINE, ".lambent-00000000-"))
    for now_s in (time.time() + 3e7, 0.0):
        left.write_text("")
        elsewhere.write_text("")
        for path in (tmp_path / "s").rglob("*"):
            os.utime(path, (now_s, now_s))
        with Store.create(tmp_path / "s", {}) as store:
            assert store.read("a").tolist() == [1, 1, 1]
            store.put("a", "x", 2 * ONE, key="l")
            store.put("a", "x", ONE, key="k")
        assert not left.exists() and elsewhere.exists(), "another machine's file may be in use"
    assert Store.open(tmp_path / "s").read("a").tolist() == [1, 1, 1]


def test_the_right_to_write_ends_with_close_with_the_object_and_with_a_context(tmp_path: Path) -> None:
    store = Store.create(tmp_path / "s", {})
    assert refused_elsewhere(tmp_path / "s")
    writer = store.begin("a", "a", (1, 3), (1, 3), "float32", key="k")
    store.close()
    assert not refused_elsewhere(tmp_path / "s")
    with pytest.raises(UserError, match="writer was closed or replaced; begin the array again"):
        writer.write((0, 0), ONE)
    store.set_document("d", 1)
    assert refused_elsewhere(tmp_path / "s"), "the next writing call takes the lock again"
    del store, writer
    gc.collect()
    assert not refused_elsewhere(tmp_path / "s")
    with Store.create(tmp_path / "s", {}):
        assert refused_elsewhere(tmp_path / "s")
    assert not refused_elsewhere(tmp_path / "s")
    Store.open(tmp_path / "s").artefacts()
    assert not refused_elsewhere(tmp_path / "s")


def test_the_same_thread_hands_over_to_its_newer_store(tmp_path: Path) -> None:
    older = Store.create(tmp_path / "s", {})
    writer = older.begin("a", "a", (2, 3), (1, 3), "float32", key="k")
    writer.write((0, 0), ONE)
    newer = Store.create(tmp_path / "s", {})
    with pytest.raises(UserError, match="writer was closed or replaced"):
        writer.write((1, 0), ONE)
    newer.put("b", "b", ONE, key="k")
    older.set_document("d", 1)
    assert older.read("b").tolist() == [1, 1, 1], "it has seen what the newer one wrote"
    store = Store.open(tmp_path / "s")
    assert store.documents == {"d": 1} and "b" in store and store.availability("a") == ("partial", 0.5)


def test_another_thread_is_refused_until_it_ends(tmp_path: Path) -> None:
    ready, leave, kept = Event(), Event(), []

    def work() -> None:
        kept.append(Store.create(tmp_path / "s", {}))
        ready.set()
        leave.wait()

    thread = Thread(target=work)
    thread.start()
    ready.wait()
    with pytest.raises(UserError, match=f"found process {os.getpid()}"):
        Store.create(tmp_path / "s", {})
    leave.set()
    thread.join()
    Store.create(tmp_path / "s", {}).set_document("d", 1)


def test_a_forked_child_does_not_inherit_the_right(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lock = WriterLock(tmp_path)
    assert lock.held
    monkeypatch.setattr(os, "getpid", lambda: -1)
    assert not lock.held


def test_a_damaged_store_is_not_held(tmp_path: Path) -> None:
    Store.create(tmp_path, {}).close()
    (tmp_path / "manifest.json").write_text("{")
    with pytest.raises(UserError, match="damaged"):
        Store.create(tmp_path, {})
    assert not refused_elsewhere(tmp_path)


def test_a_folder_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="cannot be written"):
        Store.create(tmp_path / "file/s", {})


def test_what_a_killed_writer_left_goes_with_the_next_writer(tmp_path: Path) -> None:
    """A reader leaves it: it does not hold the lock."""
    with Store.create(tmp_path / "s", {}) as store:
        store.put("a", "x", np.ones((4, 4), np.float32), key="k")
    program = (
        "import os, signal, sys; from pathlib import Path; from lambent.core.files import atomic_path\n"
        "with atomic_path(Path(sys.argv[1])): os.kill(os.getpid(), signal.SIGKILL)"
    )
    for name in ("manifest.json", "a/c/0/0"):
        subprocess.run([sys.executable, "-c", program, str(tmp_path / "s" / name)], check=False)
    left = list((tmp_path / "s").rglob(".lambent-*"))
    Store.open(tmp_path / "s").read("a")
    assert len(left) == 2 and all(path.exists() for path in left)
    with Store.create(tmp_path / "s", {}) as store:
        np.testing.assert_array_equal(store.read("a"), np.ones((4, 4)))
    assert not any(path.exists() for path in left)
