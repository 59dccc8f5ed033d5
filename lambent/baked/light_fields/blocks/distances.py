"""Inverse distances of a light field's maps in blocks of 4 x 4 texels: 64 bits a block, plus a pool for hard blocks.

Codes are logarithmic: code c, 1 to 255, lies at the share (c - 1)/254 between the logarithms of a map's least and
largest inverse distance; 0 is the sky. A block is two 32-bit words; its lowest bytes are codes a and b:

    a > b      texel i has a - (a - b) k/7, k its three bits from bit 16 + 3 i on
    a <= b     two bits from bit 32 + 2 i on are the lowest of k; the kind, in bits 16 and 17, gives its meaning:
      kind 0   0 is the sky; 1, 2 and 3 are a, (a + b)/2 and b
      kind 1   a + (b - a) k/3; some texels show the sky in part, and a pool entry has their `LightField.cover`
      kind 2   any distances: an entry has four more bits of k; 0 is the sky, others are a + (b - a) (k - 1)/62
      kind 3   both: an entry with cover, and one with four more bits of k; a + (b - a) k/63

Bits 18 to 31 number the (first) entry. An entry has 64 bits, four per texel. A map's blocks lie row by row, its pool in
rows below them; the last entry holds the base-2 logarithms of the least and the largest inverse distance, as float
bits. Entries go to mixed texels first, then to the blocks of the largest distance error. A shader reads integers only,
which every adapter supports. Importing this file imports numba.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from lambent.baked.light_fields.blocks.tiles import BLOCK, pool_rows

LEAST_ERROR = 0.02  # of a block's texels, in the logarithm: below it, a block needs no entry
MOST_ERROR = 0.3  # larger errors count as this
LEAST_SPAN = 0.01  # octaves
MOST_ENTRIES = 1 << 14


def encoded(inverse: NDArray[Any], cover: NDArray[np.uint8] | None) -> NDArray[np.uint32]:
    """Blocks (P, h/4 + pool, w/4, 2) of inverse distances (P, h, w), 1/m, and cover (P, h, w).

    Without cover, texels with an inverse distance above 0 show a surface.

    Raises
    ------
    ValueError
        If h or w is not a multiple of 4.
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
    """Base-2 logarithms of the least and the largest inverse distance; 0 and 1 if nothing is hit."""
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
    """Least and largest code of a block's surfaces, rounded outwards to integers; 0, 0 for sky alone."""
    low, high = 256.0, 0.0
    for i in range(16):
        if code[i] > 0:
            low, high = min(low, code[i]), max(high, code[i])
    if high == 0.0:
        return 0, 0
    return int(np.floor(low)), int(np.ceil(high))


@numba.njit(cache=True, nogil=True)
def _error(code: Any, low: int, high: int, steps: int, most: float) -> float:
    """Squared error of a block's surfaces with `steps` steps between two codes, at most `most` a texel."""
    wrong = 0.0
    for i in range(16):
        if code[i] > 0:
            k = _step(code[i], low, high, steps)
            wrong += min((low + (high - low) * k / steps - code[i]) ** 2, most)
    return wrong


@numba.njit(cache=True, nogil=True)
def _step(code: float, low: int, high: int, steps: int) -> int:
    return min(max(int((code - low) * steps / max(high - low, 1) + 0.5), 0), steps)


@numba.njit(cache=True, nogil=True)
def _put_in_line(code: Any, low: int, high: int, words: Any) -> None:
    """Write a block without an entry."""
    sky = False
    for i in range(16):
        sky |= code[i] == 0
    if not sky and low == high:
        if high < 255:
            high += 1
        else:
            low -= 1
    bits = np.uint64(low | high << 8) if sky else np.uint64(high | low << 8)
    for i in range(16):
        if sky:
            k = _step(code[i], low, high, 2) + 1 if code[i] > 0 else 0
            bits |= np.uint64(k) << np.uint64(32 + 2 * i)
        else:
            bits |= np.uint64(7 - _step(code[i], low, high, 7)) << np.uint64(16 + 3 * i)
    words[0], words[1] = np.uint32(bits & np.uint64(0xFFFFFFFF)), np.uint32(bits >> np.uint64(32))


