"""Light compressed as unsigned BC6H: blocks of 4 x 4 texels in 128 bits (bit layout: `bc6h_format`).

Fits minimise squared errors of the bits of half floats, read as integers, so that errors are relative. Each block is
first fitted by one line through colour space. If the error exceeds ROUGH, as at edges between hues, the texels are
split by the partition that two lines fit best, and the better fit is kept. Importing this file imports numba.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from lambent.baked.light_fields.blocks.bc6h_format import (
    BITS,
    DIRECT,
    FINEST_FIRST,
    LEVELS,
    MOST_ENDS,
    OTHER_BITS,
    SECOND,
    SHARES,
    TEXELS,
    half,
    ordered,
    quantised,
    read,
    unquantised,
    write,
)

BLOCK = 4  # texels a side
LARGEST = 65504.0
ROUGH = 8.0  # rms error of one line, in steps of a half float (about .6 %), above which two lines are tried
SLACK = 48.0  # steps of a half float (3 to 5 %) by which ends may lie beyond their texels
_FITS = 3  # rounds of least squares after texels choose their colours
_MODES_TRIED = 2  # modes tried, finest first, of those that can represent the ends
_POWERS = 4  # power iterations for the principal axis
_BETWEEN = 300.0  # variance along a line over its quantisation error with 8 colours, about 6 x 7^2
_AT_ONCE = 1 << 14  # blocks per task of a thread
_ONE, _TWO = FINEST_FIRST
_WHOLE = np.zeros(TEXELS, np.int64)  # one subset


def encoded(rgb: NDArray[Any], importance: NDArray[Any] | None = None, rough: float = ROUGH) -> NDArray[np.uint32]:
    """Compress light (..., H, W, 3) into blocks (..., H/4, W/4, 4); clamp it to 0 and LARGEST, NaN becomes 0.

    Parameters
    ----------
    rgb : (..., H, W, 3)
        H and W are multiples of 4.
    importance : (..., H, W), optional
        Weights of the texels' squared errors, by default 1.
    rough : float
        Two lines are tried in blocks where the error of one exceeds this, as `ROUGH`. Infinity allows one line only and
        takes a third of the time.

    Raises
    ------
    ValueError
        If there are not 3 channels, or H or W is not a multiple of 4.
    """
    *lead, height, width, channels = rgb.shape
    if channels != 3 or height % BLOCK or width % BLOCK:
        raise ValueError(f"light of shape {rgb.shape} has no whole blocks of {BLOCK} x {BLOCK} texels")
    halves = np.clip(np.nan_to_num(rgb, nan=0.0, posinf=LARGEST), 0, LARGEST).astype(np.float16)
    counts = np.ones(rgb.shape[:-1], np.float32) if importance is None else importance.astype(np.float32)
    texels, weights = _by_block(halves.view(np.uint16)), _by_block(counts[..., None])[..., 0]
    blocks = np.zeros((len(texels), 4), np.uint32)
    _in_threads(partial(_encode, rough), texels, weights, blocks)
    return blocks.reshape(*lead, height // BLOCK, width // BLOCK, 4)


def _by_block(image: NDArray[Any]) -> NDArray[Any]:
    """(B, 16, C) of (..., H, W, C)."""
    height, width, channels = image.shape[-3:]
    texels = image.reshape(-1, height // BLOCK, BLOCK, width // BLOCK, BLOCK, channels).swapaxes(2, 3)
    return np.ascontiguousarray(texels).reshape(-1, TEXELS, channels)


def decoded(blocks: NDArray[np.uint32]) -> NDArray[np.float16]:
    """Decode blocks (..., H/4, W/4, 4) of any mode to light (..., H, W, 3); blocks of reserved modes are black."""
    *lead, rows, columns, _ = blocks.shape
    flat = np.ascontiguousarray(blocks, np.uint32).reshape(-1, 4)
    texels = np.zeros((len(flat), TEXELS, 3), np.uint16)
    _in_threads(read, flat, texels)
    light = texels.view(np.float16).reshape(-1, rows, columns, BLOCK, BLOCK, 3).swapaxes(2, 3)
    return np.ascontiguousarray(light).reshape(*lead, rows * BLOCK, columns * BLOCK, 3)


def _in_threads(work: Any, *arrays: NDArray[Any]) -> None:
    """Run `work` on parts of arrays in threads: numba's parallel loops take four times as long to compile."""
    with ThreadPoolExecutor() as pool:
        parts = [slice(first, first + _AT_ONCE) for first in range(0, len(arrays[0]), _AT_ONCE)]
        list(pool.map(lambda part: work(*(array[part] for array in arrays)), parts))


