"""Lamps: Blender's watts as radiant intensity, irradiance and radiance, linear Rec. 709.

As Cycles has it: P watts of a point or a spot are P/(4 pi) W/sr in every direction that it lights, P of a sun are W/m^2
on a surface that faces it, P of an area is its flux, of radiance P/(pi A). An IES texture multiplies P by its candela.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from mathutils import Vector

from .files import Copies
from .geometry import escaped
from .properties import setting
from .units import Frame, behind, upright

SIDES = 64  # of a disc
FACE = "lamp face"  # material of area lamps
REAL_SUN_RAD = 0.0094  # diameter; larger suns become a disc in the picture of the world


@dataclass
class Lamps:
    """Lamps as sections of a scene.toml: `lights`, `objects` of the area lamps, whose faces are `obj` text."""

    frame: Frame
    copies: Copies
    note: object
    world_is_plain: bool
    lights: list = field(default_factory=list)
    objects: dict = field(default_factory=dict)
    obj: list = field(default_factory=list)
    names: dict = field(default_factory=dict)  # full name of an object -> names of its lamps
    soft: int = 0
    soft_sun: tuple | None = None  # unit vector towards it, irradiance, angular radius

    def add(self, name, light, matrix):
        """A lamp of Blender at the world matrix of its object."""
        factor, photometry = _of_nodes(light, lambda what: self.note(f"light {name}: {what}"))
        power = light.energy * 2 ** getattr(light, "exposure", 0.0)
        if not getattr(light, "normalize", True):
            power *= light.area(matrix_world=matrix)
        if light.type != "SUN":
            power = self.frame.watts(power)
        tint = [a * b for a, b in zip(_colour(light), factor, strict=True)]
        own, watts = setting(light, "lambent_luminaire"), [power * c for c in tint]
        files = own or photometry
        file = self.copies.take(files, light, "luminaires", f"light {name}", "Blender's lamp stays") if files else None
        if not (own and file) and (min(watts) < 0 or not any(watts)):
            self.note(f"light {name}: left out, it {'takes light away' if min(watts) < 0 else 'gives no light'}")
        elif file is not None:
            self._luminaire(name, matrix, file, {} if own else {"scale": power * luminance(tint)}, tint)
        elif light.type == "AREA":
            self._face(name, light, matrix, watts)
        elif light.type == "SUN":
            self._sun(name, light.angle, behind(matrix), watts)
        else:
            self.soft += light.shadow_soft_size > 0
            self._lamp(name, light, matrix, [w / (4 * math.pi) for w in watts])

    def finish(self):
        """The note on the sizes of all lamps."""
        if self.soft:
            self.note(f"{self.soft} point and spot lights have a radius: they become points, with sharp shadows")

    def _light(self, kind, name, **values):
        self.lights.append({"kind": kind, "name": name, **values})

    def _sun(self, name, angle, direction, irradiance):
        """A sharp sun; or, of a scene's suns, the first soft one where the world leaves room for it."""
        if angle <= REAL_SUN_RAD:
            self._light("directional", name, direction=direction, irradiance=irradiance)
        elif self.soft_sun is None and self.world_is_plain:
            self.soft_sun = ([-x for x in direction], irradiance, angle / 2)
        else:
            self.note(f"light {name}: its angle of {math.degrees(angle):.3g} degrees: its shadows are sharp")
            self._light("directional", name, direction=direction, irradiance=irradiance)

    def _lamp(self, name, light, matrix, intensity):
        place = {"position": self.frame.place(matrix.translation), "intensity": intensity}
        if light.type == "POINT":
            self._light("point", name, **place)
            return
        edge = math.cos(light.spot_size / 2)
        inner = math.acos(min(edge + (1 - edge) * light.spot_blend, 1.0))
        angles = {"inner_deg": math.degrees(inner), "outer_deg": math.degrees(light.spot_size / 2)}
        self._light("spot", name, **place, direction=behind(matrix), **angles)

    def _luminaire(self, name, matrix, file, scale, tint):
        """A luminaire; Blender's horizontal angle 0 is towards its lamp's -y."""
        colour = {"colour": tint} if any(tint) else {}
        place = {"position": self.frame.place(matrix.translation), "direction": behind(matrix)}
        across = upright((-matrix.col[1].xyz).normalized())
        self._light("ies", name, file=file, **place, across=across, **scale, **colour)

    def _face(self, name, light, matrix, watts):
        """An emitting rectangle or ellipse."""
        if light.spread < math.pi - 1e-3:
            self.note(f"light {name}: its spread of {math.degrees(light.spread):.3g} degrees becomes 180")
        corners, ahead = [self.frame.place(matrix @ Vector((x, y, 0.0))) for x, y in _outline(light)], behind(matrix)
        normal = _normal(corners)
        area_m2 = math.hypot(*normal)
        if sum(n * a for n, a in zip(normal, ahead, strict=True)) < 0:
            corners.reverse()
        if area_m2 < 1e-12:
            self.note(f"light {name}: left out, it has no area")
            return
        self.obj += [f"o {name}", f"usemtl {FACE}", *("v {:.9g} {:.9g} {:.9g}".format(*corner) for corner in corners)]
        self.obj += ["vt 0 0", "vn {:.9g} {:.9g} {:.9g}".format(*ahead)]
        self.obj.append("f " + " ".join(f"{i - len(corners)}/-1/-1" for i in range(len(corners))))
        self.objects[escaped(name)] = {"emission": [w / (math.pi * area_m2) for w in watts]}


