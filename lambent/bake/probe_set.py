"""All probes of a scene: one after another with its object left out, sharing meshes and light map."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.bake.atlas import Atlas
from lambent.bake.emitters import balance_emitters
from lambent.bake.mitsuba_scene import SceneBuilder
from lambent.bake.planes import bounding_planes
from lambent.bake.probe import LightMapCache, bake_probe
from lambent.bake.probe_centre import encloses, probe_centre
from lambent.bake.quality import Quality

Array = NDArray[np.floating]


class ProbeSet:
    """Bakes the probes of an atlas' scene from its light map (H, W, 3)."""

    def __init__(self, atlas: Atlas, irradiance: Array, irradiance_back: Array | None) -> None:
        self._builder = SceneBuilder(atlas.scene, atlas.uv2, diffuse=False)
        balance_emitters(self._builder)
        self._cache = LightMapCache(self._builder, irradiance, irradiance_back)

    @cached_property
    def _whole(self) -> Any:
        return self._builder.build()

    def bake(self, name: str, quality: Quality, seed: int) -> tuple[dict[str, Array], dict[str, Any]]:
        """Arrays radiance, distance and planes of one object's probe, and what to note: centre and what was left out.

        Planes that the scene gives are taken as they are; others are found from what the probe sees.
        """
        without = self._builder.build(leave_out={name})
        centre = probe_centre(self._builder, name, without)
        left_out = not encloses(self._builder, name, centre, self._whole)
        seen = without if left_out else self._whole
        probe = bake_probe(seen, self._cache, centre, quality.probe_texels, quality.probe_samples, seed)
        given = self._builder.scene.probe_planes.get(name)
        if given is None:
            planes = bounding_planes(probe.distance, probe.normals)
            planes[:, 3] -= planes[:, :3] @ centre.astype(np.float32)
        else:
            planes = np.asarray(given, np.float32)
        arrays = {"radiance": probe.radiance, "distance": probe.distance, "planes": planes}
        return arrays, {"centre": [float(x) for x in centre], "object_left_out": left_out}
