"""Luminaires as surfaces: objects in the shape of their openings, which shine by their photometry."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace
from itertools import chain, count

import numpy as np

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
MATERIAL = "luminaire"  # black


def with_luminous_surfaces(scene: Scene, numbers: Collection[int]) -> Scene:
    """The scene with objects in place of some of its lights, by number: IesLights whose opening has a size.

    An object has the name of its light, or one with a number after it, and as `emission` the mean radiance of its
    surface.
    """
    names, taken = names_of_lights(scene.lights), {o.name for o in scene.objects}
    objects, sized = list[SceneObject](), list[int]()
    for number, light in enumerate(scene.lights):
        if number not in numbers or not isinstance(light, IesLight) or not any(light.photometry.opening.size_m):
            continue
        name = next(n for n in _numbered(names[number]) if n not in taken)
        taken.add(name)
        mesh = surface_of(light)
        flux_w = light.photometry.lumens * np.array(light.scale)
        mean = flux_w / (np.pi * triangle_areas(mesh.corners).sum())
        objects.append(SceneObject(name, mesh, MATERIAL, triple(mean), light_map_scale=0.25, luminaire=light))
        sized.append(number)
    if not objects:
        return scene
    lights = tuple(light for number, light in enumerate(scene.lights) if number not in sized)
    materials = {**scene.materials, MATERIAL: Material(name=MATERIAL)}
    return replace(scene, objects=(*scene.objects, *objects), lights=lights, materials=materials)


def _numbered(name: str) -> Iterator[str]:
    return chain([name], (f"{name}_{number}" for number in count(2)))


def surface_of(light: IesLight) -> Mesh:
    """The opening of a luminaire as a closed mesh in world space; flat, if it shines along its axis alone."""
    opening = light.photometry.opening
    world = np.eye(4)
    world[:3, :3], world[:3, 3] = light.axes.T, light.position
    return transformed(_flat(opening) if is_flat(light) else _solid(opening), world)


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
