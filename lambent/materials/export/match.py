"""Find the parameters of another tool's model that look most like a material, and say what they miss."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from lambent.core.directions import Floats
from lambent.core.errors import UserError
from lambent.core.progress import Progress
from lambent.materials.document import Lobe, Material
from lambent.materials.export.contract import Cost, Subject
from lambent.materials.export.pairs import Pairs
from lambent.materials.fitting.metrics import CUBEROOT, errors_of

MOST_EVALUATIONS = 60  # of the Jacobian, per start
ALBEDO_BINS = 8
ALBEDO_WEIGHT = 0.3  # of relative differences of albedo, beside those of f
ALBEDO_TOLERANCE = 0.02  # relative; a larger difference is said in words
ALPHA_MIN, ALPHA_MAX = 0.001, 1.0  # roughness the other tools take

Model = Callable[[Floats], Floats]
"""f (N, C) in 1/sr at the pairs, of a parameter vector."""


def material_of(subject: Subject) -> Material:
    """The subject, or a `UserError` where it is a table."""
    if isinstance(subject, Material):
        return subject
    raise UserError("is a measurement, not a material", file=subject.info.file, hint="lambent fit makes one of it")


def match(
    pairs: Pairs, model: Model, starts: Sequence[Floats], bounds: tuple[Floats, Floats], progress: Progress, what: str
) -> tuple[Floats, float]:
    """Bounded least squares from every start: cube-root, cosine-weighted differences of f, and those of the albedos.

    The albedos are there because a cube root sees so much of the tails that tails too long are paid for with light:
    a metal would come out a third too dark. Parameters whose bounds are equal stay where they are.

    Returns
    -------
    best : (P,)
        Parameters of the best end point.
    total : float
        What it leaves; 0 is perfect, a black surface leaves 1 + ALBEDO_WEIGHT.
    """
    from scipy.optimize import least_squares

    low, high = bounds
    free = high > low
    differences = _Differences(pairs)
    ends = []
    for i, start in enumerate(starts):
        progress(i, len(starts), what)
        margin = 1e-6 * (high - low)
        x = np.clip(start, low + margin, high - margin)

        def residual(moved: Floats, x: Floats = x) -> Floats:
            return differences(model(_moved(x, free, moved)))

        found = least_squares(
            residual, x[free], bounds=(low[free], high[free]), x_scale="jac", max_nfev=MOST_EVALUATIONS, ftol=1e-5
        )
        ends.append((2 * float(found.cost), i, _moved(x, free, found.x)))
    progress(len(starts), len(starts), what)
    total, _, best = min(ends, key=lambda end: end[:2])
    return best, total


def _moved(x: Floats, free: NDArray[np.bool_], values: Floats) -> Floats:
    x = x.copy()
    x[free] = values
    return x


class _Differences:
    """Residuals of a model against a material's values at the pairs."""

    def __init__(self, pairs: Pairs) -> None:
        samples = pairs.samples
        w, self._c = CUBEROOT.terms(samples)
        self._target = CUBEROOT.transform(self._c[:, None] * samples.f)
        black = CUBEROOT.error(samples, np.zeros_like(samples.f))
        channels = samples.f.shape[1]
        self._root = np.sqrt(w / channels)[:, None] / max(black, 1e-6)
        # Albedos in bins of theta_i, reflected and transmitted: (bins, N) shares of each pair.
        order = np.argsort(np.argsort(samples.wi[:, 2], kind="stable"), kind="stable")
        which = order * ALBEDO_BINS // len(order) + ALBEDO_BINS * pairs.far
        share = samples.weight * np.abs(samples.wo[:, 2]) * ALBEDO_BINS / len(order)
        self._gather = np.where(which == np.arange(2 * ALBEDO_BINS)[:, None], share, 0.0)
        albedo = self._gather @ samples.f
        self._albedo = albedo
        size = np.sqrt(np.sum(albedo**2))
        self._albedo_root = np.sqrt(ALBEDO_WEIGHT) / max(float(size), 1e-6)

    def __call__(self, f: Floats) -> Floats:
        seen = self._root * (CUBEROOT.transform(self._c[:, None] * f) - self._target)
        albedo = self._albedo_root * (self._gather @ f - self._albedo)
        return np.concatenate([seen.ravel(), albedo.ravel()])


def cost_of(pairs: Pairs, f_written: Floats, lost: Sequence[str]) -> Cost:
    """Errors of what was written, f (N, C) at `pairs`, and the same as shares of the errors of a black surface."""
    errors = errors_of(pairs.samples, f_written)
    black = errors_of(pairs.samples, np.zeros_like(pairs.samples.f))
    share = {name: error / black[name] if black[name] > 0 else 0.0 for name, error in errors.items()}
    return Cost((*lost, *_light_lost(pairs, f_written)), errors, share)


def _light_lost(pairs: Pairs, f_written: Floats) -> list[str]:
    """Where the light returned, mean over the incident directions and channels, is not the material's."""
    samples, lines = pairs.samples, []
    cosine = samples.weight * np.abs(samples.wo[:, 2])
    for side, here in (("reflected", ~pairs.far), ("transmitted", pairs.far)):
        before, after = (float((cosine[here] @ f[here]).mean()) for f in (samples.f, f_written))
        if before > 0 and abs(after - before) > ALBEDO_TOLERANCE * before:
            lines.append(f"the {side} light is {after / before:.2f} times the material's")
    return lines


def shape_losses(material: Material, *, beckmann_kept: bool = False) -> list[str]:
    """What Smith-masked GGX facets with a Fresnel factor cannot say of the lobes."""
    lost = []
    if material.kd_coupled and any(material.kd):
        lost.append("the diffuse term is coupled to Fresnel in the way of the format, not in ours, or not at all")
    if not beckmann_kept and any(lobe.distribution == "beckmann" for lobe in material.lobes):
        lost.append("Beckmann lobes became GGX lobes, whose tails are longer; a fit of GGX lobes loses less")
    if material.lobes:
        alphas = ", ".join(f"{lobe.alpha:.2g}" for lobe in material.lobes)
        lost.append(f"alpha ({alphas}): Smith's masking stands in place of the exponent of the cosines")
    return lost


def slope_start(lobe: Lobe, distribution: str) -> tuple[float, float]:
    """Roughness along t and b to start from: a GGX peak is as wide as a Beckmann one of 1.2 times its roughness."""
    scale = 0.8 if lobe.distribution == "beckmann" and distribution == "ggx" else 1.0
    mx, my = (float(np.clip(scale * m, ALPHA_MIN, ALPHA_MAX)) for m in (lobe.mx, lobe.my))
    return mx, my


def brightness(lobe: Lobe) -> float:
    """About the light the lobe returns, to rank lobes by."""
    mean = float(
        np.mean([k * (r if lobe.side == "reflection" else 1 - r) for k, r in zip(lobe.k, lobe.r0, strict=True)])
    )
    return mean + 0.02 * float(np.mean(lobe.k))


def three(values: Floats) -> tuple[float, float, float]:
    """RGB of (1,) or (3,) values, rounded to what is written."""
    red, green, blue = (round(float(v), 6) for v in np.broadcast_to(values, 3))
    return red, green, blue
