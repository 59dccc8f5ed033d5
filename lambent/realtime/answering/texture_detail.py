"""The detail of exchanged textures in light that answers edits: what surfaces send to each other, and what probes see.

Diffuse albedos of the answer are those of materials, and the rays' weights hold the luminance of the baked textures. So
each point and each patch gets an albedo of its own, its material's times the ratio of the new texture to the luminance
of the baked one, both averaged over the surface that it stands for. A texel of a probe sees both textures averaged over
the part of the surface behind it, which is taken as flat within a texel of the light map.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lambent.baked.answering.answer import MOST_ALBEDO, Albedos, Answer
from lambent.baked.answering.stored import SeenSpots, StoredAnswer
from lambent.core.arrays import Floats, Indices, sums_of
from lambent.core.geometry.cubemap import face_directions
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.triangles import triangle_areas
from lambent.core.light.colour import luminance
from lambent.materials.bsdf import diffuse_seen
from lambent.realtime.light.baked import BakedScene
from lambent.scenes.looks.retexturing import materials_without_uv
from lambent.scenes.looks.textures import halved
from lambent.scenes.scene import MaterialTextures, Texture

PER_TEXEL = 16  # samples of a texture per texel of the light map
MOST_SAMPLES = 1 << 21  # per material
MOST_RATIO = 32.0  # new texture over baked one: rays hold next to nothing of what was nearly black
NEAR_TEXELS = 8.0  # farther from its texel of the light map, a probe's ray has left the surface taken as flat
_R2 = 0.7548776662466927, 0.5698402909980532  # the R2 sequence (Roberts 2018)

Halves = NDArray[np.float16]
Textures = Mapping[str, MaterialTextures | None]  # by material: the ones that it shows instead of the baked ones


def with_own_albedos(answer: Answer) -> Answer:
    """The answer with one albedo for each point and each patch, after those of the materials."""
    materials, points, patches = len(answer.albedos.reflected), answer.points, answer.patches
    rows = own_rows(answer)
    count = len(points.material)
    return replace(
        answer,
        points=replace(points, material=materials + np.arange(count)),
        patches=replace(patches, material=materials + count + np.arange(len(patches.material))),
        albedos=Albedos(answer.albedos.reflected[rows], answer.albedos.transmitted[rows]),
    )


def own_rows(answer: Answer) -> Indices:
    """Material of each row of the albedos of `with_own_albedos`."""
    first = np.arange(len(answer.albedos.reflected))
    return np.concatenate([first, answer.points.material, answer.patches.material])


class Samples(NamedTuple):
    """Samples (n,) of surfaces, even in the light map: face, its corners' weights, texel of the map, uv (n, 2)."""

    face: NDArray[np.integer]
    weights: Floats
    texel: Indices
    uv: Floats


@dataclass(frozen=True, eq=False)
class Detail:
    """Exchanged textures: factors (rows, 3) of `with_own_albedos`, and diffuse textures by material number.

    `changed` has the baked and the new texture of a material, None for none; `seen` what probes see of them, by object.
    """

    factors: Floats
    changed: Mapping[int, tuple[Texture | None, Texture | None]]
    seen: dict[str, tuple[Indices, Halves, Halves]] = field(default_factory=dict)

    def albedos(self, of_rows: Albedos) -> Albedos:
        """Albedos of rows with this detail, at most MOST_ALBEDO in sum."""
        reflected, transmitted = of_rows.reflected * self.factors, of_rows.transmitted * self.factors
        scale = MOST_ALBEDO / np.maximum(reflected + transmitted, MOST_ALBEDO)
        return Albedos(reflected * scale, transmitted * scale)


