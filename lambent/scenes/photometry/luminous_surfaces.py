"""Luminaires as surfaces: objects in the shape of their openings, which shine by their photometry."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import chain, count

import numpy as np
from numpy.typing import ArrayLike

from lambent.core.arrays import Floats
from lambent.core.geometry.triangles import triangle_areas
from lambent.core.plain import triple
from lambent.materials.document import Material
from lambent.scenes.geometry import box, cylinder, patch, sphere, transformed
from lambent.scenes.geometry.grid import turn
from lambent.scenes.geometry.shapes import fan
from lambent.scenes.light_groups import names_of_lights
from lambent.scenes.mesh import Mesh
from lambent.scenes.photometry.opening import Opening, X, Y, Z
from lambent.scenes.scene import IesLight, Scene, SceneObject

THIN_M = 0.002  # thickness of a flat opening that shines on both sides
AROUND = 48  # sides of round openings
MATERIAL = "luminaire"
BLACK = Material(name=MATERIAL)


def with_luminous_surfaces(scene: Scene) -> Scene:
    """The scene with an object for each of its lights whose opening has a size, and that has none yet.

    An object has the name of its light, or one with a number after it, and as `emission` the mean radiance of its
    surface.
    """
    names, taken = names_of_lights(scene.lights), {o.name for o in scene.objects}
    there = {o.luminaire for o in scene.objects}
    material = next(n for n in _numbered(MATERIAL) if scene.materials.get(n, BLACK) == BLACK)
    objects = list[SceneObject]()
    for number, light in enumerate(scene.lights):
        if isinstance(light, IesLight) and any(light.photometry.opening.size_m) and number not in there:
            name = next(n for n in _numbered(names[number]) if n not in taken)
            taken.add(name)
            objects.append(shining(SceneObject(name, surface_of(light), material, luminaire=number), light))
    if not objects:
        return scene
    return replace(scene, objects=(*scene.objects, *objects), materials={**scene.materials, material: BLACK})


def shining(o: SceneObject, light: IesLight) -> SceneObject:
    """The object of a luminaire with the mean radiance of its surface, and few texels."""
    flux_w = light.photometry.lumens * np.array(light.scale)
    mean = flux_w / (np.pi * triangle_areas(o.mesh.corners).sum())
    return replace(o, emission=triple(mean), light_map_scale=0.25)


def _numbered(name: str) -> Iterator[str]:
    return chain([name], (f"{name}_{number}" for number in count(2)))


def surface_of(light: IesLight) -> Mesh:
    """The opening of a luminaire as a closed mesh in world space; flat, if it shines along its axis alone."""
    opening = light.photometry.opening
    return transformed(_flat(opening) if is_flat(light) else _solid(opening), placement(light.axes, light.position))


def placement(axes: ArrayLike, position: ArrayLike) -> Floats:
    """(4, 4) world from the axes of a luminaire, unit rows."""
    world = np.eye(4)
    world[:3, :3], world[:3, 3] = np.transpose(axes), position
    return world


def is_flat(light: IesLight) -> bool:
    """Whether the opening of a luminaire is a surface across its axis that shines on one side."""
    vertical, lit = np.array(light.photometry.vertical_deg), light.photometry.table.any(axis=0)
    return light.photometry.opening.size_m[Z] == 0 and not (lit & (vertical > 90)).any()


def _flat(opening: Opening) -> Mesh:
    x, y, _ = opening.size_m
    if opening.shape == "box":
        return patch((-x / 2, -y / 2, 0), (x, 0, 0), (0, y, 0))
    phi = np.linspace(0, 2 * np.pi, AROUND, endpoint=False)
    rim = np.column_stack([x / 2 * np.cos(phi), y / 2 * np.sin(phi), np.zeros(AROUND)])
    return fan(rim, (0, 0, 1))


def _solid(opening: Opening) -> Mesh:
    size = np.maximum(opening.size_m, THIN_M)
    if opening.shape == "box":
        return box(size)
    scaled = np.eye(4)
    if opening.shape == "ellipsoid":
        scaled[:3, :3] = np.diag(size)
        return transformed(sphere(0.5, AROUND, AROUND // 2), scaled)
    along = {X: turn("z", -90.0), Y: np.eye(3), Z: turn("x", 90.0)}[opening.axis]
    scaled[:3, :3] = np.diag(size) @ along
    scaled[:3, 3] = -0.5 * scaled[:3, :3] @ (0.0, 1.0, 0.0)
    return transformed(cylinder(0.5, 1.0, around=AROUND), scaled)