def luminance(colour):
    """Of linear Rec. 709."""
    return 0.2126 * colour[0] + 0.7152 * colour[1] + 0.0722 * colour[2]


def _colour(light):
    if not getattr(light, "use_temperature", False):
        return list(light.color)
    return [a * b for a, b in zip(light.color, light.temperature_color, strict=True)]


def _of_nodes(light, note):
    """The factor (3,) of a lamp's Emission node, and the file or text of an IES texture that is its strength."""
    if light.node_tree is None or not getattr(light, "use_nodes", True):
        return [1.0, 1.0, 1.0], None
    output = next(
        (n for n in light.node_tree.nodes if n.bl_idname == "ShaderNodeOutputLight" and n.is_active_output), None
    )
    emission = source(output.inputs["Surface"]) if output else None
    if emission is None or emission.bl_idname != "ShaderNodeEmission":
        note("its nodes are not carried")
        return [1.0, 1.0, 1.0], None
    colour, strength = emission.inputs["Color"], emission.inputs["Strength"]
    ies = source(strength)
    if colour.is_linked or (
        ies is not None and (ies.bl_idname != "ShaderNodeTexIES" or ies.inputs["Strength"].is_linked)
    ):
        note("its nodes are not carried, but for plain emission and an IES texture")
        return [1.0, 1.0, 1.0], None
    factor = strength.default_value if ies is None else ies.inputs["Strength"].default_value
    if ies is not None and not (ies.filepath if ies.mode == "EXTERNAL" else ies.ies):
        note("its IES texture has no file")
    file = None if ies is None else ies.filepath if ies.mode == "EXTERNAL" else ies.ies
    return [factor * c for c in colour.default_value[:3]], file


def source(socket):
    """The node that a socket is linked to, past reroutes; None without one."""
    while socket.is_linked:
        node = socket.links[0].from_node
        if node.bl_idname != "NodeReroute":
            return node
        socket = node.inputs[0]
    return None


def _outline(light):
    """(x, y) of an area lamp's corners, in order around it."""
    width, height = light.size / 2, (light.size_y if light.shape in ("RECTANGLE", "ELLIPSE") else light.size) / 2
    if light.shape in ("SQUARE", "RECTANGLE"):
        return [(-width, -height), (-width, height), (width, height), (width, -height)]
    angles = [-2 * math.pi * i / SIDES for i in range(SIDES)]
    return [(width * math.cos(a), height * math.sin(a)) for a in angles]


def _normal(corners):
    """Of a plane polygon, as long as its area is large: Newell's method."""
    pairs = list(zip(corners, corners[1:] + corners[:1], strict=True))
    return [sum(p[i] * q[j] - p[j] * q[i] for p, q in pairs) / 2 for i, j in ((1, 2), (2, 0), (0, 1))]
