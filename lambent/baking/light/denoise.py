"""Filling and denoising of light maps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.light.colour import luminance

RINGS = 16  # texels grown into gutters; look-ups reach no farther
CONTRAST = 8.0  # brightness ratio at which the filter carries a neighbour's light across a gutter
NEAR = 6  # texels that the filter reaches
LAYERS = 4
BLOCK = 64  # texels: size of the blocks in which regions are cut out for denoising, with neighbouring blocks
MOST = 0.7  # share of a map above which it is denoised whole
RIM = 32  # texels mirrored at the borders, where the filter otherwise errs by up to 20 %
# Texels darker than DARK times a map's geometric mean are filtered with that mean brought to EXPOSED. The filter's own
# exposure lets them vanish in its rounding: beside light 1,000 times as bright they turn colourful. The squared error
# of the darkest tenth falls by a tenth in two rooms, that of a map half in the dark by half.
EXPOSED, DARK = 100.0, 0.1


def fill(values: Floats, known: Flags, labels: Indices, *, smooth: int = 0) -> Floats:
    """Grow known texels into unknown ones: (H, W, C) without black texels.

    Parameters
    ----------
    known : (H, W) bool
        Texels with a valid value.
    labels : (H, W) int
        Chart of each texel, -1 in gutters. An unknown texel within a chart takes values from its own chart first: the
        wall behind a cupboard is not filled from its neighbours in the map.
    smooth : int
        Rounds of averaging with neighbours before texels grow: noise that has grown becomes streaks, which no denoiser
        recognises as noise.
    """
    if not known.any():
        return np.zeros_like(values)
    h, w, channels = values.shape
    chart = np.pad(labels, 1, constant_values=-1).reshape(-1)
    grown = _Grown(np.pad(np.where(known[..., None], values, 0.0), ((1, 1), (1, 1), (0, 0))), np.pad(known, 1))
    grown.smooth(chart, smooth)
    while grown.ring(chart):
        pass
    grown.start()
    for _ in range(RINGS):
        grown.ring(None)
    filled = grown.values.reshape(h + 2, w + 2, channels)[1:-1, 1:-1]
    left = ~grown.known.reshape(h + 2, w + 2)[1:-1, 1:-1]
    filled[left] = values[known].mean(axis=0)
    return np.where(known[..., None], values, filled)


class _Grown:
    """A map with a border of one texel, as flat arrays, that grows ring by ring from its known texels."""

    def __init__(self, values: Floats, known: Flags) -> None:
        height, width = known.shape
        self.values, self.known = values.reshape(height * width, -1), known.reshape(-1).copy()
        self.steps = np.array([r * width + c for r in (-1, 0, 1) for c in (-1, 0, 1) if (r, c) != (0, 0)])
        inner = np.zeros((height, width), bool)
        inner[1:-1, 1:-1] = True
        self.inner = inner.reshape(-1)
        self.start()

    def start(self) -> None:
        """Restart growth from all known texels, after the charts passed to `ring` have changed."""
        self._front = np.flatnonzero(self.known)

    def smooth(self, chart: Indices, times: int) -> None:
        """Replace every known texel by the mean of itself and the known texels of its chart around it."""
        from scipy.sparse import csr_matrix

        target = np.flatnonzero(self.known)
        if not times or not len(target):
            return
        near = target[:, None] + np.append(self.steps, 0)
        same = self.known[near] & (chart[near] == chart[target][:, None])
        place = np.zeros(len(self.known), np.int32)
        place[target] = np.arange(len(target))
        count = same.sum(axis=1)
        around = csr_matrix(
            (np.ones(count.sum(), self.values.dtype), place[near[same]], np.append(0, np.cumsum(count))),
            shape=(len(target), len(target)),
        )
        mean = self.values[target]
        for _ in range(times):
            mean = (around @ mean) / count[:, None].astype(mean.dtype)
        self.values[target] = mean

    def ring(self, chart: Indices | None) -> bool:
        """Fill unknown texels next to known ones (of their own chart, with `chart`) with the mean of those."""
        reached = np.zeros(len(self.known), bool)
        reached[self._front[:, None] + self.steps] = True
        target = np.flatnonzero(reached & self.inner & ~self.known & (True if chart is None else chart >= 0))
        near = target[:, None] + self.steps
        counts = self.known[near]
        if chart is not None:
            counts &= chart[near] == chart[target][:, None]
        new = counts.any(axis=1)
        near, counts, target = near[new], counts[new], target[new]
        total = (self.values[near] * counts[..., None]).sum(axis=1)
        self.values[target] = total / counts.sum(axis=1)[:, None]
        self.known[target] = True
        self._front = target
        return bool(len(target))


def denoise(irradiance: Floats) -> Floats:
    """Denoise a light map (H, W, 3) without gutters by Open Image Denoise's light map filter, at two exposures."""
    import pyoidn

    if not irradiance.any():
        return irradiance  # the filter would amplify its own rounding errors
    images = {pyoidn.OIDN_IMAGE_COLOR: np.pad(irradiance, ((RIM, RIM), (RIM, RIM), (0, 0)), mode="symmetric")}
    light = luminance(np.asarray(irradiance, np.float64))
    mean = float(np.exp(np.log(light[light > 0]).mean()))
    bright, dark = (
        _filtered(pyoidn.OIDN_FILTER_TYPE_RT_LIGHTMAP, images, scale=scale)[RIM:-RIM, RIM:-RIM]
        for scale in (None, EXPOSED / mean)
    )
    share = 1 / (1 + (luminance(np.asarray(dark, np.float64)) / (DARK * mean)) ** 2)  # squares exceed 32 bits
    return bright + share[..., None] * (dark - bright)


