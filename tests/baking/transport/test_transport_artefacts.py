"""Transport of a view in its store: pictures from what is stored, few lights first, interrupted bakes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.baked.shared_exponent import unpacked_rgb
from lambent.baked.transport.wavelets import transformed
from lambent.baking.artefacts import transport, visibility
from lambent.baking.artefacts.transport import Settings
from lambent.baking.bake import bake
from lambent.baking.quality import quality_named
from lambent.baking.transport.view import View
from lambent.baking.transport.view_tracer import ViewTracer
from lambent.core.errors import UserError
from lambent.core.pictures.images import write_image
from lambent.core.progress import Cancelled
from lambent.materials.document import Material
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.terms import Editable
from lambent.scenes.geometry import patch
from lambent.scenes.scene import ConstantEnvironment, ImageEnvironment, MaterialTextures, Scene, SceneObject, Texture
from lambent.store.contract import baked_views, transport_lights, view_artefact_name
from lambent.store.store import Store
from tests.baking.small_scenes import GREY
from tests.baking.transport.test_transport import CAMERA, GLOSSY, ball_on_floor, view
from tests.tools.pair_numbers import pair_numbers

SIZE = (12, 10)
HOW = Settings(sharp=64, smooth=16, sharp_of_two=64, smooth_of_two=16)
FEW = quality_named("preview").changed("few", visibility={"lights": (60, 200)}, transport=vars(HOW))


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    file = tmp_path_factory.mktemp("sky") / "sky.exr"
    picture = np.full((32, 64, 3), 0.3, np.float32)
    picture[4:8, 10:14] = (30.0, 25.0, 20.0)
    write_image(file, picture)
    lamp = SceneObject("lamp", patch((-1.2, 0.0, -0.5), (2.4, 0, 0), (0, 0.9, 0)), "grey", (5.0, 4.0, 3.0))
    scene = ball_on_floor()
    return replace(scene, objects=(*scene.objects, lamp), environment=ImageEnvironment(file, rotation_deg=30.0))


def bake_view(scene: Scene, folder: Path, **more: object) -> Store:
    return bake(scene, folder, quality=FEW, only={"transport"}, views=[View(CAMERA, *SIZE)], **more)  # type: ignore


@pytest.fixture(scope="module")
def store(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Store:
    return bake_view(scene, tmp_path_factory.mktemp("view") / "s")


def name(kind: str, part: str) -> str:
    return view_artefact_name(CAMERA, *SIZE, kind, part)


def picture(store: Store, lights: int, editables: dict[str, Editable]) -> np.ndarray:
    """(P, 3) reflected light of a view, from its store alone."""
    objects = store.artefact(name("view_points", "object")).meta["objects"]
    worn = np.array([material for _, material in objects])[store.read(name("view_points", "object"))]
    total = np.zeros((len(worn), 3))
    for term in store.artefact(name("transport", f"{lights}/terms")).meta["terms"]:
        editable = editables[term["material"]]
        of_term = editable.terms[term["term"]]
        start = name("transport", f"{lights}/{term['material']}/{term['term']}/")
        polar = [factor.polar for factor in of_term.factors]
        means = [editable.curves[c].node_values(n, p) for (c, n), p in zip(term["curves"], polar, strict=True)]
        if len(means) == 1:
            light = np.einsum("jc,jcp->pc", transformed(means[0]), store.read(f"{start}rows").astype(float))
        else:
            spans, steps, values = (store.read(start + part) for part in ("spans", "steps", "values"))
            light = np.zeros((len(spans), 3))
            for p, (a, b) in enumerate(spans):
                j, k = np.divmod(pair_numbers(np.array([b - a]), steps[a:b]), len(means[1]))
                light[p] = (unpacked_rgb(values[a:b]) * means[0][j] * means[1][k]).sum(axis=0)
        total[worn == term["material"]] += light * of_term.scale * term["scale"]
    return total


def editables(scene: Scene) -> dict[str, Editable]:
    return {name: of_material(material) for name, material in scene.materials.items()}


@pytest.mark.long
def test_pictures_from_the_store_are_the_sum_over_its_lights(store: Store, scene: Scene) -> None:
    """Half floats and pairs that are left out cost less than 1/1000 of a pixel."""
    lights = ViewTracer(scene).lights(200)
    assert 150 < len(lights) <= 200
    assert 60 < np.count_nonzero(lights.near) <= 100
    assert store.artefact(name("visibility", "200")).meta["lights"] == len(lights)
    whole = view(scene, lights, SIZE)
    expected = np.zeros((len(whole.points), 3))
    for number, o in enumerate(scene.objects):
        mine = whole.points.object == number
        expected[mine] = whole.picture(of_material(scene.materials[o.material]), 64, 16)[mine]
    found = picture(store, 200, editables(scene))
    diffuse = picture(store, 200, {n: _of_diffuse(e) for n, e in editables(scene).items()})
    assert (found > diffuse).any(), "the highlight is there"
    assert np.abs(found - expected).max() < 1e-3 * expected.max()
    assert np.allclose(found, expected, rtol=3e-3, atol=1e-4 * expected.max())


def _of_diffuse(editable: Editable) -> Editable:
    terms = [replace(t, scale=(0.0, 0.0, 0.0)) if t.name != "diffuse" else t for t in editable.terms]
    return replace(editable, terms=tuple(terms))


def test_few_lights_come_first_and_more_change_the_picture_little(store: Store, scene: Scene) -> None:
    assert transport_lights(store, CAMERA, *SIZE) == [60, 200]
    assert transport_lights(store, CAMERA, 7, 7) == []
    few, many = (picture(store, n, editables(scene)) for n in (60, 200))
    assert np.abs(few - many).mean() < 0.1 * many.mean()
    assert list(baked_views(store)) == [name("", "").split("/")[1]]


def test_the_backdrop_is_what_shines_by_itself(store: Store, scene: Scene) -> None:
    seen = store.read(name("view_points", "backdrop")).reshape(-1, 3)
    pixel, objects = (store.read(name("view_points", part)) for part in ("pixel", "object"))
    assert np.allclose(seen[pixel[objects == 2]], (5.0, 4.0, 3.0))
    assert (objects == 2).any()
    assert not seen[pixel[objects != 2]].any()
    assert (np.delete(seen, pixel, axis=0) >= 0.29).all()


@pytest.mark.long
def test_an_interrupted_bake_goes_on_and_ends_with_the_same_arrays(
    store: Store, scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module, constant in ((transport, "POINTS"), (visibility, "POINTS")):
        monkeypatch.setattr(module, constant, 6)
    monkeypatch.setattr(transport, "ENTRIES", 1000)
    steps, starts = iter(range(10_000)), 0

    def stop_often(done: float, total: float, what: str) -> None:
        if next(steps) % 23 == 22:
            raise Cancelled

    found: Store | None = None
    while found is None:
        starts += 1
        try:
            found = bake_view(scene, tmp_path / "s", progress=stop_often)
        except Cancelled:
            states = {a.name: a.complete for a in Store.open(tmp_path / "s").artefacts()}
            assert not all(states.values()) or name("transport", "200/terms") not in states
    assert starts > 3
    assert np.allclose(picture(found, 200, editables(scene)), picture(store, 200, editables(scene)), rtol=1e-4)
    for part in ("200/glossy/0/rows", "60/grey/0/rows"):
        assert np.array_equal(found.read(name("transport", part)), store.read(name("transport", part)))


def test_nothing_is_baked_twice_and_scales_and_curves_are_no_inputs(store: Store, scene: Scene) -> None:
    before = {a.name: (a.key, a.done) for a in store.artefacts()}
    bright = GLOSSY.model_copy(update={"kd": (0.1, 0.1, 0.1)})
    again = bake_view(replace(scene, materials={**scene.materials, "glossy": bright}), store.folder)
    assert {a.name: (a.key, a.done) for a in again.artefacts()} == before


@pytest.mark.long
def test_textures_are_in_the_transport(tmp_path: Path) -> None:
    """A floor whose texture halves green, under even light: radiance kd texture."""
    texels = np.broadcast_to(np.array([1.0, 0.5, 1.0], np.float16), (2, 2, 3))
    floor = SceneObject("floor", patch((-9, 0, 9), (18, 0, 0), (0, 0, -18)), "grey")
    textures = {"grey": MaterialTextures(diffuse=Texture(texels))}
    even = ConstantEnvironment((1.0, 1.0, 1.0))
    store = bake_view(Scene("floor", (floor,), {"grey": GREY}, even, textures=textures), tmp_path / "s")
    found = picture(store, 200, {"grey": of_material(GREY)})
    assert np.allclose(found, 0.5 * np.array([1.0, 0.5, 1.0]), rtol=0.01)


@pytest.mark.long
def test_a_material_that_the_view_does_not_show_has_empty_arrays(scene: Scene, tmp_path: Path) -> None:
    behind = SceneObject("behind", patch((-1, 0, 8), (1, 0, 0), (0, 1, 0)), "other")
    more = replace(scene, objects=(*scene.objects, behind), materials={**scene.materials, "other": GLOSSY})
    store = bake_view(more, tmp_path / "s", editables={"glossy": of_material(Material(kd=0.5))})
    terms = store.artefact(name("transport", "60/terms")).meta["terms"]
    assert [t["curves"] for t in terms if t["material"] == "glossy"] == [[["diffuse", 16]]], "edited as something else"
    assert store.read(name("transport", "60/other/0/rows")).shape == (16, 3, 0)
    assert store.read(name("transport", "60/other/1/spans")).shape == (0, 2)
    shown = {**editables(more), "glossy": of_material(Material(kd=0.5))}
    assert np.isfinite(picture(store, 60, shown)).all()


@pytest.mark.long
def test_light_from_behind_shows_where_a_material_transmits(tmp_path: Path) -> None:
    """Under even light a sheet of kd = .3 and kt_d = .5 shows .8 of it; only its visibility has both sides."""
    sheet = SceneObject("sheet", patch((-9, 0, 9), (18, 0, 0), (0, 0, -18)), "sheet")
    wall = SceneObject("wall", patch((-9, 0.2, -9), (18, 0, 0), (0, 9, 0)), "grey")
    materials = {"sheet": Material(kd=0.3, kt_d=0.5), "grey": GREY}
    even = ConstantEnvironment((1.0, 1.0, 1.0))
    store = bake_view(Scene("sheet", (sheet,), materials, even), tmp_path / "s")
    found = picture(store, 200, editables(Scene("sheet", (sheet,), materials, even)))
    assert np.allclose(found, 0.8, rtol=0.02)
    both = bake_view(Scene("both", (sheet, wall), materials, even), tmp_path / "both")
    seen, objects = both.read(name("visibility", "200")), both.read(name("view_points", "object"))
    lights = both.artefact(name("visibility", "200")).meta["lights"]
    share = np.bitwise_count(seen).sum(axis=0) / lights
    assert (share[objects == 0] > 0.7).all()
    assert (share[objects == 1] < 0.6).all()


def test_transport_without_a_view_is_an_error(scene: Scene, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="transport: is baked for views only"):
        bake(scene, tmp_path / "s", only={"transport"})


@pytest.mark.long
def test_small_bright_lamps_are_stored_as_exactly_as_large_ones(scene: Scene, tmp_path: Path) -> None:
    """Half floats are scaled by the light that arrives: a lamp that is 1000 times smaller may be a million brighter."""
    found = []
    for edge_m, radiance in ((1.0, 4.0), (1e-3, 4e6)):
        mesh = patch((-edge_m / 2, 300.0, -edge_m / 2), (edge_m, 0, 0), (0, 0, edge_m))
        lamp = SceneObject("lamp", mesh, "grey", (radiance * 1e4,) * 3)
        lit = replace(scene, objects=(*scene.objects[:-1], lamp), environment=None)
        store = bake_view(lit, tmp_path / str(edge_m))
        found.append(picture(store, 200, {name: of_material(m) for name, m in lit.materials.items()}))
    assert found[0].max() > 0.05
    assert np.abs(found[1] - found[0]).max() < 2e-3 * found[0].max()
