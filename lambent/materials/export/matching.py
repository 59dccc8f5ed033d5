"""Fit another tool's material model to a material, and describe the differences.

For tools whose materials are sums like ours, diffuse terms are kept and each lobe gets a counterpart.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lambent.core.arrays import Flags, Floats
from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.core.plain import Triple, triple
from lambent.core.progress import Progress, tracked
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import BLACK, Lobe, Material
from lambent.materials.export.contract import Cost, Subject
from lambent.materials.export.resampling.resampled import CHECK_LOG2, FIT_LOG2, Pairs, pairs_of
from lambent.materials.lobes import with_distribution
from lambent.materials.measured.inspecting.metrics import CUBEROOT, errors_and_shares, light_ratios


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
    if material.lobes or material.kd_coupled or material.kd_curve is not None:
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


MOST_EVALUATIONS = 60  # of the Jacobian, for each start
ALBEDO_BINS = 8
ALBEDO_WEIGHT = 0.3  # weight of relative albedo differences against differences of f
ALBEDO_TOLERANCE = 0.02  # relative; larger differences are reported
LOST_AT_DEG = 30  # angle of incidence at which the lost retro light is reported
ALPHA_MIN, ALPHA_MAX = 0.001, 1.0  # range of the other tools' roughness

Model = Callable[[Floats], Floats]
"""f (N, C) in 1/sr at the pairs, of a parameter vector."""


def material_of(subject: Subject) -> Material:
    """The subject; raises `UserError` for a table."""
    if isinstance(subject, Material):
        return subject
    raise UserError("is a measurement, not a material", file=subject.info.file, hint="fit it first with `lambent fit`")


def without_retro(material: Material) -> Material:
    """The material without retro lobes, which no other tool has."""
    return material.model_copy(update={"lobes": tuple(lobe for lobe in material.lobes if not lobe.retro)})


def _retro_losses(material: Material) -> list[str]:
    """Descriptions of the loss from leaving out the retro lobes."""
    returned = tuple(lobe for lobe in material.lobes if lobe.retro)
    if not returned:
        return []
    wi = direction(np.radians(LOST_AT_DEG), 0.0)
    near = material.model_copy(update={"kt_d": BLACK, "lobes": material.reflection_lobes})
    whole, lost = (MaterialBSDF(one).albedo(wi).mean() for one in (near, Material(lobes=returned)))
    least, most = (_towards_light(one) for one in (without_retro(material), material))
    return [
        f"retro-reflection: the format has none; at {LOST_AT_DEG} degrees {lost / max(whole, 1e-9):.0%} of the "
        f"reflected light is lost, and f towards the light is {least:.3g} in place of {most:.3g} /sr"
    ]


def _towards_light(material: Material) -> float:
    """f back towards the light, 1/sr."""
    wi = direction(np.radians(LOST_AT_DEG), 0.0)
    return float(MaterialBSDF(material).eval(wi, wi).mean())


def kept_towards_light(material: Material) -> float:
    """f back towards the light without retro lobes, relative to the material's; 1 without retro lobes."""
    if not any(lobe.retro for lobe in material.lobes):
        return 1.0
    return _towards_light(without_retro(material)) / max(_towards_light(material), 1e-30)


def match(
    pairs: Pairs, model: Model, starts: Sequence[Floats], bounds: tuple[Floats, Floats], progress: Progress, what: str
) -> tuple[Floats, float]:
    """Bounded least squares from every start: cube-root, cosine-weighted differences of f, and those of the albedos.

    Without the albedos, the cube root's weight on the tails would trade light for shorter tails: a metal would come out
    a third too dark. Parameters with equal bounds are fixed.

    Returns
    -------
    best : (P,)
        The best parameters.
    total : float
        Their sum of squares; 0 is perfect, a black surface has 1 + ALBEDO_WEIGHT.
    """
    from scipy.optimize import least_squares

    low, high = bounds
    free = high > low
    differences = _differences(pairs)
    ends = []
    for i, start in enumerate(tracked(starts, progress, what)):
        margin = 1e-6 * (high - low)
        x = np.clip(start, low + margin, high - margin)

        def residual(moved: Floats, x: Floats = x) -> Floats:
            return differences(model(_moved(x, free, moved)))

        found = least_squares(
            residual, x[free], bounds=(low[free], high[free]), x_scale="jac", max_nfev=MOST_EVALUATIONS, ftol=1e-5
        )
        ends.append((2 * float(found.cost), i, _moved(x, free, found.x)))
    total, _, best = min(ends, key=lambda end: end[:2])
    return best, total


def _moved(x: Floats, free: Flags, values: Floats) -> Floats:
    x = x.copy()
    x[free] = values
    return x