def denoise_image(radiance: Floats, albedo: Floats, normal: Floats, *, fast: bool = False) -> Floats:
    """Denoise an image (H, W, 3) of radiance by Open Image Denoise, guided by albedo and normals.

    `fast` takes half the time, for pictures that are soon replaced.
    """
    import pyoidn

    if not radiance.any():
        return radiance  # as in `denoise`
    images = {
        pyoidn.OIDN_IMAGE_COLOR: radiance,
        pyoidn.OIDN_IMAGE_ALBEDO: albedo,
        pyoidn.OIDN_IMAGE_NORMAL: normal,
    }
    quality = pyoidn.OIDN_QUALITY_FAST if fast else pyoidn.OIDN_QUALITY_HIGH
    return _filtered(pyoidn.OIDN_FILTER_TYPE_RT, images, quality=quality, hdr=True)


def _filtered(
    kind: str, images: Mapping[str, Floats], quality: int | None = None, scale: float | None = None, **options: bool
) -> Floats:
    """The output (H, W, 3) of an Open Image Denoise filter, clamped at 0; without a `scale`, at its own exposure."""
    import pyoidn

    inputs = {name: np.ascontiguousarray(image, np.float32) for name, image in images.items()}
    clean = inputs[pyoidn.OIDN_IMAGE_OUTPUT] = np.zeros_like(inputs[pyoidn.OIDN_IMAGE_COLOR])
    with pyoidn.Device() as device:
        device.commit()
        with pyoidn.Filter(device, kind) as one:
            for name, image in inputs.items():
                one.set_image(name, image, pyoidn.OIDN_FORMAT_FLOAT3)
            for name, value in options.items():
                one.set_bool(name, value)
            if quality is not None:
                one.set_int("quality", quality)
            if scale is not None:
                one.set_float("inputScale", scale)
            one.commit()
            one.execute()
        error = device.get_error()
        if error is not None:
            raise RuntimeError(f"denoising failed: {error}")
    return np.maximum(clean, 0.0)


