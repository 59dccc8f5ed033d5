"""Light compressed as BC6H: unsigned, blocks of 4 x 4 texels in 128 bits, the modes with one subset (11 to 14).

A block stores two colours, and for each texel one of 16 colours on the line between them. Channels are half floats
read as integers: lines are then nearly straight in the logarithm, and errors relative. Modes differ in how they split
60 bits between the first colour and the second:

    mode (number)   bits of the first   of the second
    11 (3)          10                  10, as it is
    12 (7)          11                  9, as a difference
    13 (11)         12                  8, as a difference
    14 (15)         16                  4, as a difference

Format: Direct3D 11.3 functional specification, 19.5.14; Khronos data format specification, 1.3, chapter 20.2. The modes
with two subsets are neither written nor read. Importing this file imports numba.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

BLOCK = 4  # texels a side
LARGEST = 65504.0
_WEIGHTS = np.array([0, 4, 9, 13, 17, 21, 26, 30, 34, 38, 43, 47, 51, 55, 60, 64], np.int64)
_MODES = np.array([[3, 10, 10], [7, 11, 9], [11, 12, 8], [15, 16, 4]], np.int64)  # number, bits of both colours
_FITS = 3  # rounds of fitting the line to the texels' indices
_POWERS = 4  # power iterations towards the principal axis
_AT_ONCE = 1 << 16  # blocks that a thread takes at a time


def encoded(rgb: NDArray[Any]) -> NDArray[np.uint32]:
    """Compress light (..., H, W, 3) to blocks (..., H/4, W/4, 4); negative values and NaN become 0.

    Raises
    ------
    ValueError
        If H or W is not a multiple of 4, or there are not three channels.
    """
    *lead, height, width, channels = rgb.shape
    if channels != 3 or height % BLOCK or width % BLOCK:
        raise ValueError(f"light of shape {rgb.shape} has no whole blocks of {BLOCK} x {BLOCK} texels")
    halves = np.clip(np.nan_to_num(rgb, nan=0.0, posinf=LARGEST), 0, LARGEST).astype(np.float16)
    rows, columns = height // BLOCK, width // BLOCK
    texels = halves.view(np.uint16).reshape(-1, rows, BLOCK, columns, BLOCK, 3).swapaxes(2, 3)
    flat = np.ascontiguousarray(texels).reshape(-1, BLOCK * BLOCK, 3)
    blocks = np.zeros((len(flat), 4), np.uint32)
    _in_threads(_encode, flat, blocks)
    return blocks.reshape(*lead, rows, columns, 4)


def decoded(blocks: NDArray[np.uint32]) -> NDArray[np.float16]:
    """Light (..., H, W, 3) of blocks (..., H/4, W/4, 4).

    Raises
    ------
    ValueError
        If a block has a mode that `encoded` does not write.
    """
    *lead, rows, columns, _ = blocks.shape
    flat = np.ascontiguousarray(blocks, np.uint32).reshape(-1, 4)
    texels = np.zeros((len(flat), BLOCK * BLOCK, 3), np.uint16)
    if not np.isin(flat[:, 0] & 31, _MODES[:, 0]).all():
        raise ValueError("blocks of BC6H with two subsets are not read")
    _in_threads(_decode, flat, texels)
    light = texels.view(np.float16).reshape(-1, rows, columns, BLOCK, BLOCK, 3).swapaxes(2, 3)
    return np.ascontiguousarray(light).reshape(*lead, rows * BLOCK, columns * BLOCK, 3)


def _in_threads(work: Any, given: NDArray[Any], made: NDArray[Any]) -> None:
    """Run `work` on parts of both arrays in threads; numba's parallel loops take four times as long to compile."""
    with ThreadPoolExecutor() as pool:
        parts = [slice(first, first + _AT_ONCE) for first in range(0, len(given), _AT_ONCE)]
        list(pool.map(lambda part: work(given[part], made[part]), parts))


@numba.njit(cache=True, nogil=True)
def _unquantised(value: int, bits: int) -> int:
    """Expand a channel of `bits` bits to the 16-bit scale."""
    if bits >= 15 or value == 0:
        return value
    if value == (1 << bits) - 1:
        return 0xFFFF
    return ((value << 16) + 0x8000) >> bits


@numba.njit(cache=True, nogil=True)
def _half(a: int, b: int, weight: int) -> int:
    """Bits of the half float interpolated between two channels on the 16-bit scale."""
    return (((a * (64 - weight) + b * weight + 32) >> 6) * 31) >> 6


