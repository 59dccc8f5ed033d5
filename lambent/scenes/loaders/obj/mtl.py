"""MTL: the materials of OBJ files, with the PBR extension that exporters agreed on.

The format does not define its numbers physically. Pr and Pm make a metallic-roughness surface. Otherwise Ns, an
exponent of the half vector's cosine, becomes a slope roughness sqrt(2 / (Ns + 2)) (Walter et al. 2007, "Microfacet
models for refraction", section 5.4); Ks is a mirror's reflectance if `illum` requests reflections (3 to 9) or nothing
is diffuse, otherwise a share of 8 %, the highest reflectance of plastics and varnish.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from lambent.core.ceilings import MATERIALS, MTL_BYTES
from lambent.core.errors import UserError
from lambent.core.geometry.directions import Floats
from lambent.core.inputs import decoded, read_bytes
from lambent.core.plain import Triple, is_number
from lambent.materials.fresnel import r0_of
from lambent.scenes.loaders.scene_files import SceneFiles
from lambent.scenes.loaders.surfaces.material_builder import MaterialBuilder, TextureImage, TextureImages
from lambent.scenes.loaders.surfaces.surface import (
    GREY,
    ROUGHNESS_MIN,
    UNDESCRIBED,
    SpecularLobe,
    Surface,
    metallic_roughness,
    rgb,
)
from lambent.scenes.loaders.surfaces.textured import Textured, absolute, combined, constant, scaled
from lambent.scenes.scene import Texture, UvTransform

DEFAULT = "default"
PLASTIC_R0_MAX = 0.08
MIRRORS = range(3, 10)  # illum values that request reflections
OPTIONS = {"-blendu": 1, "-blendv": 1, "-boost": 1, "-cc": 1, "-clamp": 1, "-imfchan": 1, "-texres": 1, "-type": 1,
           "-bm": 1, "-mm": 2, "-o": 3, "-s": 3, "-t": 3}  # fmt: skip
NUMBERS = {
    "Ka", "Kd", "Ks", "Ke", "Tf", "Ns", "Ni", "d", "Tr", "illum", "Pr", "Pm", "Ps", "Pc", "Pcr", "aniso", "anisor",
}  # fmt: skip
MAPS = {
    "map_Kd", "map_Ks", "map_Ke", "map_Pr", "map_Pm", "map_d", "map_Ns", "norm", "map_Bump", "map_bump", "bump",
    "map_Ka", "map_Ps", "disp", "decal", "refl", "map_aat",
}  # fmt: skip
UNREAD = {"map_Ns", "disp", "decal", "refl", "map_Ps", "Ps"}
SPELLED = {name.lower(): name for name in sorted(NUMBERS | MAPS, reverse=True)}  # exporters differ in capitalisation
SILENT = {"map_ka", "ka", "sharpness", "map_aat", "vt", "endmtl"}  # without effect here
GLASS = (4, 6, 7, 9)  # illum values that request glass


@dataclass
class Entry:
    """The statements of one material."""

    file: Path
    numbers: dict[str, tuple[float, ...]] = field(default_factory=dict)
    maps: dict[str, tuple[str, UvTransform, int]] = field(default_factory=dict)  # name, uv transform, line


class Library:
    """The materials of an OBJ file's libraries, each created at its first use."""

    def __init__(self, files: SceneFiles) -> None:
        self._files, self._images = files, TextureImages(files)
        self._entries: dict[str, Entry] = {}
        self._notes: list[str] = []
        self.made = MaterialBuilder()

    @property
    def warnings(self) -> list[str]:
        return [*self._notes, *self.made.notes, *self._images.notes, *self._files.notes]

    def add(self, obj: Path, names: str, line: int) -> None:
        """Read the libraries named on a line: one name containing blanks, or several."""
        field = f"line {line} mtllib"
        whole, _ = self._files.find(names, obj, field)
        for name in [names] if whole.is_file() else names.split():
            if self._files.find(name, obj, field)[0] in self._files.sources:
                continue
            otherwise = ": its materials become grey"
            path = self._files.look_for("material library", name, obj, field, self._notes.append, otherwise)
            if path is not None:
                self._entries = _entries(path, self._notes) | self._entries

    def use(self, name: str) -> str:
        """Name of the material for a `usemtl`."""
        name = name or DEFAULT
        self.made.make(name, lambda notes: self._surface(name, notes))
        return name

    def _surface(self, name: str, notes: list[str]) -> Surface:
        entry = self._entries.get(name)
        if entry is not None:
            return _Reading(entry, self._images, notes).surface()
        if name != DEFAULT:
            notes.append(UNDESCRIBED)
        return Surface.grey()