@numba.njit(cache=True, nogil=True)
def _encode(rough: float, texels: Any, importance: Any, blocks: Any) -> None:
    """Encode bits of half floats (B, 16, 3), with importance (B, 16), to blocks (B, 4)."""
    values, weights = np.zeros((TEXELS, 3)), np.zeros(TEXELS)
    ends, other_ends = np.zeros((MOST_ENDS, 3), np.int64), np.zeros((MOST_ENDS, 3), np.int64)
    index, other_index = np.zeros(TEXELS, np.int64), np.zeros(TEXELS, np.int64)
    for b in range(len(texels)):
        values[:] = texels[b]
        _weigh(values, weights)
        weights *= importance[b]
        error, mode = _fit(values, weights, _WHOLE, _ONE, 0, ends, index)
        partition = 0
        if error > rough**2 * 3 * weights.sum():
            partition, left = _best_partition(values, weights)
            if left < error:
                found, other = _fit(values, weights, SECOND[partition], _TWO, partition, other_ends, other_index)
                if found < error:
                    mode = other
                    ends[:] = other_ends
                    index[:] = other_index
        write(blocks[b], mode, partition, ends, index)


@numba.njit(cache=True, nogil=True)
def _weigh(texels: Any, weights: Any) -> None:
    """Compute weights (16,) of texels: 1 + brightness over the mean brightness of the block.

    Errors are relative: without these weights, fits to dark texels around a lamp would cost 4 % of its light.
    """
    total = 0.0
    for i in range(TEXELS):
        weights[i] = 0.0
        for c in range(3):
            bits = int(texels[i, c])
            exponent, mantissa = bits >> 10, bits & 1023
            weights[i] += mantissa * 2.0**-24 if exponent == 0 else (1024 + mantissa) * 2.0 ** (exponent - 25)
        total += weights[i]
    for i in range(TEXELS):
        weights[i] = 1 + 16 * weights[i] / max(total, 1e-30)


@numba.njit(cache=True, nogil=True)
def _best_partition(texels: Any, weights: Any) -> tuple[int, float]:
    """The partition whose subsets two lines fit best, and their approximate weighted squared error."""
    sums, whole, part = np.empty((TEXELS, 10)), np.zeros(10), np.empty(10)
    for i in range(TEXELS):
        x, y, z = texels[i, 0] - texels[0, 0], texels[i, 1] - texels[0, 1], texels[i, 2] - texels[0, 2]
        for k, value in enumerate((1.0, x, y, z, x * x, x * y, x * z, y * y, y * z, z * z)):
            sums[i, k] = weights[i] * value
            whole[k] += sums[i, k]
    best, least = 0, np.inf
    for partition in range(len(SECOND)):
        part[:] = 0
        for i in range(TEXELS):
            if SECOND[partition, i]:
                for k in range(10):
                    part[k] += sums[i, k]
        left = _off_line(part)
        for k in range(10):
            part[k] = whole[k] - part[k]
        left += _off_line(part)
        if left < least:
            best, least = partition, left
    return best, least


@numba.njit(cache=True, nogil=True)
def _off_line(sums: Any) -> float:
    """Approximate squared error of the best line of 8 colours, from sums (10,) of weights, positions and products."""
    xx, xy, xz = (
        sums[4] - sums[1] ** 2 / sums[0],
        sums[5] - sums[1] * sums[2] / sums[0],
        sums[6] - sums[1] * sums[3] / sums[0],
    )
    yy, yz, zz = (
        sums[7] - sums[2] ** 2 / sums[0],
        sums[8] - sums[2] * sums[3] / sums[0],
        sums[9] - sums[3] ** 2 / sums[0],
    )
    all_of_it = xx + yy + zz
    if xx >= max(yy, zz):
        a, b, c = xx, xy, xz
    elif yy >= zz:
        a, b, c = xy, yy, yz
    else:
        a, b, c = xz, yz, zz
    along = 0.0
    for _ in range(_POWERS):
        length = np.sqrt(a * a + b * b + c * c)
        if length < 1e-20:
            break
        a, b, c = a / length, b / length, c / length
        p, q, r = xx * a + xy * b + xz * c, xy * a + yy * b + yz * c, xz * a + yz * b + zz * c
        along = a * p + b * q + c * r
        a, b, c = p, q, r
    return float(max(all_of_it - along, 0.0) + along / _BETWEEN)