@numba.njit(cache=True, nogil=True)
def _put_with_entries(code: Any, cover: Any, kind: int, low: int, high: int, number: int, words: Any) -> None:
    """Write a block (words 0) and its entries (words 1 and 2), of a kind that has entries."""
    block = np.zeros((3, 2), np.uint32)
    block[0, 0] = np.uint32(low | high << 8 | kind << 16 | number << 18)
    of_cover, of_code = (1, 2) if kind == 3 else (1, 1)
    for i in range(16):
        k = 0
        if code[i] > 0:
            k = _step(code[i], low, high, 62) + 1 if kind == 2 else _step(code[i], low, high, 3 if kind == 1 else 63)
        block[0, 1] |= np.uint32((k & 3) << 2 * i)
        if kind != 2:
            block[of_cover, i >> 3] |= np.uint32(int(cover[i]) << 4 * (i & 7))
        if kind != 1:
            block[of_code, i >> 3] |= np.uint32((k >> 2) << 4 * (i & 7))
    for row in range(3):
        words[row, 0], words[row, 1] = block[row, 0], block[row, 1]


@numba.njit(cache=True, nogil=True)
def _whole(code: Any, cover: Any, whole: Any) -> bool:
    """Codes of texels as sky or surface, by the majority of their quarters; returns whether any texel is mixed."""
    mixed = False
    for i in range(16):
        mixed |= cover[i] != 0 and cover[i] != 15
        bits = (cover[i] & 1) + (cover[i] >> 1 & 1) + (cover[i] >> 2 & 1) + (cover[i] >> 3)
        whole[i] = code[i] if bits >= 2 else 0.0
    return mixed


@numba.njit(cache=True, nogil=True)
def _encode(code: Any, cover: Any, words: Any, octaves: float) -> None:
    """Encode a map: codes and cover (B, 16) to words (B + pool, 2). One code step is `octaves` octaves."""
    count = len(code)
    room = min(len(words) - count, MOST_ENTRIES)
    least, most = 16 * (LEAST_ERROR / (0.6931 * octaves)) ** 2, (MOST_ERROR / (0.6931 * octaves)) ** 2
    gain, kind, mixed = np.zeros(count), np.zeros(count, np.int64), np.zeros(count, np.bool_)
    whole = np.zeros(16, np.float32)
    for b in range(count):
        mixed[b] = _whole(code[b], cover[b], whole)
        low, high = _ends(code[b])
        sky = (whole == 0).any()
        gain[b] = _error(code[b], low, high, 3, most) if mixed[b] else _error(whole, low, high, 2 if sky else 7, most)
    order = np.argsort(-gain)
    for turn in range(2):  # cover, then distances
        for b in order:
            fits = mixed[b] if turn == 0 else gain[b] > least and (kind[b] == 1 or not mixed[b])
            if fits and room > 0:
                kind[b] += 1 if turn == 0 else 2
                room -= 1
    number = 0
    for b in range(count):
        taken = np.zeros((3, 2), np.uint32)
        if kind[b]:
            low, high = _ends(code[b])
            _put_with_entries(code[b], cover[b], kind[b], low, high, number, taken)
        else:
            _whole(code[b], cover[b], whole)
            low, high = _ends(whole)
            _put_in_line(whole, low, high, taken[0])
        words[b] = taken[0]
        for k in range(2 if kind[b] == 3 else min(kind[b], 1)):
            words[count + number] = taken[1 + k]
            number += 1


@numba.njit(cache=True, nogil=True)
def _decode(words: Any, code: Any, cover: Any) -> None:
    """Decode words (B + pool, 2) to codes and cover (B, 16)."""
    count = len(code)
    for b in range(count):
        first, second = int(words[b, 0]), int(words[b, 1])
        a, z = first & 255, first >> 8 & 255
        kind = first >> 16 & 3
        at = min(count + (first >> 18), len(words) - (2 if kind == 3 else 1))
        for i in range(16):
            found, bits, k = 0.0, 15, second >> 2 * i & 3
            if a > z:
                found = a - (a - z) * ((first | second << 32) >> (16 + 3 * i) & 7) / 7
            elif kind == 0:
                found = a + (z - a) * (k - 1) / 2 if k else 0.0
            else:
                if kind != 2:
                    bits = int(words[at, i >> 3]) >> 4 * (i & 7) & 15
                if kind != 1:
                    k |= (int(words[at + kind - 2, i >> 3]) >> 4 * (i & 7) & 15) << 2
                if kind == 2:
                    found = a + (z - a) * (k - 1) / 62 if k else 0.0
                else:
                    found = a + (z - a) * k / (3 if kind == 1 else 63)
            cover[b, i] = bits if found > 0 else 0
            code[b, i] = found if bits else 0.0
