"""A light field on the GPU: its maps as tiles of an atlas, with levels, and what their texels mean in distance."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import wgpu
from numpy.typing import NDArray

from lambent.core.errors import UserError
from lambent.core.light_field import LightField, Sky
from lambent.core.light_field_maps import whole_texels
from lambent.core.light_field_tiles import Tiles, tiled
from lambent.core.shared_exponent import packed_rgb
from lambent.realtime.cube_mips import finite
from lambent.realtime.device import BLOCKS, WEBGPU_LIMITS, adapter_info

MOST_TEXELS = WEBGPU_LIMITS["max-texture-dimension-2d"]


@dataclass(frozen=True)
class Grid:
    """Where tiles lie: row after row of `columns`, layer after layer of `rows`."""

    columns: int
    rows: int
    layers: int

    @classmethod
    def of(cls, count: int, tile: int) -> Grid:
        """The grid of `count` tiles with the fewest empty places, of those that WebGPU has room for."""
        most = MOST_TEXELS // tile
        layers = -(-count // (most * most))
        each = -(-count // layers)
        columns = min(
            range(-(-each // most), min(most, each) + 1), key=lambda c: (c * -(-each // c), abs(c * c - each))
        )
        return cls(columns, -(-each // columns), layers)

    def placed(self, tiles: NDArray[Any]) -> NDArray[Any]:
        """Tiles (P, t, t, C), P at most `columns`, side by side: (t, P t, C)."""
        count, t, _, channels = tiles.shape
        return tiles.transpose(1, 0, 2, 3).reshape(t, count * t, channels)


@dataclass(frozen=True)
class Coding:
    """How texels of radiance are stored: in blocks of BC6H, or each by itself in 32 bits."""

    format: str
    block: int  # texels a side of what is written as one
    bytes: int  # of such a block
    pack: Callable[[NDArray[np.float32]], NDArray[Any]]  # (P, t, t, 3) to (P, t/block, t/block, words)


def is_software(device: Any) -> bool:
    """Whether the adapter unpacks blocks by code, for each texel that is read."""
    return adapter_info(device).is_software


def coding(device: Any, tiles: Tiles) -> Coding:
    """Blocks where the adapter reads them in hardware and tiles consist of them; they have a quarter of the bytes."""
    if BLOCKS in device.features and not is_software(device) and tiles.tile % 4 == 0:
        from lambent.core.bc6h import BLOCK, encoded  # which imports numba

        return Coding("bc6h-rgb-ufloat", BLOCK, 16, encoded)
    return Coding("rgb9e5ufloat", 1, 4, lambda texels: packed_rgb(texels)[..., None])


def with_quarters(inverse: NDArray[np.float16], cover: NDArray[np.uint8]) -> NDArray[np.float16]:
    """Inverse distances with the quarters of texels that show a surface: three lowest bits, and the sign.

    What is left of the distance is right to .4 %.
    """
    rounded = np.minimum(inverse.view(np.uint16) + np.uint16(4), np.uint16(0x7BFF)) & np.uint16(0x7FF8)
    bits = (cover & 7).astype(np.uint16) | (cover.astype(np.uint16) >> 3 & 1) << 15
    return np.asarray((rounded | bits).view(np.float16))


@dataclass(frozen=True)
class Packed:
    """Maps as they are written to an atlas: tiles of every level of radiance, and of inverse distance."""

    levels: tuple[NDArray[Any], ...]
    inverse: NDArray[Any]

    def __len__(self) -> int:
        return len(self.inverse)


class Atlas:
    """The textures of a light field: radiance with levels, and inverse distance.

    Each map has a place, by number. With `most_bytes` there are places for as many maps as fit into them.
    """

    def __init__(self, device: Any, field: LightField, most_bytes: float | None = None, sky: Sky | None = None) -> None:
        """`sky` is in coarser levels of texels that show a surface and the sky."""
        self.tiles = Tiles.of(field.radiance.shape[1])
        self._how, self._field, self._sky = coding(device, self.tiles), field, sky
        self.levels = sum((self.tiles.tile >> k) % self._how.block == 0 for k in range(self.tiles.levels))
        self.places = len(field.points)
        if most_bytes is not None:
            self.places = min(self.places, int(most_bytes / self.map_bytes))
        if self.places < 1:
            raise UserError(
                "is too small for one light field map", field="--light-field-mb",
                got=f"{(most_bytes or 0) / 1e6:.3g} MB", expected=f"{self.map_bytes / 1e6:.2g} MB or more",
            )  # fmt: skip
        self.grid = Grid.of(self.places, self.tiles.tile)
        self._device = device
        self.radiance = self._texture(self._how.format, self.levels)
        self.inverse_distance = self._texture("r16float", 1)

    @property
    def bytes(self) -> int:
        """Of both textures."""
        width, height, layers = self.radiance.size
        texels = sum((width >> k) * (height >> k) for k in range(self.levels))
        return int(layers * (texels * self._how.bytes // self._how.block**2 + 2 * width * height))

    def _texture(self, format: str, levels: int) -> Any:
        grid, tile = self.grid, self.tiles.tile
        usage = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST
        size = (grid.columns * tile, grid.rows * tile, grid.layers)
        return self._device.create_texture(size=size, format=format, mip_level_count=levels, usage=usage)

    @property
    def map_bytes(self) -> float:
        """Of one map in both textures."""
        per_texel = self._how.bytes / self._how.block**2
        return float(sum((self.tiles.tile >> k) ** 2 for k in range(self.levels)) * per_texel + 2 * self.tiles.tile**2)

    def packed(self, part: slice | Sequence[int]) -> Packed:
        """Some maps, ready to be written; any thread may do this."""
        field, how = self._field, self._how
        light, _ = finite(field.radiance[part])
        ready = field.blocks if how.block > 1 else None
        if ready is not None and how.block * ready.shape[1] != self.tiles.tile:
            ready = None  # a tile that can be halved more often
        finest = ready[part] if ready is not None else how.pack(tiled(light, self.tiles.tile))
        if self._sky is not None and field.cover is not None:
            light = whole_texels(light, field.cover[part], self._sky)
        coarser = zip(range(self.levels), self.tiles.chain(light), strict=False)
        levels = (finest, *(how.pack(tiles) for level, tiles in coarser if level))
        inverse = np.asarray(field.inverse_distance[part])
        inverse = np.where(np.isfinite(inverse) & (inverse > 0), inverse, np.float16(0))
        if field.cover is not None:
            inverse = with_quarters(inverse, field.cover[part])
        return Packed(levels, tiled(inverse[..., None], self.tiles.tile))

    def fill(self) -> None:
        """Write the first maps into all places, row by row."""
        for first in range(0, self.places, self.grid.columns):
            self.write(self.packed(slice(first, min(first + self.grid.columns, self.places))), first)

    def write(self, maps: Packed, place: int) -> None:
        """Write maps into places from `place` on, all of one row."""
        for level, tiles in enumerate(maps.levels):
            self._put(self.radiance, level, place, tiles, self._how.block)
        self._put(self.inverse_distance, 0, place, maps.inverse, 1)

    def _put(self, texture: Any, level: int, place: int, tiles: NDArray[Any], block: int) -> None:
        row, column = divmod(place, self.grid.columns)
        layer, row = divmod(row, self.grid.rows)
        tile = self.tiles.tile >> level
        texels = np.ascontiguousarray(self.grid.placed(tiles))
        rows, columns = texels.shape[:2]
        self._device.queue.write_texture(
            {"texture": texture, "mip_level": level, "origin": (column * tile, row * tile, layer)},
            texels,
            {"bytes_per_row": columns * texels.shape[2] * texels.itemsize, "rows_per_image": rows},
            (columns * block, rows * block, 1),
        )
