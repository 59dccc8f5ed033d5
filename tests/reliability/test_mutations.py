"""A sample of the mutations that `mutate` makes, the same in every run, and whether they reach every reader."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.materials.measured.registry import readers
from tests.reliability import mutations
from tests.reliability.mutate import Bench, Count, Hang, Result, run, table
from tests.reliability.readers import Sound, scene_formats, sound

SAMPLE = 300


def test_every_reader_has_sound_files() -> None:
    """A new format, measured or of scenes, needs one in `sound_files.seeds` or `readers.sound`."""
    names = {one.reader for one in sound()}
    assert {reader.NAME for reader in readers()} <= names
    assert all(any(name.startswith(found) for name in names) for found in scene_formats())


def test_every_sound_file_is_used(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    assert {one.reader: said for one in sound() if (said := bench.use(one, one.files[one.broken]))} == {}


def test_broken_files_of_every_reader(tmp_path: Path) -> None:
    result = run(tmp_path, 0, SAMPLE, seed=11)
    assert result.failures == {}
    assert sum(c.tried for c in result.counts.values()) == SAMPLE
    assert sum(c.refused for c in result.counts.values()) > SAMPLE / 3, "the mutations break nothing"
    assert sum(c.read for c in result.counts.values()) > SAMPLE / 20, "nothing is read, so nothing is used"


def test_what_fails_is_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A reader with a bug, one that hangs and one that takes memory are failures; a `UserError` is none."""

    def use(path: Path) -> None:
        raise {0: KeyError("x"), 1: Hang("long"), 2: MemoryError(), 3: UserError("refused")}[number]

    one = Sound("made up", {"a": b"{}"}, "a", "a", lambda path: None)
    monkeypatch.setattr("tests.reliability.mutate.sound", lambda: (one,))
    for number in range(4):
        broken = Sound(
            "made up", {"a": b"{}"}, "a", "a", lambda path: use(path) if path.read_bytes() != b"{}" else None
        )
        monkeypatch.setattr("tests.reliability.mutate.sound", lambda broken=broken: (broken,))
        result = run(tmp_path / str(number), 0, 8, seed=0)
        count = result.counts["made up"]
        assert (count.failed > 0) == bool(result.failures) == (number < 3), number
        assert (count.refused > 0) == (number == 3)
    assert "| made up | 8 |" in table(Result({"made up": Count(tried=8)}))


@pytest.mark.parametrize("reader", sorted({one.reader for one in sound()}))
def test_mutations_know_the_structure(reader: str) -> None:
    """Each changes the file, and those of JSON, XML, TOML, PNG and GLB still have their form."""
    one = next(one for one in sound() if one.reader == reader)
    content = one.files[one.broken]
    way = mutations.structural(content)
    random = np.random.default_rng(0)
    changed = {(way or mutations.words)(content, random) for _ in range(20)}
    assert len(changed - {content}) > 3
    if way is mutations.png:
        assert all(c.startswith(b"\x89PNG") for c in changed)
    ends = (".toml", ".gltf", ".json", ".glb", "scene.xml", "inner.xml")
    assert (way is not None) == (
        one.broken.endswith(ends) or b"PNG" in content[:8] or reader == "LBNL BSDF XML" or "document" in reader
    )
