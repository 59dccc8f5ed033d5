"""Blocks of BC6H: small errors on what they are made for, bounds, and the adapter reads them as we do."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lambent.baked.light_fields.blocks.bc6h import LARGEST, decoded, encoded

Y, X = np.mgrid[0:64, 0:64] / 64
RNG = np.random.default_rng(3)
LINE = np.exp2(6 * X - 3)[..., None] * [1.0, 0.6, 0.3]  # six stops in 64 texels, one hue
TURNING = np.exp(1.5 * X[..., None] * [1, 0.8, 0.5] - Y[..., None] * [0.2, 1, 1.5])
EDGE = np.where((X + 0.5 * Y > 0.6)[..., None], [20, 0.3, 0.1], [0.05, 0.1, 0.2])
CORNERS = np.where((X // 0.04 + Y // 0.06) % 2 > 0, 1.0, 0.4)[..., None] * np.where(
    (X + 0.5 * Y > 0.6)[..., None], [2, 0.3, 0.1], [0.5, 0.9, 1.2]
)  # three colours and more in a block
HOSTILE = RNG.gamma(0.05, 100.0, (64, 64, 3))


MODES = (0, 1, 2, 6, 10, 14, 18, 22, 26, 30, 3, 7, 11, 15)


def modes(blocks: np.ndarray) -> set[int]:
    """Numbers of the modes of blocks (B, 4), reserved ones among them."""
    low = blocks[:, 0] & 3
    return set(np.where(low < 2, low, blocks[:, 0] & 31).tolist())


def psnr_db(light: np.ndarray) -> float:
    """By the largest value."""
    error = decoded(encoded(light)).astype(float) - light
    return float(10 * np.log10(light.max() ** 2 / np.mean(error**2)))


@pytest.mark.long
@pytest.mark.parametrize(
    ("light", "least_db"), [(LINE, 55), (TURNING, 45), (EDGE, 55)], ids=["line", "turning", "edge"]
)
def test_gradients_and_edges_survive(light: np.ndarray, least_db: float) -> None:
    assert psnr_db(light) > least_db


def test_what_is_no_light_becomes_black_and_what_is_too_much_the_largest() -> None:
    bad = np.full((4, 4, 3), -1.0)
    bad[0, 0], bad[1, 1] = np.nan, -np.inf
    assert not decoded(encoded(bad)).any()
    assert np.all(decoded(encoded(np.full((4, 4, 3), np.inf))) == np.float16(LARGEST))


def test_a_block_shows_no_more_than_its_texels() -> None:
    """However wild: within the block's own range in each channel, but for half a step of ends of 6 bits."""
    shown = decoded(encoded(HOSTILE)).astype(float)
    tops = HOSTILE.reshape(16, 4, 16, 4, 3).max(axis=(1, 3), keepdims=True)
    assert np.isfinite(shown).all() and shown.min() >= 0
    assert np.all(shown.reshape(16, 4, 16, 4, 3) <= np.minimum(1.25 * tops + 1e-3, LARGEST))


