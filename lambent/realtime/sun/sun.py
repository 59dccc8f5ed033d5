"""The sun that the light map leaves out, and the shadow map that shows where it shines: made once, as a scene opens.

Depths along the sun's direction, 1 nearest to it, in at most four squares: the first holds what cameras see, the last
the whole scene. What blocks light in a bake blocks it here: all surfaces but the holes of masked ones and clear glass,
whose layers are beside the map (`panes`). Each part of a wide sun has squares of its own (`sun_squares`).
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from lambent.core.arrays import Flags, Floats
from lambent.core.plain import Triple
from lambent.realtime.gpu.layouts import SHADOW_MAP, Layouts
from lambent.realtime.gpu.structs import SUN_DTYPE, Record
from lambent.realtime.gpu.uploads import upload
from lambent.realtime.light.baked import BakedScene
from lambent.realtime.sun.panes import PaneLayers, no_panes, pane_layers
from lambent.realtime.sun.solid_depths import SolidDepths, depth_texture, read_depths
from lambent.realtime.sun.sun_squares import MOST_SQUARES, SIDE, SunSquares, parts_of
from lambent.realtime.sun.sunlit_faces import sunlit_faces
from lambent.store.contract import SunRecord

SunParts = tuple[SunSquares, ...]
BLOCK = 8  # texels along a block whose least and greatest depths are known: SUN_BLOCK of sun.wgsl


class SunLight:
    """A sun on the GPU: its record, its shadow map and the blocks of that; none without `parts`.

    `nowhere` stands for the pixels that see a sun where there is none. Only `reached_faces` (F,) get sun; None: any.
    """

    def __init__(
        self, layouts: Layouts, sun: SunRecord | None = None, parts: SunParts = (), depths: Any = None,
        panes: PaneLayers | None = None, sunlit: NDArray[np.uint8] | None = None, reached_faces: Flags | None = None,
    ) -> None:  # fmt: skip
        self.reached_faces = reached_faces
        self.parts = len(parts)
        self.exists = self.parts > 0
        panes = panes or no_panes(layouts.device)
        self.squares = len(parts[0].squares) if parts else 0
        self.pane_layers = panes.count
        self._data, self._queue = sun_data(sun, parts), layouts.device.queue
        self.uniform = layouts.uniform(SUN_DTYPE.itemsize)
        self.shine(sun.irradiance if sun is not None else (0.0, 0.0, 0.0))
        self.nowhere = upload(layouts.device, [np.zeros((1, 1, 1, 1), np.float16)], "r16float").create_view()
        if self.exists:
            read = (read_depths(layouts.device, depths, layer)[None] for layer in range(depths.size[2]))
            blocks = upload(layouts.device, [np.concatenate([block_ranges(one) for one in read])], "rg32float")
            textures = (depths, blocks, panes.depths, panes.colours)
            views = (texture.create_view(dimension="2d-array") for texture in textures)
            reached = np.ones((1, 1), np.uint8) if sunlit is None else sunlit
            reached = upload(layouts.device, [reached[None, :, :, None] * np.uint8(255)], "r8unorm").create_view()
            self.group = layouts.group(layouts.of(*SHADOW_MAP), self.uniform, *views, reached)

    def shine(self, irradiance: Triple) -> None:
        """Bring so many W/m^2 from now on, where there is a sun."""
        if self.exists:
            self._data["irradiance"][0, :3] = irradiance
        self._queue.write_buffer(self.uniform, 0, self._data.tobytes())


def sun_data(sun: SunRecord | None, parts: SunParts) -> Record:
    """Record of SUN_DTYPE; all 0 without a sun."""
    data = np.zeros(1, SUN_DTYPE)
    if sun is None or not parts:
        return data
    data["towards"][0] = *sun.direction, np.tan(sun.radius_rad)
    data["irradiance"][0], data["parts"] = (*sun.irradiance, len(parts[0].squares)), len(parts)
    for k, part in enumerate(parts):
        across, down, towards = part.axes
        data["part_towards"][0, k] = *towards, part.tangent
        data["across"][0, k], data["down"][0, k] = (*across, part.low_m), (*down, part.span_m)
        for row, (u, v, side) in zip(data["squares"][0, MOST_SQUARES * k :], part.squares, strict=False):
            row[:] = u, v, SIDE / side, side / SIDE
    return data


def block_ranges(depths: Floats) -> NDArray[np.float32]:
    """Least and greatest depths (layers, n, 3 n / 2, 2) about blocks of maps (layers, side, side), n = side / BLOCK.

    A block's are those of the 3 x 3 blocks around it, so that one look-up holds all within a block's side. Levels of
    blocks of BLOCK, 2 BLOCK, ... texels lie beside each other, the second and all further ones in a column: adapters in
    software read one MIP level for four pixels at once.
    """
    layers, side = depths.shape[:2]
    n = count = side // BLOCK
    cut = depths.reshape(layers, n, BLOCK, n, BLOCK)
    least, greatest = cut.min(axis=(2, 4)), cut.max(axis=(2, 4))
    found = np.zeros((layers, n, n + n // 2, 2), np.float32)
    found[:, :, :n] = _with_neighbours(least, greatest)
    while (count := count // 2) > 0:
        least, greatest = (level.reshape(layers, count, 2, count, 2) for level in (least, greatest))
        least, greatest = least.min(axis=(2, 4)), greatest.max(axis=(2, 4))
        found[:, n - 2 * count : n - count, n : n + count] = _with_neighbours(least, greatest)
    return found


def _with_neighbours(least: Floats, greatest: Floats) -> Floats:
    """(layers, n, n, 2) over 3 x 3 of (layers, n, n)."""
    size = (1, 3, 3)
    return np.stack(
        [
            scipy.ndimage.minimum_filter(least, size, mode="nearest"),
            scipy.ndimage.maximum_filter(greatest, size, mode="nearest"),
        ],
        -1,
    )


def draw_depths(layouts: Layouts, parts: SunParts, resources: Any, panes: Collection[str] = ()) -> Any:
    """Texture of a layer for each square, with the depths of what blocks the sun (of `resources.SceneResources`)."""
    squares = [(part, square) for part in parts for square in part.squares]
    texture = depth_texture(layouts.device, SIDE, SIDE, len(squares))
    solid, encoder = SolidDepths(layouts, resources, materials=panes), layouts.device.create_command_encoder()
    for layer, (part, square) in enumerate(squares):
        view = texture.create_view(dimension="2d", base_array_layer=layer, array_layer_count=1)
        solid.draw(encoder, view, part.clip_from_world(square))
    layouts.device.queue.submit([encoder.finish()])
    return texture


def sun_light(layouts: Layouts, scene: BakedScene, resources: Any) -> SunLight:
    """The sun of a baked scene, its shadow map drawn; dark where there is none."""
    if scene.sun is None or not len(scene.faces):
        return SunLight(layouts)
    paths = (camera for path in scene.record.paths for camera in path.keys)
    eyes = np.array([camera.position for camera in (*scene.record.cameras, *paths)], float).reshape(-1, 3)
    sun, corners = scene.sun, scene.positions[scene.faces].astype(float)
    parts = parts_of(sun.direction, sun.radius_rad, corners, eyes)
    depths = draw_depths(layouts, parts, resources, sun.panes)
    reached = None if scene.sunlit is None else sunlit_faces(scene.sunlit, scene.uv2, scene.faces)
    panes = pane_layers(layouts, parts, resources, depths, sun.panes)
    return SunLight(layouts, sun, parts, depths, panes, scene.sunlit, reached)
