"""The sun through clear glass and holes in the shadow map: each surface gets what the glass before it lets through."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lambent.core.arrays import Flags, Floats
from lambent.core.views.camera import Camera
from lambent.materials.clear import clear_terms, transmittance
from lambent.materials.document import Lobe, Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.light.baked import BakedScene
from lambent.realtime.renderer import Renderer
from lambent.scenes.geometry import patch, placed, sphere
from lambent.scenes.scene import MaterialTextures, Mesh, Texture
from tests.realtime.sun.test_realtime_sun import DOWN, IRRADIANCE, SIZE, TOWARDS, floor, places, scene

GREY = Material(name="grey", kd=0.5)


def glass(name: str, *k: float) -> Material:
    through = Lobe(side="transmission", mx=0.003, my=0.003, r0=0.04, k=k, alpha=0.45)
    return Material(name=name, lobes=(through, Lobe(mx=0.003, my=0.003, r0=0.08)))


CLEAR, RED = glass("clear", 0.8, 0.8, 0.8), glass("red", 0.9, 0.3, 0.0)
MATERIALS = {material.name: material for material in (GREY, CLEAR, RED)}


def passed(material: Material, cosine: float = float(TOWARDS[1])) -> Floats:
    terms = clear_terms(material)
    assert terms is not None
    return np.array(transmittance(cosine, terms))


def glazed(parts: dict[str, tuple[Mesh, str]], textures: dict[str, MaterialTextures] | None = None) -> BakedScene:
    """The floor and parts of meshes and materials, under the sun."""
    plain = scene({"floor": floor()} | {name: mesh for name, (mesh, _) in parts.items()}, 0.27, GREY)
    worn = {name: material for name, (_, material) in parts.items()}
    objects = [o.model_copy(update={"material": worn.get(o.name, "grey")}) for o in plain.record.objects]
    record = plain.record.model_copy(update={"objects": tuple(objects), "materials": MATERIALS})
    assert plain.sun is not None
    sun = plain.sun.model_copy(update={"panes": ("clear", "red")})
    return replace(plain, record=record, sun=sun, textures=textures or {})


def lit(device: Any, baked: BakedScene, camera: Camera = DOWN, frames: int = 1) -> Floats:
    """(SIZE, SIZE, 3) irradiance over that of the open floor."""
    renderer = Renderer(device, baked)
    state = FrameState(camera, SIZE, SIZE, show="light-map", antialias=False)
    shown = [renderer.image(replace(state, accumulate=k)) for k in range(frames)][-1]
    return np.asarray(shown / (np.array(IRRADIANCE) * TOWARDS[1]))


def pane(height: float, low: float = -2.0, high: float = 2.0) -> Mesh:
    return patch((low, height, 2), (high - low, 0, 0), (0, 0, -4))


def where(x: float, height: float) -> float:
    """x of the floor that sees the sun through x at a height."""
    return x - float(TOWARDS[0] / TOWARDS[1]) * height


# Of glass the camera, at 1.9 m, is below: it sees the floor alone.
@pytest.mark.long
def test_floor_gets_what_panes_let_through(device: Any) -> None:
    count = 3
    panes = {f"pane_{i}": (pane(2.0 + 0.3 * i), "red" if i == 1 else "clear") for i in range(count)}
    found = lit(device, glazed(panes))
    expected = np.prod([passed(MATERIALS[material]) for _, material in panes.values()], axis=0)
    x = places(DOWN)[..., 0]
    under = (x > -1.7 - 0.6) & (x < 0.6)
    assert under.sum() > 1000
    assert np.abs(found[under] - expected).max() < 0.003 * count


@pytest.mark.long
def test_glass_behind_a_surface_does_not_dim_it_nor_glass_behind_what_blocks_the_sun(device: Any) -> None:
    low, shelf = pane(-0.5), patch((-0.9, 0.8, 0.5), (0.6, 0, 0), (0, 0, -1.0))
    found = lit(device, glazed({"low": (low, "red"), "high": (pane(2.0), "clear"), "shelf": (shelf, "grey")}))
    expected = passed(CLEAR)
    share = found / expected
    assert np.all((np.abs(share - 1) < 0.01).all(axis=-1) | (found.max(axis=-1) < 0.95)), "lit, in shade or between"
    assert (np.abs(share - 1) < 0.01).all(axis=-1).mean() > 0.5 and (found.max(axis=-1) < 0.01).sum() > 50


@pytest.mark.long
def test_edges_of_panes_are_sharp_and_lie_where_the_sun_draws_them(device: Any) -> None:
    found = lit(device, glazed({"pane": (pane(2.0, -0.6, 2.0), "red")}), frames=16)
    x = places(DOWN)[..., 0] - where(-0.6, 2.0)
    share = 1 - found[..., 2]  # blue does not pass
    beyond = np.abs(x) > 0.03
    assert np.allclose(share[beyond], (x > 0)[beyond], atol=0.01)
    assert share.mean() == pytest.approx((x > 0).mean(), abs=0.01)


def test_bowl_dims_by_the_slant_of_each_place(device: Any) -> None:
    bowl = placed(sphere(0.7, 128, 64), (where(-0.7, -2.9), 2.9, float(TOWARDS[2] / TOWARDS[1]) * 2.9 - 0.4))
    found = lit(device, glazed({"bowl": (bowl, "clear")}))
    offset = places(DOWN) - np.array([-0.7, 0.0, -0.4])
    across = np.linalg.norm(offset - (offset @ TOWARDS)[..., None] * TOWARDS, axis=-1)
    inside = across < 0.62
    cosine = np.sqrt(1 - (across[inside] / 0.7) ** 2)
    expected = np.array([passed(CLEAR, c)[0] for c in cosine]) ** 2
    assert inside.sum() > 500
    assert np.abs(found[inside][:, 0] - expected).mean() < 0.01
    assert np.allclose(found[across > 0.75], 1, atol=0.01)


def striped(part: str, values: tuple[float, ...], **more: Any) -> MaterialTextures:
    """Stripes of half a metre: left and right value."""
    channels = 3 if part == "specular" else 1
    texels = np.zeros((8, 8, channels), np.float16)
    texels[:, :4], texels[:, 4:] = values
    return MaterialTextures(**{part: Texture(texels)}, **more)


def stripes_at(height: float) -> tuple[Flags, Flags]:
    """(SIZE, SIZE) whether floor sees the sun through a left stripe of a pane, and whether surely not between two."""
    turn = 2 * ((places(DOWN)[..., 0] - where(-2.0, height)) % 1)
    return turn < 1, np.abs(turn % 1 - 0.5) < 0.3


@pytest.mark.long
def test_textures_tint_what_panes_pass_and_cut_holes_in_them(device: Any) -> None:
    parts = {"pane": (pane(2.0), "clear")}
    left, sure = stripes_at(2.0)
    tinted = lit(device, glazed(parts, {"clear": striped("specular", (1.0, 0.5))}))
    expected = np.where(left, 1.0, 0.5)[..., None] * passed(CLEAR)
    assert np.abs(tinted - expected)[sure].max() < 0.02
    cut = lit(device, glazed(parts, {"clear": striped("opacity", (1.0, 0.0))}))
    expected = np.where(left, passed(CLEAR)[0], 1.0)
    assert np.abs(cut[..., 0] - expected)[sure].max() < 0.02


def test_sun_shines_through_the_holes_of_masks(device: Any) -> None:
    """A plate with a mask of stripes: what is open is lit, the rest is dark."""
    blind = {"blind": (pane(2.0), "grey")}
    baked = glazed(blind, {"grey": striped("opacity", (1.0, 0.0))})
    objects = [o if o.name == "blind" else o.model_copy(update={"material": "solid"}) for o in baked.record.objects]
    materials = MATERIALS | {"solid": GREY.model_copy(update={"name": "solid"})}
    record = baked.record.model_copy(update={"objects": tuple(objects), "materials": materials})
    found = lit(device, replace(baked, record=record), frames=8)[..., 0]
    left, sure = stripes_at(2.0)
    assert np.abs(found - ~left)[sure].max() < 0.01
    assert sure.mean() > 0.5 and 0.3 < left[sure].mean() < 0.7
