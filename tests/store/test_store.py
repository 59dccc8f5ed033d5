"""A store is whole or says what is missing, whatever happened to the process or the disk; what is there is of use."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lambent.core.errors import UserError
from lambent.store.artefact import Artefact
from lambent.store.store import Store, Writer

ARRAY = np.arange(6 * 5 * 3, dtype=np.float32).reshape(6, 5, 3)
CHUNKS = (2, 5, 3)


def begin(folder: Path, key: str = "k") -> tuple[Store, Any]:
    store = Store.create(folder, {"scene": "hash"})
    return store, store.begin("light_map/irradiance", "light map", ARRAY.shape, CHUNKS, "float32", key=key)


def write_all(writer: Any) -> None:
    for chunk in writer.missing:
        writer.write(chunk, ARRAY[writer.artefact.region(chunk)])


def finished(folder: Path) -> Store:
    store, writer = begin(folder)
    write_all(writer)
    writer.finish(noise=0.01)
    return store


def chunk_files(folder: Path) -> list[Path]:
    return sorted(path for path in (folder / "light_map/irradiance/c").rglob("*") if path.is_file())


def edit_manifest(folder: Path, **changes: Any) -> None:
    path = folder / "manifest.json"
    manifest = json.loads(path.read_text())
    manifest["artefacts"]["light_map/irradiance"].update(changes)
    path.write_text(json.dumps(manifest))


def test_what_was_written_is_read_by_another_process_later(tmp_path: Path) -> None:
    finished(tmp_path / "s").set_document("timings", {"light_map_s": 1.5})
    store = Store.open(tmp_path / "s")
    np.testing.assert_array_equal(store.read("light_map/irradiance"), ARRAY)
    assert "light_map/irradiance" in store
    assert store.inputs == {"scene": "hash"}
    assert store.documents["timings"] == {"light_map_s": 1.5}
    assert store.artefact("light_map/irradiance").meta == {"noise": 0.01}
    assert [a.state for a in store.artefacts("light map")] == ["complete"]


def test_partial_says_so_and_goes_on_where_it_stopped(tmp_path: Path) -> None:
    _, writer = begin(tmp_path / "s")
    writer.write((1, 0, 0), ARRAY[2:4])
    store = Store.open(tmp_path / "s")
    assert "light_map/irradiance" not in store
    with pytest.raises(UserError, match=r"partial \(1 of 3 chunks\).*run `lambent bake` again"):
        store.read("light_map/irradiance")
    store, writer = begin(tmp_path / "s")
    assert writer.missing == [(0, 0, 0), (2, 0, 0)]
    np.testing.assert_array_equal(writer.read_chunk((1, 0, 0)), ARRAY[2:4])
    write_all(writer)
    writer.finish()
    np.testing.assert_array_equal(store.read("light_map/irradiance"), ARRAY)


def test_a_damaged_chunk_is_noticed(tmp_path: Path) -> None:
    finished(tmp_path / "s")
    path = chunk_files(tmp_path / "s")[1]
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    with pytest.raises(UserError, match=r"irradiance 1\.0\.0: chunk is damaged; bake again with --anew"):
        Store.open(tmp_path / "s").read("light_map/irradiance")
    path.unlink()
    with pytest.raises(UserError, match="chunk is damaged"):
        Store.open(tmp_path / "s").read("light_map/irradiance")


def test_zeros_and_empty_arrays(tmp_path: Path) -> None:
    store = Store.create(tmp_path / "s", {})
    store.put("zeros", "x", np.zeros((4, 3), np.float16), key="k")
    store.put("empty", "x", np.zeros((0, 3), np.uint32), key="k")
    store = Store.open(tmp_path / "s")
    assert not store.read("zeros").any() and store.read("zeros").dtype == np.float16
    assert store.read("empty").shape == (0, 3)


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", "null", '{"format": "lambent-store"}', '{"format": "lambent-store", "version": 1}', "\x00\xff",
     '{"format": "lambent-store", "version": 1, "inputs": {}, "documents": {}, "artefacts": {"a": {}}}',
     '{"format": "lambent-store", "version": 1, "inputs": {}, "documents": {}, "artefacts": 3}'],
)  # fmt: skip
def test_a_damaged_manifest_is_one_clear_line(tmp_path: Path, text: str) -> None:
    (tmp_path / "manifest.json").write_bytes(text.encode("latin-1"))
    with pytest.raises(UserError, match=r"manifest\.json: manifest is damaged") as caught:
        Store.open(tmp_path)
    assert "\n" not in str(caught.value)


def test_another_version_is_named(tmp_path: Path) -> None:
    (tmp_path / "manifest.json").write_text('{"format": "lambent-store", "version": 99}')
    with pytest.raises(UserError, match=r"found lambent-store 99; expected lambent-store 1 or 2"):
        Store.open(tmp_path)


def test_what_zarr_json_says_is_not_believed(tmp_path: Path) -> None:
    """Shape and type are the manifest's; `zarr.json` is there for other programs."""
    finished(tmp_path / "s")
    path = tmp_path / "s/light_map/irradiance/zarr.json"
    meta = json.loads(path.read_text())
    meta["shape"] = [10**6, 10**6, 3]
    path.write_text(json.dumps(meta))
    np.testing.assert_array_equal(Store.open(tmp_path / "s").read("light_map/irradiance"), ARRAY)


