"""The objects of a frame, each with how it is drawn."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any

from lambent.materials.document import Material
from lambent.realtime.frame_state import SHOW, FrameState
from lambent.realtime.incident import LookUp
from lambent.realtime.integrators import INTEGRATORS, Integrator
from lambent.realtime.resources import ObjectResources, SceneResources
from lambent.realtime.textures import WIDENING, bits_that_show


@dataclass(frozen=True)
class Draw:
    """One object as it is drawn in a frame."""

    item: ObjectResources
    material: Material
    integrator: Integrator
    n: int  # samples per lobe
    look_up: LookUp
    material_group: Any
    textures: int = 0  # bits of the textures to read, see realtime.textures
    aims: bool = False  # samples at the lamps of its probe
    planar: bool = False  # has pixels on planar reflectors

    def by(self, how: Integrator, resources: SceneResources, n: int) -> Draw:
        """The same object by another integrator, for a pass that neither aims nor reads reflections."""
        group = resources.materials[self.item.record.material].group(self.material, how, n)
        return replace(self, integrator=how, n=n, material_group=group, aims=False, planar=False)

    @property
    def lobes(self) -> int:
        return len(self.material.lobes) if self.integrator.specular else 0

    @property
    def shader(self) -> str:
        """File of the integrator's shader."""
        return self.integrator.aimed if self.aims and self.integrator.aimed else self.integrator.shader

    @property
    def object_group(self) -> Any:
        return self.item.group(self.integrator.cube, self.look_up, self.aims)

    @property
    def constants(self) -> dict[str, float]:
        """Constants of the pipeline, not uniforms: the compiler unrolls loops, which is a quarter faster."""
        return {
            "SAMPLES": self.n,
            "LOBES": self.lobes,
            "TEXTURES": self.textures,
            **self.look_up.constants(self.item.light.probe),
            **self.integrator.constants,
        }


def draws_of(state: FrameState, resources: SceneResources, reflecting: Collection[str] = ()) -> list[Draw]:
    """What a frame draws; objects whose names are in `reflecting` have pixels on planar reflectors."""
    wanted = INTEGRATORS["diffuse" if SHOW[state.show][3] else state.integrator]
    found = {}
    for name, buffers in resources.materials.items():
        material, textures = state.materials.get(name, resources.scene.record.materials[name]), buffers.textures
        lobes = len(material.lobes) if wanted.specular else 0
        how = wanted if lobes else INTEGRATORS["diffuse"]
        n = how.rows or (state.samples(material, textures.rough) if lobes else 1)
        anisotropic = any(lobe.mx != lobe.my for lobe in material.lobes)
        bits = bits_that_show(textures.bits, lobes, anisotropic)
        found[name] = (material, how, n, buffers.group(material, how, n), bits)
    draws = []
    for item in resources.objects:
        material, how, n, group, bits = found[item.record.material]
        light = item.light
        look_up = light.look_up(state.lookups.get(item.record.name, state.lookup)) if how.specular else light.cheapest
        aims = bool(how.aimed) and look_up.AIMS and light.lamps.is_aimed_at(material, bool(bits & WIDENING))
        planar = how.specular and item.record.name in reflecting
        draws.append(Draw(item, material, how, n, look_up, group, bits, aims, planar))
    return draws
