"""A store as a folder: complete, sound, small, and nothing else is overwritten."""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

import lambent
from lambent.core.errors import UserError
from lambent.core.pictures.images import read_encoded
from lambent.core.pictures.metrics import tile_means
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.commands import Commands
from lambent.realtime.gpu.targets import pixels
from lambent.realtime.renderer import Renderer
from lambent.site.chunks import Packing
from lambent.site.export import POSTER
from lambent.store.contract import scene_record
from lambent.store.store import Store


def manifest_of(site: Path) -> dict:
    return json.loads((site / "manifest.json").read_text())


def packed_bytes(site: Path, piece: dict) -> bytes:
    """A file of data, or what stands for it in the manifest."""
    packed = base64.b64decode(piece["inline"]) if "inline" in piece else (site / piece["file"]).read_bytes()
    assert len(packed) == piece["packed"]
    return packed


def unpacked(site: Path, piece: dict) -> bytes:
    """As the page unpacks it, by cumulative sums."""
    data = gzip.decompress(packed_bytes(site, piece))
    if "packing" not in piece:
        return data
    packing, at, parts = Packing(**piece["packing"]), 0, []
    for count, back in packing.runs:
        size = count * packing.word
        planes = np.frombuffer(data[at : at + size], np.uint8).reshape(packing.word, packing.channels, -1)
        words = np.ascontiguousarray(planes.transpose(1, 2, 0)).view(f"<u{packing.word}")[..., 0]
        run = np.cumsum(words.T, axis=0, dtype=words.dtype).ravel()
        for first in range(back, count, back) if back else ():
            run[first : first + back] += run[first - back : first][: len(run[first : first + back])]
        parts.append(run.tobytes())
        at += size
    return b"".join(parts)


def is_named_by(piece: dict, data: bytes) -> bool:
    """Whether the name of a file is that of its data and packing."""
    packing = {"packing": piece["packing"]} if "packing" in piece else {}
    return hashlib.sha256(data + json.dumps(packing).encode()).hexdigest()[:20] in piece["file"]


def test_every_file_is_there_and_holds_what_the_manifest_says(box_site):
    manifest = manifest_of(box_site)
    pieces = [one["data"] for kind in ("buffer", "texture") for one in manifest["tables"][kind] if "data" in one]
    assert len(pieces) > 20
    pieces += [piece["blocks"] for piece in pieces if "blocks" in piece]
    for piece in pieces:
        data = unpacked(box_site, piece)
        assert len(data) == piece["bytes"] and is_named_by(piece, data)
        assert "inline" in piece or (box_site / piece["file"]).stat().st_size == piece["packed"]
    assert all((box_site / one["file"]).is_file() for one in manifest["tables"]["shader_module"])
    assert all((box_site / name).is_file() for name in ("index.html", "main.js", "site.css", "poster.jpg"))
    text = "".join(file.read_text("utf-8") for file in box_site.glob("*.*s*") if file.suffix in (".js", ".css"))
    assert "http://" not in text and "https://" not in text, "no third party is asked"


def test_the_frame_has_the_faces_out_of_view(baked_box, box_site):
    faces = sum(one.face_count for one in scene_record(Store.open(baked_box)).objects)
    manifest = manifest_of(box_site)
    depth = manifest["passes"][manifest["states"][0]["frames"]["plain"][0]]
    drawn = sum(command[1] for command in depth["commands"] if command[0] == "drawIndexed")
    assert drawn == 3 * faces


@pytest.mark.long
def test_the_poster_shows_the_room_as_baked(device, blue_box, box_site):
    """Not in the light of the last state, whose wall is blue."""
    renderer = Renderer(device, Store.open(blue_box))
    exposure_ev = manifest_of(box_site)["exposureEv"]
    state = FrameState(renderer.scene.record.cameras[0], *POSTER, exposure_ev=exposure_ev)
    wanted = renderer.still(state) / 255
    error = tile_means(np.abs(read_encoded(box_site / "poster.jpg") - wanted).mean(axis=-1))
    assert error.max() < 0.03


def test_states_hold_what_differs(box_site):
    manifest = manifest_of(box_site)
    baked, blue = manifest["states"]
    assert [baked["name"], blue["name"]] == ["as baked", "blue"] and baked["changes"] == {}
    changed = {manifest["tables"]["texture"][int(at)]["format"] for at in blue["changes"]["texture"]}
    assert "rgba16float" in changed, "the light map"
    assert all(blue["counts"][kind] >= count for kind, count in baked["counts"].items())
    pieces = [piece for kind in blue["changes"].values() for piece in kind.values()]
    assert all(is_named_by(piece, unpacked(box_site, piece)) for piece in pieces)


def test_a_frame_as_data_draws_what_the_renderer_draws(device, baked_box):
    renderer = Renderer(device, Store.open(baked_box))
    state = FrameState(renderer.scene.record.cameras[0], 64, 48)
    image, commands = renderer.display_image(state), Commands()
    target = renderer.target("display", state.size)
    renderer.frame(state, commands, target.create_view(), whole=True)
    encoder = device.create_command_encoder()
    commands.encode(encoder)
    device.queue.submit([encoder.finish()])
    assert np.array_equal(pixels(device, target), image)


@pytest.mark.long
def test_an_interrupted_export_leaves_what_was_there(adapter, blue_box, baked_box, box_site, tmp_path):
    def stop(done, total, what):
        if done:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        lambent.export(blue_box, tmp_path, progress=stop)
    assert manifest_of(tmp_path) == {"format": "lambent-site", "version": 0} and not (tmp_path / "index.html").exists()
    lambent.export(baked_box, tmp_path)
    former = {one: one.read_bytes() for one in tmp_path.rglob("*") if one.is_file()}
    with pytest.raises(KeyboardInterrupt):
        lambent.export(blue_box, tmp_path, progress=stop)
    assert {one: one.read_bytes() for one in tmp_path.rglob("*") if one.is_file()} == former
    lambent.export(blue_box, tmp_path)
    assert manifest_of(tmp_path) == manifest_of(box_site)


@pytest.mark.parametrize("name", ["room.glb", "page.HTML", "site.zip"])
def test_the_name_of_a_file_is_refused(baked_box, tmp_path, name):
    for as_ in ("site", "html"):
        with pytest.raises(UserError, match=f"{name}: names a file, and an export is a folder; .* such as {name[:4]}"):
            lambent.export(baked_box, tmp_path / name, as_=as_)
    with pytest.raises(UserError, match="names a file, and a store is a folder"):
        Store.create(tmp_path / name, {})
    assert not any(tmp_path.iterdir())


@pytest.mark.long
def test_a_site_is_replaced_and_nothing_else(adapter, blue_box, box_site, tmp_path):
    other = tmp_path / "letters"
    other.mkdir()
    (other / "to a friend.txt").write_text("dear")
    for wrong, message in ((other, "holds other files than a site"), (other / "to a friend.txt", "is no folder")):
        with pytest.raises(UserError, match=message):
            lambent.export(blue_box, wrong)
    site = tmp_path / "site"
    lambent.export(blue_box, site)
    (site / "data/old.gz").write_bytes(b"old")
    made = lambent.export(blue_box, site)
    files = {file.name for file in (site / "data").iterdir()}
    assert "old.gz" not in files and len(files) == made["files"]
    assert made["folder_bytes"] == sum(file.stat().st_size for file in (site / "data").iterdir()) < 2e6
    assert made["bytes"] < made["folder_bytes"]
    assert manifest_of(site) == manifest_of(box_site), "the same store makes the same site"
