"""Bit layout of unsigned BC6H blocks: 4 x 4 texels in 128 bits, all 14 modes. Importing this file imports numba.

A block has one or two subsets of texels. A subset has two end colours, and an index per texel that selects one of 16
colours on the line between them, or of 8 with two subsets. Ends are bits of half floats, read as integers, so lines are
nearly straight in the logarithm. A mode fixes the bits of the first end and of the other ends' differences from it. One
of 32 partitions selects the texels of the second subset.

Format: Direct3D 11.3 functional specification, 19.5.14; Khronos data format specification, 1.3, chapter 20.2.
"""

from __future__ import annotations

import re
from typing import Any

import numba
import numpy as np

TEXELS = 16
MOST_ENDS = 4
_CHANNELS, _ENDS = "rgb", "wxyz"
# Mode number; bits of the number, of the first end, and of the other ends in r, g, b; then the header after the number:
# channel, end and bit, or all bits from 0 on.
_MODES = (
    (0, 2, 10, (5, 5, 5),
     "gy4 by4 bz4 rw9:0 gw9:0 bw9:0 rx4:0 gz4 gy3:0 gx4:0 bz0 gz3:0 bx4:0 bz1 by3:0 ry4:0 bz2 rz4:0 bz3"),
    (1, 2, 7, (6, 6, 6),
     "gy5 gz4 gz5 rw6:0 bz0 bz1 by4 gw6:0 by5 bz2 gy4 bw6:0 bz3 bz5 bz4 rx5:0"
     " gy3:0 gx5:0 gz3:0 bx5:0 by3:0 ry5:0 rz5:0"),
    (2, 5, 11, (5, 4, 4),
     "rw9:0 gw9:0 bw9:0 rx4:0 rw10 gy3:0 gx3:0 gw10 bz0 gz3:0 bx3:0 bw10 bz1 by3:0 ry4:0 bz2 rz4:0 bz3"),
    (6, 5, 11, (4, 5, 4),
     "rw9:0 gw9:0 bw9:0 rx3:0 rw10 gz4 gy3:0 gx4:0 gw10 gz3:0 bx3:0 bw10 bz1 by3:0 ry3:0 bz0 bz2 rz3:0 gy4 bz3"),
    (10, 5, 11, (4, 4, 5),
     "rw9:0 gw9:0 bw9:0 rx3:0 rw10 by4 gy3:0 gx3:0 gw10 bz0 gz3:0 bx4:0 bw10 by3:0 ry3:0 bz1 bz2 rz3:0 bz4 bz3"),
    (14, 5, 9, (5, 5, 5),
     "rw8:0 by4 gw8:0 gy4 bw8:0 bz4 rx4:0 gz4 gy3:0 gx4:0 bz0 gz3:0 bx4:0 bz1 by3:0 ry4:0 bz2 rz4:0 bz3"),
    (18, 5, 8, (6, 5, 5),
     "rw7:0 gz4 by4 gw7:0 bz2 gy4 bw7:0 bz3 bz4 rx5:0 gy3:0 gx4:0 bz0 gz3:0 bx4:0 bz1 by3:0 ry5:0 rz5:0"),
    (22, 5, 8, (5, 6, 5),
     "rw7:0 bz0 by4 gw7:0 gy5 gy4 bw7:0 gz5 bz4 rx4:0 gz4 gy3:0 gx5:0 gz3:0 bx4:0 bz1 by3:0 ry4:0 bz2 rz4:0 bz3"),
    (26, 5, 8, (5, 5, 6),
     "rw7:0 bz1 by4 gw7:0 by5 gy4 bw7:0 bz5 bz4 rx4:0 gz4 gy3:0 gx4:0 bz0 gz3:0 bx5:0 by3:0 ry4:0 bz2 rz4:0 bz3"),
    (30, 5, 6, (6, 6, 6),
     "rw5:0 gz4 bz0 bz1 by4 gw5:0 gy5 by5 bz2 gy4 bw5:0 gz5 bz3 bz5 bz4 rx5:0"
     " gy3:0 gx5:0 gz3:0 bx5:0 by3:0 ry5:0 rz5:0"),
    (3, 5, 10, (10, 10, 10), "rw9:0 gw9:0 bw9:0 rx9:0 gx9:0 bx9:0"),
    (7, 5, 11, (9, 9, 9), "rw9:0 gw9:0 bw9:0 rx8:0 rw10 gx8:0 gw10 bx8:0 bw10"),
    (11, 5, 12, (8, 8, 8), "rw9:0 gw9:0 bw9:0 rx7:0 rw11 rw10 gx7:0 gw11 gw10 bx7:0 bw11 bw10"),
    (15, 5, 16, (4, 4, 4),
     "rw9:0 gw9:0 bw9:0 rx3:0 rw15 rw14 rw13 rw12 rw11 rw10 gx3:0 gw15 gw14 gw13 gw12 gw11 gw10"
     " bx3:0 bw15 bw14 bw13 bw12 bw11 bw10"),
)  # fmt: skip
_SECOND = """
    0011001100110011 0001000100010001 0111011101110111 0001001100110111 0000000100010011 0011011101111111
    0001001101111111 0000000100110111 0000000000010011 0011011111111111 0000000101111111 0000000000010111
    0001011111111111 0000000011111111 0000111111111111 0000000000001111 0000100011101111 0111000100000000
    0000000010001110 0111001100010000 0011000100000000 0000100011001110 0000000010001100 0111001100110001
    0011000100010000 0000100010001100 0110011001100110 0011011001101100 0001011111101000 0000111111110000
    0111000110001110 0011100110011100
"""


