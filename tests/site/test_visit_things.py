"""What a site says about its room: caption, credit, things, finishes and where these were measured."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.baking.artefacts.geometry import scene_record_of
from lambent.core.errors import UserError
from lambent.materials.document import Material, Provenance
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.scene import ImageTexture, Look
from lambent.site.things import facts_of
from lambent.site.vertices import vertices_of
from lambent.store.contract import scene_record, whole_objects
from lambent.store.store import Store
from tests.scenes.loaders.gltf.test_gltf import document, loaded
from tests.site.test_export import manifest_of, unpacked

HEAD = 'format = "lambent-scene"\nversion = 1\nname = "box"\ngeometry = "{}"\n'
MATERIALS = "[materials]\nwhite.kd = 0.7\nred.kd = 0.1\ngreen.kd = 0.1\nblack.kd = 0.0\nmetal.kd = 0.1\n"
CAPTION, CREDIT = "Küche für Frau Süß – „hell“", "© 2026 Jörg Möller"


def test_caption_and_credit_go_from_the_scene_file_into_the_store(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(f'{HEAD.format("builtin:box")}caption = "{CAPTION}"\ncredit = "{CREDIT}"\n{MATERIALS}', "utf-8")
    record = scene_record_of(load_scene(path), ())
    assert (record.caption, record.credit) == (CAPTION, CREDIT)
    kept = type(record).model_validate(record.model_dump(mode="json"))
    assert (kept.caption, kept.credit) == (CAPTION, CREDIT)
    path.write_text(f"{HEAD.format('builtin:box')}caption = 3\n{MATERIALS}")
    with pytest.raises(UserError, match="caption"):
        load_scene(path)


def test_stores_without_them_stay_as_they_are(baked_box):
    record = scene_record(Store.open(baked_box))
    assert (record.caption, record.credit) == ("", "") and not {"caption", "credit"} & record.model_dump().keys()


def test_the_copyright_of_a_gltf_file_is_the_credit_of_a_scene_that_has_none(tmp_path):
    content = document(asset={"version": "2.0", "copyright": CREDIT})
    assert loaded(tmp_path, content).credit == CREDIT
    path = tmp_path / "scene.toml"
    path.write_text(HEAD.format("thing.gltf"))
    assert load_scene(path).credit == CREDIT
    path.write_text(HEAD.format("thing.gltf") + 'credit = "mine"\n')
    assert load_scene(path).credit == "mine"


def test_the_manifest_has_the_triangles_and_the_finishes_of_every_thing(blue_box, box_site):
    store, manifest = Store.open(blue_box), manifest_of(box_site)
    visit, buffers = manifest["visit"], manifest["tables"]["buffer"]
    data, indices = (buffers[visit["geometry"][name]]["data"] for name in ("vertices", "indices"))
    words = np.frombuffer(unpacked(box_site, data), np.uint32).reshape(-1, data["packing"]["channels"])
    vertices = vertices_of(words)
    assert vertices.shape[1] == visit["geometry"]["stride"]
    assert np.array_equal(vertices[:, :3], store.read("geometry/positions"))
    faces = np.frombuffer(unpacked(box_site, indices), np.uint32).reshape(-1, 3)
    assert np.array_equal(faces, store.read("geometry/faces"))
    wanted = whole_objects(scene_record(store).objects)
    found = [(one["name"], one["material"], one["first"], one["count"]) for one in visit["objects"]]
    assert found == [(one.name, one.material, one.first_face, one.face_count) for one in wanted]
    baked, blue = visit["finishesOfStates"]
    assert {name for name in baked if baked[name] != blue[name]} == {"red"}
    assert visit["finishes"][baked["metal"]] == {"name": "metal", "facts": []}


def test_a_finish_says_how_it_was_measured():
    known = Provenance(
        source="Öl auf Eiche.bsdf", source_format="Integra", method="gradient, 2 lobe(s) per side, seed 0",
        metric="cuberoot", errors={"l1": 0.25, "cuberoot": 0.012345}, samples={"used": 12345, "below_zero": 2},
        notes=("negative readings were kept", "sparse near grazing"),
    )  # fmt: skip
    measured = Look(Material(name="oak", kd=(0.1, 0.1, 0.1), provenance=known))
    assert facts_of(measured, "") == [
        ("Measurement", "Öl auf Eiche.bsdf, Integra"), ("Fit", "gradient, 2 lobe(s) per side, seed 0"),
        ("Error", "0.0123, cuberoot"), ("Readings", "12,345"),
        ("Notes", "negative readings were kept; sparse near grazing"),
    ]  # fmt: skip
    by_hand = Material(name="oak", kd=(0.1, 0.1, 0.1))
    assert facts_of(Look(by_hand, "oak"), "oak") == []
    assert facts_of(Look(by_hand, ImageTexture("/home/anna/Fliese.png")), "oak") == [("Texture", "Fliese.png")]
    assert facts_of(Look(by_hand, ""), "oak") == [("Texture", "none")]