def _differences(pairs: Pairs) -> Callable[[Floats], Floats]:
    """The residuals of f (N, C) of a model against a material's values at the pairs."""
    samples = pairs.samples
    w, c = CUBEROOT.terms(samples)
    target = CUBEROOT.transform(c[:, None] * samples.f)
    black = CUBEROOT.error(samples, np.zeros_like(samples.f))
    root = np.sqrt(w / samples.f.shape[1])[:, None] / max(black, 1e-6)
    # Albedos in bins of theta_i, reflected and transmitted: (bins, N) shares of each pair.
    order = np.argsort(np.argsort(samples.wi[:, 2], kind="stable"), kind="stable")
    which = order * ALBEDO_BINS // len(order) + ALBEDO_BINS * pairs.far
    share = samples.weight * np.abs(samples.wo[:, 2]) * ALBEDO_BINS / len(order)
    gather = np.where(which == np.arange(2 * ALBEDO_BINS)[:, None], share, 0.0)
    albedo = gather @ samples.f
    albedo_root = np.sqrt(ALBEDO_WEIGHT) / max(float(np.sqrt(np.sum(albedo**2))), 1e-6)

    def differences(f: Floats) -> Floats:
        seen = root * (CUBEROOT.transform(c[:, None] * f) - target)
        return np.concatenate([seen.ravel(), (albedo_root * (gather @ f - albedo)).ravel()])

    return differences


def cost_of(pairs: Pairs, f_written: Floats, lost: Sequence[str], towards_light: float = 1.0) -> Cost:
    """The cost of a written model with f (N, C) at `pairs`, including light that the material does not scatter.

    `towards_light` comes from `kept_towards_light`. C is 1 for a grey model of a material whose retro lobes alone have
    colour.
    """
    f_written = np.broadcast_to(f_written, pairs.samples.f.shape)
    light = light_ratios(pairs.samples, f_written)
    mentioned = [
        f"the {'reflected' if side == 'reflection' else 'transmitted'} light is {ratio:.2f} times the material's"
        for side, ratio in light.items()
        if abs(ratio - 1) > ALBEDO_TOLERANCE
    ]
    return Cost((*lost, *mentioned), *errors_and_shares(pairs.samples, f_written), light, towards_light)


def shape_losses(material: Material, *, beckmann_kept: bool = False) -> list[str]:
    """Properties of the lobes that Smith-masked GGX facets with a Fresnel factor cannot express."""
    lost = _retro_losses(material)
    material = without_retro(material)
    if material.kd_coupled and any(material.kd):
        lost.append("the diffuse term's coupling to Fresnel: the format has another one, or none")
    if not beckmann_kept and any(lobe.distribution == "beckmann" for lobe in material.lobes):
        lost.append("Beckmann lobes became GGX lobes, whose tails are longer; a fit of GGX lobes loses less")
    if any(lobe.shape is not None for lobe in material.lobes):
        lost.append("curve lobes became the nearest GGX lobes; a table keeps them: --as rgl, merl or lbnl_xml")
    if any(lobe.fresnel is not None for lobe in material.lobes):
        lost.append("Fresnel curves became the nearest reflectance at normal incidence")
    if material.kd_curve is not None:
        lost.append("the diffuse term's curve: the format has a constant one")
    if material.lobes:
        alphas = ", ".join(f"{lobe.alpha:.2g}" for lobe in material.lobes)
        lost.append(f"alpha ({alphas}): the exponent of the cosines becomes Smith's masking")
    return lost


def slope_start(lobe: Lobe, distribution: str) -> tuple[float, float]:
    """Start roughness along t and b: a GGX peak is as wide as a Beckmann peak of 1.2 times its roughness."""
    if lobe.shape is not None:
        lobe = with_distribution(lobe, "ggx")
    scale = 0.8 if lobe.distribution == "beckmann" and distribution == "ggx" else 1.0
    mx, my = (float(np.clip(scale * m, ALPHA_MIN, ALPHA_MAX)) for m in (lobe.mx, lobe.my))
    return mx, my


def brightness(lobe: Lobe) -> float:
    """Approximate light returned by the lobe, for ranking lobes."""
    k, r0 = np.array(lobe.k), np.array(lobe.r0)
    return float(np.mean(k * (r0 if lobe.side == "reflection" else 1 - r0))) + 0.02 * float(np.mean(k))


def rounded(values: Floats) -> Floats:
    """Values (K,), rounded as in the written file."""
    return np.array([round(float(v), 6) for v in values])


def three(values: Floats) -> Triple:
    """RGB of (1,) or (3,) values, rounded as in the written file."""
    return triple(np.broadcast_to(rounded(values), 3))