def _header(layout: str) -> list[tuple[int, int, int]]:
    """(channel, end, bit) of each bit of a header, in order."""
    found = []
    for channel, end, first, last in re.findall(r"([rgb])([wxyz])(\d+)(:0)?", layout):
        bits = range(int(first) + 1) if last else (int(first),)
        found += [(_CHANNELS.index(channel), _ENDS.index(end), bit) for bit in bits]
    return found


_HEADERS = [_header(mode[4]) for mode in _MODES]
NUMBER, NUMBER_BITS, BITS = (np.array([mode[k] for mode in _MODES], np.int64) for k in range(3))
OTHER_BITS = np.array([mode[3] for mode in _MODES], np.int64)  # (14, 3)
DIRECT = np.isin(NUMBER, (3, 30))  # modes that store the other ends directly, not as differences
HEADER_BITS = np.array([len(header) for header in _HEADERS], np.int64)
HEADER = np.array([header + [(0, 0, 0)] * (72 + 3 - len(header)) for header in _HEADERS], np.int64)
SUBSETS = np.where(HEADER_BITS == 60, 1, 2)
# Modes with finer ends first; the first that can represent the ends of a block is nearly always its best.
FINEST_FIRST = tuple(
    np.array(sorted(np.flatnonzero(count == SUBSETS), key=lambda m: -BITS[m]), np.int64) for count in (1, 2)
)
SECOND = np.array([[int(digit) for digit in texels] for texels in _SECOND.split()], np.int64)  # (32, 16) 1: 2nd subset
LEVELS = np.array([16, 8], np.int64)  # colours per line, by number of subsets less one
SHARES = np.array(
    [[0, 4, 9, 13, 17, 21, 26, 30, 34, 38, 43, 47, 51, 55, 60, 64], [0, 9, 18, 27, 37, 46, 55, 64, *[0] * 8]], np.int64
)
# Anchor of the second subset: the texel whose index omits its highest bit. The anchor of the first subset is texel 0.
ANCHOR = np.array([15] * 17 + [2, 8, 2, 2, 8, 8, 15, 2, 8, 2, 2, 8, 8, 2, 2], np.int64)


@numba.njit(cache=True, nogil=True)
def unquantised(value: int, bits: int) -> int:
    """An end's channel of `bits` bits, expanded to 16 bits."""
    if bits >= 15 or value == 0:
        return value
    if value == (1 << bits) - 1:
        return 0xFFFF
    return ((value << 16) + 0x8000) >> bits


@numba.njit(cache=True, nogil=True)
def half(a: int, b: int, share: int) -> int:
    """Bits of the half float between two 16-bit channels; `share` of b is 0 to 64."""
    return (((a * (64 - share) + b * share + 32) >> 6) * 31) >> 6


@numba.njit(cache=True, nogil=True)
def quantised(value: float, bits: int) -> int:
    """The channel of `bits` bits, 0 to 2^bits - 1, for the bits of a half float."""
    return min(max(int(value * (64.0 / 31.0)) >> (16 - bits), 0), (1 << bits) - 1)