class TextureDetails:
    """Details of exchanged textures of one scene; what they need of its surfaces is found once per material."""

    def __init__(self, baked: BakedScene, stored: StoredAnswer) -> None:
        self._baked, self._stored = baked, stored
        self._samples: dict[str, Samples] = {}

    def of(self, textures: Textures) -> Detail | None:
        """The detail of these textures; None if none changes what a surface sends."""
        numbers = {name: number for number, name in enumerate(self._stored.materials)}
        changed = {}
        for name in textures.keys() & numbers.keys():
            before, after = self._baked.textures.get(name), textures[name]
            if not placed_alike(before, after):
                changed[numbers[name]] = _diffuse(before), _diffuse(after)
        if not changed:
            return None
        factors = np.ones((len(own_rows(self._stored.answer)), 3))
        for number, both in changed.items():
            self._fill(factors, number, *both)
        return Detail(factors, changed)

    def _fill(self, factors: Floats, number: int, before: Texture | None, after: Texture | None) -> None:
        """Set the factors of a material's points and patches."""
        answer, samples = self._stored.answer, self._of_material(number)
        count, patches = len(answer.points.material), len(answer.patches.material)
        first = len(answer.albedos.reflected)
        old = luminance(_mean_values(before, samples.uv).astype(float))[:, None]
        both = np.concatenate([old, _mean_values(after, samples.uv), np.ones_like(old)], axis=1)
        sums = np.zeros((count, 5))
        for side in range(2):
            sender = self._sender_of_code[2 * samples.texel + side]
            known = sender >= 0
            sums += sums_of(both[known], sender[known], count)
        of_patches = sums_of(sums, answer.points.patch, patches)
        everyone = np.concatenate([answer.points.material, answer.patches.material])
        of_rows = np.concatenate([sums, of_patches])
        of_rows[of_rows[:, 4] == 0] = both.sum(axis=0)  # no sample near: the mean of the material
        ratio = of_rows[:, 1:4] / np.maximum(of_rows[:, :1], of_rows[:, 4:] / MOST_RATIO + 1e-30)
        factors[first:][everyone == number] = np.minimum(ratio, MOST_RATIO)[everyone == number]

    @cached_property
    def _sender_of_code(self) -> Indices:
        """(2 H W,) the sending point that counts most for each texel and side, -1 without one."""
        found = np.full(2 * self._size[0] * self._size[1], -1)
        found[self._stored.texels] = self._stored.answer.sender
        return found

    @property
    def _size(self) -> tuple[int, int]:
        """Width and height of the light map."""
        light = self._baked.irradiance
        assert light is not None, "an answer has a light map"
        return light.shape[1], light.shape[0]

    def _of_material(self, number: int) -> Samples:
        name = self._stored.materials[number]
        if name not in self._samples:
            objects = [o for o in self._baked.record.objects if o.material == name]
            ranges = [np.arange(o.first_face, o.first_face + o.face_count) for o in objects]
            faces = np.concatenate(ranges) if ranges else np.zeros(0, np.int64)
            self._samples[name] = samples_of(self._baked, faces, self._size)
        return self._samples[name]

    def tints(self, name: str, seen: SeenSpots, detail: Detail) -> tuple[Floats, Floats]:
        """Textures (6 N N, 3) that a probe sees, before and after the exchange, relative to the materials' colours."""
        if name not in detail.seen:
            detail.seen[name] = self._seen(name, seen, detail)
        at, *values = detail.seen[name]
        found = seen.tint.reshape(-1, 3).astype(np.float32), seen.tint.reshape(-1, 3).astype(np.float32)
        for tint, value in zip(found, values, strict=True):
            tint[at] = value
        return found

    def _seen(self, name: str, seen: SeenSpots, detail: Detail) -> tuple[Indices, Halves, Halves]:
        """Texels (n,) of a probe that see an exchanged texture, and what they see (n, 3) before and after."""
        texel, parts = seen.texel.reshape(-1), []
        of = np.where(texel >= 0, self._stored.material[np.maximum(texel, 0)], -1)
        for number, both in detail.changed.items():
            at = np.flatnonzero(of == number)
            code = self._stored.texels[texel[at]].astype(np.int64)
            uv, cosine, there = self._looked_at(name, seen.texel.shape[1], at, code // 2, self._of_material(number))
            shown = diffuse_seen(cosine, self._baked.record.materials[self._stored.materials[number]])[:, None]
            values = ((shown * filtered(one, uv))[there].astype(np.float16) for one in both)
            parts.append((at[there], *values))
        at, before, after = (np.concatenate(one) for one in zip(*parts, strict=True))
        return at, before, after

    def _looked_at(
        self, name: str, size: int, at: Indices, texel: Indices, samples: Samples
    ) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        """uv (n, 4, 2) of four rays through each of a probe's texels `at`, cosines (n,), and where both are known."""
        of_texel = np.full(self._size[0] * self._size[1], -1)
        of_texel[samples.texel] = np.arange(len(samples.texel))
        sample = of_texel[texel]
        there = sample >= 0
        baked, face = self._baked, samples.face[np.maximum(sample, 0)]
        corner = baked.faces[face].astype(np.int64)
        origin, first, second = (np.asarray(baked.positions[corner[:, k]], float) for k in range(3))
        first, second = first - origin, second - origin
        normal = np.cross(first, second)
        d, away = _four_directions(size)[at], origin - np.array(baked.probes[name].centre)
        with np.errstate(divide="ignore", invalid="ignore"):
            along = (away * normal).sum(axis=-1)[:, None] / (d * normal[:, None]).sum(axis=-1)
            met = along[..., None] * d - away[:, None]
            square = (normal * normal).sum(axis=-1)[:, None]
            a = (np.cross(met, second[:, None]) * normal[:, None]).sum(axis=-1) / square
            b = (np.cross(first[:, None], met) * normal[:, None]).sum(axis=-1) / square
        uv, uv2 = (
            values[corner[:, 0], None] + a[..., None] * (values[corner[:, 1]] - values[corner[:, 0]])[:, None]
            + b[..., None] * (values[corner[:, 2]] - values[corner[:, 0]])[:, None]
            for values in (_uv(baked), np.asarray(baked.uv2, float))
        )  # fmt: skip
        centre = np.stack([texel % self._size[0], texel // self._size[0]], axis=-1) + 0.5
        with np.errstate(invalid="ignore"):
            off = np.abs(uv2 * self._size - centre[:, None]).max(axis=-1) > NEAR_TEXELS
        uv = np.where((off | ~(along > 0))[..., None], samples.uv[np.maximum(sample, 0)][:, None], uv)
        cosine = np.abs((normalize(d.mean(axis=1)) * normal).sum(axis=-1)) / np.maximum(np.sqrt(square[:, 0]), 1e-30)
        return uv, cosine, there


def samples_of(baked: BakedScene, faces: NDArray[np.integer], size: tuple[int, int]) -> Samples:
    """Samples of some faces, in number proportional to their area in a light map of `size` (width, height)."""
    corner = baked.faces[faces].astype(np.int64)
    uv2 = np.asarray(baked.uv2, float)[corner] * size
    areas = triangle_areas(np.pad(uv2, ((0, 0), (0, 0), (0, 1))))
    total = float(areas.sum())
    if not total > 0:
        return Samples(np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros((0, 2)))
    count = min(MOST_SAMPLES, max(len(faces), int(PER_TEXEL * total)))
    at = (np.arange(count) + 0.5) / count * total
    chosen = np.minimum(np.searchsorted(np.cumsum(areas), at), len(faces) - 1)
    a, b = ((0.5 + step * np.arange(count)) % 1 for step in _R2)
    over = a + b > 1
    a, b = np.where(over, 1 - a, a), np.where(over, 1 - b, b)
    weights = np.stack([1 - a - b, a, b], axis=1)[..., None]
    place = np.floor((weights * uv2[chosen]).sum(axis=1)).astype(np.int64)
    column, row = np.clip(place, 0, np.array(size) - 1).T
    return Samples(
        faces[chosen], weights[..., 0], row * size[0] + column, (weights * _uv(baked)[corner[chosen]]).sum(axis=1)
    )


def placed_alike(one: MaterialTextures | None, other: MaterialTextures | None) -> bool:
    """Whether diffuse textures are the same texels in the same place."""
    both = [None if of is None else (id(of.texels), of.uv_transform) for of in map(_diffuse, (one, other))]
    return both[0] == both[1]


def _uv(baked: BakedScene) -> Floats:
    return np.zeros((len(baked.positions), 2)) if baked.uv is None else np.nan_to_num(np.asarray(baked.uv, float))


def without_uv(baked: BakedScene) -> frozenset[str]:
    """Materials of which no object has texture coordinates."""
    uv, faces = _uv(baked), baked.faces.astype(np.int64)
    objects = baked.record.objects
    return materials_without_uv(
        [(o.material, uv[faces[o.first_face : o.first_face + o.face_count].reshape(-1)]) for o in objects]
    )


def _diffuse(textures: MaterialTextures | None) -> Texture | None:
    return None if textures is None else textures.diffuse


def _mean_values(texture: Texture | None, uv: Floats) -> Floats:
    """Values (n, 3) of a texture at points uv (n, 2) that sample a surface evenly, averaged over the space between."""
    if texture is None or not len(uv):
        return np.ones((len(uv), 3), np.float32)
    spread = np.ptp(uv, axis=0).prod() * abs(float(np.linalg.det(np.array(texture.uv_transform)[:, :2])))
    texels = spread * texture.texels.shape[0] * texture.texels.shape[1]
    return _at_levels(texture, uv, np.full(len(uv), 0.5 * np.log2(max(1.0, texels / len(uv)))))


def filtered(texture: Texture | None, uv: Floats) -> Floats:
    """Values (n, 3) of a texture around uv (n, 4, 2) of four rays through one pixel."""
    if texture is None:
        return np.ones((len(uv), 3), np.float32)
    matrix = np.array(texture.uv_transform)[:, :2]
    spread = np.ptp(uv @ matrix.T, axis=1) * [texture.texels.shape[1], texture.texels.shape[0]]
    level = np.repeat(np.log2(np.maximum(spread.max(axis=1), 1.0)), 4)
    values = _at_levels(texture, uv.reshape(-1, 2), level)
    return np.asarray(values.reshape(-1, 4, 3).mean(axis=1))


def _at_levels(texture: Texture, uv: Floats, level: Floats) -> Floats:
    """Values (n, 3), interpolated at uv (n, 2) within the level nearest to `level` (n,) of halved textures."""
    matrix = np.array(texture.uv_transform)
    placed = uv @ matrix[:, :2].T + matrix[:, 2]
    wanted, found = np.rint(level).astype(int), np.ones((len(uv), 3), np.float32)
    texels = np.asarray(texture.texels, np.float32)
    for number in range(int(wanted.max(initial=0)) + 1):
        last = max(texels.shape[:2]) == 1
        mine = np.flatnonzero(wanted >= number) if last else np.flatnonzero(wanted == number)
        found[mine] = _interpolated(texels, placed[mine])
        if last:
            break
        texels = halved(texels)
    return found


def _interpolated(texels: Floats, uv: Floats) -> Floats:
    """Bilinear values (n, C) of repeated texels (H, W, C), row 0 on top, at uv (n, 2)."""
    height, width = texels.shape[:2]
    x, y = (uv[:, 0] % 1) * width - 0.5, ((1 - uv[:, 1]) % 1) * height - 0.5
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    s, t = (x - column)[:, None].astype(np.float32), (y - row)[:, None].astype(np.float32)
    left, right, above, below = column % width, (column + 1) % width, row % height, (row + 1) % height
    top = (1 - s) * texels[above, left] + s * texels[above, right]
    return np.asarray((1 - t) * top + t * ((1 - s) * texels[below, left] + s * texels[below, right]))


@lru_cache(2)
def _four_directions(size: int) -> Floats:
    """(6 N N, 4, 3) directions of four rays through each texel of a probe."""
    fine = face_directions(2 * size).reshape(6, size, 2, size, 2, 3)
    return np.ascontiguousarray(np.moveaxis(fine, 2, 3).reshape(-1, 4, 3), np.float32)
