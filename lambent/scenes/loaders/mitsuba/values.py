"""Values of a plugin's parameters: numbers, names, colours, textures, transforms. Unread parameters are noted."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from lambent.core.ceilings import XML_NESTING, XML_PLUGINS
from lambent.core.errors import did_you_mean
from lambent.core.geometry.directions import Floats, normalize, rotation_about
from lambent.core.plain import triple
from lambent.core.views.camera import FARTHEST_M, Camera, camera_axes
from lambent.scenes.loaders.mitsuba.colours import colour_of
from lambent.scenes.loaders.mitsuba.document import Document, Element
from lambent.scenes.loaders.surfaces.material_builder import TextureImage, TextureImages
from lambent.scenes.loaders.surfaces.surface import GREY, Surface
from lambent.scenes.loaders.surfaces.textured import Textured, combined, constant, flipped_uv
from lambent.scenes.scene import UvTransform

OBJECTS = {
    "bsdf", "texture", "shape", "emitter", "sensor", "film", "sampler", "rfilter", "medium", "phase", "volume",
    "integrator", "subsurface",
}  # fmt: skip
# Filters, caches, samplers: settings of Mitsuba unrelated to the scene.
MACHINERY = {
    "filter_type", "max_anisotropy", "cache", "sample_visible", "format", "accel", "sampling_weight", "variant",
    "component_format", "shutter_open", "shutter_close", "near_clip", "far_clip",
}  # fmt: skip
CHECKS = 128  # texels along a checkerboard of 2 x 2 fields
LUMINANCE = np.array([0.212671, 0.715160, 0.072169], np.float32)  # Mitsuba's own weights, for agreement with it


class Reading:
    """The state of reading one scene file: its document and files, its images, and notes for the user."""

    def __init__(self, document: Document) -> None:
        self.document, self.files, self.images = document, document.files, TextureImages(document.files)
        self.notes: list[str] = []
        self.surfaces: dict[int, Surface] = {}  # by BSDF element, so that each is read once
        self._plugins = 0

    def note(self, text: str) -> None:
        if text not in self.notes:
            self.notes.append(text)

    def count_plugin(self, element: Element) -> None:
        self._plugins += 1
        XML_PLUGINS.check(self._plugins, file=element.file, field=element.place)


class Plugin:
    """A plugin's element and its parameters; records which were read."""

    def __init__(self, element: Element, reading: Reading, trail: tuple[int, ...] = (), within: str = "") -> None:
        reading.count_plugin(element)
        if id(element) in trail:
            raise element.error("contains itself", got=element.id)
        XML_NESTING.check(len(trail), file=element.file, field=element.place)
        self.element, self.reading = element, reading
        self._trail = (*trail, id(element))
        self._within = element.id or within
        self._values: dict[str, Element] = {}
        self._objects: list[tuple[str, Element]] = []
        for child in element.children:
            if child.tag in OBJECTS:
                self._objects.append((child.name, child))
            elif child.tag == "ref":
                self._objects.append((child.name, self._referred(child)))
            else:
                self._values[child.name] = child
        self._asked: set[str] = set()

    def _referred(self, ref: Element) -> Element:
        ids = self.reading.document.ids
        wanted = ref.id or ""
        if wanted not in ids:
            raise ref.error("unknown id", got=wanted, hint=did_you_mean(wanted, ids))
        return ids[wanted]

    @property
    def type(self) -> str:
        return self.element.type

    @property
    def label(self) -> str:
        """Its name in warnings: its id, or that of the enclosing element."""
        return " ".join(filter(None, (self.element.tag, self._within, self.type and f"({self.type})")))

    def note(self, text: str) -> None:
        self.reading.note(f"{self.label}: {text}")

    def objects(self, tag: str, name: str | None = None, *, refs: bool = True) -> list[Plugin]:
        """Nested plugins of one kind, in order; of one name if given; with `refs` including referenced ones."""
        found = [(n, e) for n, e in self._objects if e.tag == tag and name in (None, n)]
        if not refs:
            found = [(n, e) for n, e in found if any(e is child for child in self.element.children)]
        self._asked |= {n or e.tag for n, e in found}
        return [Plugin(e, self.reading, self._trail, self._within) for _, e in found]

    def has(self, *names: str) -> bool:
        return any(n in self._values or any(n == o for o, _ in self._objects) for n in names)

    def ignore(self, *names: str) -> None:
        """Mark parameters as read: they have no effect here."""
        self._asked |= set(names)

    def note_unread(self, *, but: tuple[str, ...] = ()) -> None:
        """Note the parameters that were not read."""
        names = {**self._values, **{n or e.tag: e for n, e in self._objects}}
        left = sorted(n for n in names if n and n not in self._asked and n not in MACHINERY and n not in but)
        if left:
            self.note(f"ignored: {', '.join(left)}")

    def _take(self, name: str) -> Element | None:
        self._asked.add(name)
        return self._values.get(name)

    def text(self, name: str, default: str = "") -> str:
        element = self._take(name)
        return element.attributes.get("value", default) if element is not None else default

    def number(self, name: str, default: float) -> float:
        element = self._take(name)
        return default if element is None else element.floats(1)[0]

    def flag(self, name: str, default: bool) -> bool:
        element = self._take(name)
        if element is None:
            return default
        value = element.attributes.get("value", "").strip().lower()
        if value not in ("true", "false"):
            raise element.error("is neither true nor false", got=value)
        return value == "true"

    def vector(self, name: str) -> Floats | None:
        """(3,) of a point or vector, or None."""
        element = self._take(name)
        return None if element is None else element.vector()

    def transform(self, name: str = "to_world") -> Floats:
        """(4, 4); the identity by default."""
        element = self._take(name)
        if element is None:
            return np.eye(4)
        if element.tag == "animation":
            self.note("its motion is ignored: it stays at its first place")
            element = next((e for e in element.children if e.tag == "transform"), element)
        matrix: Floats = np.eye(4)
        with np.errstate(over="ignore", invalid="ignore"):  # nonfinite results are refused below
            for part in element.children:  # the first one is applied first
                matrix = _part(part) @ matrix
        if not (np.abs(matrix) < FARTHEST_M).all():
            raise element.error("transform is not finite or too large")
        return matrix

    def transform_element(self, name: str = "to_world") -> Element | None:
        return self._values.get(name)

    def constant(self, name: str, *, emitted: bool = False) -> Floats | None:
        """Linear RGB (3,) of a constant parameter; None if it is missing or a texture."""
        element = self._values.get(name)
        if element is None:
            return None  # not marked as read: it may be a texture
        self._asked.add(name)
        return colour_of(element, self.reading.document, emitted=emitted)

    def texture(self, name: str) -> Plugin | None:
        return next(iter(self.objects("texture", name)), None)

    def file(self) -> Path:
        """The file that it names, which need not exist."""
        field = f"line {self.element.line} <{self.element.tag}> filename"
        return self.reading.files.path(self.text("filename"), self.element.file, field)


