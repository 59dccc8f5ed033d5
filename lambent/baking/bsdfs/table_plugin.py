"""A measured table as a Mitsuba BSDF: the path tracer renders the measurement itself, without a fitted model.

    scene["ball"]["bsdf"] = table_dict(load("satin.bsdf"))

A table of patch matrices (LBNL Klems) is looked up directly, by `patch_sheet`. Every other table is resampled once to a
`half_vector_grid`, which documents look-up and sampling, or, with peaks about the light, to a `retro_grid`;
docs/performance.md states the error of resampling.

Conventions are those of material_plugin.py: Mitsuba's `si.wi` is the viewer (our wo), its `wo` the light (our wi), its
eval includes the cosine; a thin two-sided sheet (unless the table has a back of its own) without refraction; the
brushing direction is the mesh attribute `vertex_tangent`.

Mitsuba's own `measured` plugin evaluates an RGL file with the viewer as the file's incident direction. RGL files are
reciprocal to a few per cent only; renderings differ by that where grazing light meets a viewer near the normal.
"""

from __future__ import annotations

import functools
from operator import attrgetter
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baking.bsdfs.material_plugin import brushing_angle
from lambent.baking.bsdfs.textured import facing_frame
from lambent.baking.engine import once_per_variant
from lambent.baking.tracing.array_ops import array_ops
from lambent.core.progress import Progress, silent
from lambent.materials.measured.protocol import MeasuredTable
from lambent.materials.measured.tables.half_vector_grid import GridShape, HalfVectorGrid
from lambent.materials.measured.tables.half_vector_resampling import RetroGrid
from lambent.materials.measured.tables.patch_sheet import Lookup, PatchSheet, lookup_of

PLUGIN = "lambent_table"
_LOOKUPS: dict[str, type[HalfVectorGrid] | type[PatchSheet] | type[RetroGrid]] = {
    "grid": HalfVectorGrid, "patches": PatchSheet, "retro": RetroGrid,
}  # fmt: skip


def table_dict(
    table: MeasuredTable | Lookup, *, shape: GridShape | None = None, progress: Progress = silent
) -> dict[str, Any]:
    """The dictionary for `mi.load_dict`; registers the plugin. Pass a lookup to use one table in several scenes.

    `shape` is the grid's, if the table needs one.

    Raises
    ------
    UserError
        If no engine of Mitsuba works on this machine.
    """
    register_table_plugin()
    lookup = table if isinstance(table, Lookup) else lookup_of(table, shape, progress)
    kind = next(word for word, kind in _LOOKUPS.items() if isinstance(lookup, kind))
    data = {_key(name): mi.TensorXf(np.ascontiguousarray(attrgetter(name)(lookup))) for name in lookup.ARRAYS}
    return {"type": PLUGIN, "lookup": kind, "sizes": " ".join(map(str, lookup.sizes))} | data


def _key(name: str) -> str:
    """Mitsuba's name of an array; it must not contain dots."""
    return name.replace(".", "_")


@once_per_variant
def register_table_plugin() -> None:
    """Select the engine and register `lambent_table` with it; further calls cost nothing."""
    ops = array_ops()

    class TableBSDF(mi.BSDF):  # type: ignore[misc]
        """Component 0 reflects; component 1, if the table has it, transmits."""

        def __init__(self, props: Any) -> None:
            mi.BSDF.__init__(self, props)
            kind = _LOOKUPS[str(props["lookup"])]
            arrays = {name: mi.Float(mi.TensorXf(props[_key(name)]).array) for name in kind.ARRAYS}
            self.lookup = kind.of_sizes(tuple(map(int, str(props["sizes"]).split())), arrays)
            self.anisotropic = self.lookup.anisotropic
            kinds = [mi.BSDFFlags.GlossyReflection, mi.BSDFFlags.GlossyTransmission][: self.lookup.kinds]
            both = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
            both = both | mi.BSDFFlags.Anisotropic if self.anisotropic else both
            self.kinds = kinds
            self.m_components = [int(kind) | int(both) for kind in kinds]
            self.m_flags = functools.reduce(lambda a, b: a | b, self.m_components)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            frame = facing_frame(brushing_angle(si, active, self.anisotropic), si)
            wo = frame.to_local(si.wi)
            wi = self.lookup.sample(wo, sample1, sample2.x, sample2.y, ops)
            density = self.lookup.pdf(wi, wo, ops)
            across = wi[2] * wo[2] < 0
            active &= (density > 0) & self._enabled(ctx, across)
            value = mi.Color3f(self.lookup.evaluate(wi, wo, ops))

            bs = mi.BSDFSample3f()
            bs.wo = frame.to_world(mi.Vector3f(*wi))
            bs.pdf = dr.select(active, density, 0.0)
            bs.eta = 1.0
            bs.sampled_component = dr.select(across, mi.UInt32(1), mi.UInt32(0))
            bs.sampled_type = dr.select(across, mi.UInt32(self.m_components[-1]), mi.UInt32(self.m_components[0]))
            return bs, dr.select(active, value * (dr.abs(wi[2]) / density), 0.0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            frame = facing_frame(brushing_angle(si, active, self.anisotropic), si)
            viewer, light = frame.to_local(si.wi), frame.to_local(wo)
            active &= self._enabled(ctx, viewer[2] * light[2] < 0)
            value = mi.Color3f(self.lookup.evaluate(light, viewer, ops)) * dr.abs(light[2])
            density = self.lookup.pdf(light, viewer, ops)
            return dr.select(active, value, 0.0), dr.select(active, density, 0.0)

        def to_string(self) -> str:
            return f"{PLUGIN}[{type(self.lookup).__name__}, sizes {self.lookup.sizes}]"

        def _enabled(self, ctx: Any, across: Any) -> Any:
            """Whether `ctx` includes the side; an excluded component keeps its share of the samples and is black."""
            on = [ctx.is_enabled(kind, i) for i, kind in enumerate(self.kinds)]
            return mi.Bool(on[0]) & ~across | mi.Bool(on[-1]) & across

    mi.register_bsdf(PLUGIN, TableBSDF)
