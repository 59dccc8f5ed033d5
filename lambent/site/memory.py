"""What a site takes, by its manifest: bytes to transfer, and memory of the graphics adapter and of JavaScript.

For adapters with BC6H, where a site has cube maps in blocks.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from lambent.realtime.gpu.read_back import BC6H, BLOCKS, texel
from lambent.realtime.planar.planar_view import whole_window
from lambent.site.manifest import CANVAS, MIRROR

CANVAS_PX = 1920, 1080  # of the window that the figures are for
FACE_BYTES = 36  # of a triangle's corners, which the page keeps for clicks and steps


def graphics_bytes(tables: Mapping[str, Sequence[Mapping[str, Any]]]) -> int:
    """Bytes of all buffers and textures; those that follow the window count as in one of `CANVAS_PX`."""
    buffers = sum(int(one["size"]) for one in tables["buffer"])
    return buffers + sum(map(_texture_bytes, tables["texture"]))


def transferred(document: Mapping[str, Any]) -> int:
    """Bytes of data until the first state is exact, without stand-ins."""
    counts, tables = document["states"][0]["counts"], document["tables"]
    shown = [one["data"] for kind in ("buffer", "texture") for one in tables[kind][: counts[kind]] if "data" in one]
    pieces = [*shown, *document["clusters"].values(), *document["mirrors"]["corners"]]
    sizes = {one["file"]: one["packed"] for one in (piece.get("blocks", piece) for piece in pieces)}
    return sum(sizes.values())


def needs_of(tables: Mapping[str, Sequence[Mapping[str, Any]]]) -> dict[str, int]:
    """What buffers and textures need, by WebGPU's names of limits; without textures that follow the window."""
    sizes = [one["size"] for one in tables["texture"] if one["size"][0] not in (CANVAS, MIRROR)]
    return {
        "maxTextureDimension2D": max((int(side) for size in sizes for side in size[:2]), default=1),
        "maxTextureArrayLayers": max((int(layers) for size in sizes for layers in size[2:]), default=1),
        "maxBufferSize": max((int(one["size"]) for one in tables["buffer"]), default=0),
    }


def script_bytes(document: Mapping[str, Any], faces: int) -> int:
    """Bytes that JavaScript keeps: corners of triangles, and contents in which states differ."""
    kept: dict[str, int] = {}
    for state in document["states"]:
        for kind, places in state["changes"].items():
            for at, piece in places.items():
                for of in (piece, document["tables"][kind][at]["data"]):
                    one = of.get("blocks", of)
                    kept[one["file"]] = one["bytes"]
    return faces * FACE_BYTES + sum(kept.values())


def _texture_bytes(one: Mapping[str, Any]) -> int:
    form = BC6H if "blocks" in one.get("data", {}) else one["format"]
    block, side = BLOCKS.get(form) or (math.prod(texel(form)), 1)
    following = {CANVAS: CANVAS_PX, MIRROR: whole_window(CANVAS_PX)}
    sides = following.get(one["size"][0]) or one["size"][:2]
    layers = one["size"][2] if len(one["size"]) > 2 else 1
    levels = [[-(-max(1, n >> level) // side) for n in sides] for level in range(one.get("mipLevelCount") or 1)]
    return block * layers * sum(math.prod(level) for level in levels)
