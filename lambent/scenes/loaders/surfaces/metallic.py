"""The metallic-roughness surface of glTF, Disney's `principled` and the PBR extension of MTL."""

from __future__ import annotations

import numpy as np

from lambent.core.directions import Floats
from lambent.scenes.loaders.surfaces.surface import SpecularLobe, Surface
from lambent.scenes.loaders.surfaces.textured import Textured, combined, constant


def metallic_roughness(
    base: Textured,
    metallic: Textured,
    alpha: Textured,
    plain: Floats,
    notes: list[str],
    *,
    weight: float = 1.0,
    aspect: float = 1.0,
    through: float = 0.0,
) -> Surface:
    """Surface of a base colour: metals reflect it without a diffuse term, dielectrics have it below a clear coat.

    Parameters
    ----------
    base : Textured
        Base colour, 3 channels.
    metallic, alpha : Textured
        Share of metal, and GGX's roughness along t as a slope (roughness squared); 1 channel.
    plain : (3,)
        Reflectance of a dielectric at normal incidence.
    weight : float
        Factor of the dielectric's reflection, at grazing incidence too.
    aspect : float
        Roughness across t divided by that along t.
    through : float
        Share of the dielectric's light that is transmitted, as by a thin sheet.

    Notes
    -----
    Partial metals are blends (glTF 2.0, appendix B). The diffuse term is coupled to Fresnel. Where the reflectance
    varies, r0 is the highest and the lobe's coefficient varies: exact at normal incidence and never above 1, but places
    of low reflectance lack Fresnel's rise at grazing incidence.
    """
    plain = np.clip(plain, 0, 1)
    left = 1 - weight * float(plain.max())
    kd = combined(lambda b, m: b * (1 - m) * (1 - through) * left, base, metallic, notes=notes)
    reflectance = combined(lambda b, m: (1 - m) * weight * plain + m * b, base, metallic, notes=notes)
    highest = np.maximum(reflectance.highest, 1e-6)
    if reflectance.is_texture and float((reflectance.highest - reflectance.values.min(axis=(0, 1))).max()) > 1e-3:
        share = np.asarray(reflectance.values / highest.astype(np.float32), np.float32)
        k, r0 = Textured(share, reflectance.uv_transform), highest
        if metallic.is_texture:
            notes.append("its metallic texture is right at normal incidence alone: bare parts lack Fresnel's rise")
    else:
        grazing = weight + (1 - weight) * float(np.clip(metallic.mean[0], 0, 1))
        k, r0 = constant(np.full(3, grazing)), reflectance.mean / max(grazing, 1e-6)
    lobes = [SpecularLobe(alpha, k, r0, aspect)]
    if through > 0:
        passed = combined(lambda b, m: through * b * (1 - m), base, metallic, notes=notes)
        lobes.append(SpecularLobe(alpha, passed, weight * plain, aspect, side="transmission"))
    return Surface(kd=kd, coupled=bool(weight > 0.5 and plain.max() > 0), lobes=tuple(lobes))