def _entries(path: Path, notes: list[str]) -> dict[str, Entry]:
    """Materials of one library file by name."""
    text = decoded(read_bytes(path, MTL_BYTES))
    entries: dict[str, Entry] = {}
    entry: Entry | None = None
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        key = SPELLED.get(words[0].lower(), words[0])
        if words[0].lower() == "newmtl":
            name = line.strip()[len("newmtl") :].strip() or f"material_{number}"
            if name in entries:
                notes.append(f"material {name} is defined twice in {path.name}: the last definition is used")
            MATERIALS.check(len(entries), file=path)
            entry = entries[name] = Entry(path)
        elif entry is None:
            if key in NUMBERS | MAPS:
                raise UserError("comes before the first newmtl", file=path, field=f"line {number}", got=words[0])
        elif key in NUMBERS:
            entry.numbers[key] = _numbers(words, path, number, notes)
        elif key in MAPS:
            entry.maps[key] = (*_map(line.strip()[len(words[0]) :].strip(), path, number), number)
        elif words[0].lower() not in SILENT and f"statement {words[0]} is ignored" not in notes:
            notes.append(f"statement {words[0]} is ignored")
    return entries


def _numbers(words: list[str], path: Path, line: int, notes: list[str]) -> tuple[float, ...]:
    field = f"line {line} {words[0]}"
    rest = [w for w in words[1:] if w != "-halo"]
    if rest and rest[0] in ("spectral", "xyz"):
        notes.append(f"{words[0]} {rest[0]} on line {line} of {path.name} is ignored: it becomes grey")
        return (GREY,)
    try:
        values = tuple(float(w.partition("#")[0] or "nan") for w in rest[:3] if not w.startswith("#"))
    except ValueError as error:
        raise UserError("not a number", file=path, field=field, got=" ".join(rest)) from error
    if not values or not all(abs(v) < 1e30 for v in values):
        raise UserError("not a finite number", file=path, field=field, got=" ".join(rest) or "nothing")
    return values


def _map(text: str, path: Path, line: int) -> tuple[str, UvTransform]:
    """File name and uv transform of a map statement."""
    scale, offset = [1.0, 1.0], [0.0, 0.0]
    words = text.split()
    while words and words[0] in OPTIONS:
        option, most = words[0], OPTIONS[words[0]]
        taken = 1
        while taken < len(words) - 1 and taken <= most and (most == 1 or is_number(words[taken])):
            taken += 1
        values = [float(w) for w in words[1:taken] if is_number(w)]
        if option == "-s":
            scale[: len(values[:2])] = values[:2]
        elif option == "-o":
            offset[: len(values[:2])] = values[:2]
        words = words[taken:]
    if not words:
        raise UserError("names no picture", file=path, field=f"line {line}")
    name = text[text.index(words[0]) :] if text.count(words[0]) == 1 else " ".join(words)
    if not (np.abs([*scale, *offset]) < 1e30).all():
        raise UserError("not a finite number", file=path, field=f"line {line}", got=text)
    return name, ((scale[0], 0.0, offset[0]), (0.0, scale[1], offset[1]))