def _part(part: Element) -> Floats:
    matrix: Floats = np.eye(4)
    if part.tag == "translate":
        matrix[:3, 3] = part.vector()
    elif part.tag == "scale":
        matrix[:3, :3] = np.diag(part.vector(1.0))
    elif part.tag == "rotate":
        axis = part.vector()
        if not axis.any():
            raise part.error("axis is zero")
        matrix[:3, :3] = rotation_about(normalize(axis), math.radians(part.floats(1, "angle")[0]))
    elif part.tag == "matrix":
        values = part.floats()
        if len(values) not in (9, 16):
            raise part.error("wrong count of numbers", got=len(values), expected="9 or 16")
        size = 3 if len(values) == 9 else 4
        matrix[:size, :size] = np.array(values).reshape(size, size)
        if size == 4 and np.abs(matrix[3] - (0, 0, 0, 1)).max() > 1e-6:
            raise part.error("not an affine matrix", got=matrix[3])
    elif part.tag == "lookat":
        matrix = look_at(part)
    else:
        raise part.error("unknown transform", expected="translate, rotate, scale, matrix or lookat")
    return matrix


def look_at(part: Element) -> Floats:
    """(4, 4) of a camera or object: x to the left, y up, z forward."""
    origin, target = (triple(part.floats(3, a)) for a in ("origin", "target"))
    if origin == target:
        raise part.error("origin and target coincide")
    up = triple(part.floats(3, "up")) if "up" in part.attributes else (0.0, 1.0, 0.0)
    right, upwards, forward = camera_axes(Camera("", origin, target, up))
    matrix = np.eye(4)
    matrix[:3] = np.stack([-right, upwards, forward, origin], axis=-1)
    return matrix


def children_of(reading: Reading, tag: str) -> Iterator[Plugin]:
    """Plugins of a kind at the top of the scene."""
    for element in reading.document.elements:
        if element.tag == tag:
            yield Plugin(element, reading)


def colour(plugin: Plugin, name: str, default: float | Floats, *, emitted: bool = False) -> Textured:
    """Linear RGB of a plugin's parameter, which may be `emitted` light."""
    fixed = plugin.constant(name, emitted=emitted)
    if fixed is not None:
        return constant(fixed)
    texture = plugin.texture(name)
    if texture is None:
        return constant(np.broadcast_to(np.asarray(default, float), 3).copy())
    return of_texture(texture)


