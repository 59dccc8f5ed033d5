"""A sample of the mutations that `mutate` makes, the same in every run, and whether they reach every reader."""

from __future__ import annotations

from pathlib import Path

import pytest

from lambent.core.errors import UserError
from lambent.materials.measured.registry import readers
from tests.reliability.mutate import Bench, Hang, run
from tests.reliability.readers import Sound, scene_formats, sound

SAMPLE = 150


def test_every_reader_has_sound_files() -> None:
    """A new format, measured or of scenes, needs one in `sound_files.seeds` or `readers.sound`."""
    names = {one.reader for one in sound()}
    assert {reader.NAME for reader in readers()} <= names
    assert all(any(name.startswith(found) for name in names) for found in scene_formats())


@pytest.mark.long
def test_every_sound_file_is_used(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    assert {one.reader: said for one in sound() if (said := bench.use(one, one.files[one.broken]))} == {}


@pytest.mark.long
def test_broken_files_of_every_reader(tmp_path: Path) -> None:
    result = run(tmp_path, 0, SAMPLE, seed=11)
    assert result.failures == {}
    assert sum(c.tried for c in result.counts.values()) == SAMPLE
    assert sum(c.refused for c in result.counts.values()) > SAMPLE / 3, "the mutations break nothing"
    assert sum(c.read for c in result.counts.values()) > SAMPLE / 20, "nothing is read, so nothing is used"


@pytest.mark.parametrize("error", [KeyError("x"), Hang("long"), MemoryError(), UserError("refused")], ids=repr)
def test_what_fails_is_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    """A reader with a bug, one that hangs and one that takes memory are failures; a `UserError` is none."""

    def use(path: Path) -> None:
        if path.read_bytes() != b"{}":
            raise error

    monkeypatch.setattr("tests.reliability.mutate.sound", lambda: (Sound("made up", {"a": b"{}"}, "a", "a", use),))
    result = run(tmp_path, 0, 8, seed=0)
    count, fails = result.counts["made up"], not isinstance(error, UserError)
    assert bool(count.failed) == bool(result.failures) == fails and bool(count.refused) != fails
