"""The faces behind the surface of a piece of glass, for two refractions (`baked.light_fields.thin_glass`)."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baked.light_fields.light_field import NO_EXIT
from lambent.baked.light_fields.thin_glass import eta_of, normal_transmittance
from lambent.baking.running.tiles import slices
from lambent.baking.tracing.rays import array_of, leaving
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.materials.document import Lobe, Material

MOST_FACES = 8  # that light passes behind a surface
AT_ONCE = 1 << 18


def clearest(material: Material) -> Lobe:
    """The lobe that a material transmits most by.

    Raises
    ------
    UserError
        Where it has none.
    """
    lobes = [lobe for lobe in material.transmission_lobes if any(lobe.k)]
    if not lobes:
        raise UserError("its material transmits nothing", hint="leave out `refracts`")
    return max(lobes, key=lambda lobe: float(np.mean(lobe.k)))


def index_of_refraction(material: Material) -> float:
    """Of the glass that a material stands for, by its reflectance at normal incidence."""
    return eta_of(float(np.mean(clearest(material).r0)))


class Exits:
    """Finds the faces behind places on an object."""

    def __init__(self, builder: SceneBuilder, name: str, material: Material) -> None:
        self._alone: Any = builder.build(leave_out={n for n in builder.meshes if n != name})
        self._passed = float(np.mean(normal_transmittance(clearest(material))))

    def find(self, places: Floats, normals: Floats) -> Floats:
        """(n, 4) of places and unit normals (n, 3): `exits` of `baked.light_fields.light_field.Glass`."""
        found = np.zeros((len(places), 4))
        found[:, 3] = NO_EXIT
        for mine in slices(len(places), AT_ONCE):
            found[mine] = self._found(places[mine], normals[mine])
        return found

    def _found(self, places: Floats, normals: Floats) -> Floats:
        down = -normals
        si = self._alone.ray_intersect(leaving(self._alone, places, normals, down))
        out = np.array(si.is_valid() & (dr.dot(si.n, si.sh_frame.n) > 0))
        normal, at = array_of(si.sh_frame.n).astype(float), array_of(si.p).astype(float)
        out &= (normal * down).sum(axis=1) > 0  # a face that the ray leaves by
        share = self._passed ** self._faces_beyond(si, down)
        exits = np.concatenate([normal * share[:, None], np.linalg.norm(at - places, axis=1)[:, None]], axis=1)
        return np.where(out[:, None], exits, [0.0, 0.0, 0.0, NO_EXIT])

    def _faces_beyond(self, si: Any, w: Floats) -> Floats:
        """How many faces (n,) rays along w (n, 3) pass after the one that they have met."""
        count = mi.Float(0) * si.t
        for _ in range(MOST_FACES):
            si = self._alone.ray_intersect(si.spawn_ray(mi.Vector3f(*w.T)), si.is_valid())
            count += dr.select(si.is_valid(), 1.0, 0.0)
        return np.array(count)
