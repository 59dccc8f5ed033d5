"""What `lambent edit` opens in place: scenes, stores, sessions; under which camera and light, and into which store."""

from __future__ import annotations

import json

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.pictures.images import write_image
from lambent.editing.session.session import Session
from lambent.materials.document import Material
from lambent.scenes.scene import ImageEnvironment
from lambent.store.kept.session import Surroundings
from lambent.store.source import SURROUNDINGS
from lambent.store.store import Store
from lambent.viewer import edit
from lambent.viewer.modes.edit.subject import kind_of, opened, scene_for
from lambent.viewer.screen import Screen

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@pytest.fixture
def sky(tmp_path):
    write_image(tmp_path / "sky.hdr", np.full((4, 8, 3), 0.5, np.float32))
    return tmp_path / "sky.hdr"


def test_kinds_are_told_apart(tmp_path):
    Material(name="brass").save(tmp_path / "brass.json")
    (tmp_path / "thing.obj").write_text(TRIANGLE)
    Session.new("builtin:box", opened(tmp_path / "thing.obj", Screen(tmp_path)).session.document.camera, {}).save(
        tmp_path / "s.json"
    )
    (tmp_path / "store").mkdir()
    kinds = {"brass.json": None, "table.bsdf": None, "thing.obj": "scene", "s.json": "session", "store": "store"}
    assert {name: kind_of(tmp_path / name) for name in kinds} == kinds
    assert (
        edit.editing_mode(tmp_path / "brass.json") == "material" and edit.editing_mode(tmp_path / "thing.obj") == "edit"
    )
    assert kind_of(type(tmp_path)("builtin:teatray")) == "scene" and kind_of(tmp_path / "new.edits.json") == "session"


def test_a_scene_of_any_format_opens(tmp_path):
    (tmp_path / "thing.obj").write_text(TRIANGLE)
    subject = opened(tmp_path / "thing.obj", Screen(tmp_path), picture=(40, 30))
    document = subject.session.document
    assert document.size == (40, 30) and len(document.materials) == 1 and document.environment is None
    assert subject.store == tmp_path / "thing.edit.store" and not subject.store.exists()


@pytest.mark.long
def test_cameras_are_chosen_by_name(tmp_path):
    box = type(tmp_path)("builtin:teatray")
    assert opened(box, Screen(tmp_path), camera="front").session.document.camera.name == "front"
    with pytest.raises(UserError, match=r"unknown camera.*back.*front"):
        opened(box, Screen(tmp_path), camera="back")
    with pytest.raises(UserError, match=r"too large.*9000x10"):
        opened(box, Screen(tmp_path), picture=(9000, 10))


def test_another_light_means_another_store(tmp_path, sky):
    box = type(tmp_path)("builtin:teatray")
    plain, lit = opened(box, Screen(tmp_path)), opened(box, Screen(tmp_path), environment=sky)
    assert plain.store.name == "teatray.edit.store" and lit.store.name.startswith("teatray-sky-")
    assert lit.store_for(None) == plain.store and lit.store_for(lit.lit_by) == lit.store
    bright = Surroundings(file=str(sky), scale=2.0)
    assert len({lit.store_for(bright), lit.store, plain.store}) == 3
    assert lit.session.environment == ImageEnvironment(sky.resolve())
    with pytest.raises(UserError, match=r"file does not exist.*--environment|--environment.*file does not exist"):
        opened(box, Screen(tmp_path), environment=tmp_path / "none.hdr")


@pytest.mark.long
def test_a_store_of_another_scene_is_left_alone(tmp_path):
    with Store.create(tmp_path / "mine", {}) as store:
        store.set_document("source", "builtin:box")
    with pytest.raises(UserError, match=r"another scene.*builtin:box"):
        opened(type(tmp_path)("builtin:teatray"), Screen(tmp_path), store=tmp_path / "mine")
    (tmp_path / "other").mkdir()
    assert (
        opened(type(tmp_path)("builtin:teatray"), Screen(tmp_path), store=tmp_path / "other").store
        == tmp_path / "other"
    )


