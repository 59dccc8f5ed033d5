"""Sums of transport rows, the kernel of every edited picture, on all cores.

Transport is band-major, (J, C, P) half floats: J bands or wavelets, C colour channels, P pixels. A picture needs few of
its rows, each whole; reads are sequential, and half the size of float32.

numba does not vectorize sums of packed colours (`baked.shared_exponent`) by itself. `add_light` does; an entry takes
a third of the time. Its positions are flat indices of contiguous arrays.
"""

from __future__ import annotations

from typing import Any, Protocol

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.kernels import parallel

BLOCK = 8192  # pixels whose sums stay in the first-level cache
Halves = NDArray[np.float16]
Pixels = NDArray[np.float32]
CHANNELS = 4
WORD = ir.IntType(32)
WHOLE, REAL = ir.VectorType(WORD, CHANNELS), ir.VectorType(ir.FloatType(), CHANNELS)


@intrinsic
def float_of_half(_typing, bits):  # type: ignore[no-untyped-def]
    """Convert a half float on the processor; numba has no half floats on the CPU."""

    def generate(_context, builder, _signature, args):  # type: ignore[no-untyped-def]
        return builder.fpext(builder.bitcast(args[0], ir.HalfType()), ir.FloatType())

    return types.float32(types.uint16), generate


@intrinsic
def half_of_float(_typing, value):  # type: ignore[no-untyped-def]
    """The bits of the nearest half float."""

    def generate(_context, builder, _signature, args):  # type: ignore[no-untyped-def]
        return builder.bitcast(builder.fptrunc(args[0], ir.HalfType()), ir.IntType(16))

    return types.uint16(types.float32), generate


@intrinsic
def _float_of_bits(_typing, bits):  # type: ignore[no-untyped-def]
    def generate(_context, builder, _signature, args):  # type: ignore[no-untyped-def]
        return builder.bitcast(args[0], ir.FloatType())

    return types.float32(types.uint32), generate


@numba.njit(cache=True)
def unit_of(bits):  # type: ignore[no-untyped-def]
    """Value of mantissa 1 in a colour of `baked.shared_exponent`."""
    return _float_of_bits(np.uint32(((bits >> 27) + 103) << 23))  # type: ignore[call-arg]


