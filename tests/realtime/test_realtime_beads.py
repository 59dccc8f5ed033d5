"""The highlight of one small lamp on a rough ball is one highlight, not one per sample."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import label

from lambent.core.geometry.cubemap import face_directions
from lambent.core.geometry.directions import normalize
from lambent.core.views.camera import Camera
from lambent.materials.document import Lobe, Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.integrators.integrators import INTEGRATORS, Integrator
from lambent.realtime.integrators.patterns import rings_table
from lambent.realtime.objects.unbaked import unbaked_scene as baked_scene
from lambent.realtime.renderer import Renderer
from lambent.scenes.geometry import sphere

LIMIT = {0.05: 0.1, 0.1: 0.05, 0.25: 0.15, 0.4: 0.13}  # by m
CAMERA = Camera(name="c", position=(0.3, 0.5, 3.2), target=(0.0, 0.0, 0.0), fov_y_deg=24.0)


def lamp(radius: float = 0.05, n: int = 256) -> np.ndarray:
    """One lamp in the dark, of `radius` rad."""
    w = normalize(face_directions(n))
    inside = w @ normalize(np.array([0.5, 0.5, 0.9])) > np.cos(radius)
    return np.where(inside[..., None], 100.0, np.full(3, 0.02)).astype(np.float32)


def second_highlight(light: np.ndarray) -> float:
    """How far the second highlight stands out from where it joins the first; 1 is the height of the first."""
    shown = (light / light.max()) ** (1 / 2.2)
    highest = 0.0
    for level in np.linspace(0.3, 0.98, 35):
        pieces, count = label(shown > level)
        heights = sorted(float(shown[pieces == piece].max()) - level for piece in range(1, count + 1))
        highest = max(highest, heights[-2] if count > 1 else 0.0)
    return highest


@pytest.fixture(scope="module")
def ball(device) -> Renderer:
    material = Material(name="m", lobes=(Lobe(mx=0.1, my=0.1),))
    return Renderer(device, baked_scene({"ball": sphere(0.62, around=192, rows=96)}, material, lamp()))


def drawn(ball: Renderer, m: float, n: int, integrator: str = "rings") -> np.ndarray:
    material = Material(name="m", lobes=(Lobe(mx=m, my=m, r0=0.8, alpha=0.4),))
    state = FrameState(
        CAMERA, 160, 160, integrator=integrator, n=n, show="specular", lookup="plain", antialias=False,
        materials={"m": material},
    )  # fmt: skip
    return ball.image(state)[..., 1]


@pytest.mark.parametrize("m", [0.05, 0.1, 0.25, 0.4])
def test_a_small_lamp_has_one_highlight(ball, m: float) -> None:
    for n in (7, 9, 11, 13, 15, 17, 19):
        assert second_highlight(drawn(ball, m, n)) < LIMIT[m], n


@pytest.mark.parametrize("m", [0.1, 0.25, 0.4])
def test_a_lamp_outside_of_the_cube_map_has_one_highlight_at_any_n(ball, m: float) -> None:
    for n in (1, 3, 5, 7):
        assert second_highlight(drawn(ball, m, n, "lamps")) < 0.02, n


def test_pieces_are_told_from_one_highlight(ball, monkeypatch: pytest.MonkeyPatch) -> None:
    """Filters of a fifth of the solid angle leave one highlight per sample."""

    def sharp(lobe: Lobe, n: int) -> np.ndarray:
        return rings_table(lobe, n) - np.array([0, 0, 0.5 * np.log2(5), 0], np.float32)

    monkeypatch.setitem(INTEGRATORS, "rings", Integrator("quadrature.wgsl", sharp))
    assert second_highlight(drawn(ball, 0.4, 7)) > 0.3
