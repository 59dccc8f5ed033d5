"""Interreflections by bands and tails: furnaces, known rooms, and the path tracer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.baked.shared_exponent import unpacked_rgb
from lambent.baked.transport.tails import FIXED, Tails
from lambent.baking.bake import bake
from lambent.baking.interreflection.series import SMOOTH_ANGLES
from lambent.baking.interreflection.settings import Bounces
from lambent.baking.reference.path_traced import render_reference
from lambent.baking.transport.view import View
from lambent.core.errors import UserError
from lambent.core.views.camera import Camera
from lambent.editing.canvas import viewed
from lambent.editing.interreflection.powers import bands_of
from lambent.materials.document import Lobe, Material
from lambent.materials.factored.albedo import albedo
from lambent.materials.factored.curve import KNOTS, Curve
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.terms import Editable
from lambent.scenes.geometry import box, patch, placed, sphere
from lambent.scenes.scene import Scene, SceneObject
from lambent.store.store import Store
from tests.baking.small_scenes import turned_inwards
from tests.editing.dense_rows import second_coefficients
from tests.tools.z_test import assert_same_image

SIZE = 12
INSIDE = Camera("inside", (0.3, 0.2, 0.4), (-0.5, -0.3, -1.0), fov_y_deg=60.0)


def furnace(albedo: float = 0.5) -> Scene:
    """A closed diffuse box with emission 1."""
    room = SceneObject("room", turned_inwards(box((2, 2, 2))), "grey", emission=(1.0, 1.0, 1.0))
    return Scene("furnace", (room,), {"grey": Material(kd=albedo)})


def corner(materials: dict[str, Material]) -> Scene:
    """A floor, two walls and a ball, under a small lamp that the camera does not see."""
    floor = SceneObject("floor", patch((-1, 0, 1), (2, 0, 0), (0, 0, -2)), "floor")
    back = SceneObject("back", patch((-1, 0, -1), (2, 0, 0), (0, 2, 0)), "back")
    side = SceneObject("side", patch((-1, 0, 1), (0, 0, -2), (0, 2, 0)), "side")
    ball = SceneObject("ball", placed(sphere(0.3, 48, 24), (0.3, 0.31, -0.1)), "ball")
    lamp = SceneObject("lamp", patch((-0.3, 1.8, -0.3), (0.6, 0, 0), (0, 0, 0.6)), "black", emission=(8.0, 7.0, 5.0))
    return Scene("corner", (floor, back, side, ball, lamp), {**materials, "black": Material()})


AT_BALL = Camera("ball", (0.4, 1.2, 2.2), (0.25, 0.35, -0.1), fov_y_deg=4.0)  # which fills the picture
FROM_ABOVE = Camera("above", (0.4, 1.2, 2.2), (-0.3, 0.5, -0.6), fov_y_deg=38.0)


def baked(scene: Scene, camera: Camera, folder: Path, bounces: Bounces, size: int = SIZE) -> tuple[Store, View]:
    view = View(camera, size, size)
    return bake(scene, folder, only={"interreflection"}, views=[view], bounces=bounces), view


def picture(
    store: Store, view: View, scene: Scene, materials: dict[str, Editable], hits: int | None = None
) -> np.ndarray:
    """(P, 3) interreflections with other curves, by plain sums over the stored tiles."""
    tails = Tails.of(store.artefact(view.name("interreflection", "tails")).meta["tails"])
    albedos = np.array([np.ones(3) if side == FIXED else albedo(materials[name], side) for name, side in tails.slots])
    weights = tails.weights(albedos, second_coefficients(tails, materials))
    if hits is not None:
        weights[tails.hits != hits] = 0
    number, theta_o = (store.read(view.name("view_points", part)) for part in ("object", "theta_o"))
    worn = np.array([o.material for o in scene.objects])[number]
    total = np.zeros((len(worn), 3))
    tiles = [a for a in store.artefacts("interreflection") if a.name.count("/") > 3]
    for tile in tiles:
        *_, name, term, place = tile.name.split("/")
        array, points = store.read(tile.name), tile.meta["points"]
        entries, rest = array[:points], array[points:]
        codes, light = rest[: len(rest) // 2], unpacked_rgb(rest[len(rest) // 2 :]) * tile.meta["unit"]
        scale, coefficients = np.ones(3), np.ones((1, 3))
        if tile.meta["term"] >= 0:
            shown = materials[name].terms[int(term)]
            counts = tuple(count for _, count in tile.meta["curves"])
            scale, coefficients = np.array(shown.scale), bands_of(shown.factors, counts, materials[name])
        tail, band = np.divmod(codes, len(coefficients))
        mine = np.flatnonzero(worn == name)
        first = int(place) * store.artefact(tile.name.rpartition("/")[0] + "/0").meta["points"]  # the last is shorter
        at = np.repeat(mine[first : first + points], entries)
        if tile.meta["term"] >= 0 and shown.viewer:
            scale = scale * viewed(theta_o, materials[name].curves[shown.viewer]).T[at]
        np.add.at(total, at, light * weights[tail] * coefficients[band] * scale)
    return total


def of_scene(scene: Scene) -> dict[str, Editable]:
    return {name: of_material(material) for name, material in scene.materials.items()}


@pytest.mark.long
@pytest.mark.parametrize("grey", [0.5, 1.0])
def test_a_furnace_adds_the_same_light_at_every_bounce(tmp_path: Path, grey: float) -> None:
    """E a^(N - 1) arrives over N surfaces: exactly, path by path, but for the balance of the two ways."""
    scene = furnace(grey)
    store, view = baked(scene, INSIDE, tmp_path / "s", Bounces((64, 1, 1, 1), samples=512))
    for hits in (2, 3, 4):
        found = picture(store, view, scene, of_scene(scene), hits)
        assert abs(found.mean() - grey**hits) < 1e-3 * grey**hits * 3, hits
    whole = picture(store, view, scene, of_scene(scene))
    assert np.abs(whole / whole.mean() - 1).max() < 0.15


def interior(store: Store, view: View) -> np.ndarray:
    """(SIZE, SIZE) pixels whose neighbours show the same object: the store has one point of each, not its mean."""
    number = store.read(view.name("view_points", "object")).reshape(view.height, view.width)
    padded = np.pad(number, 1, mode="edge")
    around = [np.roll(padded, (i, j), (0, 1))[1:-1, 1:-1] for i in (-1, 0, 1) for j in (-1, 0, 1)]
    return np.asarray(np.ptp(around, axis=0) == 0)


def path_traced(
    scene: Scene, hits: int, camera: Camera = FROM_ABOVE, spp: int = 4096, edited: dict[str, Editable] | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Light of paths that meet 2 to `hits` surfaces, and its variance."""
    (whole, noise), (direct, more) = (
        render_reference(scene, camera, SIZE, SIZE, spp, max_depth=depth, edited=edited) for depth in (hits, 1)
    )
    return whole - direct, noise + more


