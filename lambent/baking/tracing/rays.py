"""Rays: arrays on the device, the offset from surfaces, and intersections.

Rays pass through holes, places where a texture says that there is no surface (`eval_null_transmission` of the BSDF).
The argument `holes` is always `has_holes(scene)`: a scene without holes spends no time on them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.geometry.directions import basis
from lambent.core.geometry.sequences import cosine_hemisphere, r2
from lambent.materials.clear import MOST

ALIGNED_BYTES = 64  # LLVM's longest vectors
OFFSET = 1e-5  # metres, and share of the largest coordinate: distance above a surface where rays leave it
OFFSET_OF_SCENE = 1e-7  # likewise, of the scene's diagonal: rays above a triangle of 1 km hit it from 30 micrometres
APPROACH = 10 * OFFSET  # likewise, before a surface that rays hit; at grazing incidence little of it is height
SHADOW_SHORT = 9e-4  # share of a ray to a point by which it stops short, as in Mitsuba


def vectors(kind: Any, array: Floats) -> Any:
    """An array (..., 3) as `kind`: mi.Vector3f, mi.Point3f or mi.Normal3f, flattened.

    Keeps the array out of kernels. Dr.Jit splits an (n, 3) array by a kernel with n as a constant, and compiles another
    one for memory that is not aligned to the vector length: that takes seconds if the kernel traces paths.
    """
    return kind(*(mi.Float(_aligned(component)) for component in array.reshape(-1, 3).T))


def rays_from(origins: Floats, directions: Floats) -> Any:
    """mi.Ray3f from origins (n, 3), or a single one (3,), along directions (n, 3)."""
    return mi.Ray3f(vectors(mi.Point3f, np.broadcast_to(origins, directions.shape)), vectors(mi.Vector3f, directions))


def array_of(vector: Any) -> NDArray[np.float32]:
    """A Dr.Jit vector or colour as an array (n, 3)."""
    components = [vector[0], vector[1], vector[2]]
    dr.eval(components)
    return np.stack([np.array(c) for c in components], axis=-1)


def block_sums(vector: Any, n: int) -> NDArray[np.float32]:
    """Sums (..., 3) over every n consecutive Dr.Jit vectors or colours."""
    return np.stack([np.array(dr.block_sum(component, n)) for component in (vector.x, vector.y, vector.z)], axis=-1)


def _aligned(values: Floats) -> NDArray[np.float32]:
    """A copy (n,) aligned to ALIGNED_BYTES."""
    memory = np.empty(4 * len(values) + ALIGNED_BYTES, np.uint8)
    start = -memory.ctypes.data % ALIGNED_BYTES
    result = memory[start : start + 4 * len(values)].view(np.float32)
    result[:] = values
    return result


def independent(seed: int, width: int) -> Any:
    """mi.Sampler of independent random numbers for `width` threads."""
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, width)
    return sampler


def leaving(scene: Any, p: Any, n: Any, direction: Any) -> Any:
    """Rays that leave points p of surfaces of normals n, on the side of `direction`: Dr.Jit's, or arrays (n, 3).

    They are offset by 1/9 of Mitsuba's epsilon; with Mitsuba's, rays miss contact geometry.
    """
    p, n, direction = _on_device(p, n, direction)
    box = scene.bbox()
    size = float(dr.norm(box.extents())) if box.valid() else 0.0
    above = OFFSET * (1 + dr.max(dr.abs(p))) + dr.opaque(mi.Float, OFFSET_OF_SCENE * size)
    return mi.Ray3f(mi.Point3f(p + n * dr.mulsign(above, dr.dot(n, direction))), direction)


def towards(scene: Any, p: Any, n: Any, target: Any) -> Any:
    """Rays that leave points p of surfaces with normals n and end just before a target point; see `leaving`."""
    p, n, target = _on_device(p, n, target)
    start = leaving(scene, p, n, target - p).o
    offset = target - start
    distance = dr.norm(offset)
    ray = mi.Ray3f(start, offset / distance)
    ray.maxt = distance * (1 - SHADOW_SHORT)
    return ray


def _on_device(*values: Any) -> Iterator[Any]:
    return (vectors(mi.Vector3f, v) if isinstance(v, np.ndarray) else v for v in values)


def cosine_directions(normals: Floats) -> Floats:
    """Cosine distributed directions (n, 3) about unit normals (n, 3), by the R2 sequence."""
    t, b = basis(normals)
    local = cosine_hemisphere(r2(len(normals)))
    return np.asarray(local[:, :1] * t + local[:, 1:2] * b + local[:, 2:] * normals)


def distances(scene: Any, ray: Any) -> NDArray[np.float64]:
    """Distances (n,) to the first hits of rays, infinite without a hit."""
    return np.array(scene.ray_intersect_preliminary(ray).t).astype(float)


def has_holes(scene: Any) -> bool:
    """Whether a shape of the scene has holes."""
    return any(mi.has_flag(shape.bsdf().flags(), mi.BSDFFlags.Null) for shape in scene.shapes())


def intersect(scene: Any, ray: Any, active: Any, holes: bool) -> Any:
    """The interaction (mi.SurfaceInteraction3f) behind all holes; `si.t` is measured from the last hole."""
    if not holes:
        return scene.ray_intersect(ray, active)
    return _behind_holes(scene, mi.Ray3f(ray), mi.Bool(active))


def in_shadow(scene: Any, ray: Any, active: Any, holes: bool, coherent: bool = False) -> Any:
    """Whether anything blocks a ray, holes excluded; `coherent` hints that neighbouring rays are nearly parallel."""
    return intersect(scene, ray, active, True).is_valid() if holes else scene.ray_test(ray, coherent, active)


def hidden(scene: Any, p: Any, n: Any, target: Any, active: Any, holes: bool) -> Any:
    """Whether anything, holes excluded, stands between points p of surfaces with normals n and a target point."""
    ray = towards(scene, p, n, target)
    return _blocked(scene, ray, mi.Point3f(target), mi.Bool(active)) if holes else scene.ray_test(ray, active)


def straight_on(si: Any, active: Any) -> Any:
    """Undeviated transmittance (mi.Color3f) of the surfaces at interactions: 1 in holes, 0 except on clear glass."""
    return si.bsdf().eval_null_transmission(si, active)


def passed(scene: Any, ray: Any, active: Any) -> Any:
    """Transmittance (mi.Color3f) along rays, straight through holes and clear glass; 0 behind anything else."""
    return _passed(scene, mi.Ray3f(ray), mi.Bool(active), None)


def passed_from(scene: Any, p: Any, n: Any, target: Any, active: Any) -> Any:
    """Likewise for light from target points that falls onto points p of surfaces with normals n."""
    return _passed(scene, towards(scene, p, n, target), mi.Bool(active), mi.Point3f(target))


@dr.syntax
def _passed(scene, ray, active, target):  # type: ignore[no-untyped-def]
    share = dr.select(active, mi.Color3f(1.0), 0.0)
    again = active
    while again:
        si = scene.ray_intersect(ray, again)
        again &= si.is_valid()
        share *= dr.select(again, straight_on(si, again), 1.0)
        ray = leaving(scene, si.p, si.n, ray.d) if target is None else towards(scene, si.p, si.n, target)
        again &= dr.max(share) > 0
    return share


def _is_hole(si: Any, active: Any) -> Any:
    met = active & si.is_valid()
    return met & (straight_on(si, met)[0] > MOST)


@dr.syntax
def _behind_holes(scene, ray, active):  # type: ignore[no-untyped-def]
    si = dr.zeros(mi.SurfaceInteraction3f, dr.width(ray.o))
    si.t = dr.full(mi.Float, dr.inf, dr.width(ray.o))  # no hit where `active` is false
    again = active
    while again:
        si = scene.ray_intersect(ray, again)
        ray = leaving(scene, si.p, si.n, ray.d)
        again = _is_hole(si, again)
    return si


@dr.syntax
def _blocked(scene, ray, target, active):  # type: ignore[no-untyped-def]
    blocked = mi.Bool(False)
    again = active
    while again:
        si = scene.ray_intersect(ray, again)
        ray = towards(scene, si.p, si.n, target)
        blocked = si.is_valid()
        again = _is_hole(si, again)
    return blocked
