"""Reflected light of a view's points by part of the environment, with fixed materials: for relighting."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from lambent.baking.artefacts.transport import ENTRIES, append
from lambent.baking.artefacts.view_points import points_key
from lambent.baking.context import BakeContext
from lambent.baking.quality import QualityName
from lambent.baking.running.keys import environment_inputs, key_of, light_inputs, material_inputs
from lambent.baking.running.tiles import seed_of
from lambent.baking.transport.view import View

if TYPE_CHECKING:
    from lambent.scenes.sky.triangle_wavelets import TriangleTree

KIND = "relighting"
NEEDS = ("view_points",)
OF_VIEWS = True
ON_REQUEST = True
REVISION = 1
POINTS = 1 << 11  # per block: all triangles of this many points are in memory at once
LAMPS, LIGHT, ERRORS = "lamps", "light", "errors"
SPARSE = ("spans", "points", "values")


@dataclass(frozen=True)
class Settings:
    """Resolution and accuracy.

    Attributes
    ----------
    depth
        Of the tree: 20 * 4^depth triangles.
    levels, samples
        Directions at each point: 4^levels in every triangle, and those drawn by the BSDF.
    tolerance
        Share of the norm of a point's transport that may be omitted from the store.
    paths
        Per point, to the lamps.
    """

    depth: int
    levels: int = 1
    samples: int = 64
    tolerance: float = 0.02
    paths: int = 64


SETTINGS = {
    QualityName.preview: Settings(3),
    QualityName.normal: Settings(4),
    QualityName.final: Settings(5, samples=256, tolerance=0.01, paths=256),
}


def keys(context: BakeContext) -> dict[str, str]:
    scene, how = context.in_views, context.settings(KIND)
    lamps = replace(scene, environment=None)
    found: dict[str, str] = {}
    for view in context.views:
        surface = key_of(KIND, REVISION, points_key(context, view), material_inputs(scene), context.seed)
        transport = key_of(KIND, REVISION, surface, vars(how) | {"paths": 0})
        found |= {view.name(KIND, part): transport for part in (*SPARSE, ERRORS)}
        found[view.name(KIND, LAMPS)] = key_of(KIND, REVISION, surface, light_inputs(lamps), how.paths)
        found[view.name(KIND, LIGHT)] = key_of(KIND, REVISION, environment_inputs(scene.environment), how.depth)
    return found


def bake(context: BakeContext) -> None:
    from lambent.scenes.sky.triangle_wavelets import PARTS, ROWS_OF_PARTS, TriangleTree, TurningLight

    tree = TriangleTree(context.settings(KIND).depth)
    for view in context.views:
        stale = context.stale(KIND)
        if view.name(KIND, LIGHT) in stale:
            picture = context.view_tracer.environment_rows(ROWS_OF_PARTS * 2 ** (tree.depth + PARTS))
            light = TurningLight.of_picture(tree, picture)
            context.put(KIND, view.name(KIND, LIGHT), light.fine.astype(np.float32), view.meta)
        if view.name(KIND, LAMPS) in stale:
            context.put(KIND, view.name(KIND, LAMPS), _lamps(context, view), view.meta)
        if stale & {view.name(KIND, part) for part in (*SPARSE, ERRORS)}:
            _bake_transport(context, view, tree)


def _lamps(context: BakeContext, view: View) -> np.ndarray:
    """(P, 3) light of all emitters except the environment."""
    from lambent.baking.transport.triangle_transport import light_of_lamps

    tracer = context.view_tracer
    _, ray = tracer.surfaces(view)
    if tracer.lamps is None:
        return np.zeros((len(tracer.points(view)), 3), np.float32)
    return light_of_lamps(tracer.lamps, ray, context.settings(KIND).paths, seed_of(context.seed, KIND, LAMPS))


def _bake_transport(context: BakeContext, view: View, tree: TriangleTree) -> None:
    """Write wavelets by blocks of points, the entries of a block before its spans."""
    from lambent.scenes.sky.triangle_wavelets import FACES

    points = len(context.view_tracer.points(view))
    blocks = -(-points // POINTS)
    key, meta = context.keys(KIND)[view.name(KIND, SPARSE[0])], {**view.meta, "block": POINTS}
    spans, points_of, values, errors = (
        context.store.begin(
            view.name(KIND, part), KIND, (count, width), (chunk, width), dtype, key=key, meta=meta, growing=chunk > 1
        )
        for part, count, width, chunk, dtype in (
            ("spans", blocks, len(tree) + 1, 1, "uint32"),
            ("points", 0, 1, ENTRIES, "uint16"),
            ("values", 0, 3, ENTRIES, "float16"),
            (ERRORS, blocks, 2, 1, "float32"),
        )
    )
    for block, rows in _blocks(context, view, tree, spans.missing):
        from lambent.baking.transport.stored import halves, largest_of_each

        kept = largest_of_each(rows, context.settings(KIND).tolerance, FACES)
        wavelet, point = np.nonzero(kept)
        entries = halves(rows.transpose(0, 2, 1)[kept])
        left_out = np.sum(rows.astype(float) ** 2) - np.sum(rows.transpose(0, 2, 1)[kept].astype(float) ** 2)
        rounded = np.sum((entries.astype(float) - rows.transpose(0, 2, 1)[kept]) ** 2)
        first = int(spans.read_chunk((block - 1, 0)).max(initial=0)) if block else 0
        first = -(-first // ENTRIES) * ENTRIES
        append(points_of, first, point.astype(np.uint16)[:, None])
        append(values, first, entries)
        errors.write((block, 0), np.array([[left_out + rounded, np.sum(rows.astype(float) ** 2)]], np.float32))
        ends = first + np.searchsorted(wavelet, np.arange(len(tree) + 1))
        spans.write((block, 0), ends.astype(np.uint32)[None])
    for writer in (points_of, values, errors, spans):
        writer.finish()


def _blocks(
    context: BakeContext, view: View, tree: TriangleTree, missing: list[Any]
) -> Iterator[tuple[int, np.ndarray]]:
    """Yield the wavelets (N, 3, P) of each missing block of points."""
    import drjit as dr
    import mitsuba as mi

    from lambent.baking.transport.triangle_transport import triangle_transport

    how, tracer = context.settings(KIND), context.view_tracer
    si, _ = tracer.surfaces(view)
    dr.eval(si)
    count, todo = dr.width(si), [chunk[0] for chunk in missing]
    for done, block in enumerate(todo):
        context.progress(done, len(todo), f"relighting with {len(tree)} triangles")
        here = block * POINTS + dr.arange(mi.UInt32, min(POINTS, count - block * POINTS))
        some = dr.gather(mi.SurfaceInteraction3f, si, here)
        dr.eval(some)
        seed = seed_of(context.seed, KIND, block)
        found = triangle_transport(tracer.scene, some, tree, how.levels, how.samples, seed)
        yield block, np.ascontiguousarray(tree.of_transport(found), np.float32)
    context.progress(1, 1, f"relighting with {len(tree)} triangles")
