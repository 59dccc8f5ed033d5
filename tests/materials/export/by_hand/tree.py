"""BSDF files of tensor trees, read by other means than the project's: recursion, and the disk map by its angles."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np

_SPACE = "{http://windows.lbl.gov}"


def read_by_hand(path: Path) -> tuple[int, dict[tuple[str, str], Any]]:
    """Rank, and nested lists by wavelength and direction, such as ("Visible", "Reflection Back")."""
    root = ET.parse(path).getroot()
    structure = root.findtext(f".//{_SPACE}IncidentDataStructure")
    trees = {}
    for data in root.iter(f"{_SPACE}WavelengthData"):
        block = data.find(f"{_SPACE}WavelengthDataBlock")
        assert block.findtext(f"{_SPACE}AngleBasis") == "LBNL/Shirley-Chiu"
        direction = block.findtext(f"{_SPACE}WavelengthDataDirection")
        words = iter(re.findall(r"[{}]|[^\s,{}]+", block.findtext(f"{_SPACE}ScatteringData")))
        assert next(words) == "{"
        trees[data.findtext(f"{_SPACE}Wavelength"), direction] = _nested(words)
        assert next(words, None) is None
    return int(structure.removeprefix("TensorTree")), trees


def _nested(words: Any) -> list[Any]:
    found: list[Any] = []
    for word in words:
        if word == "}":
            return found
        found.append(_nested(words) if word == "{" else float(word))
    raise AssertionError("a brace that is not closed")


def value_at(tree: list[Any], place: np.ndarray) -> float:
    """The value at a place (rank,) of the unit cube."""
    at = np.array(place, dtype=float)
    while isinstance(tree[0], list):
        upper = at >= 0.5
        tree, at = tree[sum(1 << d for d in range(len(at)) if upper[d])], 2 * at - upper
    side = round(len(tree) ** (1 / len(at)))
    assert side ** len(at) == len(tree) and side & (side - 1) == 0
    index = 0
    for x in at:
        index = index * side + int(x * side)
    return tree[index]


def place_of(rank: int, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """Place (rank,) of directions (3,): light travels to -wi, and leaves to wo."""
    out = np.array(wo[:2])
    if rank == 4:
        return np.concatenate([_square(-wi[:2]), _square(out)])
    turn = np.arctan2(-wi[1], -wi[0])
    out = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]) @ out
    return np.concatenate([[0.5 - 0.5 * np.hypot(wi[0], wi[1])], _square(out)])


def _square(disk: np.ndarray) -> np.ndarray:
    """Shirley & Chiu 1997 backwards: the ring of radius r is the outline of the square of half side r.

    A quarter of the ring about each axis is one side of the outline, along which the angle is linear.
    """
    r, phi = np.hypot(*disk), np.degrees(np.arctan2(disk[1], disk[0]))
    if -45 <= phi < 45:
        a, b = r, r * phi / 45
    elif 45 <= phi < 135:
        a, b = r * (90 - phi) / 45, r
    elif -135 <= phi < -45:
        a, b = r * (90 + phi) / 45, -r
    else:
        a, b = -r, r * (180 - phi % 360) / 45
    return np.array([(a + 1) / 2, (b + 1) / 2])


def leaves_of(tree: list[Any], side: float = 1.0, rank: int = 4) -> list[tuple[float, float]]:
    """(volume, value) of every leaf."""
    if isinstance(tree[0], list):
        return [leaf for branch in tree for leaf in leaves_of(branch, side / 2, rank)]
    return [(side**rank / len(tree), value) for value in tree]
