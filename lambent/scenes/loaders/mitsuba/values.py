"""Values of a plugin's parameters: numbers, names, colours, transforms. What nobody asked for can be listed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from lambent.core.colour import srgb_decode
from lambent.core.errors import did_you_mean
from lambent.core.frames import Floats, normalize
from lambent.scenes.loaders.mitsuba.document import Document, Element
from lambent.scenes.loaders.pictures import Pictures
from lambent.scenes.loaders.place import named
from lambent.scenes.loaders.surface import Surface

OBJECTS = {
    "bsdf", "texture", "shape", "emitter", "sensor", "film", "sampler", "rfilter", "medium", "phase", "volume",
    "integrator", "subsurface",
}  # fmt: skip
PLUGINS_MAX = 400_000
NESTING_MAX = 32
ABSURD, FAR = 1e30, 1e9
# Filters, caches, samplers: how Mitsuba works, not what the scene is.
MACHINERY = {
    "filter_type", "max_anisotropy", "cache", "sample_visible", "format", "accel", "sampling_weight", "variant",
    "component_format", "shutter_open", "shutter_close", "near_clip", "far_clip",
}  # fmt: skip
Y_INTEGRAL_NM = 106.856895  # of the CIE 1931 luminosity function, as Mitsuba normalises emission


class Reading:
    """What is common to one scene file's reading: its document, pictures, and what has to be said."""

    def __init__(self, document: Document) -> None:
        self.document, self.pictures = document, Pictures()
        self.said: list[str] = []
        self.surfaces: dict[int, Surface] = {}  # by BSDF element: one that is referred to often is read once
        self.sources = list(document.sources)
        self._plugins = 0

    def say(self, text: str) -> None:
        if text not in self.said:
            self.said.append(text)

    def count_plugin(self, element: Element) -> None:
        self._plugins += 1
        if self._plugins > PLUGINS_MAX:
            raise element.error("scene refers to itself too often", expected=f"at most {PLUGINS_MAX} plugins")


class Plugin:
    """A plugin's element and its parameters, each remembered once it was asked for."""

    def __init__(self, element: Element, reading: Reading, trail: tuple[int, ...] = (), within: str = "") -> None:
        reading.count_plugin(element)
        if id(element) in trail:
            raise element.error("contains itself", got=element.id)
        if len(trail) > NESTING_MAX:
            raise element.error("is nested too deep", expected=f"at most {NESTING_MAX}")
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
        """What to call it in a warning: by its id, or that of what it is in."""
        return " ".join(filter(None, (self.element.tag, self._within, self.type and f"({self.type})")))

    def say(self, text: str) -> None:
        self.reading.say(f"{self.label}: {text}")

    def objects(self, tag: str, name: str | None = None, *, refs: bool = True) -> list[Plugin]:
        """Plugins of one kind within it, in order; of one name where that is given; `refs` with those referred to."""
        found = [(n, e) for n, e in self._objects if e.tag == tag and name in (None, n)]
        if not refs:
            found = [(n, e) for n, e in found if any(e is child for child in self.element.children)]
        self._asked |= {n or e.tag for n, e in found}
        return [Plugin(e, self.reading, self._trail, self._within) for _, e in found]

    def has(self, *names: str) -> bool:
        return any(n in self._values or any(n == o for o, _ in self._objects) for n in names)

    def ignore(self, *names: str) -> None:
        """Count parameters as read: they change nothing here."""
        self._asked |= set(names)

    def say_unread(self, *, but: tuple[str, ...] = ()) -> None:
        """Say what nobody asked for."""
        names = {**self._values, **{n or e.tag: e for n, e in self._objects}}
        left = sorted(n for n in names if n and n not in self._asked and n not in MACHINERY and n not in but)
        if left:
            self.say(f"not read: {', '.join(left)}")

    def _take(self, name: str) -> Element | None:
        self._asked.add(name)
        return self._values.get(name)

    def text(self, name: str, default: str = "") -> str:
        element = self._take(name)
        return element.attributes.get("value", default) if element is not None else default

    def number(self, name: str, default: float) -> float:
        element = self._take(name)
        if element is None:
            return default
        return floats_of(element, 1)[0]

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
        return None if element is None else triple_of(element)

    def transform(self, name: str = "to_world") -> Floats:
        """(4, 4); the identity where it is not given."""
        element = self._take(name)
        if element is None:
            return np.eye(4)
        if element.tag == "animation":
            self.say("its movement is not read: it stands as at the beginning")
            element = next((e for e in element.children if e.tag == "transform"), element)
        matrix = transform_of(element)
        if not (np.abs(matrix) < FAR).all():
            raise element.error("transform is not finite, or leads absurdly far")
        return matrix

    def transform_element(self, name: str = "to_world") -> Element | None:
        return self._values.get(name)

    def constant(self, name: str) -> Floats | None:
        """Linear RGB (3,) of a parameter that is the same everywhere; None where it is not given, or is a texture."""
        element = self._values.get(name)
        if element is None:
            return None
        self._asked.add(name)
        return colour_of(element)

    def texture(self, name: str) -> Plugin | None:
        return next(iter(self.objects("texture", name)), None)

    def file(self, name: str = "filename") -> Path:
        """A file that a parameter names; it need not exist."""
        written = self.text(name)
        root = self.reading.document.root
        return named(written, self.element.file, root, f"line {self.element.line} <{self.element.tag}> {name}")


