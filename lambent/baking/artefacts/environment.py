"""The environment as a cube map."""

from __future__ import annotations

from dataclasses import dataclass

from lambent.baking.context import BakeContext
from lambent.baking.quality import QualityName
from lambent.baking.running.keys import environment_inputs, key_of
from lambent.core.light.colour import in_halves

KIND = "environment"
NEEDS = ()
REVISION = 1
RADIANCE = "environment/radiance"
BLACK_TEXELS = 16  # along a side, without an environment


@dataclass(frozen=True)
class Settings:
    """`texels` along a side of each face of the cube map."""

    texels: int


SETTINGS = {QualityName.preview: Settings(256), QualityName.normal: Settings(512), QualityName.final: Settings(1024)}


def keys(context: BakeContext) -> dict[str, str]:
    inputs = environment_inputs(context.scene.environment)
    return {RADIANCE: key_of(KIND, REVISION, context.settings(KIND).texels, inputs)}


def bake(context: BakeContext) -> None:
    environment = context.scene.environment
    from lambent.baking.sky.cube import environment_cube

    context.progress(0, 1, "environment")
    cube = environment_cube(environment, context.settings(KIND).texels if environment else BLACK_TEXELS)
    radiance, unit = in_halves(cube)
    context.put(KIND, RADIANCE, radiance, {"unit": unit})
    context.progress(1, 1, "environment")
