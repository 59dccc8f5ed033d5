"""Glossy surfaces seen in others: rooms as they are baked are those of the path tracer, whatever the series."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from lambent.baking.artefacts.interreflection import parts
from lambent.baking.bake import bake
from lambent.baking.bake import found as kinds
from lambent.baking.context import BakeContext
from lambent.baking.interreflection.as_baked import is_lambertian, over_albedo, shapes_of, state_of, unlike_documents
from lambent.baking.interreflection.series import bins_of, tails_of
from lambent.baking.interreflection.settings import Bounces
from lambent.baking.interreflection.tiles import Job, TileTracer
from lambent.baking.methods import chosen
from lambent.baking.quality import quality_named
from lambent.baking.transport.view import View
from lambent.baking.transport.view_tracer import ViewTracer
from lambent.core.views.camera import Camera
from lambent.materials.document import Lobe, Material
from lambent.materials.factored.albedo import albedo
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.of_models import editable
from lambent.materials.factored.terms import Editable
from lambent.materials.models.blinn_phong import BlinnPhong
from lambent.scenes.geometry import patch
from lambent.scenes.scene import MaterialTextures, Scene, SceneObject, Texture
from lambent.store.store import Store
from tests.baking.interreflection.test_interreflection import SIZE, baked, of_scene, path_traced, picture
from tests.tools.z_test import assert_same_image

SHINY = Material(kd=(0.3, 0.2, 0.1), lobes=(Lobe(mx=0.15, my=0.15, r0=0.5, k=(0.6, 0.8, 0.9), alpha=0.5),))
GLOSS = Material(lobes=(Lobe(mx=0.15, my=0.15, r0=0.5, k=(0.9, 0.5, 0.3), alpha=0.5),))
FIRST = {name: Material(kd=0.5) for name in ("floor", "back", "side", "seen")}
MODELS = {"floor": editable(BlinnPhong(ks=(0.6, 0.5, 0.4), exponent=60.0))}  # as baked, whatever the document says
GLOSSY = {"floor": SHINY, "back": GLOSS, "side": SHINY, "seen": FIRST["seen"]}


AT_WALL = Camera("wall", (-0.6, 0.4, 0.0), (1.0, -0.5, 0.0), fov_y_deg=20.0)


def room(materials: dict[str, Material]) -> Scene:
    """A closed room of 2 m whose ceiling shines; the camera looks at the foot of a wall."""
    sides = {
        "floor": ((-1, -1, 1), (2, 0, 0), (0, 0, -2)),
        "back": ((-1, -1, -1), (2, 0, 0), (0, 2, 0)),
        "front": ((-1, -1, 1), (0, 2, 0), (2, 0, 0)),
        "left": ((-1, -1, 1), (0, 0, -2), (0, 2, 0)),
        "seen": ((1, -1, 1), (0, 2, 0), (0, 0, -2)),
    }
    of_sides = {"left": "side", "front": "side"}
    walls = (SceneObject(name, patch(*place), of_sides.get(name, name)) for name, place in sides.items())
    lamp = SceneObject("lamp", patch((-1, 1, 1), (0, 0, -2), (2, 0, 0)), "black", (3.0, 2.0, 1.0))
    return Scene("room", (*walls, lamp), {**materials, "black": Material()})


def compared(scene: Scene, later: dict[str, Editable], folder: Path, series: tuple[int, ...]) -> None:
    """The wall of a store and of the path tracer: pixel by pixel, and in the mean, within the noise of both."""
    view, passes, bounces = View(AT_WALL, SIZE, SIZE), [], Bounces(series, samples=1024)
    for seed in range(2):
        store = bake(
            scene, folder / str(seed), only={"interreflection"}, views=[view], bounces=bounces, seed=seed,
            editables={name: one for name, one in later.items() if name in MODELS},
        )  # fmt: skip
        passes.append(picture(store, view, scene, {**of_scene(scene), **later}).reshape(SIZE, SIZE, 3))
    found, variance = np.mean(passes, axis=0), np.var(passes, axis=0, ddof=1).mean() / 2
    expected, noise = path_traced(scene, len(series), AT_WALL, edited=later or None)
    assert_same_image(found, np.full_like(found, variance), expected, noise, level=1e-3)  # highlights: long tails
    error = np.sqrt(variance + noise.mean()) / SIZE / expected.mean()
    assert error < 0.01
    assert abs(found.mean() / expected.mean() - 1) < 3 * error + 0.003


@pytest.mark.long
def test_a_glossy_room_is_that_of_the_path_tracer(tmp_path: Path) -> None:
    """A diffuse wall between glossy ones; once it was a few percent off."""
    compared(room(GLOSSY), {}, tmp_path, (16, 1, 1, 1))


@pytest.mark.long
def test_strengths_of_what_is_glossy_are_exact_too(tmp_path: Path) -> None:
    """Where all of a material is scaled alike, or its one term is tinted, by channels and to black and from it."""
    dark = GLOSS.model_copy(update={"lobes": (GLOSS.lobes[0].model_copy(update={"k": (0.9, 0.5, 0.0)}),)})
    scene = room({**FIRST, "back": dark, "floor": SHINY})
    tinted = of_material(
        GLOSS.model_copy(update={"lobes": (GLOSS.lobes[0].model_copy(update={"k": (0.1, 0.9, 0.7)}),)})
    )
    half = of_material(SHINY)
    half = replace(half, terms=tuple(replace(t, scale=tuple(0.5 * x for x in t.scale)) for t in half.terms))
    compared(scene, {"back": tinted, "floor": half}, tmp_path, (16, 1))


@pytest.mark.long
def test_a_textured_floor_beside_a_wall(tmp_path: Path) -> None:
    """Texel by texel, not by their mean, which would be 3 % off, where nothing is edited."""
    texels = np.full((2, 64, 3), 0.2, np.float16)
    texels[:, 32:] = 1.8
    scene = replace(room(FIRST), textures={"floor": MaterialTextures(diffuse=Texture(texels))})
    compared(scene, {}, tmp_path, (16, 1))


@pytest.mark.long
def test_light_through_a_glossy_sheet(tmp_path: Path) -> None:
    """A sheet between the lamp and the wall, which scatters to both sides, each with a slot of its own."""
    sheet = Material(kd=0.2, kt_d=0.2, lobes=(Lobe(side="transmission", mx=0.2, my=0.2, r0=0.1, k=0.7, alpha=0.5),))
    plain = room(FIRST)
    held = SceneObject("sheet", patch((-0.9, 0.5, 0.9), (1.8, 0, 0), (0, 0, -1.8)), "sheet")
    scene = replace(plain, objects=(*plain.objects, held), materials={**plain.materials, "sheet": sheet})
    compared(scene, {}, tmp_path, (16, 1, 1))


@pytest.mark.long
def test_materials_that_are_not_those_of_their_documents(tmp_path: Path) -> None:
    """A model in place of a document scatters as the model."""
    compared(room(FIRST), MODELS, tmp_path, (16, 1))


def test_a_store_knows_the_state_that_it_is_baked_of(tmp_path: Path) -> None:
    """Another highlight makes its tiles stale; another colour of what is Lambertian does not."""
    store = Store.create(tmp_path / "s", {})

    def keys(materials: dict[str, Material], diffuse_seen: bool = False) -> set[str]:
        context = BakeContext(
            room(materials), store, kinds(), quality_named("preview"), chosen({}), views=[View(AT_WALL, 4, 4)],
            bounces=Bounces((4, 1), samples=16, diffuse_seen=diffuse_seen),
        )  # fmt: skip
        return {part.key for part in parts(context, context.views[0])}

    before = keys({**FIRST, "floor": SHINY})
    assert keys({**FIRST, "floor": SHINY, "back": Material(kd=(0.1, 0.2, 0.3))}) == before
    wider = SHINY.model_copy(update={"lobes": (SHINY.lobes[0].model_copy(update={"mx": 0.2, "my": 0.2}),)})
    after = keys({**FIRST, "floor": wider})
    assert len(before) == len(after) and not before & after
    diffuse = keys({**FIRST, "floor": wider}, diffuse_seen=True)
    assert not after & diffuse
    assert keys({**FIRST, "floor": SHINY}, diffuse_seen=True) == diffuse


@pytest.mark.long
def test_surfaces_seen_as_diffuse_ones(tmp_path: Path) -> None:
    """The picture of a glossy room is then that of Lambertian walls of the same albedos."""
    scene, found = room(GLOSSY), []
    even = {name: Material(kd=tuple(albedo(one, "reflection"))) for name, one in of_scene(scene).items() if one.terms}
    for k, (shown, diffuse_seen) in enumerate([(scene, True), (room({**GLOSSY, **even}), False), (scene, False)]):
        bounces = Bounces((16, 1), samples=128, diffuse_seen=diffuse_seen)
        store, view = baked(shown, AT_WALL, tmp_path / str(k), bounces)
        found.append(picture(store, view, shown, of_scene(shown)))
    assert np.allclose(found[0], found[1], rtol=0.02, atol=1e-4)
    assert not np.allclose(found[0], found[2], rtol=0.02, atol=1e-4)


@pytest.mark.parametrize(("material", "expected"), [
    (Material(kd=(0.8, 0.1, 0.0)), True),
    (Material(kd=0.3, kt_d=0.5), True),
    (Material(kd=0.8, lobes=(Lobe(mx=0.2, my=0.2, r0=0.1, k=0.02),)), True),
    (Material(kd=0.5, kd_coupled=True), False),
    (Material(kd=0.5, lobes=(Lobe(mx=0.003, my=0.003, r0=0.1),)), False),
    (Material(kd=(0.9, 0.9, 0.0), lobes=(Lobe(mx=0.2, my=0.2, r0=0.1, k=0.02),)), False),
    (Material(kd=0.5, kt_d=0.1, lobes=(Lobe(mx=0.2, my=0.2, side="transmission"),)), False),
    (Material(), True),
])  # fmt: skip
def test_which_materials_are_lambertian(material: Material, expected: bool) -> None:
    assert is_lambertian(of_material(material)) is expected


def test_shapes_of_channels_and_of_sides() -> None:
    """A black channel has the shape of the brightest one; black materials and Lambertian ones have none."""
    one = of_material(Material(lobes=(Lobe(mx=0.2, my=0.2, k=(0.5, 0.001, 0.0)),)))
    d = albedo(one, "reflection")
    assert np.allclose(over_albedo(one), [[[1 / d[0], 0, 0], [1 / d[0], 0, 0]], np.zeros((2, 3))])
    both = of_material(Material(kd=0.1, lobes=(Lobe(side="transmission", mx=0.1, my=0.1),)))
    assert np.allclose(over_albedo(both)[:, 0] * [albedo(both, s) for s in ("reflection", "transmission")], 1)
    dark = of_material(Material(kd=0.1, lobes=(Lobe(side="transmission", mx=0.1, my=0.1, k=0.0),)))
    assert not over_albedo(dark).any()
    scene = room({**FIRST, "floor": GLOSS, "back": SHINY})
    assert set(shapes_of(scene, of_scene(scene))) == {"floor", "back"}
    picked = MaterialTextures(diffuse=Texture(np.ones((1, 1, 3), np.float16)))
    assert "seen" in shapes_of(replace(scene, textures={"seen": picked}), of_scene(scene))


def test_states_differ_by_the_whole_of_a_curve() -> None:
    start = of_material(SHINY)
    values = start.curves["highlight"].values.copy()
    values[2000] += 1e-3
    moved = start.with_curve("highlight", type(start.curves["highlight"])(values))
    assert repr(moved.curves) == repr(start.curves) and state_of(moved) != state_of(start)
    named = replace(start, name="another")
    assert state_of(named) == state_of(start)
    scene = room({**FIRST, "floor": SHINY})
    assert set(unlike_documents(scene, {"floor": named, "back": moved, "nowhere": moved})) == {"back"}


@pytest.mark.long
def test_another_process_traces_the_same(mi: ModuleType) -> None:
    """A tracer that was sent has the same surfaces: models in place of documents, and whether others are diffuse."""
    scene, few = room(GLOSSY), Bounces((4, 1, 1))
    editables = {**of_scene(scene), **MODELS}
    tracer = ViewTracer(scene, editables)
    job = Job("seen", tracer.points(View(AT_WALL, 4, 4)), "job", 16)
    found = []
    for diffuse in (False, True):
        here = TileTracer(scene, tails_of(editables, few), bins_of(editables, few), 0, tracer, diffuse)
        there = pickle.loads(pickle.dumps(here))
        one, other = here(job), there(job)
        assert all(np.array_equal(a.array, b.array) and a.unit == b.unit for a, b in zip(one, other, strict=True))
        found.append(one[0].array)
    assert not np.array_equal(*found)
