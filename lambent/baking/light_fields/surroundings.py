"""The scene that a light field is taken in, and how bright it can be."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from lambent.baking.light.cache import LightMapCache
from lambent.baking.light_fields.acquisition import Surroundings
from lambent.baking.tracing.lights.sun import Sun, SunRays
from lambent.baking.tracing.scene_builder import SceneBuilder, environment_dict
from lambent.baking.tracing.traced_scene import TracedScene
from lambent.core.arrays import Floats
from lambent.core.light.colour import unit_of_halves
from lambent.scenes.scene import Scene

Maps = tuple[Floats, Floats | None]  # the light map's irradiance (H, W, 3), and that of the other sides


def around(traced: TracedScene, maps: Maps | None, depth: int, bare: Collection[str] = ()) -> Surroundings:
    """The whole scene, lit by the light map, or without `maps` by paths that meet `depth` surfaces.

    Openings of drawn lamps are left out. Objects in `bare` have lost their lobes, so that they show their diffuse light
    alone.
    """
    diffuse = maps is None
    if not bare:
        cache, whole = None if maps is None else traced.cache(*maps), traced.whole(diffuse=diffuse)
        seen = traced.builder(diffuse=diffuse).without(traced.apart, whole)
        return Surroundings(seen, cache, depth, traced.sun)
    usual, scene = traced.builder(diffuse=diffuse), without_lobes(traced.scene, bare)
    builder = SceneBuilder(scene, traced.atlas.uv2, diffuse=diffuse, measured=usual.measured, sampling=usual.sampling())
    whole = builder.build(traced.apart)
    sun = None if traced.sun is None else SunRays(traced.sun, whole)
    return Surroundings(whole, None if maps is None else LightMapCache(builder, *maps, sun), depth, traced.sun)


def without_lobes(scene: Scene, names: Collection[str]) -> Scene:
    """The scene with these objects in materials of their own, without lobes; those that transmit stay as they are."""
    materials, textures = dict(scene.materials), dict(scene.textures)
    changed = {}
    for o in scene.objects:
        material = scene.materials[o.material]
        if o.name in names and not material.transmits:
            bare = f"{o.material} without lobes"
            materials[bare] = material.model_copy(update={"name": bare, "lobes": ()})
            if o.material in textures:
                textures[bare] = textures[o.material]
            changed[o.name] = replace(o, material=bare)
    objects = tuple(changed.get(o.name, o) for o in scene.objects)
    return replace(scene, objects=objects, materials=materials, textures=textures)


def unit_of(scene: Scene, irradiance: Floats, sun: Sun | None) -> float:
    """A unit in which half floats have room for all light but highlights of lamps without size, which are clipped.

    Known before anything is traced: whatever a map is interrupted and continued by, it is in one unit.
    """
    brightest = [max(o.emission) for o in scene.objects]
    brightest.append(float(irradiance.max(initial=0)) / np.pi)
    if sun is not None:
        brightest.append(max(sun.record.irradiance) / np.pi)
    if scene.environment is not None:
        said = environment_dict(scene.environment)
        brightest.append(float(np.array(said["bitmap"]).max()) * said["scale"])
    return unit_of_halves(max(brightest))
