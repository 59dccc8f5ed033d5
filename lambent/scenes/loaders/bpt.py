"""Bezier patches as text (BPT), as the teapot and its tea set are distributed, in two layouts.

Those of Holmes's PatchOff have the number of patches; of each its degrees in u and v, then its control points, u
fastest. Older files have the number of patches; of each the numbers of its 16 points, from 1; the number of points; the
points. Numbers are separated by white space or commas; line ends have no meaning. z is up in both.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

from lambent.core.arrays import Flags, Floats, numbers_in
from lambent.core.ceilings import BPT_BYTES, TRIANGLES
from lambent.core.errors import UserError
from lambent.core.inputs import read_bytes
from lambent.scenes.geometry import bezier
from lambent.scenes.geometry.bezier import net_areas, oriented_alike, steps_to, tessellated, triangles_of
from lambent.scenes.geometry.grid import FLAT
from lambent.scenes.loaders.contents import DEFAULTS, Contents, LoadOptions, grey_thing
from lambent.scenes.loaders.meshes.repair import ABSURD

NAME, ENDINGS = "Bezier patches", (".bpt",)
DEVIATION = 1 / 1000  # of triangles from the patches, of the diagonal of all control points
MOST_TRIANGLES = 2_000_000  # beyond which triangles may deviate more
MOST_DEGREE = 3
POINTS = 16  # of a bicubic patch
TOLD = 5  # patches named in a warning
NUMBER = re.compile(rb"[+-]?(\d+\.?\d*([eE][+-]?\d+)?|\.\d+([eE][+-]?\d+)?|nan|inf|infinity)", re.IGNORECASE)


def load(path: Path, options: LoadOptions = DEFAULTS) -> Contents:
    """A file as one grey object, z up turned to y up, with its patches in the file's order."""
    control, notes = read(path), []
    usable = np.asarray((np.abs(control) < ABSURD).all(axis=(1, 2, 3)))
    notes += _left_out("a control point is not finite", ~usable)
    control = np.where(usable[:, None, None, None], control, np.nan)
    control = oriented_alike(np.stack([control[..., 0], control[..., 2], -control[..., 1]], axis=-1))
    corners = control[usable].reshape(-1, 3)
    size = float(np.linalg.norm(np.ptp(corners, axis=0))) if len(corners) else 0.0
    if size == 0:
        raise UserError("holds no patch with an area", file=path, hint="; ".join(notes) or None)
    steps, tolerance = steps_to(np.nan_to_num(control), DEVIATION * size), DEVIATION * size
    while triangles_of(steps) > MOST_TRIANGLES and steps.max() > 2:
        tolerance *= 2
        steps = steps_to(np.nan_to_num(control), tolerance)
    TRIANGLES.check(triangles_of(steps), file=path)
    mesh = tessellated(control, steps)
    notes += _left_out("no area", usable & (net_areas(control) <= FLAT * size**2))
    if not len(mesh.faces):
        raise UserError("holds no patch with an area", file=path, hint="; ".join(notes) or None)
    return grey_thing(path, mesh, [f"{path.stem}: {n}" for n in notes])


def _left_out(why: str, patches: Flags) -> list[str]:
    numbers = (np.flatnonzero(patches) + 1).tolist()
    if not numbers:
        return []
    more = f" and {len(numbers) - TOLD} more" if len(numbers) > TOLD else ""
    named = ", ".join(map(str, numbers[:TOLD])) + more
    return [f"patch{'es' if len(numbers) > 1 else ''} {named} left out: {why}"]


def read(path: Path) -> Floats:
    """Control points (n, 4, 4, 3) of a file, in its axes; degrees below 3 are elevated.

    Raises
    ------
    UserError
        If a word is not a number, a count or a degree is not what the format allows, or the file is too short or long.
    """
    text = _Numbers(path)
    count = text.integer("number of patches", least=1)
    return text.indexed(count) if text.is_indexed() else text.patches(count)