@pytest.mark.parametrize("changes", [{"chunks": [2, 5, 4]}, {"chunks": [2, 4, 3]}, {"dtype": "float64"}])
def test_chunks_of_another_size_than_the_manifest_says(tmp_path: Path, changes: dict[str, Any]) -> None:
    finished(tmp_path / "s")
    edit_manifest(tmp_path / "s", **{"complete": False, **changes})
    with pytest.raises(UserError, match=r"irradiance 0\.0\.0: chunk cannot be read"):
        Store.open(tmp_path / "s").read_partial("light_map/irradiance")


@pytest.mark.parametrize("name", ["../outside", "/tmp/outside", "a/../../outside"])
def test_names_stay_inside_the_folder(tmp_path: Path, name: str) -> None:
    store = Store.create(tmp_path / "s", {})
    with pytest.raises(UserError, match="path leaves its folder"):
        store.put(name, "x", ARRAY, key="k")
    assert [path.name for path in tmp_path.iterdir()] == ["s"]


def test_create_does_not_take_over_a_folder(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("mine")
    with pytest.raises(UserError, match="neither empty nor a store"):
        Store.create(tmp_path, {})
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_missing_store_and_missing_array(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="not a store"):
        Store.open(tmp_path / "absent")
    with pytest.raises(UserError, match="bake it first"):
        Store.create(tmp_path / "s", {}).read("probe/vase/radiance")


@settings(max_examples=25)
@given(data=st.data())
def test_any_order_any_interruption_same_array(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    """Shapes, chunkings, the order of chunks and the point of interruption do not show in what is read."""
    shape = tuple(data.draw(st.lists(st.integers(1, 7), min_size=1, max_size=3)))
    chunks = tuple(data.draw(st.integers(1, size)) for size in shape)
    array = np.random.default_rng(data.draw(st.integers(0, 9))).integers(0, 3, shape).astype(np.uint16)
    folder = tmp_path_factory.mktemp("store") / "s"

    def go_on() -> tuple[Store, Any]:
        store = Store.create(folder, {})
        return store, store.begin("a", "a", shape, chunks, "uint16", key="k")

    _, writer = go_on()
    order = data.draw(st.permutations(writer.missing))
    stop = data.draw(st.integers(0, len(order)))
    for chunk in order[:stop]:
        writer.write(chunk, array[writer.artefact.region(chunk)])
    _, writer = go_on()
    assert sorted(writer.missing) == sorted(order[stop:])
    for chunk in writer.missing:
        writer.write(chunk, array[writer.artefact.region(chunk)])
    writer.finish()
    np.testing.assert_array_equal(Store.open(folder).read("a"), array)


def test_saving_one_more_array_does_not_write_all_entries_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of hundreds of arrays the manifest took longer than the arrays."""
    made: list[str] = []
    entry = Artefact.entry
    monkeypatch.setattr(Artefact, "entry", lambda self: made.append(self.name) or entry(self))
    with Store.create(tmp_path / "s", {}) as store:
        for k in range(40):
            store.put(f"probe/{k}", "probe", ARRAY, key="k")
        assert len(made) <= 3 * 40
        store.begin("probe/3", "probe", ARRAY.shape, ARRAY.shape, "float32", key="other")
    again = Store.open(tmp_path / "s")
    assert len(again.artefacts()) == 40 and not again.artefact("probe/3").complete


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
