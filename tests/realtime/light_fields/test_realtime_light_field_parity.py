"""The march through a light field: the shader draws what numpy's look-up says."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lambent.baked.light_fields import lookup as numpy_twin
from lambent.baked.light_fields.blocks.blocks import in_blocks
from lambent.baked.light_fields.light_field import NO_POINT, LightField
from lambent.core.geometry.cubemap import sample
from lambent.materials.document import Lobe, Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.device import BLOCKS
from lambent.realtime.incident.light_field import filled
from lambent.realtime.light_fields import light_field_atlas
from lambent.realtime.renderer import Renderer
from tests.realtime.lit_plate import CAMERA, mirrored, plate_field, plate_scene
from tests.realtime.lit_wall import cube_of, smooth_light

SIZE = 128
STATE = FrameState(CAMERA, SIZE, SIZE, n=1, antialias=False, show="specular", integrator="rings")


@pytest.fixture(scope="module")
def field() -> LightField:
    return plate_field()


@pytest.fixture(scope="module")
def renderer(device: Any, field: LightField) -> Renderer:
    return Renderer(device, plate_scene(field))


@pytest.mark.parametrize("across", [2, 8])
def test_shader_and_numpy_agree(device: Any, across: int) -> None:
    """Also for points so far from the place that their distances are not the ray's."""
    field = plate_field(across)
    place, w, inside = mirrored(field, SIZE)
    sky = cube_of(smooth_light)
    march = numpy_twin.marched(field, place, w, sky=lambda w: sample(sky, w))
    assert march.met[inside].mean() > 0.2 and march.sky[inside].mean() > 0.02, "the scene asks for all answers"
    assert (~march.met & ~march.sky)[inside].any()
    got = Renderer(device, plate_scene(field)).image(replace(STATE, lookup="light_field")).reshape(-1, 3)
    error = np.abs(got - march.radiance)[inside].max(axis=1)
    assert inside.sum() > 4000
    assert np.quantile(error, 0.5) < 5e-4 and np.quantile(error, 0.995) < 3e-3, np.quantile(error, [0.5, 0.995, 1])


@pytest.mark.long
def test_shader_and_numpy_agree_on_quarters_of_texels(device: Any, field: LightField) -> None:
    """Any quarters at all; but for rays that pass a surface within the .4 % that the bits take of its distance."""
    cover = np.random.default_rng(3).integers(0, 16, field.inverse_distance.shape).astype(np.uint8)
    covered = replace(field, cover=np.where(field.inverse_distance > 0, cover | (cover > 7) * 15, 0).astype(np.uint8))
    place, w, inside = mirrored(covered, SIZE)
    sky = cube_of(smooth_light)
    march = numpy_twin.marched(covered, place, w, sky=lambda w: sample(sky, w))
    whole = numpy_twin.marched(field, place, w, sky=lambda w: sample(sky, w))
    assert (march.sky & ~whole.sky)[inside].mean() > 0.02, "quarters matter"
    got = Renderer(device, plate_scene(covered)).image(replace(STATE, lookup="light_field")).reshape(-1, 3)
    error = np.abs(got - march.radiance)[inside].max(axis=1)
    assert np.quantile(error, 0.5) < 0.01 and np.quantile(error, 0.9) < 0.05, np.quantile(error, [0.5, 0.9, 0.98, 1])


@pytest.mark.long
def test_shader_and_numpy_agree_on_blocks(device: Any, field: LightField, monkeypatch: pytest.MonkeyPatch) -> None:
    """Quarters in patches, as at edges, and everywhere, so that the pool is too small for all mixed blocks."""
    if BLOCKS not in device.features:
        pytest.skip("the adapter has no textures in blocks")
    monkeypatch.setattr(light_field_atlas, "is_software", lambda device: False)
    side, (rows, columns) = field.inverse_distance.shape[1], np.indices(field.inverse_distance.shape[1:])
    patches = np.where(((rows // 12 + columns // 12) % 4 == 0) | (rows < side // 4), rows * columns % 16, 15)
    cover = np.where(field.inverse_distance > 0, patches, 0).astype(np.uint8)
    stored = in_blocks(replace(field, cover=cover))
    place, w, inside = mirrored(stored, SIZE)
    cube = cube_of(smooth_light)
    expected = numpy_twin.marched(stored, place, w, sky=lambda w: sample(cube, w)).radiance
    got = Renderer(device, plate_scene(stored)).image(replace(STATE, lookup="light_field")).reshape(-1, 3)
    error = np.abs(got - expected)[inside].max(axis=1)
    assert np.quantile(error, 0.5) < 0.01 and np.quantile(error, 0.9) < 0.05, np.quantile(error, [0.5, 0.9, 0.98, 1])


def test_places_without_points_take_those_of_the_nearest_that_have_some(device: Any) -> None:
    """Here the rows below; a field without any leaves its object to the probe."""
    field = plate_field(dropped=10)
    assert np.all(filled(field.sample_map)[:10] == field.sample_map[10])
    np.testing.assert_array_equal(filled(field.sample_map)[10:], field.sample_map[10:])
    none = replace(field, sample_map=np.full_like(field.sample_map, NO_POINT))
    pictures = [
        Renderer(device, plate_scene(one)).image(replace(STATE, lookup=name))
        for one, name in ((none, "light_field"), (field, "plain"))
    ]
    np.testing.assert_array_equal(*pictures)


ROUGH = Material(name="rough", lobes=(Lobe(mx=0.25, my=0.4, r0=(0.9, 0.6, 0.3), alpha=0.5),))


@pytest.fixture(scope="module")
def rough(device: Any, field: LightField) -> Renderer:
    return Renderer(device, plate_scene(field, ROUGH))


@pytest.mark.long
def test_filtered_samples_come_near_many(rough: Renderer, field: LightField) -> None:
    """Levels of the maps follow the solid angles of samples, as those of a probe."""
    many = rough.converged(replace(STATE, integrator="qmc"), 200)
    inside = mirrored(field, SIZE)[2].reshape(SIZE, SIZE)
    few = {n: rough.image(replace(STATE, n=n)) for n in (7, 19)}
    errors = {n: float(np.sqrt(np.mean((image - many)[inside] ** 2)) / many[inside].mean()) for n, image in few.items()}
    assert errors[19] < 0.1 and errors[7] < 0.15, errors


def test_the_choice_is_shown_in_colours(renderer: Renderer, field: LightField) -> None:
    """Red where numpy's march misses, blue where it sees the sky, one colour per point elsewhere, at any exposure."""
    place, w, inside = mirrored(field, SIZE)
    march = numpy_twin.marched(field, place, w)
    got = renderer.image(replace(STATE, lookup="light_field-choice", exposure_ev=2.0)).reshape(-1, 3) * 4 / 0.3
    sky, missed = march.sky & inside, ~march.met & ~march.sky & inside
    assert np.mean(np.abs(got[sky] - [0, 0.1, 1]).max(axis=1) < 0.05) > 0.95
    assert np.mean(np.abs(got[missed] - [1, 0, 0]).max(axis=1) < 0.05) > 0.8
    colours = np.unique(np.round(got[march.met & inside], 1), axis=0)
    assert 20 < len(colours) < 150
