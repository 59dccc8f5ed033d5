"""Matching for tools whose materials are sums like ours: diffuse terms are kept, each lobe gets a counterpart."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.progress import Progress
from lambent.materials.document import Lobe, Material
from lambent.materials.export.contract import Cost
from lambent.materials.export.matching.match import (
    ALPHA_MAX,
    ALPHA_MIN,
    cost_of,
    kept_towards_light,
    match,
    rounded,
    slope_start,
    without_retro,
)
from lambent.materials.export.resampling.pairs import CHECK_LOG2, FIT_LOG2, Pairs, pairs_of


@dataclass(frozen=True)
class Part:
    """A lobe of the other tool.

    Attributes
    ----------
    lobe : Lobe
        Our counterpart.
    mx, my : float
        Roughness along t and b of the tool's facets.
    colour : (C,)
        Factor of the lobe; for a reflection lobe in MaterialX, its reflectance at normal incidence.
    others : (K,)
        The tool's other parameters.
    """

    lobe: Lobe
    mx: float
    my: float
    colour: Floats
    others: Floats


@dataclass(frozen=True)
class Tool:
    """A tool's model of lobes.

    Attributes
    ----------
    eval : callable
        f (N, C) of a part at the pairs; zero on the other side.
    others : callable
        (start, low, high), each (K,), of a reflection lobe's parameters besides roughness and colour, for C channels;
        transmission has none.
    colour_start : callable
        Start colour (C,) for a lobe, before limiting.
    distribution : callable
        The tool's distribution for a lobe: "ggx" or "beckmann".
    rounded_others : callable
        The other parameters, rounded as in the file.
    """

    name: str
    eval: Callable[[Pairs, Part], Floats]
    others: Callable[[Lobe, int], tuple[Floats, Floats, Floats]]
    colour_start: Callable[[Lobe], Floats]
    colour_max: float
    distribution: Callable[[Lobe], str]
    rounded_others: Callable[[Floats], Floats]

    def rounded(self, part: Part) -> Part:
        """The part, rounded as in the file."""
        colour, others = rounded(part.colour), self.rounded_others(part.others)
        return replace(part, mx=round(part.mx, 6), my=round(part.my, 6), colour=colour, others=others)

    def others_of(self, lobe: Lobe, channels: int) -> tuple[Floats, Floats, Floats]:
        """`others` of any lobe."""
        return self.others(lobe, channels) if lobe.side == "reflection" else (np.zeros(0),) * 3


@dataclass(frozen=True)
class Likeness:
    """A material of the other tool: diffuse coefficients (C,) of both sides, and a part per lobe."""

    kd: Floats
    kt_d: Floats
    parts: tuple[Part, ...] = ()

    def eval(self, pairs: Pairs, tool: Tool) -> Floats:
        """f (N, C) in 1/sr at the pairs."""
        f = np.where(pairs.far[:, None], self.kt_d / np.pi, self.kd / np.pi)
        for part in self.parts:
            f = f + tool.eval(pairs, part)
        return f


def likeness(material: Material, tool: Tool, lost: Sequence[str], progress: Progress) -> tuple[Likeness, Cost]:
    """The closest material of the tool, rounded as in the file, and its cost; exact without lobes.

    Retro lobes have no counterpart: they are left out of the match, but counted in the cost.
    """
    check, towards_light = pairs_of(material, CHECK_LOG2, seed=1), kept_towards_light(material)
    material = without_retro(material)
    pairs = pairs_of(material, FIT_LOG2, seed=0)
    kd, kt_d = (np.array(rgb[: pairs.samples.f.shape[1]]) for rgb in (material.kd, material.kt_d))
    found = Likeness(kd, kt_d)
    if material.lobes or material.kd_coupled:
        spaces = [_diffuse_space(kd), _diffuse_space(kt_d), *(_space(lobe, tool, pairs) for lobe in material.lobes)]
        start, low, high = (np.concatenate(parts) for parts in zip(*spaces, strict=True))

        def model(x: Floats) -> Floats:
            return _read(x, material, tool, pairs).eval(pairs, tool)

        best = _read(match(pairs, model, [start], (low, high), progress, tool.name)[0], material, tool, pairs)
        found = Likeness(rounded(best.kd), rounded(best.kt_d), tuple(tool.rounded(part) for part in best.parts))
    return found, cost_of(check, found.eval(check, tool), lost, towards_light)


def _diffuse_space(coefficient: Floats) -> tuple[Floats, Floats, Floats]:
    """Start and bounds of the roots of a diffuse coefficient; 0 stays 0."""
    root = np.sqrt(np.minimum(coefficient, 1))
    return root, np.zeros_like(root), np.where(root > 0, 1.0, 0.0)


def _space(lobe: Lobe, tool: Tool, pairs: Pairs) -> tuple[Floats, Floats, Floats]:
    """Start and bounds of a part's parameters: ln mx, ln my, roots of the colour, the others."""
    channels = pairs.samples.f.shape[1]
    mx, my = slope_start(lobe, tool.distribution(lobe))
    others = tool.others_of(lobe, channels)
    colour = np.sqrt(np.clip(tool.colour_start(lobe)[:channels], 1e-4, tool.colour_max))
    start = np.array([np.log(mx), np.log(my), *colour, *others[0]])
    small, large = np.log(ALPHA_MIN), np.log(ALPHA_MAX)
    low = np.array([small, small, *np.zeros(channels), *others[1]])
    high = np.array([large, large, *np.full(channels, np.sqrt(tool.colour_max)), *others[2]])
    if lobe.mx == lobe.my:
        high[1] = low[1]
    return start, low, high


def _read(x: Floats, material: Material, tool: Tool, pairs: Pairs) -> Likeness:
    channels = pairs.samples.f.shape[1]
    kd, kt_d, at, parts = x[:channels] ** 2, x[channels : 2 * channels] ** 2, 2 * channels, []
    for lobe in material.lobes:
        count = 2 + channels + len(tool.others_of(lobe, channels)[0])
        own = x[at : at + count]
        at += count
        mx = float(np.exp(own[0]))
        my = mx if lobe.mx == lobe.my else float(np.exp(own[1]))
        parts.append(Part(lobe, mx, my, own[2 : 2 + channels] ** 2, own[2 + channels :]))
    return Likeness(kd, kt_d, tuple(parts))
