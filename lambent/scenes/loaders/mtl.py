"""MTL: the materials of OBJ files, with the PBR extension that exporters agreed on.

Its numbers were never defined as physics. Pr, Pm make a metallic-roughness surface. Otherwise Ns, an exponent of the
half vector's cosine, becomes a slope roughness sqrt(2 / (Ns + 2)) (Walter et al. 2007, "Microfacet models for
refraction", section 5.4); Ks is a mirror's reflectance where `illum` asks for reflections (3 to 9) or nothing is
diffuse, and else a share of 8 %, the most that plastics and varnish reflect.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from lambent.core.directions import Floats
from lambent.core.errors import UserError
from lambent.core.files import read_bytes
from lambent.core.plain import is_number
from lambent.materials.document import Material
from lambent.scenes.loaders.metallic import metallic_roughness
from lambent.scenes.loaders.pictures import Picture, Pictures
from lambent.scenes.loaders.place import found
from lambent.scenes.loaders.surface import ROUGHNESS_MIN, Gloss, Surface, coated, finished, rgb, seen_through
from lambent.scenes.loaders.varying import IDENTITY, UvTransform, Varying, absolute, combined, constant, scaled
from lambent.scenes.scene import MaterialTextures, Texture, Triple

LIMIT_BYTES = 16 << 20
MATERIALS_MAX = 65536
DEFAULT = "default"
GREY = 0.5
PLASTIC_R0_MAX = 0.08
MIRRORS = range(3, 10)  # illum that asks for reflections
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
SPELLED = {name.lower(): name for name in sorted(NUMBERS | MAPS, reverse=True)}  # exporters mind no capitals
SILENT = {"map_ka", "ka", "sharpness", "map_aat", "vt", "endmtl"}  # which change nothing here
GLASS = (4, 6, 7, 9)  # illum that asks for glass


@dataclass
class Entry:
    """What the file says of one material."""

    file: Path
    line: int
    numbers: dict[str, tuple[float, ...]] = field(default_factory=dict)
    maps: dict[str, tuple[str, UvTransform, int]] = field(default_factory=dict)  # name, layout, line


class Library:
    """The materials of an OBJ file's libraries; each is made when it is asked for."""

    def __init__(self, pictures: Pictures, root: Path) -> None:
        self._pictures, self._root = pictures, root
        self._entries: dict[str, Entry] = {}
        self._made: dict[str, tuple[Material, MaterialTextures | None, Triple]] = {}
        self._said: list[str] = []
        self._of: dict[str, list[str]] = {}
        self.sources: list[Path] = []

    def add(self, obj: Path, names: str, field: str) -> None:
        """Read the libraries that a line names: one name with blanks in it, or several."""
        whole, _ = found(names, obj, self._root, f"{field} mtllib")
        for name in [names] if whole.is_file() else names.split():
            path, moved = found(name, obj, self._root, f"{field} mtllib")
            if not path.is_file():
                self._said.append(f"material library {name} is not there: its materials are grey")
            elif path not in self.sources:
                if moved:
                    self._said.append(f"material library {name} was found beside {obj.name}")
                self.sources.append(path)
                self._entries |= {n: e for n, e in _entries(path, self._said).items() if n not in self._entries}

    def name_of(self, wanted: str) -> str:
        """The material that a `usemtl` means."""
        return wanted or DEFAULT

    def material(self, name: str) -> Material:
        return self._get(name)[0]

    def textures(self, name: str) -> MaterialTextures | None:
        return self._get(name)[1]

    def emission(self, name: str) -> Triple:
        return self._get(name)[2]

    def warnings(self, used: Iterable[str]) -> list[str]:
        return self._said + [f"material {n}: {what}" for n in used for what in dict.fromkeys(self._of.get(n, []))]

    def _get(self, name: str) -> tuple[Material, MaterialTextures | None, Triple]:
        if name not in self._made:
            said = self._of.setdefault(name, [])
            entry = self._entries.get(name)
            if entry is None:
                if name != DEFAULT:
                    said.append("is not described: it is grey")
                surface = Surface(kd=constant(np.full(3, GREY)))
            else:
                surface = _Reading(entry, self._pictures, self._root, said, self.sources).surface()
            self._made[name] = (*finished(name, surface, said), surface.emission)
        return self._made[name]


