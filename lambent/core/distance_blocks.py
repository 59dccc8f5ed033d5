"""Inverse distances of a light field's maps in blocks of 4 x 4 texels, at 64 bits a block and a pool for hard blocks.

Codes are logarithms of inverse distances: code c, 1 to 255, is the share (c - 1)/254 of the way from
the least to the largest of a map, 0 the sky. A block is two numbers of 32 bits; its lowest bytes are codes a and b:

    a > b                      texel i has a - (a - b) k/7, k its three bits from bit 16 + 3 i on
    a <= b, kind (bit 16) 0    two bits from bit 32 + 2 i on: 0 is sky; 1, 2 and 3 are a, (a + b)/2 and b
    a <= b, kind 1             texels that show the sky in part: an entry of the pool has cover and a + (b - a) k/15
    a <= b, kind 2             any distances: an entry has a + (b - a) (k - 1)/254, k = 0 for the sky

Bits 18 to 31 of kinds 1 and 2 number the entry, of 128 bits. Kind 1: 64 bits of k, then 64 of `LightField.cover`, four a
texel; kind 2: 8 bits of k a texel. A map's blocks lie row by row, its entries in rows below them, two texels each; the last
texel has the bits of the logarithms, base 2, of the least and the largest. Blocks
with a mixed texel get entries first, then those whose distances are farthest off. A shader reads whole numbers alone:
every adapter can. Importing this file imports numba.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from lambent.core.light_field_tiles import BLOCK, pool_rows

LEAST_ERROR = 0.02  # in the logarithm, of a block's texels: below, it needs no entry
MOST_ERROR = 0.3  # farther off is as bad
LEAST_SPAN = 0.01  # octaves
MIXED = 100.0  # added to what is wrong with a block that has texels of both


def encoded(inverse: NDArray[Any], cover: NDArray[np.uint8] | None) -> NDArray[np.uint32]:
    """Blocks (P, h/4 + pool, w/4, 2) of inverse distances (P, h, w), 1/m, and cover.

    Without cover, texels show a surface where their inverse distance is above 0.
    """
    count, height, width = inverse.shape
    if height % BLOCK or width % BLOCK:
        raise ValueError(f"distances of shape {inverse.shape} have no whole blocks of {BLOCK} x {BLOCK} texels")
    rows, columns = height // BLOCK, width // BLOCK
    found = np.zeros((count, rows + pool_rows(rows), columns, 2), np.uint32)

    def one(p: int) -> None:
        there = np.asarray(inverse[p], np.float32)
        solid = np.isfinite(there) & (there > 0)
        bits = np.where(solid, 15 if cover is None else cover[p], 0).astype(np.uint8)
        octave = np.log2(np.where(bits > 0, there, 1.0))
        span = _span(octave[bits > 0])
        code = (1 + 254 * (octave - span[0]) / (span[1] - span[0])).clip(1, 255).astype(np.float32)
        code[bits == 0] = 0
        words = found[p].reshape(-1, 2)
        words[-1] = span.view(np.uint32)
        _encode(_in_blocks(code), _in_blocks(bits), words[:-1], float(span[1] - span[0]) / 254)

    with ThreadPoolExecutor() as pool:
        list(pool.map(one, range(count)))
    return found


def decoded(blocks: NDArray[np.uint32], rows: int) -> tuple[NDArray[np.float16], NDArray[np.uint8]]:
    """Inverse distances and cover (P, 4 rows, 4 columns) of blocks (P, rows + pool, columns, 2)."""
    count, _, columns, _ = blocks.shape
    inverse = np.zeros((count, rows * BLOCK, columns * BLOCK), np.float16)
    cover = np.zeros(inverse.shape, np.uint8)

    def one(p: int) -> None:
        words = np.ascontiguousarray(blocks[p]).reshape(-1, 2)
        code, bits = np.zeros((rows * columns, BLOCK * BLOCK), np.float32), np.zeros((rows * columns, 16), np.uint8)
        _decode(words[:-1], code, bits)
        low, high = words[-1].view(np.float32)
        found = np.exp2(low + (code - 1) * ((high - low) / 254)) * (code > 0)
        inverse[p], cover[p] = _in_rows(found, columns), _in_rows(bits, columns)

    with ThreadPoolExecutor() as pool:
        list(pool.map(one, range(count)))
    return inverse, cover


def _span(octaves: NDArray[np.float32]) -> NDArray[np.float32]:
    """Logarithms of base 2 of the least and the largest inverse distance; 0 and 1 where there is none."""
    if not octaves.size:
        return np.array([0, 1], np.float32)
    low, high = float(octaves.min()), float(octaves.max())
    return np.array([low, max(high, low + LEAST_SPAN)], np.float32)


def _in_rows(blocks: NDArray[Any], columns: int) -> NDArray[Any]:
    """(h, w) of (B, 16)."""
    return blocks.reshape(-1, columns, BLOCK, BLOCK).swapaxes(1, 2).reshape(-1, columns * BLOCK)


def _in_blocks(texels: NDArray[Any]) -> NDArray[Any]:
    """(B, 16) of (h, w)."""
    rows, columns = texels.shape[0] // BLOCK, texels.shape[1] // BLOCK
    return np.ascontiguousarray(texels.reshape(rows, BLOCK, columns, BLOCK).swapaxes(1, 2)).reshape(-1, BLOCK * BLOCK)


@numba.njit(cache=True, nogil=True)
def _ends(code: Any) -> tuple[int, int]:
    """The least and the largest code of a block's surfaces, as whole numbers that enclose them; 0, 0 of the sky."""
    low, high = 256.0, 0.0
    for i in range(16):
        if code[i] > 0:
            low, high = min(low, code[i]), max(high, code[i])
    if high == 0.0:
        return 0, 0
    return int(np.floor(low)), int(np.ceil(high))