@numba.njit(cache=True, nogil=True)
def _quantised(value: float, bits: int) -> int:
    """The channel of `bits` bits nearest to the bits of a half float."""
    return min(max(int(value * (64.0 / 31.0)) >> (16 - bits), 0), (1 << bits) - 1)


@numba.njit(cache=True, nogil=True)
def _weigh(texels: Any, weights: Any) -> None:
    """Weights (16,) of texels: 1, and more for texels brighter than the mean.

    Errors are relative: without weights, dark texels around a lamp would take 4 % of its light.
    """
    total = 0.0
    for i in range(16):
        weights[i] = 0.0
        for c in range(3):
            bits = int(texels[i, c])
            exponent, mantissa = bits >> 10, bits & 1023
            weights[i] += mantissa * 2.0**-24 if exponent == 0 else (1024 + mantissa) * 2.0 ** (exponent - 25)
        total += weights[i]
    for i in range(16):
        weights[i] = 1 + 16 * weights[i] / max(total, 1e-30)


@numba.njit(cache=True, nogil=True)
def _chosen(texels: Any, weights: Any, ends: Any, bits: int, index: Any) -> float:
    """Write the best colour of each texel to `index`; returns the weighted squared error. `ends` (2, 3): quantised."""
    total = 0.0
    palette = np.empty((16, 3), np.int64)
    for c in range(3):
        a, b = _unquantised(ends[0, c], bits), _unquantised(ends[1, c], bits)
        for k in range(16):
            palette[k, c] = _half(a, b, _WEIGHTS[k])
    length = 0.0
    for c in range(3):
        length += float(palette[15, c] - palette[0, c]) ** 2
    for i in range(16):
        place = 0.0
        for c in range(3):
            place += (texels[i, c] - palette[0, c]) * (palette[15, c] - palette[0, c])
        guess = min(max(int(15 * place / max(length, 1.0) + 0.5), 0), 15)
        best = np.inf
        for k in range(max(guess - 1, 0), min(guess + 2, 16)):
            error = 0.0
            for c in range(3):
                error += float(texels[i, c] - palette[k, c]) ** 2
            if error < best:
                best, index[i] = error, k
        total += weights[i] * best
    return total


@numba.njit(cache=True, nogil=True)
def _principal_ends(texels: Any, weights: Any, ends: Any) -> None:
    """Ends (2, 3) of the texels' extent along their principal axis."""
    mean, axis, next_axis, spread = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros((3, 3))
    for i in range(16):
        for c in range(3):
            mean[c] += weights[i] * texels[i, c] / weights.sum()
    for i in range(16):
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
    for i in range(16):
        place = 0.0
        for c in range(3):
            place += (texels[i, c] - mean[c]) * axis[c] / length
        low, high = min(low, place), max(high, place)
    for c in range(3):
        ends[0, c] = mean[c] + low * axis[c] / length
        ends[1, c] = mean[c] + high * axis[c] / length


@numba.njit(cache=True, nogil=True)
def _fitted_ends(texels: Any, weights: Any, index: Any, ends: Any) -> None:
    """Fit the ends to the texels in least squares for the chosen indices; unchanged if all texels chose one index."""
    aa, ab, bb = 0.0, 0.0, 0.0
    a_x, b_x = np.zeros(3), np.zeros(3)
    for i in range(16):
        b = _WEIGHTS[index[i]] / 64.0
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
        ends[0, c] = (a_x[c] * bb - b_x[c] * ab) / determinant
        ends[1, c] = (b_x[c] * aa - a_x[c] * ab) / determinant


@numba.njit(cache=True, nogil=True)
def _bounded(texels: Any, ends: Any) -> None:
    """Clamp the ends to the range of the texels: on this scale, anything beyond is brighter by powers of two."""
    for c in range(3):
        low, high = texels[0, c], texels[0, c]
        for i in range(1, 16):
            low, high = min(low, texels[i, c]), max(high, texels[i, c])
        for e in range(2):
            ends[e, c] = min(max(ends[e, c], low), high)


