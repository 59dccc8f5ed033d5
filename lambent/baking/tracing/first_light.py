"""Emitters without the sun and lamps, for sampling at points of the light map: their light is added by rays.

A sky is the same picture without the sun's part, with its own guide: samples aimed at the sun would be wasted. Later
surfaces on a path see the sun, and sample all emitters.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baking.sky.guide import guided_sky, learn
from lambent.baking.sky.sun import FoundSun, SunPicture, is_sun
from lambent.baking.tracing.lights.emitters import brought_by, number_of
from lambent.baking.tracing.scene_builder import SceneBuilder, environment_dict
from lambent.scenes.scene import Environment


class FirstLight:
    """All emitters of a builder but the sun, if `found`, and some of its lights, by number.

    `environment` is as from `sky_without`, for the scene `whole`.
    """

    def __init__(
        self, builder: SceneBuilder, whole: Any, found: FoundSun | None, environment: Any,
        without: Collection[int] = (),
    ) -> None:  # fmt: skip
        suns = [number for number, light in enumerate(builder.scene.lights) if found and is_sun(light, found)]
        others = {*suns, *without, *builder.scene.openings}
        lights = [emitter for number, emitter in enumerate(builder.lights) if number not in others]
        emitters = [*lights, *([] if environment is None else [environment])]
        apart = [builder.lights[number] for number in without if number in builder.scene.openings]
        numbers = [number_of(emitter) for emitter in apart]
        self._apart = mi.Bool(np.isin(np.arange(max(numbers, default=0) + 1), numbers))
        shining = [mesh for mesh in builder.meshes.values() if mesh.is_emitter()]
        meshes = [mesh for mesh in shining if number_of(mesh.emitter()) not in numbers]
        parts = {f"part_{i}": part for i, part in enumerate([*meshes, *emitters])}
        if not parts:
            parts["darkness"] = {"type": "point", "position": [0.0, 0.0, 0.0], "intensity": 0.0}
        self.scene = mi.load_dict({"type": "scene", **parts}, optimize=False)
        self._environment = environment
        for emitter in emitters:
            emitter.set_scene(whole)  # distant light begins beyond the whole scene

    def pdf(self, si: Any, ds: Any, first: Any, active: Any) -> Any:
        """Density (mi.Float) of `scene.sample_emitter_direction`; `ds` describes a ray's hit in the whole scene.

        Infinite for openings that are left out, if the `first` ray of a path hits them: they get no weight.
        """
        number = dr.reinterpret_array(mi.UInt32, ds.emitter)
        apart = active & (number < dr.width(self._apart)) & dr.gather(mi.Bool, self._apart, number, active)
        if self._environment is not None:
            ds = dr.copy(ds)
            ds.emitter = dr.select(ds.emitter.is_environment(), mi.EmitterPtr(self._environment), ds.emitter)
        return dr.select(
            apart, dr.select(first, dr.inf, 0.0), self.scene.pdf_emitter_direction(si, ds, active & ~apart)
        )


def sky_without(found: FoundSun, builder: SceneBuilder, whole: Any, effort: float = 1.0) -> Any:
    """mi.Emitter of a builder's environment without its sun, with its own guide; None without an environment.

    The guide, learnt with `effort`, sees the sky through the panes that the sun passes.
    """
    environment = builder.environment
    same = found.picture is None and not found.record.panes
    if environment is None or builder.scene.environment is None or same:
        return environment
    sky = bare_sky(found, builder.scene.environment)
    guide = learn(builder.scene, whole, sky, panes=bool(found.record.panes), effort=effort)
    if guide is not None:
        sky = guided_sky(sky, guide, whole.bbox())
    parameters, own = mi.traverse(sky), mi.traverse(environment)
    former, rest = (brought_by(light, builder.scene, whole) for light in (environment, sky))
    parameters["sampling_weight"] = float(own["sampling_weight"]) * max(rest / former if former > 0 else 1.0, 0.1)
    parameters.update()
    return sky


def bare_sky(found: FoundSun, environment: Environment) -> Any:
    """mi.Emitter of an environment without its sun, not guided."""
    description = environment_dict(environment)
    picture = np.array(description["bitmap"])
    if found.picture is not None:
        _take_out(picture[..., :3], found.picture, float(description["scale"]))
    return mi.load_dict(description | {"bitmap": mi.Bitmap(picture)})


def _take_out(picture: Any, sun: SunPicture, scale: float) -> None:
    """Subtract the light of a sun from a picture (H, W, 3)."""
    (height, width), (top, left) = sun.size, sun.corner
    row, column = np.nonzero(sun.pixels.any(axis=-1))
    at = row + top, (column + left) % width
    assert np.all(at[0] < height), "the rim is black"
    picture[at] = np.maximum(picture[at] - sun.pixels[row, column] / scale, 0)
