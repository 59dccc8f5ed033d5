"""Sums of packed colours (`baked.shared_exponent`), with vectorized channels.

numba does not vectorize this by itself; each entry takes a third of the time. Positions are flat indices of contiguous
arrays.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

CHANNELS = 4
WORD = ir.IntType(32)
WHOLE, REAL = ir.VectorType(WORD, CHANNELS), ir.VectorType(ir.FloatType(), CHANNELS)


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
