"""Conversion of a scene to Mitsuba.

Mitsuba's world is ours: right-handed, y up, metres.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baking.bsdfs.edited_plugin import edited_dict
from lambent.baking.bsdfs.material_plugin import material_dict, register_material_plugin
from lambent.baking.bsdfs.table_plugin import table_dict
from lambent.baking.sky.daylight import sky_image
from lambent.baking.tracing.lights.luminaire_emitters import ies_emitter
from lambent.baking.tracing.shapes import UV2_ATTRIBUTE, ObjectNumbers, Shapes
from lambent.core.arrays import Floats
from lambent.materials.factored.terms import Editable
from lambent.materials.measured.tables.patch_sheet import Lookup
from lambent.scenes.panes import is_clear
from lambent.scenes.scene import (
    ComputedEnvironment,
    ConstantEnvironment,
    DirectionalLight,
    Environment,
    IesLight,
    Light,
    MaterialTextures,
    PointLight,
    Scene,
    SunSky,
)
from lambent.scenes.sky.computed import lat_long_image
from lambent.scenes.sky.environment_images import read_lat_long, up_turn

Look = tuple[str, bool, int]  # document, whether it is clear glass, and id of the textures
COARSE = 4  # pixels along each side that become one pixel of a coarse sky
FEW_PIXELS = 128  # least pixels along the shorter side of a coarse picture; otherwise it stays unchanged


@dataclass(frozen=True)
class EmitterSampling:
    """Sampling of emitters as found by a pre-pass: the environment (mi.Emitter), guided or not, and weights.

    weights (n,) are those of `SceneBuilder.emitters()`.
    """

    environment: Any
    weights: Floats


class SceneBuilder:
    """Makes Mitsuba scenes of one scene: whole, or with objects left out; they share meshes.

    Parameters
    ----------
    scene : Scene
        The scene to build.
    uv2 : mapping, optional
        Light map coordinates (V, 2) by object name; they become the mesh attribute `vertex_uv2` (third component 0).
    diffuse : bool
        False removes the diffuse terms of all materials (for tracing with a light map).
    measured : mapping, optional
        Tables by material name that replace the material, whole even without `diffuse`.
    edited : mapping, optional
        By material name, terms and curves that replace those of documents.
    sampling : EmitterSampling, optional
        From another builder of the same scene, to sample emitters identically.
    unmapped : collection of str, optional
        Objects without texels in the light map, which keep their diffuse terms even without `diffuse`.
    coarse_sky : bool
        Reduce the environment's picture to a sixteenth of its pixels, for trials that cannot tell the difference.
    """

    def __init__(
        self,
        scene: Scene,
        uv2: Mapping[str, Floats] | None = None,
        *,
        diffuse: bool = True,
        measured: Mapping[str, Lookup] | None = None,
        sampling: EmitterSampling | None = None,
        edited: Mapping[str, Editable] | None = None,
        unmapped: Collection[str] = (),
        coarse_sky: bool = False,
    ) -> None:
        register_material_plugin()
        self.scene, self.measured, self.edited, self.unmapped = scene, measured or {}, edited or {}, unmapped
        self._diffuse = diffuse
        self._tables = {name: mi.load_dict(table_dict(grid)) for name, grid in self.measured.items()}
        for name, made in self.edited.items():
            self._tables[name] = mi.load_dict(edited_dict(scene.materials[name], made, scene.textures.get(name)))
        self._known = dict[Look, tuple[Any, MaterialTextures | None]]()
        self._first = self._bsdfs(scene, self._known)
        self._shapes = Shapes(scene, self._first, uv2 or {})
        self.meshes = self._shapes.meshes
        sized = scene.openings
        self.lights = [
            self.meshes[sized[number]].emitter() if number in sized else emitter_of(light)
            for number, light in enumerate(scene.lights)
        ]
        self._unsized = [emitter for number, emitter in enumerate(self.lights) if number not in sized]
        if sampling is None:
            self.environment: Any = emitter_of_environment(scene.environment, COARSE if coarse_sky else 1)
        else:
            self.environment = sampling.environment
            self.weigh_emitters(sampling.weights)

    def set_materials(self, scene: Scene) -> bool:
        """Set the materials and textures of a scene in all scenes built, or return False.

        False if objects of one shape would get different materials: then only another builder can. BSDFs of the first
        scene are kept. Those of another are dropped before new ones are made, which get their places: kernels depend
        on the number of BSDFs.
        """
        self._shapes.set_bsdfs(self._first)
        is_set = self._shapes.set_bsdfs(self._bsdfs(scene, dict(self._known)))
        self.scene = scene if is_set else self.scene
        return is_set

    def _bsdfs(self, scene: Scene, known: dict[Look, tuple[Any, MaterialTextures | None]]) -> list[Any]:
        """mi.BSDF of each object. Equal materials share one, because each takes time in every kernel: `known` ones."""
        found = dict.fromkeys([(o.material, self._diffuse or o.name in self.unmapped) for o in scene.objects])
        for name, diffuse in found:
            if name in self._tables:
                found[name, diffuse] = self._tables[name]
                continue
            material, textures = scene.materials[name], scene.textures.get(name)
            look = material_dict(material, diffuse=diffuse)["material"], is_clear(material, textures), id(textures)
            if look not in known:
                known[look] = mi.load_dict(material_dict(material, textures, diffuse=diffuse)), textures
            found[name, diffuse] = known[look][0]
        return [found[o.material, self._diffuse or o.name in self.unmapped] for o in scene.objects]

    def build(self, leave_out: Collection[str] = (), *, watertight: bool = False) -> Any:
        """mi.Scene without the named objects (and their emission).

        One in 100,000 rays slips between two triangles that share an edge; none does if the scene is `watertight`,
        which takes a third more time per ray. Graphics cards are always watertight.
        """
        parts: dict[str, Any] = {f"object_{i}": mesh for i, mesh in enumerate(self._shapes.without(leave_out))}
        parts |= {f"light_{i}": light for i, light in enumerate(self._unsized)}
        if self.environment is not None:
            parts["environment"] = self.environment
        if not self.lights and self.environment is None and not any(any(o.emission) for o in self.scene.objects):
            parts["darkness"] = {
                "type": "point",
                "position": [0.0, 0.0, 0.0],
                "intensity": 0.0,
            }  # Mitsuba warns about a scene without light
        if watertight and mi.variant().startswith("llvm"):
            parts["embree_use_robust_intersections"] = True
        return mi.load_dict({"type": "scene", **parts}, optimize=False)

    def without(self, names: Collection[str], whole: Any) -> Any:
        """The scene without the named objects; `whole`, which has all, if none is named."""
        return self.build(names) if names else whole

    def emitters(self) -> list[Any]:
        """All mi.Emitter: of objects, lights, environment."""
        found = [mesh.emitter() for mesh in self.meshes.values() if mesh.is_emitter()] + self._unsized
        return [*found, self.environment] if self.environment is not None else found

    def sampling(self) -> EmitterSampling:
        """The sampling of emitters, for another builder of the same scene."""
        weights = np.array([float(mi.traverse(emitter)["sampling_weight"]) for emitter in self.emitters()])
        return EmitterSampling(self.environment, weights)

    def weigh_emitters(self, weights: Floats) -> None:
        """Set the relative sampling frequency of each of `emitters()`, in scenes built from now on."""
        for emitter, weight in zip(self.emitters(), weights, strict=True):
            parameters = mi.traverse(emitter)
            parameters["sampling_weight"] = float(weight)
            parameters.update()

    @property
    def numbers(self) -> ObjectNumbers:
        """Finds the objects that rays have hit in this builder's scenes."""
        return self._shapes.numbers