@numba.njit(cache=True, nogil=True)
def _fit(
    texels: Any, weights: Any, subset: Any, modes: Any, partition: int, ends: Any, index: Any
) -> tuple[float, int]:
    """Weighted squared error and mode of the best fit by one line per subset; makes `ends` and `index` `ordered`."""
    count = subset.max() + 1
    levels = LEVELS[count - 1]
    lines, chosen = np.zeros((MOST_ENDS, 3)), np.zeros(TEXELS, np.int64)
    now, now_index = np.zeros((MOST_ENDS, 3), np.int64), np.zeros(TEXELS, np.int64)
    best, best_mode = np.inf, -1
    for fit in range(_FITS):
        for s in range(count):
            if fit == 0:
                _principal_ends(texels, weights, subset, s, lines)
            else:
                _fitted_ends(texels, weights, subset, s, levels, chosen, lines)
            _bounded(texels, subset, s, lines)
        least, tries = np.inf, 0
        for mode in modes:
            if not _quantised_ends(lines, mode, count, now):
                continue
            error = _choose(texels, weights, subset, count, now, mode, now_index)
            if fit:
                _step_ends(texels, weights, subset, count, now, mode, now_index)
                error = _choose(texels, weights, subset, count, now, mode, now_index)
            if error < least:
                least = error
                chosen[:] = now_index
            if not ordered(mode, partition, now, now_index):
                continue
            if error < best:
                best, best_mode = error, mode
                ends[:] = now
                index[:] = now_index
            tries += 1
            if tries == _MODES_TRIED:
                break
    return best, best_mode


@numba.njit(cache=True, nogil=True)
def _choose(texels: Any, weights: Any, subset: Any, count: int, ends: Any, mode: int, index: Any) -> float:
    """Write each texel's best colour to `index`; returns the weighted squared error. `ends` (4, 3) are quantised."""
    levels, bits, total = LEVELS[count - 1], BITS[mode], 0.0
    palette = np.empty((TEXELS, 3))
    for s in range(count):
        length = 0.0
        for c in range(3):
            a, b = unquantised(ends[2 * s, c], bits), unquantised(ends[2 * s + 1, c], bits)
            for k in range(levels):
                palette[k, c] = half(a, b, SHARES[count - 1, k])
            length += (palette[levels - 1, c] - palette[0, c]) ** 2
        for i in range(TEXELS):
            if subset[i] != s:
                continue
            place = 0.0
            for c in range(3):
                place += (texels[i, c] - palette[0, c]) * (palette[levels - 1, c] - palette[0, c])
            guess = min(max(int((levels - 1) * place / max(length, 1.0) + 0.5), 0), levels - 1)
            best = np.inf
            for k in range(max(guess - 1, 0), min(guess + 2, levels)):
                error = 0.0
                for c in range(3):
                    error += (texels[i, c] - palette[k, c]) ** 2
                if error < best:
                    best, index[i] = error, k
            total += weights[i] * best
    return total


@numba.njit(cache=True, nogil=True)
def _principal_ends(texels: Any, weights: Any, subset: Any, s: int, ends: Any) -> None:
    """Set the ends of subset s in `ends` (4, 3) to its texels' extent along their principal axis."""
    mean, axis, next_axis, spread, total = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros((3, 3)), 0.0
    for i in range(TEXELS):
        if subset[i] == s:
            total += weights[i]
            for c in range(3):
                mean[c] += weights[i] * texels[i, c]
    mean /= total
    for i in range(TEXELS):
        if subset[i] == s:
            for c in range(3):
                for d in range(3):
                    spread[c, d] += weights[i] * (texels[i, c] - mean[c]) * (texels[i, d] - mean[d])
    widest = 0
    for c in range(3):
        widest = c if spread[c, c] > spread[widest, widest] else widest
    for c in range(3):
        axis[c] = spread[c, widest]
    for _ in range(_POWERS):
        length = np.sqrt(axis[0] ** 2 + axis[1] ** 2 + axis[2] ** 2)
        for c in range(3):
            axis[c] /= max(length, 1e-30)
        for c in range(3):
            next_axis[c] = spread[c, 0] * axis[0] + spread[c, 1] * axis[1] + spread[c, 2] * axis[2]
        axis, next_axis = next_axis, axis
    length = max(np.sqrt(axis[0] ** 2 + axis[1] ** 2 + axis[2] ** 2), 1e-30)
    low, high = 0.0, 0.0
    for i in range(TEXELS):
        if subset[i] == s:
            place = 0.0
            for c in range(3):
                place += (texels[i, c] - mean[c]) * axis[c] / length
            low, high = min(low, place), max(high, place)
    for c in range(3):
        ends[2 * s, c] = mean[c] + low * axis[c] / length
        ends[2 * s + 1, c] = mean[c] + high * axis[c] / length