@pytest.mark.long
def test_a_store_opens_under_the_light_that_it_was_baked_with(tmp_path, sky):
    with Store.create(tmp_path / "lit", {}) as store:
        store.set_document("source", "builtin:teatray")
        store.set_document(SURROUNDINGS, {"file": "../sky.hdr"})
    subject = opened(tmp_path / "lit", Screen(tmp_path))
    assert subject.store == tmp_path / "lit" and subject.lit_by == Surroundings(file=str(sky.resolve()))
    assert subject.session.environment == ImageEnvironment(sky.resolve())
    write_image(tmp_path / "dusk.hdr", np.full((4, 8, 3), 0.25, np.float32))
    other = opened(tmp_path / "lit", Screen(tmp_path), environment=tmp_path / "dusk.hdr")
    assert other.store != tmp_path / "lit" and other.store_for(subject.lit_by) != other.store


@pytest.mark.long
def test_a_session_opens_with_its_view_and_all_materials(tmp_path):
    box = type(tmp_path)("builtin:teatray")
    first = opened(box, Screen(tmp_path), picture=(20, 10))
    document = first.session.document
    kept = {"glaze": document.materials["glaze"]}
    Session(document.model_copy(update={"materials": kept})).save(tmp_path / "glaze.edits.json")
    again = opened(tmp_path / "glaze.edits.json", Screen(tmp_path))
    assert (
        set(again.session.document.materials) == set(document.materials) and again.home == tmp_path / "glaze.edits.json"
    )
    assert again.session.document.size == (20, 10) and again.store == first.store
    assert opened(tmp_path / "glaze.edits.json", Screen(tmp_path), picture=(30, 30)).session.document.size == (30, 30)
    text = json.loads((tmp_path / "glaze.edits.json").read_text())
    text["materials"]["gold"] = text["materials"].pop("glaze")
    (tmp_path / "gold.edits.json").write_text(json.dumps(text))
    with pytest.raises(UserError, match=r"unknown material.*gold"):
        opened(tmp_path / "gold.edits.json", Screen(tmp_path))


@pytest.mark.long
def test_merged_materials_and_hard_edges_last_with_the_session(tmp_path):
    subject = opened(type(tmp_path)("builtin:teatray"), Screen(tmp_path), crease_deg=40.0)
    assert subject.scene.crease_deg == 40
    subject.session.merge("nickel", "glaze")
    subject.session.save(tmp_path / "tray.edits.json")
    again = opened(tmp_path / "tray.edits.json", Screen(tmp_path))
    assert again.scene.crease_deg == 40 and "nickel" not in again.session.document.materials
    dressed = scene_for(again.session)
    assert dressed.crease_deg == 40 and {o.material for o in dressed.objects} == {*again.session.document.materials}
    assert opened(tmp_path / "tray.edits.json", Screen(tmp_path), crease_deg=20.0).scene.crease_deg == 20
    text = json.loads((tmp_path / "tray.edits.json").read_text())
    (tmp_path / "gold.edits.json").write_text(json.dumps(text | {"merged": {"gold": "glaze"}}))
    with pytest.raises(UserError, match=r"unknown material.*gold"):
        opened(tmp_path / "gold.edits.json", Screen(tmp_path))
    with Store.create(tmp_path / "baked", {}) as store:
        store.set_document("source", "builtin:teatray")
    with pytest.raises(UserError, match=r"--crease-angle|crease"):
        opened(tmp_path / "baked", Screen(tmp_path), crease_deg=40.0)


def test_options_of_the_other_mode_are_refused(tmp_path):
    Material(name="brass").save(tmp_path / "brass.json")
    with pytest.raises(UserError, match=r"--crease-angle.*applies to scenes|applies to scenes.*--crease-angle"):
        edit.run(tmp_path / "brass.json", crease_deg=40.0)
    with pytest.raises(UserError, match=r"--camera.*applies to scenes|applies to scenes.*--camera"):
        edit.run(tmp_path / "brass.json", camera="front")
    box = type(tmp_path)("builtin:teatray")
    with pytest.raises(UserError, match="takes no material document"):
        edit.run(box, tmp_path / "brass.json")
    with pytest.raises(UserError, match="one environment"):
        edit.run(box, environments=[tmp_path / "a.hdr", tmp_path / "b.hdr"])