def _entries(path: Path, said: list[str]) -> dict[str, Entry]:
    """Materials of one library file by name."""
    text = read_bytes(path, LIMIT_BYTES).decode("utf-8-sig", "replace")
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
                said.append(f"material {name} is described twice in {path.name}: the last holds")
            if len(entries) > MATERIALS_MAX:
                raise UserError("too many materials", file=path, got=f"over {MATERIALS_MAX}")
            entry = entries[name] = Entry(path, number)
        elif entry is None:
            if key in NUMBERS | MAPS:
                raise UserError("stands before any newmtl", file=path, field=f"line {number}", got=words[0])
        elif key in NUMBERS:
            entry.numbers[key] = _numbers(words, path, number, said)
        elif key in MAPS:
            name, layout = _map(line.strip()[len(words[0]) :].strip(), path, number)
            entry.maps[key] = (name, layout, number)
        elif words[0].lower() not in SILENT and f"statement {words[0]} is not read" not in said:
            said.append(f"statement {words[0]} is not read")
    return entries


def _numbers(words: list[str], path: Path, line: int, said: list[str]) -> tuple[float, ...]:
    field = f"line {line} {words[0]}"
    rest = [w for w in words[1:] if w != "-halo"]
    if rest and rest[0] in ("spectral", "xyz"):
        said.append(f"{words[0]} {rest[0]} on line {line} of {path.name} is not read: it is grey")
        return (GREY,)
    try:
        values = tuple(float(w.partition("#")[0] or "nan") for w in rest[:3] if not w.startswith("#"))
    except ValueError as error:
        raise UserError("not a number", file=path, field=field, got=" ".join(rest)) from error
    if not values or not all(abs(v) < 1e30 for v in values):
        raise UserError("not a finite number", file=path, field=field, got=" ".join(rest) or "nothing")
    return values


