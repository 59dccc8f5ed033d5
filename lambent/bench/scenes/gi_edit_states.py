"""Random settings of materials unknown to the bake, and errors of their pictures against a reference."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from lambent.baking.interreflection.series import SMOOTH, SMOOTH_ANGLES
from lambent.core.arrays import Flags, Floats
from lambent.core.pictures.metrics import display_exposure, displayed, flip_error
from lambent.core.plain import triple
from lambent.core.views.camera import Camera
from lambent.materials.document import Material
from lambent.materials.factored.albedo import albedo
from lambent.materials.factored.curve import KNOTS, Curve
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.terms import Editable
from lambent.store.contract import view_artefact_name
from lambent.store.store import Store

KINDS = ("bands", "colours", "widths")
STEPS, SMOOTH_STEPS = 16, SMOOTH  # of a random step curve; fewer over angles without narrow peaks
WHITEST = 0.8  # highest albedo of random materials


def setting(kind: str, material: Material, rng: np.random.Generator) -> Editable:
    """A random variant of a material.

    Parameters
    ----------
    kind : {'colours', 'widths', 'bands'}
        Another diffuse colour; also wide or narrow lobes; or random step curves in all terms.
    """
    lobes = list(material.lobes)
    if kind == "widths":
        factors = np.exp(rng.uniform(np.log(0.5), np.log(4.0), len(lobes)))
        lobes = [
            lobe.model_copy(update={"mx": min(0.6, f * lobe.mx), "my": min(0.6, f * lobe.my)})
            for f, lobe in zip(factors, lobes, strict=True)
        ]
    colour = rng.uniform(0.05, WHITEST, 3) if np.max(material.kd) > 0 else np.zeros(3)
    made = of_material(material.model_copy(update={"kd": triple(colour), "lobes": tuple(lobes)}))
    return _no_whiter(stepped(made, rng)) if kind == "bands" else made


def stepped(editable: Editable, rng: np.random.Generator) -> Editable:
    """Replace curves by random step curves of about the same size: a narrow lobe might be even over the bands it meets.

    Steps are as wide as one band, or as several.
    """
    curves = {}
    over = {factor.curve: factor.over for term in editable.terms for factor in term.factors}
    for name, curve in editable.curves.items():
        count = STEPS if over.get(name, "theta_o") not in SMOOTH_ANGLES else SMOOTH_STEPS
        steps = rng.random((count, 3)) * 2 * curve.values.mean(axis=0)
        curves[name] = Curve(steps[np.minimum(np.arange(KNOTS + 1) * count // KNOTS, count - 1)])
    return replace(editable, curves=curves)


def _no_whiter(editable: Editable) -> Editable:
    """Scale the terms so that no albedo exceeds `WHITEST`."""
    most = max((float(albedo(editable, side).max()) for side in editable.sides), default=0.0)
    factor = min(1.0, WHITEST / max(most, 1e-9))
    terms = tuple(replace(term, scale=triple(np.multiply(term.scale, factor))) for term in editable.terms)
    return replace(editable, terms=terms)


def relative_mse(image: Floats, reference: Floats, shown: Flags) -> float:
    """Mean of (a - b)^2 / (b^2 + a hundredth of the squared mean) over the shown pixels."""
    a, b = image[shown], reference[shown]
    return float(np.mean((a - b) ** 2 / (b**2 + 0.01 * b.mean() ** 2)))


def flip_between(reference: Floats, image: Floats, shown: Flags | None = None) -> float:
    """Mean FLIP; over `shown` pixels only, if all others are equal in both."""
    exposure_ev = display_exposure(reference)
    if shown is None:
        return float(flip_error(displayed(reference, exposure_ev), displayed(image, exposure_ev)).mean())
    image = np.where(shown[..., None], image, reference)
    return float(flip_error(displayed(reference, exposure_ev), displayed(image, exposure_ev))[shown].mean())


def summed_up(errors: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Means over settings: FLIP and relMSE per kind, and of the worst; setting k is of kind k modulo `KINDS`."""
    means = {key: np.mean([one[key] for one in errors]) for key in errors[0]}
    kinds = {
        f"{key}_{kind}": np.mean([one[key] for one in errors[k :: len(KINDS)]])
        for k, kind in enumerate(KINDS[: len(errors)])
        for key in ("flip", "flip_limit", "relmse_limit")
    }
    worst = {f"{key}_worst": max(one[key] for one in errors) for key in ("flip", "flip_limit", "relmse_limit")}
    return {key: float(f"{value:.3g}") for key, value in {**means, **kinds, **worst}.items()}


def interior(store: Store, camera: Camera, size: tuple[int, int]) -> Flags:
    """(H, W) pixels that show a surface and whose neighbours show the same object."""
    pixel, number = (
        store.read(view_artefact_name(camera, *size, "view_points", part)).astype(np.int64)
        for part in ("pixel", "object")
    )
    shown = np.full(size[0] * size[1], -1)
    shown[pixel] = number
    padded = np.pad(shown.reshape(size[::-1]), 1, mode="edge")
    around = [np.roll(padded, (i, j), (0, 1))[1:-1, 1:-1] for i in (-1, 0, 1) for j in (-1, 0, 1)]
    return np.asarray((np.ptp(around, axis=0) == 0) & (around[4] >= 0))
