"""A view is baked for relighting into its room's store, or a store beside it, and nothing else of the room changes."""

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.quality import quality_named
from lambent.baking.running.relit import Relit, relight_copy
from lambent.baking.transport.view import View
from lambent.core.errors import UserError
from lambent.core.light.light_mix import GroupMix, LightMix
from lambent.editing.relit_view import RelitView
from lambent.scenes.lamp_edits import LampEdit
from lambent.scenes.loaders.load import load_scene
from lambent.store.kept.session import RoomState
from lambent.store.source import scene_of
from lambent.store.store import Store

FEW = quality_named("preview").changed(visibility={"lights": (20,)})


@pytest.fixture(scope="module")
def store(mi, tmp_path_factory):
    """The view edited in place, as the window bakes it."""
    folder, scene = tmp_path_factory.mktemp("room") / "tray.store", load_scene("builtin:teatray")
    view = View(scene.cameras[0], 8, 6)
    bake(scene, folder, only={"transport"}, views=[view], quality=FEW).close()
    bake(scene_of(Store.open(folder)), folder, only={"transport"}, views=[view], quality=FEW).close()
    return folder, view


def keys(folder):
    return {one.name: one.key for one in Store.open(folder).artefacts() if one.complete}


def picture(relit):
    view = relit.view
    return RelitView(Store.open(relit.place), view.camera, view.width, view.height).image()


@pytest.mark.long
def test_the_transport_of_the_view_stays(store):
    folder, view = store
    before = keys(folder)
    relit = Relit(folder, RoomState(light=LightMix({"lamp": GroupMix(intensity=0.5)})), view)
    scene = relit.scene()
    assert relit.place == folder and not relit.is_baked(scene)
    relit.bake()
    assert relit.is_baked(scene) and picture(relit).mean() > 0
    after = keys(folder)
    assert {name: after.get(name) for name in before} == before and len(after) > len(before)
    assert Store.open(folder).artefact(view.name("relighting", "spans")).shape[1] == 1281, "as finely as the store"


@pytest.mark.long
def test_edits_go_to_a_store_beside_it(store):
    folder, view = store
    before, scene = keys(folder), load_scene("builtin:teatray")
    glaze = scene.materials["glaze"].model_copy(update={"kd": (0.05, 0.6, 0.05)})
    edited = Relit(folder, RoomState(materials={"glaze": glaze}), view)
    edited.bake()
    green = picture(edited)
    bare = Relit(folder, RoomState(textures={"glaze": ""}), view)
    assert edited.place == bare.place == relight_copy(folder) != folder
    assert edited.is_baked(edited.scene()) and not bare.is_baked(bare.scene()), "which has the other glaze"
    assert keys(folder) == before and np.isfinite(green).all()


def test_lamps_that_the_scene_lacks_are_refused(store):
    folder, view = store
    relit = Relit(folder, RoomState(lamps={7: LampEdit((0.0, 1.0, 0.0))}), view)
    assert relit.place == relight_copy(folder)
    with pytest.raises(UserError, match="no such lamp"):
        relit.scene()