@numba.njit(cache=True, nogil=True)
def _in_line(code: Any, low: int, high: int, words: Any) -> float:
    """Write a block without an entry; its squared error in code, each at most that of a texel without distance."""
    sky = False
    for i in range(16):
        sky |= code[i] == 0
    words[0], words[1] = np.uint32(0), np.uint32(0)
    wrong = 0.0
    if not sky and low == high:
        if high < 255:
            high += 1
        else:
            low -= 1
    bits = np.uint64(low | high << 8) if sky else np.uint64(high | low << 8)
    steps = 2 if sky else 7
    for i in range(16):
        if code[i] == 0:
            continue
        k = min(max(int((code[i] - low) * steps / max(high - low, 1) + 0.5), 0), steps)
        wrong += (low + (high - low) * k / steps - code[i]) ** 2
        if sky:
            bits |= np.uint64(k + 1) << np.uint64(32 + 2 * i)
        else:
            bits |= np.uint64(7 - k) << np.uint64(16 + 3 * i)
    words[0], words[1] = np.uint32(bits & np.uint64(0xFFFFFFFF)), np.uint32(bits >> np.uint64(32))
    return wrong


@numba.njit(cache=True, nogil=True)
def _with_entry(code: Any, cover: Any, mixed: bool, low: int, high: int, number: int, words: Any, entry: Any) -> None:
    """Write a block that has an entry (2, 2) of the pool."""
    words[0] = np.uint32(low | high << 8 | (1 if mixed else 2) << 16 | number << 18)
    words[1] = np.uint32(0)
    flat = np.zeros(4, np.uint32)
    for i in range(16):
        place = (code[i] - low) / max(high - low, 1)
        if mixed:
            k = min(max(int(place * 15 + 0.5), 0), 15) if code[i] > 0 else 0
            flat[i >> 3] |= np.uint32(k << 4 * (i & 7))
            flat[2 + (i >> 3)] |= np.uint32(int(cover[i]) << 4 * (i & 7))
        elif code[i] > 0:
            k = min(max(int(place * 254 + 0.5), 0), 254) + 1
            flat[i >> 2] |= np.uint32(k << 8 * (i & 3))
    entry[0, 0], entry[0, 1], entry[1, 0], entry[1, 1] = flat[0], flat[1], flat[2], flat[3]


@numba.njit(cache=True, nogil=True)
def _encode(code: Any, cover: Any, words: Any, octaves: float) -> None:
    """A map: codes and cover (B, 16) to words (B + pool, 2). A code more is so many octaves."""
    count = len(code)
    room = min((len(words) - count) // 2, 1 << 14)
    wrong = np.zeros(count)
    least, most = 16 * (LEAST_ERROR / (0.6931 * octaves)) ** 2, (MOST_ERROR / (0.6931 * octaves)) ** 2
    whole = np.zeros(16, np.float32)
    for b in range(count):
        mixed = False
        for i in range(16):
            mixed |= cover[b, i] != 0 and cover[b, i] != 15
            bits = (cover[b, i] & 1) + (cover[b, i] >> 1 & 1) + (cover[b, i] >> 2 & 1) + (cover[b, i] >> 3)
            whole[i] = code[b, i] if bits >= 2 else 0.0
        low, high = _ends(whole)
        error = min(_in_line(whole, low, high, words[b]), 16 * most)
        if mixed:
            wrong[b] = MIXED * most + error
        elif error > least:
            wrong[b] = error
    order = np.argsort(-wrong)
    for number in range(min(room, count)):
        b = order[number]
        if wrong[b] == 0.0:
            break
        low, high = _ends(code[b])
        at = count + 2 * number
        _with_entry(code[b], cover[b], wrong[b] >= MIXED * most, low, high, number, words[b], words[at : at + 2])


@numba.njit(cache=True, nogil=True)
def _decode(words: Any, code: Any, cover: Any) -> None:
    """Words (B + pool, 2) to codes and cover (B, 16)."""
    count = len(code)
    for b in range(count):
        first, second = int(words[b, 0]), int(words[b, 1])
        a, z = first & 255, first >> 8 & 255
        kind = 3 if a > z else first >> 16 & 3
        at = min(count + 2 * (first >> 18), len(words) - 2)
        for i in range(16):
            found, bits = 0.0, 15
            if kind == 3:
                k = (first | second << 32) >> (16 + 3 * i) & 7
                found = a - (a - z) * k / 7
            elif kind == 0:
                k = second >> 2 * i & 3
                found = a + (z - a) * (k - 1) / 2 if k else 0.0
            elif kind == 1:
                k = int(words[at, i >> 3]) >> 4 * (i & 7) & 15
                bits = int(words[at + 1, i >> 3]) >> 4 * (i & 7) & 15
                found = a + (z - a) * k / 15
            else:
                k = int(words[at + (i >> 3), i >> 2 & 1]) >> 8 * (i & 3) & 255
                found = a + (z - a) * (k - 1) / 254 if k else 0.0
            cover[b, i] = bits if found > 0 else 0
            code[b, i] = found if bits else 0.0