@numba.njit(cache=True, nogil=True)
def _quantised_ends(ends: Any, mode: Any, found: Any) -> bool:
    """Quantise both ends to a mode's bits; returns whether the mode can hold them."""
    bits, second = mode[1], mode[2]
    most = (1 << (second - 1)) - 1
    for c in range(3):
        found[0, c], found[1, c] = _quantised(ends[0, c], bits), _quantised(ends[1, c], bits)
        if mode[0] != 3 and abs(found[1, c] - found[0, c]) > most:
            return False
    return True


@numba.njit(cache=True, nogil=True)
def _put(block: Any, at: int, value: int, count: int) -> int:
    """Write `count` bits at bit `at`; returns the bit after."""
    for i in range(count):
        if value >> i & 1:
            block[(at + i) >> 5] |= np.uint32(1 << ((at + i) & 31))
    return at + count


@numba.njit(cache=True, nogil=True)
def _get(block: Any, at: int, count: int) -> int:
    value = 0
    for i in range(count):
        value |= int(block[(at + i) >> 5] >> np.uint32((at + i) & 31) & np.uint32(1)) << i
    return value


@numba.njit(cache=True, nogil=True)
def _write(block: Any, mode: Any, ends: Any, index: Any) -> None:
    """Write a block from ends (2, 3) and indices (16,)."""
    bits, second = mode[1], mode[2]
    swapped = index[0] >= 8  # the first index has no highest bit
    first, last = (1, 0) if swapped else (0, 1)
    at = _put(block, 0, mode[0], 5)
    for c in range(3):
        at = _put(block, at, ends[first, c] & 1023, 10)
    for c in range(3):
        value = ends[last, c] - (0 if mode[0] == 3 else ends[first, c])
        at = _put(block, at, value & ((1 << second) - 1), second)
        for i in range(bits - 1, 9, -1):  # high bits of the first colour, in descending order
            at = _put(block, at, ends[first, c] >> i & 1, 1)
    for i in range(16):
        at = _put(block, at, 15 - index[i] if swapped else index[i], 3 if i == 0 else 4)


@numba.njit(cache=True, nogil=True)
def _encode(texels: Any, blocks: Any) -> None:
    """Encode bits of half floats (B, 16, 3) into blocks (B, 4)."""
    values, weights = np.zeros((16, 3)), np.zeros(16)
    for b in range(len(texels)):
        for i in range(16):
            for c in range(3):
                values[i, c] = texels[b, i, c]
        ends = np.zeros((2, 3))
        found, best_ends = np.zeros((2, 3), np.int64), np.zeros((2, 3), np.int64)
        index, best_index = np.zeros(16, np.int64), np.zeros(16, np.int64)
        best, best_mode = np.inf, 0
        _weigh(values, weights)
        _principal_ends(values, weights, ends)
        for fit in range(_FITS):
            if fit:
                _fitted_ends(values, weights, best_index, ends)
            _bounded(values, ends)
            for m in range(4):
                if not _quantised_ends(ends, _MODES[m], found):
                    break
                error = _chosen(values, weights, found, _MODES[m, 1], index)
                if error < best:
                    best, best_mode = error, m
                    for c in range(3):
                        best_ends[0, c], best_ends[1, c] = found[0, c], found[1, c]
                    for i in range(16):
                        best_index[i] = index[i]
        _write(blocks[b], _MODES[best_mode], best_ends, best_index)


@numba.njit(cache=True, nogil=True)
def _decode(blocks: Any, texels: Any) -> None:
    """Decode blocks (B, 4) into bits of half floats (B, 16, 3)."""
    for b in range(len(blocks)):
        block = blocks[b]
        m = int(block[0] & np.uint32(31)) >> 2
        bits, second = _MODES[m, 1], _MODES[m, 2]
        ends = np.zeros((2, 3), np.int64)
        for c in range(3):
            ends[0, c] = _get(block, 5 + 10 * c, 10)
        at = 35
        for c in range(3):
            value = _get(block, at, second)
            at += second
            for i in range(bits - 1, 9, -1):
                ends[0, c] |= _get(block, at, 1) << i
                at += 1
            if m:
                value = ends[0, c] + (value - (1 << second) if value >> (second - 1) else value)
            ends[1, c] = value & ((1 << bits) - 1)
        for i in range(16):
            k = _get(block, at, 3 if i == 0 else 4)
            at += 3 if i == 0 else 4
            for c in range(3):
                a, z = _unquantised(ends[0, c], bits), _unquantised(ends[1, c], bits)
                texels[b, i, c] = _half(a, z, _WEIGHTS[k])
