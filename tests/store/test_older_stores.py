"""A store of the first format, as zarr itself wrote its chunks: it is read, gone on with, and looks the same after."""

from __future__ import annotations

import json
import zlib
from pathlib import Path

import numpy as np
import pytest
import zarr

from lambent.store.store import Store

RAW = np.random.default_rng(0).random((2, 5, 7, 4)).astype(np.float32)
RAW[:, :, 4:] = 0  # chunks of zeros have no file
CHUNKS = (2, 4, 4, 4)


@pytest.fixture
def older(tmp_path: Path) -> Path:
    """One complete array and one that was interrupted after three of its four chunks."""
    entries = {}
    for name, last in (("light_map/traced", 3), ("light_map/gathered", 4)):
        array = zarr.create_array(tmp_path / name, shape=RAW.shape, chunks=CHUNKS, dtype="float32")
        done = {}
        for number, (row, column) in enumerate(np.ndindex(2, 2)):
            if number < last:
                rows, columns = slice(row * 4, row * 4 + 4), slice(column * 4, column * 4 + 4)
                array[:, rows, columns] = RAW[:, rows, columns]
                path = tmp_path / name / f"c/0/{row}/{column}/0"
                done[f"0.{row}.{column}.0"] = zlib.crc32(path.read_bytes()) if path.exists() else 0
        entries[name] = {
            "kind": "raw", "shape": RAW.shape, "chunks": CHUNKS, "dtype": "float32", "key": "k", "meta": {"seed": 1},
            "done": done, "complete": last == 4,
        }  # fmt: skip
    manifest = {
        "format": "lambent-store", "version": 1, "inputs": {"scene": "hash"}, "documents": {"timings": {"a": 1}},
        "artefacts": entries,
    }  # fmt: skip
    (tmp_path / "manifest.json").write_text(json.dumps(manifest, indent=1))
    return tmp_path


def test_it_is_read(older: Path) -> None:
    store = Store.open(older)
    np.testing.assert_array_equal(store.read("light_map/gathered"), RAW)
    assert store.availability("light_map/traced") == ("partial", 0.75)
    assert store.artefact("light_map/gathered").meta == {"seed": 1}
    assert store.inputs == {"scene": "hash"} and store.documents == {"timings": {"a": 1}}


def test_a_bake_goes_on_and_writes_what_zarr_would(older: Path) -> None:
    before = (older / "light_map/gathered/c/0/1/0/0").read_bytes()
    store = Store.create(older, {"scene": "hash"})
    writer = store.begin("light_map/traced", "raw", RAW.shape, CHUNKS, "float32", key="k")
    assert writer.missing == [(0, 1, 1, 0)]
    writer.write((0, 1, 1, 0), RAW[writer.artefact.region((0, 1, 1, 0))])
    writer.finish()
    manifest = json.loads((older / "manifest.json").read_text())
    assert manifest["version"] == 1
    traced, gathered = (manifest["artefacts"][f"light_map/{name}"] for name in ("traced", "gathered"))
    assert traced == gathered
    anew = store.begin("light_map/traced", "raw", RAW.shape, CHUNKS, "float32", key="another")
    for chunk in anew.missing:
        anew.write(chunk, RAW[anew.artefact.region(chunk)])
    assert (older / "light_map/traced/c/0/1/0/0").read_bytes() == before
    np.testing.assert_array_equal(zarr.open_array(older / "light_map/traced", mode="r")[...], RAW)