def floats_of(element: Element, count: int | None = None, attribute: str = "value") -> list[float]:
    """Finite numbers of an attribute, separated by blanks or commas."""
    text = element.attributes.get(attribute, "")
    try:
        values = [float(word) for word in text.replace(",", " ").split()]
    except ValueError as error:
        raise element.error("not a number", got=text) from error
    if not all(abs(v) < ABSURD for v in values):
        raise element.error("not a finite number", got=text)
    if count is not None and len(values) != count:
        raise element.error("wrong count of numbers", got=text or "nothing", expected=count)
    return values


def triple_of(element: Element, default: float = 0.0) -> Floats:
    """(3,) of x, y, z or of a value; one number counts for all three."""
    if "value" in element.attributes:
        values = floats_of(element)
        if len(values) not in (1, 3):
            raise element.error("wrong count of numbers", got=len(values), expected="1 or 3")
        return np.array(values * 3 if len(values) == 1 else values)
    return np.array([floats_of(element, 1, c)[0] if c in element.attributes else default for c in "xyz"])


def colour_of(element: Element) -> Floats:
    """Linear RGB (3,) of a float, rgb, srgb, spectrum or blackbody element; not negative.

    A spectrum of wavelengths is a reflectance, seen under D65. Blackbodies are in W/(sr m^2 nm), weighed as by Mitsuba.
    """
    text = element.attributes.get("value", "").strip()
    if element.tag == "blackbody":
        return _blackbody(element)
    if element.tag not in ("float", "rgb", "srgb", "spectrum", "integer", "color"):
        raise element.error("is no colour", expected="float, rgb, srgb or spectrum")
    if text.startswith("#"):
        digits = text[1:]
        if len(digits) != 6 or any(c not in "0123456789abcdefABCDEF" for c in digits):
            raise element.error("not a colour", got=text, expected="#rrggbb")
        return srgb_decode(np.array([int(digits[i : i + 2], 16) for i in (0, 2, 4)]) / 255.0)
    if ":" in text or "filename" in element.attributes:
        return _spectrum(element, text)
    values = floats_of(element)
    if len(values) not in (1, 3):
        raise element.error("wrong count of numbers", got=len(values), expected="1 or 3")
    rgb = np.maximum(np.array(values * 3 if len(values) == 1 else values), 0.0)
    return srgb_decode(rgb) if element.tag == "srgb" else rgb