def _denoise_around(irradiance: Floats, wanted: Flags) -> Floats:
    """`denoise` the wanted texels (H, W) together with their surroundings; all others are unchanged."""
    from scipy.ndimage import binary_dilation, find_objects, label

    height, width = wanted.shape
    down, across = -(-height // BLOCK), -(-width // BLOCK)
    padded = np.zeros((down * BLOCK, across * BLOCK), bool)
    padded[:height, :width] = wanted
    blocks = padded.reshape(down, BLOCK, across, BLOCK).any(axis=(1, 3))
    around = binary_dilation(blocks, np.ones((3, 3), bool))
    boxes = [
        tuple(slice(side.start * BLOCK, side.stop * BLOCK) for side in box)
        for box in find_objects(label(around, np.ones((3, 3), int))[0])
    ]
    if sum(irradiance[box].shape[0] * irradiance[box].shape[1] for box in boxes) > MOST * wanted.size:
        return denoise(irradiance)
    clean = irradiance.copy()
    for box in boxes:
        clean[box] = denoise(irradiance[box])
    return clean


def denoise_charts(irradiance: Floats, known: Flags, labels: Indices, *, smooth: int = 0) -> Floats:
    """Fill and denoise a light map (H, W, 3) without carrying light from one chart into another.

    The filter ignores charts: light CONTRAST times as bright reaches across the gutter. Charts next to such light are
    denoised in separate layers, each filled as if the other charts did not exist.
    """
    layer = layers_of(irradiance, known, labels)
    clean = np.zeros_like(irradiance)
    for number in range(max(1, int(layer.max()) + 1)):
        mine = layer == number
        part = _denoise_around(fill(irradiance, known & mine, np.where(mine, labels, -1), smooth=smooth), known & mine)
        clean = np.where(mine[..., None] | ((layer < 0) & (number == 0))[..., None], part, clean)
    return clean


def layers_of(irradiance: Floats, known: Flags, labels: Indices) -> Indices:
    """Layer (H, W) of each texel, -1 in gutters: nearby charts whose light differs much are in different layers.

    The light of two charts is compared as means over their texels within NEAR texels of each other.
    """
    light = np.where(known, luminance(irradiance), 0.0)
    pairs, totals = [], []
    for step in range(1, NEAR + 1):
        for rows, columns in ((0, step), (step, 0), (step, step), (step, -step)):
            here, there = _shifted(labels, rows, columns)
            chosen = (here != there) & (here >= 0) & (there >= 0)
            chosen &= np.logical_and(*_shifted(known, rows, columns))
            lights = [a[chosen] for a in _shifted(light, rows, columns)]
            couple = np.stack([here[chosen], there[chosen]], axis=-1)
            order = np.argsort(couple, axis=1)
            pairs.append(np.take_along_axis(couple, order, axis=1))
            totals.append(np.take_along_axis(np.stack(lights, axis=-1), order, axis=1))
    couples, number = np.unique(np.concatenate(pairs), axis=0, return_inverse=True)
    one, other = (np.bincount(number.reshape(-1), total, len(couples)) for total in np.concatenate(totals).T)
    apart = couples[np.maximum(one, other) > CONTRAST * np.minimum(one, other)]
    return _coloured(labels, apart)


def _shifted(array: NDArray[Any], rows: int, columns: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Two views of equal shape: each texel, and the texel offset by (rows, columns)."""
    height, width = array.shape
    here = array[: height - rows, max(0, -columns) : width - max(0, columns)]
    return here, array[rows:, max(0, columns) : width + min(0, columns)]


def _coloured(labels: Indices, apart: Indices) -> Indices:
    """Layers in which no pair of charts `apart` (n, 2) shares one, as far as LAYERS suffice."""
    others: dict[int, list[int]] = {}
    for a, b in apart.tolist():
        others.setdefault(a, []).append(b)
        others.setdefault(b, []).append(a)
    layer: dict[int, int] = {}
    for chart in sorted(others, key=lambda c: (-len(others[c]), c)):
        taken = {layer.get(other) for other in others[chart]}
        layer[chart] = next((k for k in range(LAYERS) if k not in taken), LAYERS - 1)
    result = np.where(labels >= 0, 0, -1)
    if layer:
        names = np.array(sorted(layer))
        place = np.searchsorted(names, labels).clip(0, len(names) - 1)
        numbers = np.array([layer[int(c)] for c in names])[place]
        result = np.where(names[place] == labels, numbers, result)
    return result
