"""Homomorphic factors (McCool, Ang & Ahmad 2001): f = alpha P(wi) Q(h) P(wo), from two textures and three numbers.

A text file beside the textures gives alpha: either alone, one number per channel; or after a title and the kind of file
(0: P and Q; 1: P, Q and a highlight; 2: the highlight alone), followed by an unused exposure. NAME.txt belongs to the
pictures NAME_0 and NAME_1, or NAMEp and NAMEq; a text of alpha alone belongs to its folder's one pair ending in p and
q.

Textures are linear and hold the upper hemisphere as a parabolic map: (x, y) / (1 + z) from -1 to 1 across the picture.
A highlight, which has no scale in the file, is ignored. P and Q have an unknown absolute scale; alpha makes f the
file's values in 1/sr.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.core.geometry.sequences import radical_inverse
from lambent.core.pictures.images import read_encoded
from lambent.materials.bsdf import components
from lambent.materials.lobes import NUMPY, Vector, clamped, half_vector
from lambent.materials.measured.parts.text_numbers import head_text, read_text, shown, without_comments
from lambent.materials.measured.protocol import MeasuredSamples, TableInfo, collect
from lambent.materials.measured.tables.table import ReflectionTable

NAME = "homomorphic factors"
LIMIT_BYTES = 1 << 16
KINDS = ("P and Q", "P, Q and a highlight", "a highlight alone")
EVEN = 0.02  # of the textures' range: largest deviation from rotational symmetry that counts as isotropic
_NUMBER = re.compile(rb"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_LONGEST_NUMBER = 40  # characters: the pattern needs quadratic time to reject one
_SAMPLES = 20_000


def recognise(head: bytes, size: int) -> bool:
    """Whether the file is a title, a kind, alpha and an exposure, or alpha alone, one number per line."""
    text = head_text(head)
    if text is None or size > LIMIT_BYTES:
        return False
    text = without_comments(text)
    return [_numbers(line) for line in text.strip().split(b"\n")] == [1, 1, 1] or _is_titled(text)


def _is_titled(text: bytes) -> bool:
    lines = text.strip().split(b"\n")
    titled = (
        len(lines) == 4 and re.search(rb"[A-Za-z]", lines[0]) is not None and lines[1].strip() in (b"0", b"1", b"2")
    )
    return titled and [_numbers(line) for line in lines[2:]] == [3, 1]


def _numbers(line: bytes) -> int:
    """Number of numbers in a line; 0 if it has anything else."""
    words = line.split()
    return len(words) * all(len(word) <= _LONGEST_NUMBER and _NUMBER.fullmatch(word) is not None for word in words)


@dataclass(frozen=True, eq=False)
class ParabolicMap:
    """A texture (n, n, 3) over the upper hemisphere, flat; bilinear between its texels."""

    texels: Floats
    size: int

    @classmethod
    def of(cls, picture: Floats) -> ParabolicMap:
        return cls(np.ascontiguousarray(picture, np.float32).ravel(), len(picture))

    def at(self, w: Vector, ops: Any = NUMPY) -> Vector:
        """RGB of directions on the upper side."""
        n = self.size
        rows, columns = (clamped((c / (1 + w[2]) + 1) / 2, n, ops) for c in (w[1], w[0]))
        value: list[Any] = [0.0, 0.0, 0.0]
        for row, along in rows:
            for column, across in columns:
                texel = 3 * (row * n + column)
                value = [v + along * across * ops.gather(self.texels, texel + c) for c, v in enumerate(value)]
        return value[0], value[1], value[2]


class HomomorphicTable(ReflectionTable):
    """f = alpha P(wi) Q(h) P(wo).

    Parameters
    ----------
    p, q : (n, n, 3)
        Textures in [0, 1], at least 2 x 2.
    alpha : (3,)
    """

    def __init__(self, p: Floats, q: Floats, alpha: Floats, name: str, notes: tuple[str, ...] = ()) -> None:
        self.p, self.q, self.alpha = ParabolicMap.of(p), ParabolicMap.of(q), np.asarray(alpha, float)
        isotropic = max(_unevenness(texture) for texture in (self.p, self.q)) <= EVEN
        self.info = TableInfo(name, NAME, isotropic, False, 3, "f", {"P": len(p), "Q": len(q)}, notes)

    def _eval_above(self, wi: Floats, wo: Floats) -> Floats:
        i, o = components(wi), components(wo)
        parts = [
            np.stack(texture.at(w), axis=-1) for texture, w in ((self.p, i), (self.q, half_vector(i, o)), (self.p, o))
        ]
        return np.asarray(self.alpha * parts[0] * parts[1] * parts[2])

    def samples(self, max_count: int | None = None) -> MeasuredSamples:
        """The product at 20,000 pairs, uniform over d_wi d_wo."""
        k = np.arange(_SAMPLES)
        z_i, phi_i, z_o, phi_o = (radical_inverse(k, base) for base in (2, 3, 5, 7))
        wi, wo = (direction(np.arccos(z), 2 * np.pi * phi) for z, phi in ((z_i, phi_i), (z_o, phi_o)))
        weight = np.full(_SAMPLES, (2 * np.pi) ** 2 / _SAMPLES)
        return collect(wi, wo, self.eval(wi, wo), weight, self.info, np.zeros(_SAMPLES, bool), max_count)


def read(path: Path) -> HomomorphicTable:
    """The product of the textures beside the file.

    Raises
    ------
    UserError
        The file has a highlight alone, alpha is negative, or a texture is missing, damaged, or not square.
    """
    path = Path(path)
    text = without_comments(read_text(path, LIMIT_BYTES))
    notes: tuple[str, ...] = ("the absolute scale is the file's alpha",)
    if _is_titled(text):
        lines = shown(text.strip()).split("\n")
        kind, alpha = int(lines[1]), np.array([float(word) for word in lines[2].split()])
        if kind == 2:
            raise UserError("has no factors", file=path, field="line 2", got="kind 2, a highlight alone",
                            expected="kind 0 or 1", hint="open the file of P and Q beside it")  # fmt: skip
        if kind == 1:
            notes += ("its extra highlight is left out: the file does not state its scale",)
        paths = [_beside(path, letter, endings) for letter, endings in (("P", ("_0", "p")), ("Q", ("_1", "q")))]
    else:
        alpha = np.array([float(word) for word in shown(text).split()])
        paths = _pair_of(path)
    if not (np.isfinite(alpha).all() and (alpha >= 0).all()):
        raise UserError("alpha is negative", file=path, got=alpha.tolist(), expected="three numbers from 0")
    p, q = (_texture(file) for file in paths)
    return HomomorphicTable(p, q, alpha, path.name, notes)


def _beside(path: Path, letter: str, endings: tuple[str, ...]) -> Path:
    names = [f"{path.stem}{ending}.png" for ending in endings]
    for name in names:
        if (path.parent / name).is_file():
            return path.parent / name
    raise UserError(f"texture {letter} is missing", file=path, expected=f"{' or '.join(names)} beside it")


def _pair_of(path: Path) -> list[Path]:
    """The one pair of pictures in the folder whose names differ in a final p and q."""
    pairs = [p for p in sorted(path.parent.glob("*p.png")) if p.with_name(f"{p.stem[:-1]}q.png").is_file()]
    if len(pairs) != 1:
        got = f"{len(pairs)} pairs" + "".join(f", {p.name}" for p in pairs[:3])
        raise UserError("textures P and Q", file=path, got=got, expected="one pair NAMEp.png, NAMEq.png beside it")
    return [pairs[0], pairs[0].with_name(f"{pairs[0].stem[:-1]}q.png")]


def _texture(path: Path) -> Floats:
    picture = read_encoded(path)[..., :3]
    if picture.shape[0] != picture.shape[1] or len(picture) < 2:
        got = f"{picture.shape[1]}x{picture.shape[0]}"
        raise UserError("is not a parabolic map", file=path, got=got, expected="a square picture")
    return picture


def radial_means(texture: ParabolicMap, angle_rad: Floats) -> Floats:
    """(K, 3) means of a texture over the azimuth at angles (K,) from the normal."""
    phi = np.arange(64) * (2 * np.pi / 64)
    rings = texture.at(components(direction(angle_rad[:, None], phi)))
    return np.asarray(np.stack(rings, axis=-1).mean(axis=1))


def _unevenness(texture: ParabolicMap) -> float:
    """Largest deviation from the radial mean within 80 degrees of the normal."""
    theta = np.radians(np.arange(1.0, 81))
    w = direction(theta[:, None], np.arange(64) * (2 * np.pi / 64))
    values = np.stack(texture.at(components(w)), axis=-1)
    return float(np.abs(values - radial_means(texture, theta)[:, None]).max())
