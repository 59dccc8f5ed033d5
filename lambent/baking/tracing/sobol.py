"""Owen-scrambled Sobol points as a sampler of Mitsuba's interface, for paths.

Every pair of dimensions of a path is the Sobol sequence's first pair, shuffled and scrambled independently (Burley
2020, "Practical hash-based Owen scrambling", JCGT 9(4)): each pixel's first 2^k samples are stratified in each pair,
for all k. Number, seed and count of samples are no constants of kernels.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

SCALE = 2.0**-32
BELOW_ONE = 1 - 2.0**-24


@dataclass
class SobolSampler:
    """Sample number `index` of the series `seed`, both mi.UInt32 by thread; `dimension` counts drawn pairs."""

    index: Any
    seed: Any
    dimension: Any

    @classmethod
    def of_pixels(cls, seed: int, pixels: range, first: int, count: int) -> SobolSampler:
        """Samples first..first + count - 1 of each pixel, pixel after pixel; the range numbers the pixels."""
        thread, each = dr.arange(mi.UInt32, len(pixels) * count), dr.opaque(mi.UInt32, count)
        pixel = thread // each
        index = thread - pixel * each + dr.opaque(mi.UInt32, first)
        series = mi.sample_tea_32(pixel + dr.opaque(mi.UInt32, pixels.start), dr.opaque(mi.UInt32, seed & 0xFFFFFFFF))[
            0
        ]
        return cls(index, series, dr.zeros(mi.UInt32, len(pixels) * count))

    def next_1d(self, active: Any = True) -> Any:
        """Uniform in [0, 1)."""
        return self.next_2d(active).x

    def next_2d(self, active: Any = True) -> Any:
        """Uniform in [0, 1)^2."""
        own = mixed(self.seed ^ (self.dimension * 0x9E3779B9 + 0x85EBCA6B))
        self.dimension = self.dimension + 1
        index = scrambled(self.index, own)
        x = scrambled(dr.brev(index), mixed(own ^ 0x68BC21EB))
        y = scrambled(second_dimension(index), mixed(own ^ 0x02E5BE93))
        return mi.Point2f(*(dr.minimum(mi.Float(v) * SCALE, BELOW_ONE) for v in (x, y)))


def second_dimension(index: Any) -> Any:
    """The Sobol sequence's second dimension, as bits of a fraction: Pascal's triangle modulo 2 (Ahmed 2024)."""
    bits = index ^ (index >> 16)
    for shift, kept in ((8, 0xFF00FF00), (4, 0xF0F0F0F0), (2, 0xCCCCCCCC), (1, 0xAAAAAAAA)):
        bits ^= (bits & kept) >> shift
    return dr.brev(bits)


def scrambled(bits: Any, seed: Any) -> Any:
    """Nested uniform scrambling of the bits of a fraction, highest first (Laine & Karras 2011, constants of Burley)."""
    x = dr.brev(bits)
    x += seed
    for factor in (0x6C50B47C, 0xB82F1E52, 0xC7AFE638, 0x8D22F6E6):
        x ^= x * factor
    return dr.brev(x)


def mixed(bits: Any) -> Any:
    """A hash of 32 bits (the finalizer of MurmurHash3)."""
    bits ^= bits >> 16
    bits *= 0x85EBCA6B
    bits ^= bits >> 13
    bits *= 0xC2B2AE35
    return bits ^ (bits >> 16)
