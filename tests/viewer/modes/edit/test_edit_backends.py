"""The window's picture of edits: the same from the processor's cores and from textures of a GPU."""

import time
from functools import partial

import numpy as np
import pytest
import wgpu

from lambent.core.light.false_colour import Range
from lambent.materials.document import Lobe, Material
from lambent.materials.factored.of_lobes import of_material
from lambent.realtime.gpu.device import AdapterInfo
from lambent.realtime.gpu.targets import pixels
from lambent.viewer.edits import edited
from lambent.viewer.edits.shown import OnGpu, OnHost, backend_of
from lambent.viewer.modes.edit import painter
from lambent.viewer.modes.edit.drawing import EditDrawing
from lambent.viewer.modes.edit.painter import Painter, Wish, checked
from lambent.viewer.screen import Rect
from tests.editing.test_frozen_pictures import DIFFUSE, SIZE, START, dark_parts, expected, light
from tests.viewer import waiting
from tests.viewer.edited_view import LIGHTS, new_state, pull, settled, tint, until

VIEWS = ("filmic", "neutral", "linear", "false-colour")


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr(painter, "FADE_S", 0.01)
    monkeypatch.setattr(painter, "FRAME_S", 0.001)


@pytest.fixture
def opened(screen, tmp_path):
    """States on one view each, with the first transport."""
    states = []

    def start(backend):
        folder = tmp_path / str(len(states))
        folder.mkdir()
        state, bakes = new_state(screen, folder, backend=backend)
        states.append(state)
        until(state, lambda: bakes.begun)
        bakes.begun[0].arrive(LIGHTS[1])
        until(state, lambda: state.loading.lights == LIGHTS[1])
        return state

    yield start
    for state in states:
        state.close()


def window_of(device, state):
    """What the window's textures A and B show, (H, W, 3) bytes each."""
    settled(state)
    drawing = EditDrawing(device, state)
    usage = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST | wgpu.TextureUsage.COPY_SRC
    width, height = state.session.document.size
    drawing._textures = [
        device.create_texture(size=(width, height, 1), format="rgba8unorm", usage=usage) for _ in range(2)
    ]
    drawing.update(Rect(0, 0, 80, 60), 1.0)
    return [pixels(device, texture).astype(int) for texture in drawing._textures]


@pytest.mark.long
def test_the_window_shows_the_same_from_the_cores_and_from_the_gpu(device, opened):
    """Drags, a switched curve, colours, an undo and a comparison, in every view transform."""
    states = [opened(OnHost(device)), opened(OnGpu(device))]
    for state in states:
        pull(state.session, "tray")
        settled(state)
        state.compared.keep(state.now)
        pull(state.session, "tray", "fresnel")
        tint(state.session, "wall", (0.2, 0.9, 0.5))
        state.look.exposure_ev, state.look.scale = -1.0, Range(0.1, 1000.0)
    for view in VIEWS:
        for state in states:
            state.look.view_transform = view
        (a, b), (other_a, other_b) = (window_of(device, state) for state in states)
        assert np.abs(a - other_a).max() <= 2 and np.abs(b - other_b).max() <= 2, view
        assert np.abs(b - a).max() > 20, "the edit is seen"
    host, gpu = (state.painter.frame for state in states)
    assert np.allclose(gpu.radiance, host.radiance, rtol=2e-3, atol=1e-4)
    assert np.allclose(gpu.compared_radiance, host.compared_radiance, rtol=2e-3, atol=1e-4)
    assert np.abs(gpu.shown.bytes.astype(int) - host.shown.bytes).max() <= 2
    for state in states:
        state.session.undo()
        state.session.undo()
    host, gpu = (settled(state) for state in states)
    assert np.allclose(gpu.radiance, host.radiance, rtol=2e-3, atol=1e-4)


@pytest.mark.long
def test_more_lights_fade_in_on_the_gpu_too(device, opened, monkeypatch):
    monkeypatch.setattr(painter, "FADE_S", 0.5)
    shown = []
    for backend in (OnHost(device), OnGpu(device)):
        state = opened(backend)
        before = settled(state).radiance
        clock = state.painter._clock = type(state.screen.clock)()
        state.painter.run(lambda state=state: state.painter._fade_over(0.5 * state.painter.frame.radiance))
        clock.now_s = state.painter._fade_from_s = 0.0
        number = state.painter.frame.number
        until(state, lambda state=state, number=number: state.painter.frame.number > number + 3)
        assert np.allclose(state.painter.frame.radiance, before / 2, rtol=1e-3)
        shown.append(state.painter.frame.shown.bytes.astype(int))
        clock.now_s = 1.0
        assert np.allclose(settled(state).radiance, before, rtol=1e-3)
    assert np.abs(shown[1] - shown[0]).max() <= 2


def test_without_room_on_the_gpu_the_cores_go_on_with_all_edits(device, opened, monkeypatch):
    state, host = opened(OnGpu(device)), opened(OnHost(device))
    for one in (state, host):
        pull(one.session, "tray")
    settled(state)

    def full(*, size, usage):
        raise wgpu.GPUOutOfMemoryError("full")

    monkeypatch.setattr(device, "create_buffer", full)
    for one in (state, host):
        settled(one)
        part = one.painter._parts["wall"][0]
        one.painter.run(lambda one=one, part=part: one.painter.put("wall", part))
        tint(one.session, "wall", (0.2, 0.9, 0.5))
    assert np.allclose(settled(state).radiance, settled(host).radiance, rtol=2e-3, atol=1e-4)
    assert "no room" in state.painter.notice and not host.painter.notice
    assert isinstance(state.painter._backend, OnHost)


@pytest.mark.parametrize("made", [OnHost, OnGpu])
def test_interreflections_are_the_whole_sum_while_materials_are_edited_in_turn(device, made):
    """The background makes layers of the canvas while the painter draws on it."""
    source, painter = light(DIFFUSE), Painter(SIZE, backend=made(device))
    painter.run(partial(painter.begin, np.zeros((*SIZE, 3), np.float32)))
    for name, part in dark_parts(source).items():
        painter.run(partial(painter.put, name, part))
    painter.run(partial(painter.give, source))
    now = dict(START)
    for k in range(12):
        lobes = (Lobe(mx=0.1 + 0.02 * k, my=0.1 + 0.02 * k, r0=0.5),)
        kd = (0.1, 0.05 * k, 0.4)
        now["glossy" if k % 2 else "paper"] = of_material(
            Material(kd=kd, lobes=lobes) if k % 2 else Material(kd=kd, kt_d=0.2)
        )
        painter.want(Wish(dict(now)))
        time.sleep(0.01)
    waiting.until(lambda: not painter.busy, lambda: (checked(painter), painter.take()))
    reference = expected(source, now)
    assert np.abs(painter.frame.radiance - reference).max() < 2e-3 * reference.max()
    painter.close()


@pytest.mark.parametrize(("type", "wanted"), [("CPU", OnHost), ("DiscreteGPU", OnGpu), ("IntegratedGPU", OnGpu)])
def test_a_real_gpu_shows_its_own_textures(device, monkeypatch, type, wanted):
    monkeypatch.setattr(edited, "adapter_info", lambda _: AdapterInfo("it", type, "Vulkan", ""))
    assert isinstance(backend_of(device), wanted)
