"""Light fields on the GPU, against a room whose light is known."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baked.light_fields.blocks.tiles import Tiles
from lambent.baked.light_fields.light_field import LightField
from lambent.baked.light_fields.stored import read_light_field
from lambent.core.errors import UserError
from lambent.core.geometry.octahedral import texel_directions, texel_solid_angles
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.device import BLOCKS
from lambent.realtime.light.baked import read_baked
from lambent.realtime.light_fields import light_field_atlas
from lambent.realtime.light_fields.light_field_atlas import MOST_TEXELS, Layout, coding
from lambent.realtime.renderer import Renderer
from lambent.render import Settings, still
from tests.realtime.lit_ball import CAMERA, HALF, ball_scene, light_field, mirrored, put_ball, seen
from tests.realtime.lit_wall import cube_of
from tests.viewer.small_store import write_small_store

SIZE = 96
STATE = FrameState(CAMERA, SIZE, SIZE, n=1, antialias=False, show="specular")


@pytest.fixture(scope="module")
def field() -> LightField:
    return light_field()


@pytest.fixture(scope="module")
def renderer(device: Any, field: LightField) -> Renderer:
    return Renderer(device, ball_scene(field=field))


def error(image: np.ndarray) -> float:
    """Root mean square over the ball's inner pixels: at its edge the mesh is no ball."""
    truth, ball = mirrored(SIZE, SIZE)
    inner = ball & np.roll(ball, 4, 0) & np.roll(ball, -4, 0) & np.roll(ball, 4, 1) & np.roll(ball, -4, 1)
    return float(np.sqrt(np.mean((image - truth)[inner] ** 2)))


@pytest.mark.long
def test_methods_rank_as_they_should(renderer: Renderer) -> None:
    errors = {name: error(renderer.image(replace(STATE, lookup=name))) for name in ("plain", "light_field")}
    assert errors["light_field"] < 0.25 * errors["plain"]
    np.testing.assert_array_equal(renderer.image(STATE), renderer.image(replace(STATE, lookup="light_field")))


def brighter(p: np.ndarray) -> np.ndarray:
    """How many times brighter (..., 3) the wall at p is in other light: red fades in one corner, blue grows."""
    return np.asarray(1 + np.array([-0.8, 0.3, 1.5]) * np.exp(-2 * np.sum((p - HALF) ** 2, axis=-1))[..., None])


def walls_from(centre: tuple[float, float, float], w: np.ndarray, lit: bool = False) -> np.ndarray:
    """Radiance (..., 3) of the walls along w from a place, in the other light where they are `lit` by it."""
    light, t = seen(np.array(centre), w, ball=False)
    return light * brighter(np.array(centre) + t[..., None] * w) if lit else light


@pytest.mark.long
def test_light_follows_what_the_probe_sees_of_its_change(device: Any, renderer: Renderer, field: LightField) -> None:
    """As light fields that are taken again in the other light, and unlike the maps as they are."""
    as_baked = renderer.image(STATE)
    for centre in ((0.1, -0.2, 0.15),):
        w, at = texel_directions(field.radiance.shape[1]), field.points[:, None, None].astype(float)
        light, distance = seen(at, w)
        is_wall = seen(at, w, ball=False)[1] == distance
        change = np.where(is_wall[..., None], brighter(at + distance[..., None] * w), 1)
        taken_again = replace(field, radiance=(light * change).astype(np.float16))
        truth = Renderer(device, ball_scene(field=taken_again)).image(STATE)

        scene = ball_scene(field=field)
        probe = replace(scene.probes["ball"], centre=centre, radiance=cube_of(partial(walls_from, centre), 128))
        moved = Renderer(device, replace(scene, probes={"ball": probe}))
        item = moved.resources.objects[0]
        baked = item.light
        item.relight(baked.relit(cube_of(partial(walls_from, centre, lit=True), 128), ()), item.emission)
        off, stale = (np.sqrt(np.mean((image - truth) ** 2)) for image in (moved.image(STATE), as_baked))
        assert off < 0.12 * stale, (off, stale)
        item.relight(baked.relit(probe.radiance, ()), item.emission)
        np.testing.assert_allclose(moved.image(STATE), as_baked, rtol=1e-6)


