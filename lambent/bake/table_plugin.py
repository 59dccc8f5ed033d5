"""A measured table as a Mitsuba BSDF: the path tracer renders the measurement itself, without a fitted model.

    scene["ball"]["bsdf"] = table_dict(load("satin.bsdf"))

The table is resampled once onto `half_vector_grid`; its docstring says how that looks up and samples, and
docs/performance.md what the resampling costs in exactness. Conventions are those of material_plugin.py: Mitsuba's
`si.wi` is the viewer (our wo), its `wo` the light (our wi), its eval includes the cosine; a thin two-sided sheet
(unless the table has a back of its own) without refraction; the brushing direction is the mesh attribute
`vertex_tangent`.

Mitsuba's own `measured` plugin asks an RGL file with the viewer as the file's incident direction. RGL files are
reciprocal to a few per cent only, so the two renderings differ by that much where grazing light meets a steep viewer.
"""

from __future__ import annotations

import functools
from dataclasses import fields
from typing import Any

import numpy as np

from lambent.bake.engine import engine
from lambent.bake.material_plugin import Turned, brushing_angle
from lambent.core.progress import Progress, silent
from lambent.materials.measured import half_vector_grid
from lambent.materials.measured.half_vector_grid import GridOps, GridShape, HalfVectorGrid, grid_of
from lambent.materials.measured.protocol import MeasuredTable

PLUGIN = "lambent_table"
_ARRAYS = ("values", "marginal", "conditional", "density", "across")


def table_dict(
    table: MeasuredTable | HalfVectorGrid, *, shape: GridShape | None = None, progress: Progress = silent
) -> dict[str, Any]:
    """The dictionary for `mi.load_dict`; registers the plugin. Give a grid to use one table in several scenes.

    Raises
    ------
    UserError
        Where no engine of Mitsuba works here.
    """
    register_table_plugin()
    import mitsuba as mi

    grid = table if isinstance(table, HalfVectorGrid) else grid_of(table, shape, progress)
    sizes = [getattr(grid.shape, field.name) for field in fields(GridShape)]
    data = {name: mi.TensorXf(np.ascontiguousarray(getattr(grid, name))) for name in _ARRAYS}
    return {"type": PLUGIN, "shape": " ".join(map(str, sizes)), "faces": grid.faces, "kinds": grid.kinds} | data


def register_table_plugin() -> None:
    """Choose the engine and make `lambent_table` known to it; further calls cost nothing."""
    _register(engine().variant)


@functools.cache
def _register(variant: str) -> None:
    """The class must be made after the variant is set: it derives from that variant's mi.BSDF."""
    import drjit as dr
    import mitsuba as mi

    ops = GridOps(
        dr.sqrt, dr.cbrt, dr.sin, dr.cos, dr.atan2, dr.floor, dr.abs, dr.maximum, dr.minimum, dr.select,
        lambda table, index: dr.gather(mi.Float, table, mi.UInt32(index)), mi.Int32,
    )  # fmt: skip

    class TableBSDF(mi.BSDF):  # type: ignore[misc, name-defined]
        """Component 0 reflects, component 1 transmits, where the table does."""

        def __init__(self, props: Any) -> None:
            mi.BSDF.__init__(self, props)
            shape = GridShape(*map(int, str(props["shape"]).split()))
            arrays = {name: mi.Float(mi.TensorXf(props[name]).array) for name in _ARRAYS}
            self.grid = HalfVectorGrid(shape, int(props["faces"]), int(props["kinds"]), **arrays)
            self.anisotropic = shape.viewer_phi > 1
            kinds = [mi.BSDFFlags.GlossyReflection, mi.BSDFFlags.GlossyTransmission][: self.grid.kinds]
            both = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
            both = both | mi.BSDFFlags.Anisotropic if self.anisotropic else both
            self.kinds = kinds
            self.m_components = [int(kind) | int(both) for kind in kinds]
            self.m_flags = functools.reduce(lambda a, b: a | b, self.m_components)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            angle = brushing_angle(si, active, self.anisotropic)
            wo = Turned(*angle).to_local(si.wi)
            wi = half_vector_grid.sample(wo, sample1, sample2.x, sample2.y, self.grid, ops)
            density = half_vector_grid.pdf(wi, wo, self.grid, ops)
            across = wi[2] * wo[2] < 0
            active &= (density > 0) & self._enabled(ctx, across)
            value = mi.Color3f(half_vector_grid.evaluate(wi, wo, self.grid, ops))

            bs = mi.BSDFSample3f()
            bs.wo = mi.Vector3f(Turned(*angle).to_world(wi))
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
            angle = brushing_angle(si, active, self.anisotropic)
            viewer, light = Turned(*angle).to_local(si.wi), Turned(*angle).to_local(wo)
            active &= self._enabled(ctx, viewer[2] * light[2] < 0)
            value = mi.Color3f(half_vector_grid.evaluate(light, viewer, self.grid, ops)) * dr.abs(light[2])
            density = half_vector_grid.pdf(light, viewer, self.grid, ops)
            return dr.select(active, value, 0.0), dr.select(active, density, 0.0)

        def to_string(self) -> str:
            return f"{PLUGIN}[{self.grid.shape}, {self.grid.faces} faces, {self.grid.kinds} kinds]"

        def _enabled(self, ctx: Any, across: Any) -> Any:
            """Whether `ctx` wants the side; a component left out keeps its share of the samples and is black."""
            on = [ctx.is_enabled(kind, i) for i, kind in enumerate(self.kinds)]
            return mi.Bool(on[0]) & ~across | mi.Bool(on[-1]) & across

    mi.register_bsdf(PLUGIN, TableBSDF)
