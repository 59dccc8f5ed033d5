"""Structs shared with shaders: what numpy writes into every field is what WGSL reads from it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from lambent.materials.shader_layout import wgsl_dtype
from lambent.realtime.gpu.shader_source import shader_files
from lambent.realtime.gpu.structs import STRUCTS
from tests.tools.shader_parity import dispatched

WGSL = "\n".join(path.read_text() for _, path in sorted(shader_files().items()))


def leaves(place: str, dtype: np.dtype[Any], begin: int = 0) -> Iterator[tuple[str, int]]:
    """WGSL expressions of all numbers of a record, and the words where numpy has them."""
    if dtype.fields is not None:
        for field, (inner, offset, *_) in dtype.fields.items():
            yield from leaves(f"{place}.{field}", inner, begin + offset)
        return
    for word, index in enumerate(np.ndindex(dtype.shape)):
        yield place + "".join(f"[{i}]" for i in index), begin // 4 + word


@pytest.mark.parametrize("name", STRUCTS)
def test_every_field_is_read_where_it_was_written(name: str) -> None:
    """Each word of the record holds its own number, which a shader reads field by field."""
    dtype = STRUCTS[name]
    words = 7 + 3 * np.arange(dtype.itemsize // 4, dtype=np.uint32)
    words |= np.uint32(0x3F000000)  # ordinary floats, too
    found = list(leaves("given", dtype))
    stores = "\n".join(f"out[{word}] = bitcast<u32>({place});" for place, word in found)
    structs = "\n".join(re.search(rf"^struct {one} {{.*?^}}", WGSL, re.M | re.S)[0] for one in STRUCTS)  # type: ignore
    code = f"""{structs}
@group(0) @binding(0) var<uniform> given: {name};
@group(0) @binding(1) var<storage, read_write> out: array<u32>;
@compute @workgroup_size(1) fn main() {{ {stores} }}"""
    read = dispatched(code, [words], len(words), 1).view(np.uint32)
    at = [word for _, word in found]
    assert len(set(at)) == len(at) >= 0.75 * len(words)
    np.testing.assert_array_equal(read[at], words[at])


def test_layout_by_hand() -> None:
    """A number fits behind a vector of three; other vectors, structs and arrays begin at multiples of 16 bytes."""
    text = """
struct Inner {
    a: vec3f, // a comment, with: a colon
    b: f32,
    c: u32,
}
struct Outer {
    a: f32,
    b: vec2f,
    c: vec3f,
    d: Inner,
    e: array<vec4f, 2>,
    f: f32,
}
"""
    dtype, align = wgsl_dtype("Outer", text)
    assert dtype.fields is not None
    assert [dtype.fields[name][1] for name in "abcdef"] == [0, 8, 16, 32, 64, 96]
    assert (dtype.itemsize, align) == (112, 16)
    inner = dtype["d"]
    assert inner.fields is not None and inner.itemsize == 32
    assert [inner.fields[name][1] for name in "abc"] == [0, 12, 16]
    with pytest.raises(AssertionError, match="no struct"):
        wgsl_dtype("Missing", text)