@pytest.mark.long
def test_the_sky_follows_by_itself(device: Any, field: LightField) -> None:
    """Where the march ends in the sky: four times as bright, whatever the probe sees there."""
    open_field = replace(field, inverse_distance=0 * field.inverse_distance)
    scene = replace(ball_scene(field=open_field), environment=np.full((6, 4, 4, 3), 0.25, np.float32))
    bright = Renderer(device, scene)
    np.testing.assert_allclose(bright.image(STATE)[SIZE // 2, SIZE // 2], 0.25, rtol=0.02)
    item = bright.resources.objects[0]
    item.relight(item.light.relit(scene.probes["ball"].radiance, (), (4.0, 2.0, 1.0)), item.emission)
    np.testing.assert_allclose(bright.image(STATE)[SIZE // 2, SIZE // 2], (1.0, 0.5, 0.25), rtol=0.02)


@pytest.mark.long
def test_blocks_in_a_store_and_on_the_adapter(
    tmp_path: Path, device: Any, renderer: Renderer, field: LightField, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Maps in blocks are drawn as maps of half floats, by an adapter that reads blocks and by one that does not."""
    store = put_ball(tmp_path / "ball.store", field)
    read = read_light_field(store, "ball")
    assert read.blocks is not None and read.distances is not None and read.radiance.shape == field.radiance.shape
    exact, scene = renderer.image(STATE), read_baked(store)
    image = Renderer(device, scene).image(STATE)
    assert psnr_db(image, exact) > 38
    if BLOCKS not in device.features:
        pytest.skip("the adapter has no textures in blocks")
    monkeypatch.setattr(light_field_atlas, "is_software", lambda device: False)
    assert coding(device).format == "bc6h-rgb-ufloat"
    assert psnr_db(Renderer(device, scene).image(STATE), image) > 50


def psnr_db(image: np.ndarray, exact: np.ndarray) -> float:
    return float(10 * np.log10(exact.max() ** 2 / np.mean((image - exact) ** 2)))


@pytest.mark.long
@pytest.mark.parametrize("part", ["radiance", "sample_map"])
def test_a_light_field_that_contradicts_itself_is_refused(tmp_path: Path, field: LightField, part: str) -> None:
    fewer = replace(
        field, points=field.points[:9], normals=field.normals[:9], inverse_distance=field.inverse_distance[:9]
    )
    broken = fewer if part == "radiance" else replace(fewer, radiance=field.radiance[:9])
    store = put_ball(tmp_path / "ball.store", broken)
    with pytest.raises(UserError, match="light_field/ball"):
        read_light_field(store, "ball")


def test_thousands_of_maps_fit_few_layers() -> None:
    """The thesis's 1156 at as many texels with hardly an empty place, and the most there can be within 256 layers."""
    tiles = Tiles.of(310)
    assert tiles.tiles == (312, 80, 24, 8) and 310**2 <= 6 * 128**2
    columns, rows, layers = Layout.of(1156, tiles.tiles).size
    assert columns * rows * layers < 1.03 * 1156 * tiles.texels and tiles.texels < 1.08 * 312**2
    for count, side in ((1, 6), (7, 30), (4000, 94), (65535, 222), (3, 1022)):
        tiles = Tiles.of(side)
        layout = Layout.of(count, tiles.tiles)
        assert layout.places * layout.layers >= count and max(layout.size[:2]) <= MOST_TEXELS
        assert layout.layers <= 256 and tiles.tiles[0] <= side + 5


def test_tiles_of_all_levels_lie_apart() -> None:
    tiles = Tiles.of(46)
    layout = Layout.of(61, tiles.tiles)
    taken = np.zeros(layout.size[::-1], int)
    for level, tile in enumerate(tiles.tiles):
        placed = list[int]()
        for start, count in ((0, 40), (40, 21)):
            for run, column, row, layer in layout.runs(start, count, level):
                placed += range(start + run.start, start + run.stop)
                first = layout.first_row(level) + row * tile
                taken[layer, first : first + tile, column * tile : (column + run.stop - run.start) * tile] += 1
        assert placed == list(range(61))
    assert taken.max() == 1 and taken.sum() == 61 * tiles.texels


def test_levels_keep_the_light_and_see_over_edges(field: LightField) -> None:
    tiles = Tiles.of(126)
    maps = field.radiance[:3].astype(np.float32)
    whole = (maps * texel_solid_angles(126)[..., None]).sum(axis=(1, 2))
    for k, level in enumerate(tiles.chain(maps)):
        n = tiles.sides[k]
        inner = level[:, 1 : n + 1, 1 : n + 1]
        assert level.shape == (3, tiles.tiles[k], tiles.tiles[k], 3)
        np.testing.assert_allclose((inner * texel_solid_angles(n)[..., None]).sum(axis=(1, 2)), whole, rtol=0.02)
        np.testing.assert_array_equal(level[:, 0, 1 : n + 1], inner[:, 0, ::-1])  # an edge, mirrored about its middle


def test_a_store_without_light_fields_is_a_line(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no light field") as fault:
        still(
            write_small_store(tmp_path / "s"),
            tmp_path / "a.png",
            settings=Settings(8, 8, "lamps", lookup="light_field"),
        )
    assert "--lookup" in str(fault.value) and "\n" not in str(fault.value)
