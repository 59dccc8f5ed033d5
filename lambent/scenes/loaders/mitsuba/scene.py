"""A Mitsuba scene file, versions 0.6 and 3, as parts of a scene.

Everything that is not read is dropped, with a warning. A scene whose cameras use another up axis is rotated to y up.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

from lambent.core.ceilings import TRIANGLES
from lambent.core.errors import UserError
from lambent.core.geometry.directions import Floats, normalize, rotation_about
from lambent.core.plain import UniqueNames
from lambent.core.views.camera import Camera
from lambent.scenes.loaders.contents import DEFAULTS, Contents, LoadOptions
from lambent.scenes.loaders.mitsuba import lights
from lambent.scenes.loaders.mitsuba.bsdfs import surface_of
from lambent.scenes.loaders.mitsuba.document import read
from lambent.scenes.loaders.mitsuba.shapes import Made, mesh_of_shape, stem_of
from lambent.scenes.loaders.mitsuba.values import Plugin, Reading, children_of
from lambent.scenes.loaders.scene_files import SceneFiles
from lambent.scenes.loaders.surfaces.material_builder import MaterialBuilder
from lambent.scenes.loaders.surfaces.surface import Surface
from lambent.scenes.scene import DirectionalLight, Environment, Light, PointLight, SceneObject, SunSky

GROUPS = ("shapegroup", "instance", "merge")
LEVEL = 0.05  # largest component of a camera's sideways axis along the up axis
UNREAD = {"medium": "participating media are ignored", "volume": "volumes are ignored",
          "subsurface": "subsurface scattering is ignored"}  # fmt: skip


def load(path: Path, options: LoadOptions = DEFAULTS) -> Contents:
    """Contents of a Mitsuba scene.

    Raises
    ------
    UserError
        If the file, or a mesh it refers to, is unusable, or there are no triangles.
    """
    return _Scene(Reading(read(path, SceneFiles(path, options.root))), path).contents()


class _Scene:
    """State of converting one scene to contents."""

    def __init__(self, reading: Reading, path: Path) -> None:
        self._reading, self._path = reading, path
        self._world: Floats = np.eye(4)
        self._objects: list[SceneObject] = []
        self._by_element: dict[int, str] = {}
        self._names = UniqueNames()
        self._material_names = UniqueNames()
        self._local: dict[int, Made] = {}
        self._triangles = 0
        self._warnings: list[str] = []
        self._made = MaterialBuilder(self._warnings)

    def contents(self) -> Contents:
        sensors = list(children_of(self._reading, "sensor"))
        self._world, turned = _upright(sensors)
        if turned:
            self._warnings.append(f"its cameras have {turned} up: the scene is rotated to y up")
        for shape in children_of(self._reading, "shape"):
            self._add_shape(shape, self._world)
        if not self._objects:
            raise UserError("holds no triangles", file=self._path, hint="; ".join(self._notes()) or None)
        environment, found = self._lights()
        point_lights: list[Light] = [*found]
        if isinstance(environment, SunSky):
            point_lights = [lights.in_sky_units(light) for light in found]
            self._take_sky_units(bool(found))
        cameras = self._cameras(sensors)
        self._say_the_rest()
        return Contents(
            tuple(self._objects),
            self._made.materials,
            tuple(point_lights),
            tuple(cameras),
            tuple(self._reading.files.sources),
            tuple(self._notes()),
            self._made.textures,
            environment,
            tells_its_light=True,
        )

    def _notes(self) -> list[str]:
        return [*self._warnings, *self._reading.notes, *self._reading.images.notes, *self._reading.files.notes]

    def _add_shape(self, shape: Plugin, world: Floats) -> None:
        if shape.type == "instance":
            self._add_instance(shape, world)
            return
        if shape.type == "shapegroup":
            return  # shown only by instances
        if shape.type == "merge":
            for inner in shape.objects("shape", refs=False):
                self._add_shape(inner, world)
            return
        emission = lights.emission_of(shape)
        bsdf = next(iter(shape.objects("bsdf")), None)
        for what, words in UNREAD.items():
            if shape.objects(what):
                self._reading.note(words)
        if bsdf is not None and bsdf.type == "null" and not any(emission):
            shape.note("left out, it has no surface (null)")
            return
        wanted = stem_of(shape)
        mesh, notes = mesh_of_shape(shape, wanted, world, self._local)
        self._warnings += notes
        if mesh is None:
            return
        shape.objects("sensor")
        shape.note_unread(but=("max_smooth_angle", "name", "id"))
        self._triangles += len(mesh.faces)
        TRIANGLES.check(self._triangles, file=self._path)
        material = self._material(bsdf, wanted)
        self._objects.append(SceneObject(self._names.unique(wanted), mesh, material, emission))

    def _add_instance(self, shape: Plugin, world: Floats) -> None:
        """Add a copy of a group's shapes at another place."""
        placed = world @ shape.transform()
        for group in shape.objects("shape"):
            if group.type != "shapegroup":
                shape.note("its shape is no shapegroup")
            for inner in group.objects("shape", refs=False):
                if inner.type in GROUPS:
                    raise inner.element.error("nested groups are ignored")
                self._add_shape(inner, placed)
        shape.note_unread()

    def _material(self, bsdf: Plugin | None, shape: str) -> str:
        """The name of a BSDF's material, created at its first use."""
        key = id(bsdf.element) if bsdf is not None else 0
        if key not in self._by_element:
            wanted = "default" if bsdf is None else bsdf.element.id or f"{shape}_{bsdf.type}"
            name = self._by_element[key] = self._material_names.unique(wanted)
            self._made.make(name, lambda _: Surface.grey() if bsdf is None else surface_of(bsdf))
        return self._by_element[key]

    def _lights(self) -> tuple[Environment | None, list[PointLight | DirectionalLight]]:
        environment: Environment | None = None
        found: list[PointLight | DirectionalLight] = []
        for plugin in children_of(self._reading, "emitter"):
            if plugin.type not in lights.ENVIRONMENTS:
                light = lights.light_of(plugin, self._world)
                found += [light] if light is not None else []
            elif environment is not None:
                plugin.note("left out, a scene has one environment")
            else:
                environment = lights.environment_of(plugin, self._world)
        return environment, found

    def _take_sky_units(self, lit: bool) -> None:
        """Convert emission in a scene with a sky to its unit: Mitsuba then has all light in W/(sr m^2 nm)."""
        if lit or any(any(o.emission) for o in self._objects):
            self._warnings.append("its lamps are taken in the unit of its sky, W/(sr m2 nm): 1 is 73 kcd/m2")
        self._objects = [replace(o, emission=lights.scaled(o.emission)) for o in self._objects]

    def _cameras(self, sensors: list[Plugin]) -> list[Camera]:
        names = UniqueNames()
        cameras = []
        for plugin in sensors:
            camera = lights.camera_of(plugin, plugin.element.id or "camera", self._world)
            if camera is not None:
                cameras.append(replace(camera, name=names.unique(camera.name)))
        return cameras

    def _say_the_rest(self) -> None:
        """Note the unread top-level elements of the file."""
        kinds = Counter(e.tag for e in self._reading.document.elements)
        for tag, words in UNREAD.items():
            if kinds[tag]:
                self._reading.note(words)
        known = {"shape", "sensor", "emitter", "bsdf", "texture", "integrator", "sampler", "film", "rfilter", "alias"}
        left = [tag for tag in kinds if tag not in known | set(UNREAD)]
        if left:
            self._reading.note(f"ignored: {', '.join(f'<{tag}>' for tag in left)}")
        integrators = [e.type for e in self._reading.document.elements if e.tag == "integrator"]
        if integrators:
            self._reading.note(f"its integrator ({integrators[0]}) is ignored")