def number(plugin: Plugin, name: str, default: float) -> Textured:
    """A plugin's parameter as one channel; for a texture, its luminance."""
    v = colour(plugin, name, default)
    if not v.is_texture:
        return constant(float(v.values.mean()))
    return Textured((v.values @ LUMINANCE)[..., None], v.uv_transform)


def opacity(plugin: Plugin, name: str) -> Textured:
    """Like `number`; for an image with an alpha channel, that channel."""
    texture = plugin.texture(name)
    if texture is not None and texture.type == "bitmap":
        image = _image(texture)
        if image is not None and image.alpha:
            texture.ignore("gamma", "raw")
            plugin.note("its mask is the image's alpha channel")
            return image.opacity()
    return number(plugin, name, GREY)


def of_texture(texture: Plugin) -> Textured:
    """Linear RGB of a texture."""
    if texture.type == "bitmap":
        v = _bitmap(texture)
    elif texture.type == "checkerboard":
        v = _checkerboard(texture)
    elif texture.type == "scale":
        inner = next(iter(texture.objects("texture")), None)
        factor = texture.constant("scale")
        base = of_texture(inner) if inner is not None else constant(np.full(3, GREY))
        v = combined(lambda a, b: a * b, base, constant(np.ones(3) if factor is None else factor), notes=[])
    elif texture.type in ("rgb", "srgb", "uniform", "d65", "rawconstant", "constant"):
        v = colour(texture, "color" if texture.has("color") else "value", GREY)
    else:
        texture.note("unknown texture, it becomes grey")
        return constant(np.full(3, GREY))
    texture.note_unread()
    return v


def raw_values(texture: Plugin) -> Textured | None:
    """Values of a bitmap as stored, 3 channels, for normal maps."""
    image = _image(texture)
    if image is None:
        return None
    texture.ignore("gamma", "raw", "wrap_mode", "wrap_mode_u", "wrap_mode_v")
    return image.rgb(srgb=False)


def _bitmap(texture: Plugin) -> Textured:
    image = _image(texture)
    if image is None:
        return constant(np.full(3, GREY))
    gamma = texture.number("gamma", 0.0)
    raw = texture.flag("raw", False) or gamma == 1
    texels = image.rgb(srgb=not raw and gamma <= 0).values
    if not raw and gamma > 0 and image.texels.dtype == np.uint8:
        texels = texels ** np.float32(gamma)
    for side in ("wrap_mode", "wrap_mode_u", "wrap_mode_v"):
        mode = texture.text(side, "repeat").lower()
        if mode != "repeat":
            texture.note(f"its texture is repeated, not {mode}")
    channel = texture.text("channel").lower()
    if channel in ("r", "g", "b"):
        texels = np.repeat(texels[..., ["r", "g", "b"].index(channel), None], 3, axis=-1)
    elif channel == "a":
        texels = np.repeat(image.opacity().values, 3, axis=-1)
    return Textured(texels, image.uv_transform)


def _image(texture: Plugin) -> TextureImage | None:
    """The image of a bitmap; None, with a note, if its file is missing."""
    name, uv_transform, element = texture.text("filename"), _uv_transform(texture), texture.element
    field = f"line {element.line} filename"
    image = texture.reading.images.named(name, element.file, field, texture.note, ": it becomes grey")
    return None if image is None else replace(image, uv_transform=uv_transform)


def _uv_transform(texture: Plugin) -> UvTransform:
    """Our uv transform of Mitsuba's to_uv (version 3), or of its scales and offsets (0.6)."""
    theirs = np.eye(3)
    matrix = texture.transform("to_uv")
    theirs[:2, :2], theirs[:2, 2] = matrix[:2, :2], matrix[:2, 3]
    both = texture.number("uvscale", 1.0)
    old = np.diag([*(texture.number(f"{c}scale", both) for c in "uv"), 1.0])
    old[:2, 2] = [texture.number(f"{c}offset", 0.0) for c in "uv"]
    return flipped_uv(old @ theirs)


def _checkerboard(texture: Plugin) -> Textured:
    dark, light = (
        colour(texture, name if texture.has(name) else other, default).mean
        for name, other, default in (("color0", "color_0", 0.4), ("color1", "color_1", 0.2))
    )
    second = np.arange(CHECKS) >= CHECKS // 2
    differs = second[:, None] != second[None, :]
    texels = np.where(differs[..., None], light, dark).astype(np.float32)
    return Textured(texels, _uv_transform(texture))
