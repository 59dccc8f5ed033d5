"""Fit another tool's material model to a material, and describe the differences."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from lambent.core.arrays import Flags, Floats
from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.core.plain import Triple, triple
from lambent.core.progress import Progress, tracked
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import BLACK, Lobe, Material
from lambent.materials.export.contract import Cost, Subject
from lambent.materials.export.resampling.pairs import Pairs
from lambent.materials.measured.inspecting.metrics import CUBEROOT, errors_and_shares, light_ratios

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
    if material.lobes:
        alphas = ", ".join(f"{lobe.alpha:.2g}" for lobe in material.lobes)
        lost.append(f"alpha ({alphas}): the exponent of the cosines becomes Smith's masking")
    return lost


def slope_start(lobe: Lobe, distribution: str) -> tuple[float, float]:
    """Start roughness along t and b: a GGX peak is as wide as a Beckmann peak of 1.2 times its roughness."""
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