FIRST = {name: Material(kd=0.5) for name in ("floor", "back", "side", "ball")}


@pytest.mark.long
def test_diffuse_rooms_are_those_of_the_path_tracer(tmp_path: Path) -> None:
    """Albedos that the bake did not know; all lengths of paths; one material is not edited."""
    later = {
        "floor": Material(kd=(0.7, 0.6, 0.2)), "back": Material(kd=(0.1, 0.4, 0.8)), "side": Material(kd=0.9),
        "ball": FIRST["ball"],
    }  # fmt: skip
    bounces = Bounces((16, 1, 1, 1), samples=4096, fixed=frozenset({"ball", "black"}))
    store, view = baked(corner(FIRST), FROM_ABOVE, tmp_path / "s", bounces)
    scene = corner(later)
    found = picture(store, view, scene, of_scene(scene)).reshape(SIZE, SIZE, 3)
    expected, noise = path_traced(scene, 4)
    inner = interior(store, view)
    assert inner.sum() > 60
    assert_same_image(found[inner], (0.03 * found[inner]) ** 2, expected[inner], noise[inner])
    assert abs(found[inner].mean() / expected[inner].mean() - 1) < 0.01


def stepped(material: Editable, rng: np.random.Generator, sharp: int = 64) -> Editable:
    """Curves of random steps as wide as the bands; a narrow lobe might be even over the bands that it meets."""
    curves = dict(material.curves)
    for term in material.terms:
        for factor in term.factors:
            steps = rng.random((4 if factor.over in SMOOTH_ANGLES else sharp, 3)) ** 3
            curves[factor.curve] = Curve(np.vstack([np.repeat(steps, KNOTS // len(steps), axis=0), steps[-1:]]))
    return replace(material, curves=curves)


@pytest.mark.long
def test_random_tables_of_bands(tmp_path: Path) -> None:
    """Any curves at the first surface and any colours of the others, from one bake; pixels are nearly points.

    Paths meet two surfaces: the third may be the first's material again, which counts by its albedo there.
    """
    camera = Camera("near", (0.4, 1.2, 2.2), (0.25, 0.35, -0.1), fov_y_deg=0.5)
    glossy = Material(kd=0.3, lobes=(Lobe(mx=0.3, my=0.3, r0=0.4),))
    scene, rng = corner({**FIRST, "ball": glossy}), np.random.default_rng(0)
    store, view = baked(scene, camera, tmp_path / "s", Bounces((64, 1), samples=8192))
    for _ in range(2):
        edited = {name: of_material(Material(kd=tuple(rng.uniform(0, 0.9, 3)))) for name in FIRST}
        edited["ball"] = stepped(of_material(glossy), rng)
        found = picture(store, view, scene, {**of_scene(scene), **edited}).reshape(SIZE, SIZE, 3)
        expected, noise = path_traced(scene, 2, camera, edited=edited)
        assert_same_image(found, (0.05 * found) ** 2, expected, noise)
        error = np.sqrt(noise.mean(axis=(0, 1)) + found.var(axis=(0, 1))) / SIZE
        assert (np.abs((found - expected).mean(axis=(0, 1))) < 4 * error).all()
        assert np.median(error / found.mean(axis=(0, 1))) < 0.03


@pytest.mark.long
def test_two_glossy_surfaces(tmp_path: Path) -> None:
    """Bands at the second surface too: a glossy ball shows glossy walls, and a material that is not edited."""
    dull, shiny = (Material(kd=kd, lobes=(Lobe(mx=m, my=m, r0=0.5),)) for kd, m in ((0.1, 0.5), (0.3, 0.3)))
    bounces = Bounces((64, 32), samples=4096, fixed=frozenset({"side"}))
    first = {**FIRST, "side": shiny, "floor": dull, "back": dull, "ball": dull}
    store, view = baked(corner(first), AT_BALL, tmp_path / "s", bounces)
    scene = corner({**FIRST, "side": shiny, "floor": shiny, "back": shiny, "ball": shiny})
    found = picture(store, view, scene, of_scene(scene)).reshape(SIZE, SIZE, 3)
    expected, noise = path_traced(scene, 2, AT_BALL)
    assert_same_image(found, (0.05 * found) ** 2, expected, noise)
    assert abs(found.mean() / expected.mean() - 1) < 0.02


@pytest.mark.long
def test_samples_are_added_to_a_finished_store(tmp_path: Path) -> None:
    """Batch after batch: the same light with less noise; what is enough is not traced again."""
    scene = corner(FIRST)
    few, view = baked(scene, FROM_ABOVE, tmp_path / "s", Bounces((16, 1, 1), samples=32))
    before = picture(few, view, scene, of_scene(scene))
    more, _ = baked(scene, FROM_ABOVE, tmp_path / "s", Bounces((16, 1, 1), samples=1024))
    whole, _ = baked(scene, FROM_ABOVE, tmp_path / "t", Bounces((16, 1, 1), samples=1024))
    after, once = (picture(store, view, scene, of_scene(scene)) for store in (more, whole))
    assert np.abs(after - once).mean() < 0.01 * once.mean()  # sums of rounded tiles
    assert np.abs(before - once).mean() > 4 * np.abs(after - once).mean()
    tiles = {a.name: a.meta["samples"] for a in more.artefacts("interreflection") if "samples" in a.meta}
    assert set(tiles.values()) == {1024}


@pytest.mark.parametrize("series", [(64,), (64, 3), (64, 1, 8), (1,) * 7])
def test_series_that_mean_nothing(series: tuple[int, ...]) -> None:
    with pytest.raises(UserError, match="series"):
        Bounces(series)
