"""The draws of a frame: its objects, each with integrator, samples and textures."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any

from lambent.materials.clear import clear_terms
from lambent.materials.document import Material
from lambent.materials.lobes import widths
from lambent.realtime.frame_state import SHOW, FrameState
from lambent.realtime.incident import LookUp, brings_light
from lambent.realtime.integrators.integrators import INTEGRATORS, Cube, Integrator
from lambent.realtime.light.probe_light import ProbeLight
from lambent.realtime.materials.textures import BITS, WIDENING, bits_that_show
from lambent.realtime.objects.clusters import Ranges
from lambent.realtime.resources import ObjectResources, SceneResources

BLURS_M = 0.04  # least roughness of lobes that blur what they mirror
FAINT_N = 5  # samples per lobe that suffice if no lamp's highlight shows


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
    takes_lamps: bool = False  # out of the probe's cube map, and evaluates them
    planar_n: int = 0  # samples per lobe on planar reflectors; 0 for objects without pixels on any
    is_beyond: bool = False  # light of a part, added to neighbouring parts
    is_pane: bool = False  # clear glass: the background shows straight through it
    has_holes: bool = False

    def by(self, how: Integrator, resources: SceneResources, n: int) -> Draw:
        """The same object by another integrator, for a pass that does not read reflections."""
        group = resources.materials[self.item.record.material].group(self.material, how, n)
        takes = takes_lamps(how, self.item.light, self.look_up, self.material, self.textures)
        return replace(self, integrator=how, n=n, material_group=group, takes_lamps=takes, planar_n=0)

    @property
    def planar(self) -> bool:
        """Whether the object has pixels on planar reflectors."""
        return self.planar_n > 0

    @property
    def lobes(self) -> int:
        return len(self.material.lobes) if self.integrator.specular else 0

    @property
    def shader(self) -> str:
        """File of the integrator's shader."""
        return (self.takes_lamps and self.integrator.lamps) or self.integrator.shader

    @property
    def cube(self) -> Cube:
        """The cube map of the probe that the draw reads."""
        return "cleaned" if self.takes_lamps else self.integrator.cube

    @property
    def _layers(self) -> dict[str, float]:
        if not self.takes_lamps:
            return {}
        return {"LAYERS": 1 + self.item.light.lamps.mixes(self.material, bool(self.textures & WIDENING))}

    @property
    def blurs(self) -> bool:
        """Whether each of its lobes is wide enough to blur the view mirrored in it."""
        narrowest = min((min(widths(lobe)) for lobe in self.material.lobes), default=0.0)
        return bool(self.integrator.lamps) and narrowest >= BLURS_M and not self.textures & BITS["roughness"]

    @property
    def _openings(self) -> dict[str, float]:
        return {"MIRRORS_OPENINGS": 1} if self.planar and not self.blurs else {}

    @property
    def _change(self) -> dict[str, float]:
        return {"RELIT": 1} if self.item.light.is_relit and brings_light(self.look_up) else {}

    @property
    def _part(self) -> dict[str, float]:
        return {"PART": 1 + self.is_beyond} if self.item.record.borders else {}

    @property
    def faces(self) -> Ranges:
        """(first, count) of the faces to draw."""
        record = self.item.record
        return self.item.beyond if self.is_beyond else [(record.first_face, record.face_count)]

    @property
    def object_group(self) -> Any:
        return self.item.group(self.cube, self.look_up)

    @property
    def constants(self) -> dict[str, float]:
        """Constants of the pipeline. With constants instead of uniforms, unrolled loops make it a quarter faster."""
        return {
            "SAMPLES": self.n,
            "LOBES": self.lobes,
            "TEXTURES": self.textures,
            **({"LAMBENT_CURVES": 1} if self.material.version > 1 else {}),
            **self.look_up.constants(self.item.light.device, self.item.light.probe),
            **self._change,
            **self.integrator.constants,
            **self._layers,
            **self._part,
            **self._openings,
            **({"STRAIGHT": 1, "MASKED": self.has_holes} if self.is_pane else {}),
        }


def takes_lamps(how: Integrator, light: ProbeLight, look_up: LookUp, material: Material, textures: int) -> bool:
    """Whether an integrator takes a probe's lamps out of its cube map for a material.

    `textures` are the bits of the textures that show.
    """
    return bool(how.lamps) and not brings_light(look_up) and light.lamps.serve(material, bool(textures & WIDENING))


def shows_no_lamp(how: Integrator, light: ProbeLight, look_up: LookUp, material: Material, textures: int) -> bool:
    """Whether lamps stay in the cube map because their highlights on the material are faint."""
    return bool(how.lamps) and not brings_light(look_up) and light.lamps.are_faint(material, bool(textures & WIDENING))


def panes_of(state: FrameState, resources: SceneResources) -> frozenset[str]:
    """Names of the objects of clear glass (`materials.clear`), if the frame shows specular light.

    Glass whose light field has maps of refracted rays uses these maps instead.
    """
    if SHOW[state.show][3] or not INTEGRATORS[state.integrator].specular:
        return frozenset()
    given = resources.scene.record.materials
    clear = {
        name for name, buffers in resources.materials.items()
        if not buffers.textures.bits & WIDENING and clear_terms(state.materials.get(name, given[name])) is not None
    }  # fmt: skip
    items = (item for item in resources.objects if item.record.material in clear)
    return frozenset(item.record.name for item in items if not _refracts(state, item))


def _refracts(state: FrameState, item: ObjectResources) -> bool:
    look_up = item.light.look_up(state.lookups.get(item.record.name, state.lookup))
    field = item.light.probe.light_field
    return brings_light(look_up) and field is not None and field.glass is not None


def draws_of(
    state: FrameState, resources: SceneResources, reflecting: Collection[str] = (), panes: Collection[str] = ()
) -> list[Draw]:
    """Draws of a frame; objects in `reflecting` are on planar reflectors, objects in `panes` are clear glass."""
    wanted = INTEGRATORS["diffuse" if SHOW[state.show][3] else state.integrator]
    found = {}
    for name, buffers in resources.materials.items():
        material, textures = state.materials.get(name, resources.scene.record.materials[name]), buffers.textures
        lobes = len(material.lobes) if wanted.specular else 0
        how = wanted if lobes else INTEGRATORS["diffuse"]
        anisotropic = any(lobe.mx != lobe.my for lobe in material.lobes)
        bits = bits_that_show(textures.bits, lobes, anisotropic)
        found[name] = (material, how, bits)
    draws = []
    for item in resources.objects:
        material, how, bits = found[item.record.material]
        buffers, light = resources.materials[item.record.material], item.light
        wish = state.lookups.get(item.record.name, state.lookup)
        look_up = light.look_up(wish) if how.specular else light.cheapest
        takes = takes_lamps(how, light, look_up, material, bits)
        alone = takes and light.lamps.all_out(material, bool(bits & WIDENING))
        rough = buffers.textures.rough
        n = how.rows or (state.samples(material, rough, alone) if how.specular else 1)
        if state.n is None and not takes and shows_no_lamp(how, light, look_up, material, bits):
            n = min(n, FAINT_N)
        is_pane, has_holes = item.record.name in panes, item.record.name in resources.masked
        mirrors = how.specular and item.record.name in reflecting and not is_pane
        on_planes = state.planar_samples(material, rough) if mirrors else 0
        group = buffers.group(material, how, n)
        draws.append(
            Draw(
                item, material, how, n, look_up, group, bits, takes, on_planes, is_pane=is_pane, has_holes=has_holes
            )
        )  # fmt: skip
    return draws