def _map(text: str, path: Path, line: int) -> tuple[str, UvTransform]:
    """File name and layout of a map statement."""
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
    """One material on its way to a surface."""

    def __init__(self, entry: Entry, pictures: Pictures, root: Path, said: list[str], sources: list[Path]) -> None:
        self._entry, self._pictures, self._root, self._said, self._sources = entry, pictures, root, said, sources

    def surface(self) -> Surface:
        said = self._said
        unread = sorted(UNREAD & self._keys())
        if unread:
            said.append(f"not read: {', '.join(unread)}")
        kd = self._coloured("Kd", "map_Kd", GREY if "map_Kd" not in self._entry.maps else 1.0)
        surface = self._metallic(kd) if {"Pr", "Pm", "map_Pr", "map_Pm"} & self._keys() else self._phong(kd)
        surface = self._clear_coated(surface)
        surface = replace(surface, normal=self._normal(), emission=self._emission())
        return self._opaque(surface)

    def _keys(self) -> set[str]:
        return {*self._entry.numbers, *self._entry.maps}

    def _metallic(self, base: Varying) -> Surface:
        metallic = self._scaled("Pm", "map_Pm", 0.0)
        roughness = self._scaled("Pr", "map_Pr", 0.5)
        alpha = combined(lambda r: r * r, roughness, said=self._said)
        r0 = self._r0()
        strength = min(max(self._number("aniso", 0.0), 0.0), 1.0)
        if self._number("anisor", 0.0):
            self._said.append("its anisotropy is not turned (anisor)")
        aspect = math.sqrt(1 - 0.9 * strength)
        along = combined(lambda a: np.clip(a, 0, 1) / aspect, alpha, said=self._said)
        return metallic_roughness(base, metallic, along, np.full(3, r0), self._said, aspect=aspect**2)

    def _phong(self, kd: Varying) -> Surface:
        ks = self._coloured("Ks", "map_Ks", 0.0)
        mirror = int(self._number("illum", 2)) in MIRRORS or not kd.highest.any()
        r0 = np.clip(ks.highest, 0, 1) * (1.0 if mirror else PLASTIC_R0_MAX)
        if not r0.any() or int(self._number("illum", 2)) in (0, 1):
            return Surface(kd=_at_most_one(kd))
        shade = combined(lambda k: k / np.maximum(ks.highest, 1e-6), ks, said=self._said)
        m = math.sqrt(2 / (max(self._number("Ns", 10.0), 0.0) + 2))
        below = combined(lambda k: np.clip(k, 0, 1) * (1 - r0), kd, said=self._said)
        return Surface(kd=below, coupled=True, glosses=(Gloss(constant(m), shade, r0),))

    def _clear_coated(self, surface: Surface) -> Surface:
        share = min(max(self._number("Pc", 0.0), 0.0), 1.0)
        if not share:
            return surface
        m = max(self._number("Pcr", 0.03), 0.0) ** 2
        return coated(surface, Gloss(constant(m), constant(np.full(3, share)), np.full(3, self._r0())))

    def _r0(self) -> float:
        ior = self._number("Ni", 1.5)
        return ((ior - 1) / (ior + 1)) ** 2 if ior > 1 else 0.04

    def _emission(self) -> Triple:
        ke = np.maximum(self._colour("Ke", 0.0), 0)
        picture = self._picture("map_Ke") if ke.any() or "Ke" not in self._entry.numbers else None
        if picture is not None:
            self._said.append("its emission is averaged over its picture")
            ke = (ke if ke.any() else np.ones(3)) * picture[0].rgb(srgb=True).mean(axis=(0, 1), dtype=float)
        return rgb(ke)

    def _opaque(self, surface: Surface) -> Surface:
        """With its mask, or with the light that passes it."""
        opacity = self._number("d", 1 - self._number("Tr", 0.0))
        opacity = min(max(opacity, 0.0), 1.0)
        mask = self._picture("map_d")
        cut = self._picture("map_Kd") if mask is None and opacity == 1 else None
        if mask is not None:
            texels = mask[0].opacity() if mask[0].alpha else mask[0].rgb(srgb=False)[..., :1]
            return replace(surface, opacity=absolute(Varying(texels, mask[1])))
        if cut is not None and cut[0].alpha and float(cut[0].opacity().min()) < 0.5:
            self._said.append("the alpha of its picture cuts it out")
            return replace(surface, opacity=absolute(Varying(cut[0].opacity(), cut[1])))
        if opacity < 1:
            self._said.append(f"is seen through ({1 - opacity:.0%}), without refraction")
            return self._pane(surface, opacity)
        return surface

    def _pane(self, surface: Surface, opacity: float) -> Surface:
        """What covers a share of what is behind it; glass reflects as much whatever it covers. Tf tints what passes."""
        tint = np.clip(self._colour("Tf", 1.0), 0, 1)
        tint = tint if tint.any() else np.ones(3)
        if int(self._number("illum", 2)) not in GLASS:
            covered = seen_through(surface, np.full(3, opacity))
            *others, straight = covered.glosses
            return replace(covered, glosses=(*others, replace(straight, k=scaled(straight.k, tint))))
        r0 = np.full(3, self._r0())
        shown = tuple(replace(g, r0=r0) for g in surface.glosses)
        straight = Gloss(constant(ROUGHNESS_MIN), constant((1 - opacity) * tint), r0, side="transmission")
        return replace(surface, kd=scaled(surface.kd, opacity), glosses=(*shown, straight))

    def _normal(self) -> Texture | None:
        for key in ("norm", "map_Bump", "map_bump", "bump"):
            picture = self._picture(key)
            if picture is None:
                continue
            texels = picture[0].rgb(srgb=False) * 2 - 1
            if key != "norm" and not _looks_like_normals(texels):
                self._said.append("its bump map is not read")
                continue
            return absolute(Varying(texels, picture[1]))
        return None

    def _picture(self, key: str) -> tuple[Picture, UvTransform] | None:
        if key not in self._entry.maps:
            return None
        name, layout, line = self._entry.maps[key]
        path, moved = found(name, self._entry.file, self._root, f"line {line} {key}")
        if not path.is_file():
            self._said.append(f"picture {name} is not there")
            return None
        if moved:
            self._said.append(f"picture {name} was found beside {self._entry.file.name}")
        if path not in self._sources:
            self._sources.append(path)
        return self._pictures.of_file(path), layout

    def _coloured(self, key: str, map_key: str, default: float) -> Varying:
        factor = np.maximum(self._colour(key, default), 0)
        picture = self._picture(map_key)
        if picture is None:
            even = float(np.ptp(factor)) == 0 and factor[0] in (0, 1)  # what exporters write beside a picture
            lost = map_key == "map_Kd" and map_key in self._entry.maps
            return constant(np.full(3, GREY) if lost and even else factor)
        if not factor.any():
            factor = np.ones(3)  # exporters write a black factor beside a picture that they mean to be seen
        return Varying(picture[0].rgb(srgb=True) * factor.astype(np.float32), picture[1] or IDENTITY)

    def _scaled(self, key: str, map_key: str, default: float) -> Varying:
        picture = self._picture(map_key)
        if picture is None:
            return constant(min(max(self._number(key, default), 0.0), 1.0))
        return Varying(picture[0].rgb(srgb=False)[..., :1], picture[1])

    def _colour(self, key: str, default: float) -> Floats:
        values = self._entry.numbers.get(key, (default,))
        return np.array(values if len(values) == 3 else (values[0],) * 3)

    def _number(self, key: str, default: float) -> float:
        return self._entry.numbers.get(key, (default,))[0]


def _at_most_one(kd: Varying) -> Varying:
    return combined(lambda k: np.clip(k, 0, 1), kd, said=[])


def _looks_like_normals(texels: Floats) -> bool:
    """Whether a bump map is a normal map in truth: mean upwards, lengths about one."""
    mean = texels.mean(axis=(0, 1))
    length = np.linalg.norm(texels, axis=-1)
    return bool(mean[2] > 0.5 and abs(mean[0]) < 0.3 and abs(mean[1]) < 0.3 and abs(float(length.mean()) - 1) < 0.15)