def light_map_uv(si: Any, active: Any) -> Any:
    """Light map coordinates (mi.Point2f) of surface interactions."""
    uv2 = si.shape.eval_attribute_3(UV2_ATTRIBUTE, si, active)
    return mi.Point2f(uv2.x, uv2.y)


def light_map_texel(si: Any, width: int, height: int, active: Any) -> Any:
    """Light map texel (mi.UInt32), row * width + column, of surface interactions."""
    uv2 = light_map_uv(si, active)
    column = dr.clip(mi.Int32(dr.floor(uv2.x * width)), 0, width - 1)
    row = dr.clip(mi.Int32(dr.floor(uv2.y * height)), 0, height - 1)
    return mi.UInt32(row * width + column)


def bare_scene(corners: Floats) -> Any:
    """mi.Scene of triangles (F, 3, 3) in one mesh without a material, for intersections only."""
    mesh = mi.Mesh("all", 3 * len(corners), len(corners))
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = mi.Float(corners.astype(np.float32).ravel())
    parameters["faces"] = mi.UInt32(np.arange(3 * len(corners), dtype=np.uint32))
    parameters.update()
    dark = {"type": "point", "position": [0.0, 0.0, 0.0], "intensity": 0.0}  # Mitsuba warns without a light
    return mi.load_dict({"type": "scene", "all": mesh, "dark": dark}, optimize=False)


