"""Which texels of the light map the sun may reach: the renderer's shadow map leaks along joints of thin sheets."""

from __future__ import annotations

import numpy as np

from lambent.baking.artefacts.light_map import may_have_sun
from lambent.baking.context import BakeContext
from lambent.baking.running.keys import key_of
from lambent.store.sunlit import GEOMETRY, SUNLIT

KIND = "sunlit"
NEEDS = ("geometry", "light_map")
REVISION = 2


def keys(context: BakeContext) -> dict[str, str]:
    if not may_have_sun(context.scene):
        return {}
    return {SUNLIT: key_of(KIND, REVISION, context.keys("light_map")["light_map/irradiance"], context.seed)}


def bake(context: BakeContext) -> None:
    from lambent.baking.light.sunlit import sunlit
    from lambent.baking.tracing.lights.sun import SunRays

    traced, texels, sun = context.traced, context.traced.texels, context.traced.sun
    found = np.ones((texels.height, texels.width), np.uint8)
    notes: dict[str, object] = {"geometry": context.keys("geometry")[GEOMETRY]}
    if sun is not None:
        rays = SunRays(sun, traced.whole(diffuse=False))
        found = sunlit(texels, traced.merged, traced.labels, rays, context.seed, context.progress)
        notes["sun"] = list(sun.record.direction)
    context.put(KIND, SUNLIT, found, context.provenance(**notes))
