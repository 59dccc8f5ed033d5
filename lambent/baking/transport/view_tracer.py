"""The scene of edited views in traceable form: visible points and lights, each computed once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache, cached_property
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.baking.interreflection.as_baked import unlike_documents
from lambent.baking.tracing.rays import array_of, has_holes, intersect, rays_from
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.baking.tracing.shapes import ObjectNumbers
from lambent.baking.transport.lights import Samples, environment_rows, environment_samples, scene_lights
from lambent.baking.transport.view import View
from lambent.baking.transport.view_points import ViewPoints, view_points
from lambent.core.views.camera import pixel_rays
from lambent.materials.factored.terms import Editable
from lambent.scenes.looks.textures import prepared
from lambent.scenes.scene import Scene
from lambent.scenes.sky.triangle_lights import TriangleLights


class ViewTracer:
    """A scene for Mitsuba whose views are converted to points.

    Materials in `editables` whose terms and curves differ from the scene's documents scatter by them.
    """

    def __init__(self, scene: Scene, editables: Mapping[str, Editable] | None = None) -> None:
        edited = unlike_documents(scene, editables or {})
        self._builder = SceneBuilder(replace(scene, textures=prepared(scene.textures)), edited=edited)
        self.scene: Any = self._builder.build()
        self.points = cache(self._points)
        self.lights = cache(self._lights)

    @property
    def numbers(self) -> ObjectNumbers:
        """Finds the objects that rays have hit."""
        return self._builder.numbers

    def _points(self, view: View) -> ViewPoints:
        """The points of a view, traced watertight: a ray through a crack would leave a black pixel."""
        return view_points(self._builder, self._builder.build(watertight=True), view.camera, view.width, view.height)

    def surfaces(self, view: View) -> tuple[Any, Any]:
        """Interactions (mi.SurfaceInteraction3f) at the points, in order, and the rays (mi.Ray3f) to them."""
        ray = self._rays(view)
        si = intersect(self.scene, ray, mi.Bool(True), has_holes(self.scene))
        shown = dr.compress(si.is_valid())
        return dr.gather(mi.SurfaceInteraction3f, si, shown), dr.gather(mi.Ray3f, ray, shown)

    def _rays(self, view: View) -> Any:
        directions = pixel_rays(view.camera, view.width, view.height).reshape(-1, 3)
        return rays_from(np.asarray(view.camera.position, float), directions)

    @cached_property
    def lamps(self) -> Any:
        """The scene (mi.Scene) without its environment; None if it then has no emitters."""
        scene = self._builder.scene
        if not scene.lights and not any(any(o.emission) for o in scene.objects):
            return None
        return SceneBuilder(replace(scene, environment=None), edited=self._builder.edited).build()

    def environment_rows(self, rows: int) -> NDArray[np.float32]:
        """(rows, 2 rows, 3) lat-long picture of the environment, black without one."""
        environment = self._builder.environment
        black = np.zeros((rows, 2 * rows, 3), np.float32)
        return black if environment is None else environment_rows(environment, rows)

    def _lights(self, count: int) -> TriangleLights:
        """About `count` lights."""
        return scene_lights(self._builder.scene, self._samples, count)

    @cached_property
    def _samples(self) -> Samples | None:
        """Samples of the environment."""
        environment = self._builder.environment
        return None if environment is None else environment_samples(environment)

    def backdrop(self, view: View) -> NDArray[np.float32]:
        """(height, width, 3) radiance of the pixels without reflection."""
        ray = self._rays(view)
        si = intersect(self.scene, ray, mi.Bool(True), has_holes(self.scene))
        si.wi = dr.select(si.is_valid(), si.wi, -ray.d)
        seen = array_of(si.emitter(self.scene).eval(si))
        return seen.reshape(view.height, view.width, 3)
