"""Virtual gonio-photometer: measures BSDFs of the path tracer like a device with a specimen.

Mitsuba's `eval(si, wo)` is f |cos| towards the light `wo` for the viewer `si.wi`; so our wo becomes si.wi and our wi
its wo. The specimen is measured at one point (uv = 0), as a flat sheet with n = +z.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from lambent.baking.engine import engine
from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.core.geometry.directions import Floats
from lambent.core.progress import Progress, silent
from lambent.materials.document import Material
from lambent.materials.measured.inspecting.synthetic import ANISOTROPIC, ISOTROPIC, Evaluate, Setup, record, synthesise
from lambent.materials.measured.tables.gonio import GonioTable

_METAL = {"type": "roughconductor", "distribution": "beckmann"}
_BROWN = {"type": "rgb", "value": [0.32, 0.14, 0.055]}
_PANE = {"type": "rgb", "value": [0.95, 0.97, 0.96]}
_THIN = {"roughness": 0.35, "eta": 1.5, "spec_trans": 0.85, "diff_trans": 1.0}

SPECIMENS: dict[str, dict[str, Any]] = {
    "rough copper": {**_METAL, "material": "Cu", "alpha": 0.15},
    "brushed aluminium": {**_METAL, "material": "Al", "alpha_u": 0.05, "alpha_v": 0.25},
    "varnished wood": {"type": "roughplastic", "distribution": "beckmann", "alpha": 0.1, "diffuse_reflectance": _BROWN},
    # A pane is two rough interfaces; the thin-sheet model of Burley 2015 is Mitsuba's only one that treats both at
    # once: light goes straight on, spread by both, without refraction. Known fault: at oblique incidence it cuts off
    # the far tail of its transmission lobe, where wo.h changes sign; here that is below a thousandth of the peak.
    "frosted glass": {"type": "principledthin", "base_color": _PANE, **_THIN},
}
"""Built-in specimens by name. The aluminium is brushed along x: its highlight is wide along y."""


def measure(
    specimen: str | Mapping[str, Any] | Material,
    *,
    incident: Setup | None = None,
    noise: float = 0.02,
    seed: int = 0,
    name: str | None = None,
    progress: Progress = silent,
) -> GonioTable:
    """Measure a built-in specimen, a Mitsuba BSDF dict, or a material document; `write_gonio` writes the table.

    Parameters
    ----------
    specimen : str, dict or Material
        Name in `SPECIMENS`, `{"type": ..., ...}` for Mitsuba, or a material document.
    incident : Setup, optional
        The device's grids and faults; by default, the thesis's grid for the specimen's symmetry.
    noise : float
        Relative standard deviation of a reading; replaces that of `incident`.
    seed : int
        Of the noise; replaces that of `incident`.
    name : str, optional
        Name in the table; by default the specimen's own.

    Raises
    ------
    UserError
        If the specimen is unknown, broken, or scatters into single directions, which no device can measure.
    """
    if isinstance(specimen, Material):
        anisotropic = any(lobe.mx != lobe.my for lobe in specimen.lobes)
        setup = replace(incident or (ANISOTROPIC if anisotropic else ISOTROPIC), noise=noise, seed=seed)
        document = specimen.model_copy(update={"name": name or specimen.name})
        return synthesise(document, setup, progress)
    if isinstance(specimen, str):
        name, specimen = name or specimen, SPECIMENS[known("specimen", specimen, SPECIMENS)]
    engine()  # before Mitsuba is imported
    import mitsuba as mi

    name = name or str(specimen.get("type"))
    bsdf = _load(dict(specimen), name)
    flags = bsdf.flags()
    if mi.has_flag(flags, mi.BSDFFlags.Delta) or mi.has_flag(flags, mi.BSDFFlags.Null):
        raise UserError("is specular (a delta BSDF), which cannot be measured", field=name, hint="give it roughness")
    setup = incident or (ANISOTROPIC if mi.has_flag(flags, mi.BSDFFlags.Anisotropic) else ISOTROPIC)
    setup = replace(setup, noise=noise, seed=seed)
    transmits = mi.has_flag(flags, mi.BSDFFlags.Transmission)
    return record(_evaluator(bsdf), name, setup, transmits=transmits, progress=progress)


def _load(specimen: dict[str, Any], name: str) -> Any:
    import mitsuba as mi

    try:
        loaded = mi.load_dict(specimen)
    except (RuntimeError, TypeError, ValueError) as error:
        raise UserError(f"not a BSDF that Mitsuba can load ({str(error).splitlines()[-1]})", field=name) from error
    if not isinstance(loaded, mi.BSDF):
        raise UserError("is not a BSDF", field=name, got=type(loaded).__name__)
    return loaded


def _evaluator(bsdf: Any) -> Evaluate:
    """f (N, 3) without the cosine, from the path tracer's own evaluation."""
    import drjit as dr
    import mitsuba as mi

    from lambent.baking.tracing.rays import array_of, vectors

    def evaluate(wi: Floats, wo: Floats) -> Floats:
        si = dr.zeros(mi.SurfaceInteraction3f, len(wi))
        si.wi = vectors(mi.Vector3f, wo)
        value = array_of(bsdf.eval(mi.BSDFContext(), si, vectors(mi.Vector3f, wi))).astype(float)
        cos_i = np.abs(wi[:, 2:])
        return np.asarray(np.divide(value, cos_i, out=np.zeros((len(wi), 3)), where=cos_i > 1e-6))

    return evaluate