@numba.njit(cache=True, nogil=True)
def _fitted_ends(texels: Any, weights: Any, subset: Any, s: int, levels: int, index: Any, ends: Any) -> None:
    """Fit the ends of subset s by least squares to the texels' chosen colours; no change if all chose the same."""
    aa, ab, bb = 0.0, 0.0, 0.0
    a_x, b_x = np.zeros(3), np.zeros(3)
    for i in range(TEXELS):
        if subset[i] != s:
            continue
        b = SHARES[0 if levels == TEXELS else 1, index[i]] / 64.0
        a = 1 - b
        w = weights[i]
        aa, ab, bb = aa + w * a * a, ab + w * a * b, bb + w * b * b
        for c in range(3):
            a_x[c] += w * a * texels[i, c]
            b_x[c] += w * b * texels[i, c]
    determinant = aa * bb - ab * ab
    if determinant < 1e-6:
        return
    for c in range(3):
        ends[2 * s, c] = (a_x[c] * bb - b_x[c] * ab) / determinant
        ends[2 * s + 1, c] = (b_x[c] * aa - a_x[c] * ab) / determinant


@numba.njit(cache=True, nogil=True)
def _bounded(texels: Any, subset: Any, s: int, ends: Any) -> None:
    """Clamp ends to the range of their texels: on this logarithmic scale, ends beyond it would be far brighter."""
    for c in range(3):
        low, high = _range_of(texels, subset, s, c)
        for e in range(2 * s, 2 * s + 2):
            ends[e, c] = min(max(ends[e, c], low), high)


@numba.njit(cache=True, nogil=True)
def _quantised_ends(ends: Any, mode: int, count: int, found: Any) -> bool:
    """Quantise ends to a mode's bits; returns whether the mode may represent them, with lines reversed or not."""
    for c in range(3):
        for e in range(2 * count):
            found[e, c] = quantised(ends[e, c], BITS[mode])
            if not DIRECT[mode] and abs(found[e, c] - found[0, c]) > 1 << (OTHER_BITS[mode, c] - 1):
                return False
    return True


@numba.njit(cache=True, nogil=True)
def _step_ends(texels: Any, weights: Any, subset: Any, count: int, ends: Any, mode: int, index: Any) -> None:
    """Move quantised ends by at most a step per channel to the least error for the texels' chosen colours.

    Ends may leave the range of the texels by SLACK, one or two steps of fine modes; ends of coarser modes stay inside.
    """
    bits = BITS[mode]
    for s in range(count):
        for c in range(3):
            low, high = _range_of(texels, subset, s, c)
            low, high = low - SLACK, high + SLACK
            first, last, best = ends[2 * s, c], ends[2 * s + 1, c], np.inf
            for a in range(max(first - 1, 0), min(first + 2, 1 << bits)):
                whole_a = unquantised(a, bits)
                if a != first and not low <= half(whole_a, whole_a, 0) <= high:
                    continue
                for b in range(max(last - 1, 0), min(last + 2, 1 << bits)):
                    whole_b, error = unquantised(b, bits), 0.0
                    if b != last and not low <= half(whole_b, whole_b, 0) <= high:
                        continue
                    for i in range(TEXELS):
                        if subset[i] == s:
                            shown = half(whole_a, whole_b, SHARES[count - 1, index[i]])
                            error += weights[i] * (texels[i, c] - shown) ** 2
                    if error < best:
                        best, ends[2 * s, c], ends[2 * s + 1, c] = error, a, b


@numba.njit(cache=True, nogil=True)
def _range_of(texels: Any, subset: Any, s: int, c: int) -> tuple[float, float]:
    """Least and largest value of channel c in subset s."""
    low, high = np.inf, -np.inf
    for i in range(TEXELS):
        if subset[i] == s:
            low, high = min(low, texels[i, c]), max(high, texels[i, c])
    return low, high
