"""A light field on the GPU: its maps as tiles of an atlas with MIP levels, and the coding of distances."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import wgpu
from numpy.typing import NDArray

from lambent.baked.light_fields.blocks.tiles import BLOCK, Tiles, pool_rows, tiled
from lambent.baked.light_fields.light_field import LightField, Sky
from lambent.baked.light_fields.maps import whole_texels
from lambent.baked.shared_exponent import packed_rgb
from lambent.core.errors import UserError
from lambent.realtime.gpu.cube_mips import finite
from lambent.realtime.gpu.device import BLOCKS, WEBGPU_LIMITS, adapter_info

MOST_TEXELS = WEBGPU_LIMITS["max-texture-dimension-2d"]
MOST_LAYERS = WEBGPU_LIMITS["max-texture-array-layers"]


@dataclass(frozen=True)
class Layout:
    """Layout of tiles in the layers of an atlas: row by row for each level, coarser levels below finer ones."""

    tiles: tuple[int, ...]  # side of a tile in texels, by level
    columns: int  # tiles of level 0 in a row
    places: int  # maps in a layer
    layers: int

    @classmethod
    def of(cls, count: int, tiles: tuple[int, ...]) -> Layout:
        """The smallest layout for `count` maps within WebGPU's limits."""
        most = MOST_TEXELS // tiles[0]
        least = -(-count // (most * most))
        found = [
            cls(tiles, columns, -(-count // layers), layers)
            for layers in range(least, min(2 * least + 2, MOST_LAYERS) + 1)
            for columns in range(1, most + 1)
        ]
        fitting = [one for one in found if max(one.size[:2]) <= MOST_TEXELS]
        return min(fitting, key=lambda one: (math.prod(one.size), abs(one.size[0] - one.size[1])))

    def across(self, level: int) -> int:
        """Tiles of a level in a row."""
        return self.columns * self.tiles[0] // self.tiles[level]

    def rows(self, level: int) -> int:
        """Rows of tiles of a level in a layer."""
        return -(-self.places // self.across(level))

    def first_row(self, level: int) -> int:
        """The first row of texels of a level."""
        return sum(self.rows(k) * self.tiles[k] for k in range(level))

    @property
    def size(self) -> tuple[int, int, int]:
        """Columns and rows of texels, and layers."""
        return self.columns * self.tiles[0], self.first_row(len(self.tiles)), self.layers

    def runs(self, place: int, count: int, level: int) -> Iterator[tuple[slice, int, int, int]]:
        """Runs of adjacent tiles of `count` maps from `place` on: slice of maps; column and row of tiles, and layer."""
        done = 0
        while done < count:
            layer, within = divmod(place + done, self.places)
            row, column = divmod(within, self.across(level))
            more = min(count - done, self.across(level) - column, self.places - within)
            yield slice(done, done + more), column, row, layer
            done += more


def beside(tiles: NDArray[Any]) -> NDArray[Any]:
    """Tiles (P, h, w, C) side by side: (h, P w, C)."""
    count, height, width, channels = tiles.shape
    return np.ascontiguousarray(tiles.transpose(1, 0, 2, 3).reshape(height, count * width, channels))


@dataclass(frozen=True)
class Coding:
    """Storage of radiance: BC6H blocks, or 32 bits per texel."""

    format: str
    block: int  # side of a block, texels
    bytes: int  # of a block
    pack: Callable[[NDArray[np.float32]], NDArray[Any]]  # (P, t, t, 3) to (P, t/block, t/block, words)


def is_software(device: Any) -> bool:
    """Whether the adapter is a software one, which decodes blocks in code at every texel read."""
    return adapter_info(device).is_software


def coding(device: Any) -> Coding:
    """BC6H blocks, a quarter of the bytes, if the adapter decodes them in hardware; else 32 bits per texel."""
    if BLOCKS in device.features and not is_software(device):
        from lambent.baked.light_fields.blocks.bc6h import BLOCK, encoded  # which imports numba

        return Coding("bc6h-rgb-ufloat", BLOCK, 16, partial(encoded, rough=math.inf))
    return Coding("rgb9e5ufloat", 1, 4, lambda texels: packed_rgb(texels)[..., None])


def with_quarters(inverse: NDArray[np.float16], cover: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Bits of inverse distances, with a flag for each quarter of a texel that shows a surface.

    Flags take the three lowest bits and the sign; the distance keeps a precision of .4 %.
    """
    rounded = np.minimum(inverse.view(np.uint16) + np.uint16(4), np.uint16(0x7BFF)) & np.uint16(0x7FF8)
    bits = (cover & 7).astype(np.uint16) | (cover.astype(np.uint16) >> 3 & 1) << 15
    return np.asarray(rounded | bits)


@dataclass(frozen=True)
class Packed:
    """Maps in the form that an atlas stores: tiles of every level of radiance, and distances."""

    levels: tuple[NDArray[Any], ...]
    distances: NDArray[Any]

    def __len__(self) -> int:
        return len(self.distances)

    def of(self, i: int) -> Packed:
        """One of the maps."""
        return Packed(tuple(level[i : i + 1] for level in self.levels), self.distances[i : i + 1])


class Atlas:
    """Textures of a light field: radiance with MIP levels, and inverse distance.

    Each map has a numbered place. With `most_bytes`, there are as many places as fit.
    """

    def __init__(self, device: Any, field: LightField, most_bytes: float | None = None, sky: Sky | None = None) -> None:
        """`sky`: blended into coarser levels of texels that show both a surface and the sky."""
        self.tiles = Tiles.of(field.radiance.shape[1])
        self._how, self._field, self._sky = coding(device), field, sky
        tile = self.tiles.tiles[0]
        self.cell = (tile // BLOCK, tile // BLOCK + pool_rows(tile // BLOCK)) if self.in_blocks else (tile, tile)
        self.places = len(field.points)
        if most_bytes is not None:
            self.places = min(self.places, int(most_bytes / self.map_bytes))
        if self.places < 1:
            raise UserError(
                "is too small for one light field map", field="--light-field-mb",
                got=f"{(most_bytes or 0) / 1e6:.3g} MB", expected=f"{self.map_bytes / 1e6:.2g} MB or more",
            )  # fmt: skip
        self.layout = Layout.of(self.places, self.tiles.tiles)
        self._device = device
        self.radiance = self._texture(self._how.format, self.layout.size)
        columns, rows = self.layout.columns * self.cell[0], self.layout.rows(0) * self.cell[1]
        self.distances = self._texture("rg32uint" if self.in_blocks else "r16uint", (columns, rows, self.layout.layers))

    @property
    def in_blocks(self) -> bool:
        """Whether light and distances are in blocks."""
        return self._how.block > 1

    @property
    def bytes(self) -> int:
        """Bytes of both textures."""
        texels, distances = (int(math.prod(texture.size)) for texture in (self.radiance, self.distances))
        return round(texels * self._bytes_per_texel + distances * self._bytes_per_distance)

    @property
    def map_bytes(self) -> float:
        """Bytes of one map in both textures."""
        return float(self.tiles.texels * self._bytes_per_texel + math.prod(self.cell) * self._bytes_per_distance)

    @property
    def _bytes_per_texel(self) -> float:
        return self._how.bytes / self._how.block**2

    @property
    def _bytes_per_distance(self) -> int:
        return 8 if self.in_blocks else 2

    def _texture(self, format: str, size: tuple[int, int, int]) -> Any:
        usage = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST
        return self._device.create_texture(size=size, format=format, usage=usage)

    def packed(self, part: slice | Sequence[int]) -> Packed:
        """Some maps, ready for `write`; may run in any thread."""
        field, how = self._field, self._how
        light, _ = finite(field.radiance[part])
        ready = field.blocks if self.in_blocks else None
        finest = ready[part] if ready is not None else how.pack(tiled(light, self.tiles.tiles[0]))
        if self._sky is not None and field.cover is not None:
            light = whole_texels(light, field.cover[part], self._sky)
        coarser = [how.pack(tiles) for level, tiles in enumerate(self.tiles.chain(light)) if level]
        return Packed((finest, *coarser), self._distances(part))

    def _distances(self, part: slice | Sequence[int]) -> NDArray[Any]:
        """(P, h, w, 1 or 2) of some maps."""
        field, tile = self._field, self.tiles.tiles[0]
        if self.in_blocks and field.distances is not None:
            return np.asarray(field.distances[part])
        inverse = np.asarray(field.inverse_distance[part])
        inverse = tiled(np.where(np.isfinite(inverse) & (inverse > 0), inverse, np.float16(0))[..., None], tile)
        cover = None if field.cover is None else tiled(field.cover[part][..., None], tile)
        if self.in_blocks:
            from lambent.baked.light_fields.blocks.distances import encoded  # which imports numba

            return encoded(inverse[..., 0], None if cover is None else cover[..., 0])
        return inverse.view(np.uint16) if cover is None else with_quarters(inverse, cover)

    def fill(self) -> None:
        """Write the first maps into all places, row by row."""
        step = self.layout.columns
        for first in range(0, self.places, step):
            self.write(self.packed(slice(first, min(first + step, self.places))), first)

    def write(self, maps: Packed, place: int) -> None:
        """Write maps into places from `place` on."""
        for level, tiles in enumerate(maps.levels):
            for run, column, row, layer in self.layout.runs(place, len(maps), level):
                tile = self.tiles.tiles[level]
                corner = column * tile, self.layout.first_row(level) + row * tile, layer
                self._put(self.radiance, corner, tiles[run], self._how.block)
        for run, column, row, layer in self.layout.runs(place, len(maps), 0):
            corner = column * self.cell[0], row * self.cell[1], layer
            self._put(self.distances, corner, maps.distances[run], 1)

    def _put(self, texture: Any, corner: tuple[int, int, int], tiles: NDArray[Any], block: int) -> None:
        texels = beside(tiles)
        rows, columns = texels.shape[:2]
        self._device.queue.write_texture(
            {"texture": texture, "origin": corner}, texels,
            {"bytes_per_row": columns * texels.shape[2] * texels.itemsize, "rows_per_image": rows},
            (columns * block, rows * block, 1),
        )  # fmt: skip
