"""For tools whose materials are sums, like ours: the diffuse terms stay as they are, each lobe gets a counterpart."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from lambent.core.frames import Floats
from lambent.core.progress import Progress
from lambent.materials.document import Lobe, Material
from lambent.materials.export.contract import Cost
from lambent.materials.export.match import ALPHA_MAX, ALPHA_MIN, cost_of, match, slope_start, three
from lambent.materials.export.pairs import CHECK_LOG2, FIT_LOG2, Pairs, pairs_of


@dataclass(frozen=True)
class Part:
    """One lobe as the other tool has it.

    Attributes
    ----------
    lobe : Lobe
        Ours that it stands for.
    mx, my : float
        Roughness along t and b of the tool's facets.
    colour : (C,)
        What the lobe is multiplied with; of a reflection lobe in MaterialX, its reflectance at normal incidence.
    others : (K,)
        What else the tool's lobe has.
    """

    lobe: Lobe
    mx: float
    my: float
    colour: Floats
    others: Floats


@dataclass(frozen=True)
class Tool:
    """What a tool's lobes are like.

    Attributes
    ----------
    name : str
    eval : callable
        f (N, C) of a part at the pairs, both sides of it zero where it is not.
    others : callable
        (start, low, high), each (K,), of the parameters besides roughness and colour, of a lobe and C channels.
    colour_start : callable
        (C,) of a lobe, before limiting.
    colour_max : float
    distribution : callable
        The tool's distribution for a lobe: "ggx" or "beckmann".
    """

    name: str
    eval: Callable[[Pairs, Part], Floats]
    others: Callable[[Lobe, int], tuple[Floats, Floats, Floats]]
    colour_start: Callable[[Lobe], Floats]
    colour_max: float
    distribution: Callable[[Lobe], str]


def likeness(
    material: Material, tool: Tool, lost: Sequence[str], rounded: Callable[[Part], Part], progress: Progress
) -> tuple[list[Part], Cost]:
    """The parts that together with the diffuse terms look most like the material, as written, and what they cost."""
    pairs, flat = pairs_of(material, FIT_LOG2, seed=0), flattened(material)
    parts: list[Part] = []
    if material.lobes:
        starts, low, high = zip(*(_space(lobe, tool, pairs) for lobe in material.lobes), strict=True)

        def model(x: Floats) -> Floats:
            return evaluate(pairs, flat, tool, _read(x, material, tool, pairs))

        bounds = np.concatenate(low), np.concatenate(high)
        x, _ = match(pairs, model, [np.concatenate(starts)], bounds, progress, tool.name)
        parts = [rounded(part) for part in _read(x, material, tool, pairs)]
    check = pairs_of(material, CHECK_LOG2, seed=1)
    return parts, cost_of(check, evaluate(check, flat, tool, parts), lost)


def flattened(material: Material) -> Material:
    """The material with a plain diffuse term that returns as much light as its coupled one."""
    if not material.kd_coupled:
        return material
    plain = material.model_copy(update={"kd_coupled": False})
    coupled, flat = (
        pairs_of(one.model_copy(update={"lobes": (), "kt_d": (0.0, 0.0, 0.0)}), FIT_LOG2, seed=0).samples
        for one in (material, plain)
    )
    before, after = (float(((s.weight * s.wo[:, 2]) @ s.f).mean()) for s in (coupled, flat))
    share = before / after if after > 0 else 1.0
    return plain.model_copy(update={"kd": three(share * np.array(material.kd))})


def evaluate(pairs: Pairs, material: Material, tool: Tool, parts: Sequence[Part]) -> Floats:
    """f (N, C) of the diffuse terms of `material` and the parts."""
    channels = pairs.samples.f.shape[1]
    kd, kt_d = (np.array(rgb)[:channels] / np.pi for rgb in (material.kd, material.kt_d))
    f = np.where(pairs.far[:, None], kt_d, kd)
    for part in parts:
        f = f + tool.eval(pairs, part)
    return f


def _space(lobe: Lobe, tool: Tool, pairs: Pairs) -> tuple[Floats, Floats, Floats]:
    """Start and bounds of a part's parameters: ln mx, ln my, roots of the colour, the others."""
    channels = pairs.samples.f.shape[1]
    mx, my = slope_start(lobe, tool.distribution(lobe))
    others = tool.others(lobe, channels)
    colour = np.sqrt(np.clip(tool.colour_start(lobe)[:channels], 1e-4, tool.colour_max))
    start = np.array([np.log(mx), np.log(my), *colour, *others[0]])
    small, large = np.log(ALPHA_MIN), np.log(ALPHA_MAX)
    low = np.array([small, small, *np.zeros(channels), *others[1]])
    high = np.array([large, large, *np.full(channels, np.sqrt(tool.colour_max)), *others[2]])
    if lobe.mx == lobe.my:
        high[1] = low[1]
    return start, low, high


def _read(x: Floats, material: Material, tool: Tool, pairs: Pairs) -> list[Part]:
    channels, parts, at = pairs.samples.f.shape[1], [], 0
    for lobe in material.lobes:
        count = 2 + channels + len(tool.others(lobe, channels)[0])
        own = x[at : at + count]
        at += count
        mx = float(np.exp(own[0]))
        my = mx if lobe.mx == lobe.my else float(np.exp(own[1]))
        parts.append(Part(lobe, mx, my, own[2 : 2 + channels] ** 2, own[2 + channels :]))
    return parts