@numba.njit(cache=True, nogil=True)
def ordered(mode: int, partition: int, ends: Any, index: Any) -> bool:
    """Reverse lines in place so that anchors' highest bits are 0; returns whether the mode can represent the ends."""
    subsets = SUBSETS[mode]
    levels = LEVELS[subsets - 1]
    for s in range(subsets):
        if index[ANCHOR[partition] if s else 0] < levels // 2:
            continue
        for c in range(3):
            ends[2 * s, c], ends[2 * s + 1, c] = ends[2 * s + 1, c], ends[2 * s, c]
        for i in range(TEXELS):
            if subsets == 1 or SECOND[partition, i] == s:
                index[i] = levels - 1 - index[i]
    if DIRECT[mode]:
        return True
    for c in range(3):
        beyond = 1 << (OTHER_BITS[mode, c] - 1)
        for e in range(1, 2 * subsets):
            if not -beyond <= ends[e, c] - ends[0, c] < beyond:
                return False
    return True


@numba.njit(cache=True, nogil=True)
def write(block: Any, mode: int, partition: int, ends: Any, index: Any) -> None:
    """Write quantised ends (4, 3) and indices (16,), as `ordered` leaves them, into a block (4,) of zeros."""
    at = _put(block, 0, NUMBER[mode], NUMBER_BITS[mode])
    for k in range(HEADER_BITS[mode]):
        c, e, bit = HEADER[mode, k]
        value = ends[e, c] if e == 0 or DIRECT[mode] else ends[e, c] - ends[0, c]
        at = _put(block, at, value >> bit & 1, 1)
    two = SUBSETS[mode] == 2
    if two:
        at = _put(block, at, partition, 5)
    for i in range(TEXELS):
        at = _put(block, at, index[i], _index_bits(two, partition, i))


@numba.njit(cache=True, nogil=True)
def read(blocks: Any, texels: Any) -> None:
    """Decode blocks (B, 4) to bits of half floats (B, 16, 3); blocks of reserved modes are black."""
    ends = np.zeros((MOST_ENDS, 3), np.int64)
    for b in range(len(blocks)):
        block = blocks[b]
        number_bits = 2 if _get(block, 0, 2) < 2 else 5
        mode = _mode_of(_get(block, 0, number_bits))
        if mode < 0:
            texels[b] = 0
            continue
        at = number_bits
        ends[:] = 0
        for k in range(HEADER_BITS[mode]):
            c, e, bit = HEADER[mode, k]
            ends[e, c] |= _get(block, at, 1) << bit
            at += 1
        two = SUBSETS[mode] == 2
        partition = _get(block, at, 5) if two else 0
        at += 5 if two else 0
        _make_whole(mode, ends)
        for i in range(TEXELS):
            count = _index_bits(two, partition, i)
            k = _get(block, at, count)
            at += count
            first = 2 * SECOND[partition, i] if two else 0
            for c in range(3):
                texels[b, i, c] = half(ends[first, c], ends[first + 1, c], SHARES[1 if two else 0, k])


@numba.njit(cache=True, nogil=True)
def _make_whole(mode: int, ends: Any) -> None:
    """Expand the header's values to ends (4, 3) of 16 bits, in place."""
    bits = BITS[mode]
    for c in range(3):
        for e in range(1, 2 * SUBSETS[mode]):
            if not DIRECT[mode]:
                span = 1 << OTHER_BITS[mode, c]
                difference = ends[e, c] - (span if ends[e, c] >= span // 2 else 0)
                ends[e, c] = (ends[0, c] + difference) & ((1 << bits) - 1)
        for e in range(2 * SUBSETS[mode]):
            ends[e, c] = unquantised(ends[e, c], bits)


@numba.njit(cache=True, nogil=True)
def _index_bits(two: bool, partition: int, i: int) -> int:
    """Bits of texel i's index; those of anchors omit the highest."""
    return (3 if two else 4) - (1 if i == 0 or (two and i == ANCHOR[partition]) else 0)


@numba.njit(cache=True, nogil=True)
def _mode_of(number: int) -> int:
    for mode in range(len(NUMBER)):
        if NUMBER[mode] == number:
            return mode
    return -1


@numba.njit(cache=True, nogil=True)
def _put(block: Any, at: int, value: int, count: int) -> int:
    """Write `count` bits at bit `at`; returns the position after them."""
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