def _upright(sensors: list[Plugin]) -> tuple[Floats, str | None]:
    """Rotation (4, 4) that takes the up axis of most cameras to +y, and the name of that axis if it is another."""
    votes = Counter(axis for axis in map(_up_axis, sensors) if axis is not None)
    if not votes:
        return np.eye(4), None
    index, sign = votes.most_common(1)[0][0]
    if (index, sign) == (1, 1):
        return np.eye(4), None
    world = np.eye(4)
    if index == 1:
        world[:3, :3] = np.diag([1.0, -1.0, -1.0])
    else:  # minimal rotation to y, by a right angle about up x y; rounded to exact numbers without -0
        axis = np.cross(np.eye(3)[index] * sign, [0.0, 1.0, 0.0])
        world[:3, :3] = np.round(rotation_about(axis, math.pi / 2)) + 0.0
    return world, f"{'-' if sign < 0 else ''}{'xyz'[index]}"


def _up_axis(sensor: Plugin) -> tuple[int, int] | None:
    """The signed world axis that is up for a camera; None if its transform is ambiguous."""
    element = sensor.transform_element("to_world")
    if element is None:
        return None
    if len(element.children) == 1 and element.children[0].tag == "lookat" and "up" in element.children[0].attributes:
        up = np.array(element.children[0].floats(3, "up"))
        index = int(np.argmax(np.abs(up)))
        return index, 1 if up[index] >= 0 else -1
    matrix = sensor.transform()
    left, up, ahead = (normalize(matrix[:3, i]) for i in range(3))
    level = [i for i in range(3) if abs(left[i]) < LEVEL and abs(ahead[i]) < 0.95]
    if not level:
        return None
    index = max(level, key=lambda i: abs(up[i]))
    return (index, 1 if up[index] > 0 else -1) if abs(up[index]) > 0.3 else None
