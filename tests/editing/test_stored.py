"""Transport in a store becomes the edited picture of a session; the example of the documentation runs."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.pictures.images import read_image
from lambent.core.views.camera import Camera
from lambent.editing.curves.nodes import Which
from lambent.editing.session.session import Session
from lambent.editing.stored import edited_picture
from lambent.materials.document import Lobe, Material
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.terms import Editable
from lambent.scenes.loaders.load import load_scene
from lambent.store.contract import SceneRecord, view_artefact_name, write_scene_record
from lambent.store.store import Store
from tests.editing.pulled_materials import with_node
from tests.editing.written_view import SHINES, SHOWN, SIZE, UNIT, Light, write_view

CAMERA = Camera("view", (0.0, 1.0, 3.0), (0.0, 0.0, 0.0))
MATERIALS = {
    "tray": Material(name="tray", kd=(0.3, 0.2, 0.1), lobes=(Lobe(mx=0.3, my=0.3),)),
    "wall": Material(name="wall", kd=0.5),
}
COUNTS = {"diffuse": 4, "highlight": 16, "fresnel": 8}


def light_of(material: str) -> list[Light]:
    """Transport by bands of each term, in halves."""
    rng = np.random.default_rng(len(material))
    terms = of_material(MATERIALS[material]).terms
    shapes = [(*[COUNTS[f.curve] for f in term.factors], 3, len(SHOWN[material])) for term in terms]
    return [(term, rng.random(shape).astype(np.float16)) for term, shape in zip(terms, shapes, strict=True)]


@pytest.fixture
def store(tmp_path: Path) -> Store:
    store = Store.create(tmp_path / "room", {})
    write_view(store, CAMERA, 200, {name: light_of(name) for name in MATERIALS}, "k", {})
    record = SceneRecord(name="room", objects=(), materials=MATERIALS, cameras=(CAMERA,), bounds=((0, 0, 0), (1, 1, 1)))
    write_scene_record(store, record)
    return store


def expected(name: str, made: Editable) -> np.ndarray:
    """(P, 3) of a material."""
    total = np.zeros((len(SHOWN[name]), 3))
    for term, (_, light) in zip(made.terms, light_of(name), strict=True):
        means = [made.curves[f.curve].node_values(n, f.polar) for f, n in zip(term.factors, light.shape, strict=False)]
        sums = "jkcp,jc,kc->pc" if len(means) == 2 else "jcp,jc->pc"
        total += UNIT * np.array(term.scale) * np.einsum(sums, light.astype(float), *means)
    return total


def new_session(**materials: Material) -> Session:
    return Session.new("room", CAMERA, materials or {"tray": MATERIALS["tray"]}, size=SIZE)


def test_the_picture_is_the_sum_of_what_is_stored(store: Store) -> None:
    session = new_session()
    bright = with_node(MATERIALS["tray"], Which("shape"), 0, 3.0)
    session.change("tray", with_node(bright, Which("fresnel"), 7, 2.0))
    picture = edited_picture(store, session)
    image = picture.image().reshape(-1, 3)
    rest = np.setdiff1d(np.arange(len(image)), np.concatenate(list(SHOWN.values())))
    assert np.allclose(image[rest], SHINES)
    assert np.allclose(image[SHOWN["tray"]], SHINES + expected("tray", session.editable("tray")), rtol=3e-3)
    assert np.allclose(image[SHOWN["wall"]], SHINES + expected("wall", of_material(MATERIALS["wall"])), rtol=3e-3)
    assert picture.is_settled


def test_what_the_store_does_not_have_is_said(store: Store) -> None:
    other = Session.new("room", CAMERA, {}, size=(9, 9))
    with pytest.raises(UserError, match="no transport for camera view, 9 x 9"):
        edited_picture(store, other)
    with pytest.raises(UserError, match="other terms"):
        edited_picture(store, new_session(tray=Material(kd=0.3)))
    with pytest.raises(UserError, match="unknown material"):
        edited_picture(store, new_session(pot=MATERIALS["tray"]))
    changed = new_session()
    moved = MATERIALS["tray"].model_copy(update={"lobes": (Lobe(mx=0.3, my=0.3, alpha=0.5),)})
    assert not changed.change("tray", moved)
    with pytest.raises(UserError, match="other terms"):
        edited_picture(store, changed)
    changed.undo()
    assert changed.change("tray", MATERIALS["tray"].model_copy(update={"lobes": (Lobe(mx=0.5, my=0.5),)}))
    assert edited_picture(store, changed).is_exact


@pytest.mark.long
def test_the_documented_example_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As it stands, but for the size: what it writes is the picture of the session that it writes."""
    page = (Path(__file__).parents[2] / "docs" / "editing.md").read_text("utf-8")
    code = re.search(r"```python\n(.*?)```", page, re.DOTALL)
    assert code is not None
    assert len([line for line in code[1].splitlines() if line and not line.startswith("from")]) <= 10
    monkeypatch.chdir(tmp_path)
    exec(code[1].replace("(512, 512)", "(40, 40)"), {})
    with Store.open(tmp_path / "tray.store") as baked:
        session = Session.open(tmp_path / "tray.edits.json")
        edited = edited_picture(baked, session)
        edited.draw()
        assert np.allclose(
            read_image(tmp_path / "tray.exr"), edited.image(), rtol=0.02, atol=0.02 * edited.image().mean()
        )
        edited.show("nickel", of_material(load_scene("builtin:teatray").materials["nickel"]))
        edited.draw()
        assert not np.allclose(read_image(tmp_path / "tray.exr"), edited.image(), rtol=0.02)


def test_a_store_from_before_a_merge_is_refused(store: Store) -> None:
    merged = Session.new("room", CAMERA, MATERIALS, size=SIZE)
    name, other = list(MATERIALS)[:2]
    merged.merge(name, other)
    with pytest.raises(UserError, match=f"merges with {other}"):
        edited_picture(store, merged)


def test_transport_by_steps_of_earlier_versions_is_not_misread(store: Store) -> None:
    name = view_artefact_name(CAMERA, *SIZE, "transport", "200/terms")
    old = store.artefact(name)
    terms = [{key: value for key, value in term.items() if key != "basis"} for term in old.meta["terms"]]
    store.put(name, "transport", store.read(name), key="older", meta={**old.meta, "terms": terms})
    with pytest.raises(UserError, match="earlier version"):
        edited_picture(store, Session.new("room", CAMERA, {"tray": MATERIALS["tray"]}, size=SIZE))
