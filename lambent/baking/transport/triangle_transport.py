"""Reflected light of a view's points by triangle of the sphere: transport of light for relighting.

    T_n = integral over triangle n of  f(w, wo) V(w) |cos|        (Ng et al. 2003, eq. 3, with all BRDFs fixed)

Directions are drawn in every part of every triangle, and by the BSDF, which finds narrow highlights. Every sample is
divided by the combined density of all samples (balance heuristic, Veach 1997), so the sums are unbiased.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.baking.tracing import path_tracer
from lambent.baking.tracing.rays import array_of, has_holes, in_shadow, independent, leaving, vectors
from lambent.core.arrays import Floats, Indices
from lambent.scenes.sky.triangle_wavelets import CHILDREN, TriangleTree

UNIT = 2.0**-24  # of random integers, 24 bits of which become numbers in [0, 1)
STEPS = 1 / 1.22074408460575947536 ** np.arange(1, 4)  # of the additive sequence in three dimensions (Roberts 2018)


def triangle_transport(
    scene: Any, si: Any, tree: TriangleTree, levels: int, samples: int, seed: int
) -> NDArray[np.float32]:
    """(N, 3, P) radiance towards the viewer due to radiance 1 in each of a tree's triangles, sr times 1/sr.

    Parameters
    ----------
    si : mi.SurfaceInteraction3f
        The P points, evaluated.
    levels
        Levels below the tree's: a direction is drawn in each of the 4^levels parts of every triangle.
    samples
        Directions drawn by the BSDF.
    """
    parts, points = TriangleTree(tree.depth + levels), dr.width(si)
    places = _density_vectors(parts.corners)
    total = _by_parts(scene, si, parts.corners, places, CHILDREN**levels, samples, seed).reshape(len(tree), 3, points)
    if samples:
        w, light, pdf = _by_bsdf(scene, si, samples, seed)
        part = parts.containing(w)
        light /= (np.sum(places[part] * w, axis=1) ** -3 + samples * pdf)[:, None]
        _add(total, part >> (2 * levels), np.repeat(np.arange(points), samples), light)
    return total


def light_of_lamps(scene: Any, ray: Any, paths: int, seed: int) -> NDArray[np.float32]:
    """(P, 3) direct light of lamps reflected along rays (mi.Ray3f), without emission of the surfaces they hit."""
    points = dr.width(ray)
    number = dr.arange(mi.UInt32, points * paths) // paths
    start = path_tracer.camera_start(dr.gather(mi.Ray3f, ray, number))
    with_emission = path_tracer.radiance(scene, independent(seed, points * paths), start, max_depth=1)
    emitted = path_tracer.radiance(scene, independent(seed, points), path_tracer.camera_start(ray), max_depth=0)
    mean = np.stack([np.array(dr.block_sum(c, paths)) for c in with_emission], axis=-1) / paths
    return np.maximum(mean - array_of(emitted), 0)


def _density_vectors(corners: Floats) -> Floats:
    """(M, 3) vectors q for which directions to uniform points of a flat triangle have the density (q.w)^-3 in 1/sr.

    An area A at distance h has the density r^3 / (A h) at r = h / (n.w).
    """
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(across, axis=1) / 2
    normal = across / (2 * area)[:, None]
    h = np.sum(normal * corners[:, 0], axis=1)
    return np.asarray(normal * np.cbrt(area / h**2)[:, None])


def _by_parts(
    scene: Any, si: Any, corners: Floats, places: Floats, each: int, samples: int, seed: int
) -> NDArray[np.float32]:
    points, triangles = dr.width(si), len(corners) // each
    thread, width = dr.arange(mi.UInt32, points * triangles), dr.opaque(mi.UInt32, points)
    pixel = thread % width
    at = dr.gather(mi.SurfaceInteraction3f, si, pixel)
    device = [vectors(mi.Vector3f, v) for v in (*np.moveaxis(corners, 1, 0), places)]
    found = _sum_of_parts(
        scene, at, at.bsdf(), thread // width * each, each, device, dr.opaque(mi.Float, samples),
        thread, dr.opaque(mi.UInt32, seed), has_holes(scene),
    )  # fmt: skip
    return array_of(found).reshape(triangles, points, 3).transpose(0, 2, 1).copy()


@dr.syntax
def _sum_of_parts(scene, si, bsdf, first, each, triangles, samples, thread, seed, holes):  # type: ignore[no-untyped-def]
    total, s = dr.zeros(mi.Color3f, dr.width(thread)), mi.UInt32(0)
    ctx = mi.BSDFContext()
    while s < each:
        a, b, c, q = [dr.gather(mi.Vector3f, v, first + s) for v in triangles]
        u, v = mi.sample_tea_32(thread, seed * each + s)
        root, v = dr.sqrt(mi.Float(u >> 8) * UNIT), mi.Float(v >> 8) * UNIT
        w = dr.normalize(a * (1 - root) + b * (root * (1 - v)) + c * (root * v))
        light, pdf = bsdf.eval_pdf(ctx, si, si.to_local(w))
        density = dr.rcp(dr.dot(q, w))
        light /= density * density * density + samples * pdf
        lit = dr.max(light) > 0
        lit &= ~in_shadow(scene, leaving(scene, si.p, si.n, w), lit, holes)
        total += dr.select(lit, light, 0.0)
        s += 1
    return total


def _by_bsdf(scene: Any, si: Any, samples: int, seed: int) -> tuple[Floats, Floats, Floats]:
    """Directions (P * samples, 3) drawn by the BSDF, their light times the cosine, and their densities."""
    thread = dr.arange(mi.UInt32, dr.width(si) * samples)
    pixel, k = thread // samples, mi.Float(thread % samples + 1)
    shift = [
        *mi.sample_tea_32(pixel, dr.opaque(mi.UInt32, seed)),
        mi.sample_tea_32(pixel, ~dr.opaque(mi.UInt32, seed))[0],
    ]
    u = [mi.Float(x >> 8) * UNIT + k * step for x, step in zip(shift, STEPS, strict=True)]
    u = [x - dr.floor(x) for x in u]
    at, ctx = dr.gather(mi.SurfaceInteraction3f, si, pixel), mi.BSDFContext()
    drawn, _ = at.bsdf().sample(ctx, at, u[0], mi.Point2f(u[1], u[2]))
    value, pdf = at.bsdf().eval_pdf(ctx, at, drawn.wo, drawn.pdf > 0)
    w = at.to_world(drawn.wo)
    lit = (pdf > 0) & (dr.max(value) > 0)
    lit &= ~in_shadow(scene, leaving(scene, at.p, at.n, w), lit, has_holes(scene))
    value = dr.select(lit, value, 0.0)
    dr.eval(w, value, pdf)
    lit = np.array(lit)
    w, value = array_of(w).astype(float), array_of(value).astype(float)
    w[~lit] = (0.0, 1.0, 0.0)
    return w, value, np.where(lit, np.array(pdf), 1.0)


def _add(total: NDArray[np.float32], triangle: Indices, point: Indices, light: Floats) -> None:
    """Add light (S, 3) to triangles and points of (N, 3, P)."""
    points = total.shape[2]
    for c in range(3):
        np.add.at(total.reshape(-1), (triangle * 3 + c) * points + point, light[:, c].astype(np.float32))
