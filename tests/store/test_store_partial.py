"""Arrays are of use while they grow: what is there is read and verified chunk by chunk, across processes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lambent.core.errors import UserError
from lambent.store.artefact import Artefact
from lambent.store.store import Store, Writer

VALUES = np.arange(1, 7 * 5 + 1, dtype=np.float32).reshape(7, 5)


def writer_of(folder: Path) -> Writer:
    return Store.create(folder, {}).begin("a", "a", VALUES.shape, (2, 3), "float32", key="k")


def write(writer: Writer, *chunks: tuple[int, ...]) -> None:
    for chunk in chunks:
        writer.write(chunk, VALUES[writer.artefact.region(chunk)])


def test_another_store_sees_what_was_added_since_when_it_asks(tmp_path: Path) -> None:
    writer = writer_of(tmp_path / "s")
    reader = Store.open(tmp_path / "s")
    assert reader.availability("b") == ("absent", 0.0)
    write(writer, (0, 0), (3, 1))
    assert reader.availability("a") == ("partial", 0.0)
    reader.refresh()
    assert reader.availability("a") == ("partial", 0.25)
    array, written = reader.read_partial("a")
    expected = np.zeros_like(VALUES)
    expected[:2, :3], expected[6:, 3:] = VALUES[:2, :3], VALUES[6:, 3:]
    np.testing.assert_array_equal(array, expected)
    assert written.shape == (4, 2) and np.argwhere(written).tolist() == [[0, 0], [3, 1]]
    write(writer, *writer.missing)
    reader.refresh()
    assert reader.availability("a") == ("partial", 1.0), "complete is what its writer calls complete"
    writer.finish()
    reader.refresh()
    assert reader.availability("a") == ("complete", 1.0)
    np.testing.assert_array_equal(reader.read("a"), VALUES)


def test_parts_are_read_from_their_chunks_alone(tmp_path: Path) -> None:
    writer = writer_of(tmp_path / "s")
    write(writer, (1, 0), (1, 1))
    reader = Store.open(tmp_path / "s")
    np.testing.assert_array_equal(reader.read_region("a", (slice(2, 4),)), VALUES[2:4])
    np.testing.assert_array_equal(reader.read_region("a", reader.artefact("a").region((1, 1))), VALUES[2:4, 3:])
    assert reader.read_region("a", (slice(2, 2),)).shape == (0, 5)
    assert reader.read_region("a", (slice(5, 2),)).shape == (0, 5)
    with pytest.raises(UserError, match=r"a 0\.0: chunk is not written; bake it first"):
        reader.read_region("a", (slice(1, 4),))
    path = tmp_path / "s/a/c/1/0"
    path.write_bytes(path.read_bytes()[:-1] + b"x")
    np.testing.assert_array_equal(reader.read_region("a", (slice(2, 4), slice(3, 5))), VALUES[2:4, 3:])
    for read in (lambda: reader.read_region("a", (slice(2, 4),)), lambda: reader.read_partial("a")):
        with pytest.raises(UserError, match=r"a 1\.0: chunk is damaged"):
            read()


@given(st.lists(st.tuples(st.integers(-9, 9), st.integers(-9, 9)), max_size=2))
def test_any_part_is_what_numpy_says(tmp_path_factory: pytest.TempPathFactory, bounds: list[tuple[int, int]]) -> None:
    folder = tmp_path_factory.getbasetemp() / "whole"
    if not folder.exists():
        writer = writer_of(folder)
        write(writer, *writer.missing)
        writer.finish()
        writer._store.close()
    region = tuple(slice(*b) for b in bounds)
    np.testing.assert_array_equal(Store.open(folder).read_region("a", region), VALUES[region])


def test_chunks_in_names_each_chunk_that_is_touched() -> None:
    artefact = Artefact("a", "a", (7, 5), (2, 3), "float32", "k")
    assert artefact.chunks_in((slice(1, 3), slice(0, 3))) == [(0, 0), (1, 0)]
    assert artefact.chunks_in((slice(6, 7), slice(2, 4))) == [(3, 0), (3, 1)]
    assert artefact.chunks_in((slice(6, 6), slice(2, 4))) == []
    assert Artefact("a", "a", (), (), "float32", "k").chunks_in(()) == [()]


def test_a_number_without_axes(tmp_path: Path) -> None:
    store = Store.create(tmp_path / "s", {})
    store.put("n", "n", np.array(7.5), key="k")
    writer = store.begin("n", "n", (), (), "float64", key="k")
    writer.write((), np.array(8.5))
    for opened in (store, Store.open(tmp_path / "s")):
        assert opened.read("n") == 8.5 and opened.read("n").shape == ()


def test_an_array_that_was_begun_anew_is_not_mixed_with_the_old_one(tmp_path: Path) -> None:
    writer = writer_of(tmp_path / "s")
    write(writer, *writer.missing)
    writer.finish()
    reader = Store.open(tmp_path / "s")
    fresh = writer._store.begin("a", "a", VALUES.shape, (2, 3), "float32", key="another")
    with pytest.raises(UserError, match="was rewritten while it was read"):
        reader.read("a")
    with pytest.raises(UserError, match="writer was closed or replaced"):
        writer.write((0, 0), VALUES[:2, :3])
    assert len(fresh.missing) == 8


def test_too_large_is_said_before_anything_is_written(tmp_path: Path) -> None:
    store = Store.create(tmp_path / "s", {})
    with pytest.raises(UserError, match="impossible shape"):
        store.begin("a", "a", (1 << 20, 1 << 20), (1, 1 << 20), "float32", key="k")
    assert not (tmp_path / "s/a").exists() and Store.open(tmp_path / "s").artefacts() == []


def test_an_array_of_another_type_begins_anew(tmp_path: Path) -> None:
    """Chunks of one type are not read as another's, though key, shape and chunks agree."""
    store = Store.create(tmp_path / "s", {})
    store.begin("a", "kind", (4,), (2,), "float32", key="k").write((0,), np.ones(2, np.float32))
    assert len(store.begin("a", "kind", (4,), (2,), "float32", key="k").missing) == 1
    again = store.begin("a", "kind", (4,), (2,), "float16", key="k")
    assert len(again.missing) == 2 and again.artefact.dtype == "float16"
