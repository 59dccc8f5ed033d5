"""Textures survive a store, and an image that several materials show stays one."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lambent.scenes.scene import MaterialTextures, Texture
from lambent.store.contract import SceneRecord
from lambent.store.store import Store
from lambent.store.textures import read_textures, texture_records, write_textures


def record_of(textures: dict[str, MaterialTextures]) -> SceneRecord:
    return SceneRecord(
        name="s",
        objects=(),
        materials={},
        cameras=(),
        bounds=((0, 0, 0), (1, 1, 1)),
        textures=texture_records(textures),
    )


def test_textures_come_back_as_they_were_written(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    colour = Texture(rng.random((5, 7, 3)).astype(np.float16), ((2.0, 0.0, 0.5), (0.0, 3.0, 0.0)))
    mask = Texture(rng.random((4, 4, 1)).astype(np.float16))
    written = {
        "a": MaterialTextures(diffuse=colour, opacity=mask, cutoff=0.25),
        "b/c": MaterialTextures(diffuse=colour),
    }
    store = Store.create(tmp_path / "s", {})
    write_textures(store, written)
    record = SceneRecord.model_validate(record_of(written).model_dump(mode="json"))
    read = read_textures(Store.open(tmp_path / "s"), record)
    for name, textures in written.items():
        for part in ("diffuse", "opacity"):
            given, found = getattr(textures, part), getattr(read[name], part)
            assert (given is None) == (found is None)
            if given is not None:
                assert np.array_equal(given.texels, found.texels)
                assert given.uv_transform == found.uv_transform
    assert read["a"].cutoff == 0.25
    assert read["a"].diffuse.texels is read["b/c"].diffuse.texels


def test_an_image_that_is_there_is_not_written_again(tmp_path: Path) -> None:
    store = Store.create(tmp_path / "s", {})
    textures = {"a": MaterialTextures(roughness=Texture(np.ones((2, 2, 1), np.float16)))}
    write_textures(store, textures)
    chunk = next(
        path for path in (tmp_path / "s" / "texture").rglob("*") if path.is_file() and path.name != "zarr.json"
    )
    before = chunk.stat().st_mtime_ns
    write_textures(store, textures)
    assert chunk.stat().st_mtime_ns == before