class _Reading:
    """State of converting one material to a surface."""

    def __init__(self, entry: Entry, images: TextureImages, notes: list[str]) -> None:
        self._entry, self._images, self._notes = entry, images, notes

    def surface(self) -> Surface:
        unread = sorted(UNREAD & self._keys())
        if unread:
            self._notes.append(f"ignored: {', '.join(unread)}")
        kd = self._coloured("Kd", "map_Kd", GREY if "map_Kd" not in self._entry.maps else 1.0)
        surface = self._metallic(kd) if {"Pr", "Pm", "map_Pr", "map_Pm"} & self._keys() else self._phong(kd)
        surface = self._clear_coated(surface)
        surface = replace(surface, normal=self._normal(), emission=self._emission())
        return self._opaque(surface)

    def _keys(self) -> set[str]:
        return {*self._entry.numbers, *self._entry.maps}

    def _metallic(self, base: Textured) -> Surface:
        metallic = self._scaled("Pm", "map_Pm", 0.0)
        roughness = self._scaled("Pr", "map_Pr", 0.5)
        alpha = combined(lambda r: r * r, roughness, notes=self._notes)
        r0 = self._r0()
        strength = min(max(self._number("aniso", 0.0), 0.0), 1.0)
        if self._number("anisor", 0.0):
            self._notes.append("the rotation of its anisotropy (anisor) is ignored")
        aspect = math.sqrt(1 - 0.9 * strength)
        along = combined(lambda a: np.clip(a, 0, 1) / aspect, alpha, notes=self._notes)
        plain = np.full(3, r0)
        return metallic_roughness(base, metallic, along, plain, self._notes, aspect=aspect**2, by_half_vector=True)

    def _phong(self, kd: Textured) -> Surface:
        ks = self._coloured("Ks", "map_Ks", 0.0)
        mirror = int(self._number("illum", 2)) in MIRRORS or not kd.highest.any()
        r0 = np.clip(ks.highest, 0, 1) * (1.0 if mirror else PLASTIC_R0_MAX)
        if not r0.any() or int(self._number("illum", 2)) in (0, 1):
            return Surface(kd=combined(lambda k: np.clip(k, 0, 1), kd, notes=[]))
        shade = combined(lambda k: k / np.maximum(ks.highest, 1e-6), ks, notes=self._notes)
        m = math.sqrt(2 / (max(self._number("Ns", 10.0), 0.0) + 2))
        below = combined(lambda k: np.clip(k, 0, 1) * (1 - r0), kd, notes=self._notes)
        return Surface(kd=below, coupled=True, lobes=(SpecularLobe(constant(m), shade, r0),))

    def _clear_coated(self, surface: Surface) -> Surface:
        share = min(max(self._number("Pc", 0.0), 0.0), 1.0)
        if not share:
            return surface
        m = max(self._number("Pcr", 0.03), 0.0) ** 2
        return surface.coated(SpecularLobe(constant(m), constant(np.full(3, share)), np.full(3, self._r0())))

    def _r0(self) -> float:
        ior = self._number("Ni", 1.5)
        return r0_of(ior) if ior > 1 else 0.04

    def _emission(self) -> Triple:
        ke = np.maximum(self._colour("Ke", 0.0), 0)
        image = self._image("map_Ke") if ke.any() or "Ke" not in self._entry.numbers else None
        if image is not None:
            self._notes.append("its emission is averaged over its texture")
            ke = (ke if ke.any() else np.ones(3)) * image.rgb(srgb=True).mean
        return rgb(ke)

    def _opaque(self, surface: Surface) -> Surface:
        """Add its mask, or its transmitted light."""
        opacity = min(max(self._number("d", 1 - self._number("Tr", 0.0)), 0.0), 1.0)
        mask = self._image("map_d")
        cut = self._image("map_Kd") if mask is None and opacity == 1 else None
        if mask is not None:
            return replace(surface, opacity=absolute(mask.opacity() if mask.alpha else _first_channel(mask)))
        if cut is not None and cut.alpha and float(cut.opacity().values.min()) < 0.5:
            self._notes.append("the alpha channel of its texture becomes a cut-out")
            return replace(surface, opacity=absolute(cut.opacity()))
        if opacity < 1:
            self._notes.append(f"is transparent ({1 - opacity:.0%}), without refraction")
            return self._pane(surface, opacity)
        return surface

    def _pane(self, surface: Surface, opacity: float) -> Surface:
        """A surface that covers a share of the background; glass reflects fully. Tf tints transmitted light."""
        tint = np.clip(self._colour("Tf", 1.0), 0, 1)
        tint = tint if tint.any() else np.ones(3)
        if int(self._number("illum", 2)) not in GLASS:
            covered = surface.with_opacity(np.full(3, opacity))
            *others, straight = covered.lobes
            return replace(covered, lobes=(*others, replace(straight, k=scaled(straight.k, tint))))
        r0 = np.full(3, self._r0())
        shown = tuple(replace(g, r0=r0) for g in surface.lobes)
        straight = SpecularLobe(constant(ROUGHNESS_MIN), constant((1 - opacity) * tint), r0, side="transmission")
        return replace(surface, kd=scaled(surface.kd, opacity), lobes=(*shown, straight))

    def _normal(self) -> Texture | None:
        for key in ("norm", "map_Bump", "map_bump", "bump"):
            image = self._image(key)
            if image is None:
                continue
            normals = image.rgb(srgb=False).values * 2 - 1
            if key != "norm" and not _looks_like_normals(normals):
                self._notes.append("its bump map is ignored")
                continue
            return absolute(Textured(normals, image.uv_transform))
        return None

    def _image(self, key: str) -> TextureImage | None:
        if key not in self._entry.maps:
            return None
        name, uv_transform, line = self._entry.maps[key]
        image = self._images.named(name, self._entry.file, f"line {line} {key}", self._notes.append)
        return None if image is None else replace(image, uv_transform=uv_transform)

    def _coloured(self, key: str, map_key: str, default: float) -> Textured:
        factor = np.maximum(self._colour(key, default), 0)
        image = self._image(map_key)
        if image is None:
            even = float(np.ptp(factor)) == 0 and factor[0] in (0, 1)  # exporters write these along with a texture
            lost = map_key == "map_Kd" and map_key in self._entry.maps
            return constant(np.full(3, GREY) if lost and even else factor)
        if not factor.any():
            factor = np.ones(3)  # exporters write black along with a texture meant to be visible
        return scaled(image.rgb(srgb=True), factor)

    def _scaled(self, key: str, map_key: str, default: float) -> Textured:
        image = self._image(map_key)
        return constant(min(max(self._number(key, default), 0.0), 1.0)) if image is None else _first_channel(image)

    def _colour(self, key: str, default: float) -> Floats:
        values = self._entry.numbers.get(key, (default,))
        return np.array(values if len(values) == 3 else (values[0],) * 3)

    def _number(self, key: str, default: float) -> float:
        return self._entry.numbers.get(key, (default,))[0]


def _first_channel(image: TextureImage) -> Textured:
    return image.rgb(srgb=False).channel(0)


def _looks_like_normals(texels: Floats) -> bool:
    """Whether a bump map is really a normal map: its mean points up, and lengths are about one."""
    mean = texels.mean(axis=(0, 1))
    length = np.linalg.norm(texels, axis=-1)
    return bool(mean[2] > 0.5 and abs(mean[0]) < 0.3 and abs(mean[1]) < 0.3 and abs(float(length.mean()) - 1) < 0.15)