def _rgb(value: tuple[float, float, float]) -> dict[str, Any]:
    return {"type": "rgb", "value": list(value)}


def emitter_of(light: Light) -> Any:
    """mi.Emitter of a light."""
    return ies_emitter(light) if isinstance(light, IesLight) else mi.load_dict(light_dict(light))


def light_dict(light: PointLight | DirectionalLight) -> dict[str, Any]:
    """Mitsuba's dictionary of a light."""
    if isinstance(light, DirectionalLight):
        return {"type": "directional", "direction": list(light.direction), "irradiance": _rgb(light.irradiance)}
    if light.direction is None:
        return {"type": "point", "position": list(light.position), "intensity": _rgb(light.intensity)}
    origin = np.asarray(light.position, float)
    aside = [0.0, 0.0, 1.0] if abs(light.direction[1]) > 0.9 * np.linalg.norm(light.direction) else [0.0, 1.0, 0.0]
    frame = mi.ScalarTransform4f().look_at(origin.tolist(), (origin + light.direction).tolist(), aside)
    angles = {"cutoff_angle": light.outer_deg, "beam_width": min(light.inner_deg, light.outer_deg)}
    return {"type": "spot", "to_world": frame, "intensity": _rgb(light.intensity), **angles}


def emitter_of_environment(environment: Environment | None, size: int = 1) -> Any:
    """mi.Emitter, its picture reduced by `size` x `size`.

    None if it emits no light: Mitsuba's densities of a black picture are not finite.
    """
    if environment is None:
        return None
    found = environment_dict(environment, size)
    return mi.load_dict(found) if found["scale"] > 0 and np.array(found["bitmap"]).any() else None


def environment_dict(environment: Environment, size: int = 1) -> dict[str, Any]:
    """Mitsuba's dictionary of an environment, with `size` x `size` pixels of its picture averaged if there are enough.

    Mitsuba's lat-long image looks along -z at its left edge, ours at the centre: it is rotated by 180 degrees about y.
    """
    scale, rotation_deg, tilt = 1.0, 0.0, np.eye(4)
    if isinstance(environment, ConstantEnvironment):
        # as an image: Mitsuba's own constant evaluates to one value for any number of directions
        image = np.full((8, 16, 3), environment.radiance, np.float32)
    elif isinstance(environment, SunSky):
        image = sky_image(environment)
    elif isinstance(environment, ComputedEnvironment):
        image = lat_long_image(environment.name)
    else:
        image = read_lat_long(environment.file, environment.layout)
        scale, rotation_deg = environment.scale, environment.rotation_deg
        tilt[:3, :3] = up_turn(environment.up)
    height, width, _ = image.shape
    if size > 1 and min(height, width) >= FEW_PIXELS * size and height % size == width % size == 0:
        image = image.reshape(height // size, size, width // size, size, 3).mean(axis=(1, 3))
    turned = mi.ScalarTransform4f(tilt) @ mi.ScalarTransform4f().rotate([0, 1, 0], 180 + rotation_deg)
    bitmap = mi.Bitmap(np.ascontiguousarray(image, np.float32))
    return {"type": "envmap", "bitmap": bitmap, "scale": scale, "to_world": turned}