def test_the_adapter_decodes_the_same_bits(adapter: None) -> None:
    """Every mode, with all values of indices and ends."""
    import wgpu

    from lambent.realtime.gpu.device import BLOCKS, open_device
    from lambent.realtime.gpu.targets import pixels

    device: Any = open_device()
    if BLOCKS not in device.features:
        pytest.skip("the adapter has no textures in blocks")
    light = np.concatenate([LINE, TURNING, EDGE, CORNERS, HOSTILE], axis=1)
    written = encoded(light).reshape(-1, 4)
    assert modes(written) >= {0, 2, 3, 7, 11, 15}
    random = RNG.integers(0, 1 << 32, (4096, 4), dtype=np.uint64).astype(np.uint32)
    assert modes(random) >= set(MODES)
    blocks = np.concatenate([written, random]).reshape(1, 32, -1, 4)
    rows, columns = 4 * blocks.shape[1], 4 * blocks.shape[2]
    texture = device.create_texture(
        size=(columns, rows, 1),
        format="bc6h-rgb-ufloat",
        usage=wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST,
    )
    device.queue.write_texture(
        {"texture": texture}, blocks, {"bytes_per_row": 16 * blocks.shape[2], "rows_per_image": blocks.shape[1]},
        (columns, rows, 1),
    )  # fmt: skip
    shader = """
    @group(0) @binding(0) var source: texture_2d<f32>;
    @vertex fn corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
        return vec4f(vec2f(f32(i & 1u), f32(i >> 1u)) * 4.0 - 1.0, 0.0, 1.0);
    }
    @fragment fn texel(@builtin(position) at: vec4f) -> @location(0) vec4f {
        return textureLoad(source, vec2i(at.xy), 0);
    }
    """
    target = device.create_texture(
        size=(columns, rows, 1),
        format="rgba32float",
        usage=wgpu.TextureUsage.RENDER_ATTACHMENT | wgpu.TextureUsage.COPY_SRC,
    )
    module = device.create_shader_module(code=shader)
    pipeline = device.create_render_pipeline(
        layout="auto", vertex={"module": module, "entry_point": "corner"},
        fragment={"module": module, "entry_point": "texel", "targets": [{"format": "rgba32float"}]},
    )  # fmt: skip
    group = device.create_bind_group(
        layout=pipeline.get_bind_group_layout(0), entries=[{"binding": 0, "resource": texture.create_view()}]
    )
    encoder = device.create_command_encoder()
    draw = encoder.begin_render_pass(
        color_attachments=[
            {"view": target.create_view(), "load_op": "clear", "store_op": "store", "clear_value": (0,) * 4}
        ]
    )
    draw.set_pipeline(pipeline)
    draw.set_bind_group(0, group)
    draw.draw(3)
    draw.end()
    device.queue.submit([encoder.finish()])
    got = pixels(device, target)[..., :3].astype(np.float32)
    np.testing.assert_array_equal(got, decoded(blocks)[0].astype(np.float32))


def test_a_lamp_keeps_its_light_before_what_is_dark_and_uneven() -> None:
    """One texel of a lamp in each block, at most as bright as it is seen in part; without weights 2.5 % were lost."""
    rng = np.random.default_rng(0)
    dark = 0.3 * (1 + 0.1 * rng.standard_normal((1, 160, 160, 1))).clip(0.1) * np.ones(3)
    lamp = dark.copy()
    row, column = 4 * np.mgrid[:40, :40] + rng.integers(4, size=(2, 40, 40))
    lamp[0, row, column] += rng.uniform(25, 100, (40, 40, 1)) * np.array([1, 0.8, 0.5])
    kept = (decoded(encoded(lamp)).astype(float) - dark).sum(axis=(0, 1, 2)) / (lamp - dark).sum(axis=(0, 1, 2))
    np.testing.assert_allclose(kept, 1, atol=0.006)


def test_two_lines_keep_the_hues_of_edges() -> None:
    """Red and blue, both bright and dark: one line errs by 8 % in hue, two by 1.4 %."""
    shown = decoded(encoded(CORNERS)).astype(float)
    error = np.log(shown / CORNERS)
    hue = error - error.mean(axis=-1, keepdims=True)
    assert np.sqrt(np.mean(hue**2)) < 0.02


def test_texels_of_little_importance_leave_lines_to_the_others() -> None:
    """Every other column shows another colour than its neighbours, and a line cannot have both."""
    ignored = (X * 64).astype(int) % 2 == 1
    light = np.where(ignored[..., None], TURNING[:, ::-1], EDGE)
    errors = []
    for importance in (None, np.where(ignored, 0.01, 1.0)):
        error = np.log(decoded(encoded(light, importance)).astype(float) / light)
        errors.append(np.sqrt(np.mean(error[~ignored] ** 2)))
    assert errors[1] < 0.8 * errors[0]