@parallel(fastmath=True)
def _add(picture, transport, rows, weights, begin, end):  # type: ignore[no-untyped-def]
    channels = len(picture)
    blocks = (end - begin + BLOCK - 1) // BLOCK
    for piece in numba.prange(blocks * channels):
        c, first = piece // blocks, begin + piece % blocks * BLOCK
        last = min(end, first + BLOCK)
        used = np.flatnonzero(weights[:, c])
        for k in range(0, used.size - 3, 4):  # four rows at once use memory bandwidth best
            i, j, m, n = rows[used[k]], rows[used[k + 1]], rows[used[k + 2]], rows[used[k + 3]]
            f, g = weights[used[k], c], weights[used[k + 1], c]
            u, v = weights[used[k + 2], c], weights[used[k + 3], c]
            for p in range(first, last):
                picture[c, p] += (
                    f * float_of_half(transport[i, c, p])  # type: ignore[call-arg]
                    + g * float_of_half(transport[j, c, p])  # type: ignore[call-arg]
                    + u * float_of_half(transport[m, c, p])  # type: ignore[call-arg]
                    + v * float_of_half(transport[n, c, p])  # type: ignore[call-arg]
                )
        for k in range(used.size // 4 * 4, used.size):
            row, weight = rows[used[k]], weights[used[k], c]
            for p in range(first, last):
                picture[c, p] += weight * float_of_half(transport[row, c, p])  # type: ignore[call-arg]


def add_rows(
    picture: Pixels, transport: Halves, rows: NDArray[np.integer], weights: Floats, part: slice = slice(None)
) -> None:
    """picture (C, P) += sum over k of weights[k] (C,) transport[rows[k]] (C, P), in place, in `part` of the pixels."""
    begin, end, _ = part.indices(picture.shape[1])
    _add(picture, transport.view(np.uint16), np.asarray(rows, np.int64), np.asarray(weights, np.float32), begin, end)


class Products(Protocol):
    """A picture made of sums of transport rows, in memory (`HostProducts`) or on a GPU (`lambent.realtime.edited`)."""

    @property
    def shape(self) -> tuple[int, int, int]:
        """(J, C, P) of the transport."""

    @property
    def picture(self) -> Pixels:
        """(C, P) float32: the sums so far, initially 0."""

    def add_rows(
        self, rows: NDArray[np.integer], weights: Floats, part: slice = slice(None), *, anew: bool = False
    ) -> None:
        """picture (C, P) += sum over k of weights[k] (C,) transport[rows[k]] (C, P) in `part` of the pixels.

        With `anew` the sum replaces the previous values.
        """


class HostProducts:
    """`Products` of transport (J, C, P) float16 in memory, summed on all cores."""

    def __init__(self, transport: Halves) -> None:
        self._transport = transport
        self.shape = transport.shape
        self.picture: Pixels = np.zeros(transport.shape[1:], np.float32)

    def add_rows(
        self, rows: NDArray[np.integer], weights: Floats, part: slice = slice(None), *, anew: bool = False
    ) -> None:
        if anew:
            self.picture[:, part] = 0
        add_rows(self.picture, self._transport, rows, weights, part)


@intrinsic
def add_light(_typing, sums, at, means, of, bits):  # type: ignore[no-untyped-def]
    """sums[at:at + 4] += means[of:of + 4] times a colour."""

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        to, mean = (_place(context, builder, signature, args, k) for k in (0, 2))
        mean, before = builder.load(mean, align=4), builder.load(to, align=4)
        return _added(context, builder, to, before, _light(builder, args[4]), mean)

    return types.void(sums, types.intp, means, types.intp, types.uint32), generate


@intrinsic
def add_weighted_light(_typing, sums, at, means, of, weights, by, unit, bits):  # type: ignore[no-untyped-def]
    """sums[at:at + 4] += unit means[of:of + 4] weights[by:by + 4] times a colour."""

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        to, mean, weight = (_place(context, builder, signature, args, k) for k in (0, 2, 4))
        factors = builder.load(mean, align=4), builder.load(weight, align=4)
        light = builder.fmul(_light(builder, args[7]), _everywhere(builder, args[6], REAL))
        return _added(context, builder, to, builder.load(to, align=4), light, builder.fmul(*factors))

    return types.void(
        sums, types.intp, means, types.intp, weights, types.intp, types.float32, types.uint32
    ), generate  # fmt: skip


def _each(*numbers: int) -> ir.Constant:
    return ir.Constant(WHOLE, list(numbers if len(numbers) == CHANNELS else numbers * CHANNELS))


def _place(context: Any, builder: Any, signature: Any, args: Any, k: int) -> Any:
    """Address in array argument k, at the index given by the next argument."""
    data = context.make_array(signature.args[k])(context, builder, args[k]).data
    return builder.bitcast(builder.gep(data, [args[k + 1]]), REAL.as_pointer())


def _everywhere(builder: Any, number: Any, of: Any) -> Any:
    nothing = ir.Constant(of, ir.Undefined)
    first = builder.insert_element(nothing, number, ir.Constant(WORD, 0))
    return builder.shuffle_vector(first, nothing, _each(0))


def _light(builder: Any, bits: Any) -> Any:
    bits = _everywhere(builder, bits, WHOLE)
    mantissas = builder.and_(builder.lshr(bits, _each(0, 9, 18, 27)), _each(511, 511, 511, 0))
    exponent = builder.add(builder.lshr(bits, _each(27)), _each(103))  # as in `products.unit_of`
    unit = builder.bitcast(builder.shl(exponent, _each(23)), REAL)
    return builder.fmul(builder.uitofp(mantissas, REAL), unit)


def _added(context: Any, builder: Any, to: Any, before: Any, light: Any, factor: Any) -> Any:
    added = builder.fmul(light, factor, flags=["contract"])
    builder.store(builder.fadd(before, added, flags=["contract"]), to, align=4)
    return context.get_dummy_value()
