"""Records that WGSL reads from buffers: numpy dtypes derived from WGSL structs, here those of lobes.wgsl."""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.materials.document import Lobe
from lambent.materials.lobes import spread, widening

SIDES = {"reflection": 0, "transmission": 1}
DISTRIBUTIONS = {"beckmann": 0, "ggx": 1, "curve": 2}
_PLAIN = {
    "f32": ("f4", 4), "vec2f": ("2f4", 8), "vec3f": ("3f4", 16), "vec4f": ("4f4", 16),
    "u32": ("u4", 4), "vec2u": ("2u4", 8), "vec4u": ("4u4", 16),
}  # fmt: skip
_FIELD = re.compile(r"^ +(\w+): (.+?),(?: *//.*)?$", re.MULTILINE)


def lobe_shader() -> str:
    """Text of lobes.wgsl, to prepend to a shader that uses it."""
    return files("lambent.materials").joinpath("lobes.wgsl").read_text(encoding="utf-8")


def wgsl_dtype(kind: str, text: str) -> tuple[np.dtype[Any], int]:
    """Dtype and alignment in bytes of a WGSL type, by WGSL's rules (section 14.4.1); `text` declares its structs."""
    if kind in _PLAIN:
        return np.dtype(_PLAIN[kind][0]), _PLAIN[kind][1]
    if kind == "mat4x4f":
        return np.dtype(("f4", (4, 4))), 16
    if array := re.fullmatch(r"array<(\w+), (\d+)>", kind):
        element, align = wgsl_dtype(array[1], text)
        return np.dtype((element.base, (int(array[2]), *element.shape))), align
    struct = re.search(rf"^struct {kind} {{\n(.*?)^}}", text, re.MULTILINE | re.DOTALL)
    assert struct, f"no struct {kind}"
    names, kinds = zip(*_FIELD.findall(struct[1]), strict=True)
    members = [wgsl_dtype(one, text) for one in kinds]
    offsets, end, widest = [], 0, max(align for _, align in members)
    for dtype, align in members:
        offsets.append(-(-end // align) * align)
        end = offsets[-1] + dtype.itemsize
    size = -(-end // widest) * widest
    formats = [dtype for dtype, _ in members]
    return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": size}), widest


LOBE_DTYPE = wgsl_dtype("LambentLobe", lobe_shader())[0]


def packed_lobes(lobes: Sequence[Lobe], rows: Sequence[tuple[int, int]] = ()) -> NDArray[Any]:
    """Structured array (N,) of `LOBE_DTYPE`, ready for a storage buffer; `rows` of `slope_curve.curve_rows`."""
    return np.array(
        [
            (
                o.k, o.mx, o.r0, o.my, o.alpha, SIDES[o.side], DISTRIBUTIONS[o.distribution], o.retro,
                *(max(row, 0) for row in of_lobe), widening(o), spread(o),
            )
            for o, of_lobe in zip(lobes, rows or [(0, 0)] * len(lobes), strict=True)
        ],
        LOBE_DTYPE,
    )  # fmt: skip