class _Numbers:
    """The numbers of a file, taken one after the other."""

    def __init__(self, path: Path) -> None:
        self._path, self._at = path, 0
        self._data = read_bytes(path, BPT_BYTES).removeprefix(b"\xef\xbb\xbf").replace(b",", b" ")
        found = numbers_in(self._data)
        if found is None:
            text, line = self._word(lambda _, word: NUMBER.fullmatch(word) is None)
            raise UserError("has a word that is not a number", file=path, field=f"line {line}", got=repr(text[:40]))
        self._values = found

    def integer(self, what: str, *, least: int, most: int | None = None) -> int:
        """The next number, which must be whole and within bounds."""
        self._need(1, what)
        value = float(self._values[self._at])
        if not (value.is_integer() and least <= value <= (most if most is not None else value)):
            expected = f"a whole number from {least}" + (f" to {most}" if most is not None else "")
            self._refuse(f"{what} cannot be read", expected)
        self._at += 1
        return int(value)

    def is_indexed(self) -> bool:
        """Whether the second line that is not empty has 16 numbers: those of the points of a patch."""
        lines = (line.split() for line in self._data[: 1 << 12].splitlines())
        return [len(words) for words in lines if words][1:2] == [POINTS]

    def patches(self, count: int) -> Floats:
        """Patches with their degrees and points."""
        self._need(count * (2 + 4 * 3), "patches")  # before anything of their number is allocated
        control = np.empty((count, 4, 4, 3))
        for number in range(count):
            of_patch = f"of patch {number + 1}"
            u = self.integer(f"degree in u {of_patch}", least=1, most=MOST_DEGREE)
            v = self.integer(f"degree in v {of_patch}", least=1, most=MOST_DEGREE)
            points = self._take(3 * (u + 1) * (v + 1), f"control points {of_patch}").reshape(v + 1, u + 1, 3)
            control[number] = points if u == v == MOST_DEGREE else bezier.elevated(points)
        self._end("patch")
        return control

    def indexed(self, count: int) -> Floats:
        """Patches that share a table of points."""
        first, index = self._at, self._take(POINTS * count, "numbers of points of patches")
        points = self.integer("number of points", least=1)
        bad = np.flatnonzero(~((index >= 1) & (index <= points) & (index == np.floor(index))))
        if len(bad):
            self._at = first + int(bad[0])
            self._refuse(f"point of patch {bad[0] // POINTS + 1} does not exist", f"a whole number from 1 to {points}")
        table = self._take(3 * points, "points").reshape(-1, 3)
        self._end("point")
        return np.asarray(table[index.astype(np.int64) - 1].reshape(count, 4, 4, 3))

    def _take(self, count: int, what: str) -> Floats:
        self._need(count, what)
        self._at += count
        return self._values[self._at - count : self._at]

    def _need(self, count: int, what: str) -> None:
        left = len(self._values) - self._at
        if left < count:
            raise UserError(
                "file is truncated", file=self._path, field=what, got=f"{left} numbers", expected=f"at least {count}"
            )

    def _end(self, what: str) -> None:
        if self._at < len(self._values):
            self._refuse(f"has numbers after its last {what}", "the end of the file")

    def _refuse(self, fault: str, expected: str) -> None:
        text, line = self._word(lambda number, _: number == self._at)
        raise UserError(fault, file=self._path, field=f"line {line}", got=text[:40], expected=expected)

    def _word(self, wanted: Callable[[int, bytes], bool]) -> tuple[str, int]:
        """The first word that is wanted by its number and text, or the last one, and its line; for errors only."""
        place = None
        for number, place in enumerate(re.finditer(rb"\S+", self._data)):
            if wanted(number, place.group()):
                break
        if place is None:
            return "", 1
        line = self._data[: place.start()].replace(b"\r\n", b"\n").replace(b"\r", b"\n").count(b"\n") + 1
        return place.group().decode("latin-1"), line
