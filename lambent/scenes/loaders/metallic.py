"""The metallic-roughness surface of glTF, Disney's `principled` and the PBR extension of MTL."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lambent.core.directions import Floats
from lambent.scenes.loaders.surface import Gloss, Surface
from lambent.scenes.loaders.varying import Varying, combined, constant


def metallic_roughness(
    base: Varying,
    metallic: Varying,
    alpha: Varying,
    plain: Floats,
    said: list[str],
    *,
    weight: float = 1.0,
    aspect: float = 1.0,
    through: float = 0.0,
) -> Surface:
    """Metals reflect their base colour and have no diffuse term; dielectrics are diffuse below a clear coat.

    Parameters
    ----------
    base : Varying
        Base colour, 3 channels.
    metallic, alpha : Varying
        Share of metal, and GGX's roughness along t as a slope (roughness squared); 1 channel.
    plain : (3,)
        Reflectance of the dielectric at normal incidence.
    weight : float
        Share of the dielectric's reflection, at grazing incidence too.
    aspect : float
        Roughness across t by that along it.
    through : float
        Share of the dielectric's light that passes, as through a thin sheet.

    Notes
    -----
    Between metal and dielectric everything is blended (glTF 2.0, appendix B). The diffuse part falls as Fresnel rises.
    Where the reflectance varies, r0 is the highest and the lobe's coefficient follows: exact at normal incidence, and
    never more light than arrives; but what reflects less there does so at grazing incidence too.
    """
    plain = np.clip(plain, 0, 1)
    left = 1 - weight * float(plain.max())
    kd = combined(lambda b, m: b * (1 - m) * (1 - through) * left, base, metallic, said=said)
    reflectance = combined(lambda b, m: (1 - m) * weight * plain + m * b, base, metallic, said=said)
    highest = np.maximum(reflectance.highest, 1e-6)
    if reflectance.is_picture and float((reflectance.highest - reflectance.values.min(axis=(0, 1))).max()) > 1e-3:
        k, r0 = replace(reflectance, values=reflectance.values / highest.astype(np.float32)), highest
        if metallic.is_picture:
            said.append("its metallic texture is right at normal incidence alone: bare parts lack Fresnel's rise")
    else:
        grazing = weight + (1 - weight) * float(np.clip(metallic.mean[0], 0, 1))
        k, r0 = constant(np.full(3, grazing)), reflectance.mean / max(grazing, 1e-6)
    glosses = [Gloss(alpha, k, r0, aspect)]
    if through > 0:
        passed = combined(lambda b, m: through * b * (1 - m), base, metallic, said=said)
        glosses.append(Gloss(alpha, passed, weight * plain, aspect, side="transmission"))
    return Surface(kd=kd, coupled=bool(weight > 0.5 and plain.max() > 0), glosses=tuple(glosses))