def _spectrum(element: Element, text: str) -> Floats:
    from lambent.materials.measured.spectral import rgb_of_spectra

    if "filename" in element.attributes:
        raise element.error("spectra in files are not read", hint="write it as wavelength:value pairs or as <rgb>")
    try:
        pairs = np.array([[float(v) for v in pair.split(":")] for pair in text.replace(",", " ").split()])
        nm, values = pairs.T
    except ValueError as error:
        raise element.error("not a spectrum", got=text, expected="wavelength:value pairs") from error
    if not np.isfinite(pairs).all() or (np.diff(nm) <= 0).any() or len(nm) > 4096:
        raise element.error("not a spectrum", got=text, expected="finite values at increasing wavelengths")
    return np.maximum(rgb_of_spectra(nm) @ values, 0)


def _blackbody(element: Element) -> Floats:
    from colour import MSDS_CMFS

    from lambent.core.colour import XYZ_TO_RGB

    text = element.attributes.get("temperature", element.attributes.get("value", "")).strip().rstrip("kK")
    try:
        kelvin, scale = float(text), float(element.attributes.get("scale", 1))
    except ValueError as error:
        raise element.error("not a temperature", got=text) from error
    if not (100 <= kelvin <= 1e6 and 0 <= scale < 1e12):
        raise element.error("not a temperature", got=text, expected="100 to 1e6 K")
    observer = MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    metres = observer.wavelengths * 1e-9
    h, c, k = 6.62607015e-34, 2.99792458e8, 1.380649e-23
    radiance_nm = 2 * h * c**2 / metres**5 / np.expm1(h * c / (metres * k * kelvin)) * 1e-9
    step_nm = observer.wavelengths[1] - observer.wavelengths[0]
    xyz = radiance_nm @ observer.values * step_nm / Y_INTEGRAL_NM
    return np.maximum(XYZ_TO_RGB @ xyz, 0) * scale


def transform_of(element: Element) -> Floats:
    """(4, 4) of a transform: its parts one after the other, each applied to what the others made."""
    matrix = np.eye(4)
    with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused by whoever asked
        for part in element.children:
            matrix = _part(part) @ matrix
    return matrix


def _part(part: Element) -> Floats:
    matrix = np.eye(4)
    if part.tag == "translate":
        matrix[:3, 3] = triple_of(part)
    elif part.tag == "scale":
        matrix[:3, :3] = np.diag(triple_of(part, 1.0))
    elif part.tag == "rotate":
        axis = triple_of(part)
        if not axis.any():
            raise part.error("axis is zero")
        matrix[:3, :3] = _rotation(normalize(axis), math.radians(floats_of(part, 1, "angle")[0]))
    elif part.tag == "matrix":
        values = floats_of(part)
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
    """(4, 4): x to the left, y up, z ahead, as Mitsuba's cameras stand."""
    origin, target = (np.array(floats_of(part, 3, a)) for a in ("origin", "target"))
    up = np.array(floats_of(part, 3, "up")) if "up" in part.attributes else np.array([0.0, 1.0, 0.0])
    ahead = normalize(target - origin)
    left = normalize(np.cross(up, ahead))
    if not ahead.any():
        raise part.error("origin and target are the same point")
    if not left.any():
        left = normalize(np.cross(np.eye(3)[np.argmin(np.abs(ahead))], ahead))
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = left, np.cross(ahead, left), ahead, origin
    return matrix


def _rotation(axis: Floats, angle_rad: float) -> Floats:
    """(3, 3) right-handed rotation about a unit axis (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turned: Floats = np.eye(3) + math.sin(angle_rad) * cross + (1 - math.cos(angle_rad)) * cross @ cross
    return turned


def children_of(document: Document, reading: Reading, tag: str) -> Iterator[Plugin]:
    """Plugins of a kind at the top of the scene."""
    for element in document.elements:
        if element.tag == tag:
            yield Plugin(element, reading)
