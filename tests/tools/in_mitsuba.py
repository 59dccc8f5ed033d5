"""Mitsuba's BSDFs asked at directions of the canonical frame; the fixture `mi` must have chosen the variant."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np


def interaction(wo: np.ndarray) -> Any:
    """Surface interactions with the viewer at `wo` (N, 3), the normal along z."""
    import drjit as dr
    import mitsuba as mi

    si = dr.zeros(mi.SurfaceInteraction3f, len(wo))
    si.sh_frame = mi.Frame3f(mi.Normal3f(0, 0, 1))
    si.wi = vectors(wo)
    return si


def vectors(w: np.ndarray) -> Any:
    """mi.Vector3f of directions (N, 3)."""
    import mitsuba as mi

    return mi.Vector3f(np.ascontiguousarray(w.T, np.float32))


def f_cos(bsdf: Any, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """f times the light's cosine, (N, 3), of a BSDF or of the dictionary of one."""
    import mitsuba as mi

    plugin = mi.load_dict(bsdf) if isinstance(bsdf, dict) else bsdf
    return np.array(plugin.eval(mi.BSDFContext(), interaction(wo), vectors(wi)), dtype=float).T


def random_directions(n: int, seed: int, lowest_cosine: float = 0.05, *, both: bool = True) -> np.ndarray:
    """(n, 3) float32 directions on both sides of the surface, or above it; cosines are uniform."""
    from lambent.core.geometry.directions import direction

    rng = np.random.default_rng(seed)
    cosine = rng.uniform(lowest_cosine, 1, n) * (rng.choice([-1, 1], n) if both else 1)
    return direction(np.arccos(cosine), rng.uniform(0, 2 * np.pi, n)).astype(np.float32)


def square(folder: Path, bsdf: dict[str, Any], axes: np.ndarray, tangent: np.ndarray) -> Any:
    """Scene of a square of 2 m along `axes` (2, 3), whose vertices have this brushing direction (3,)."""
    import mitsuba as mi

    mesh = mi.Mesh("square", 4, 2)
    parameters = mi.traverse(mesh)
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) @ axes
    parameters["vertex_positions"], parameters["faces"] = corners.ravel().astype(np.float32), [0, 1, 2, 0, 2, 3]
    parameters.update()
    mesh.add_attribute("vertex_tangent", 3, list(tangent) * 4)
    mesh.write_ply(str(folder / "square.ply"))
    return mi.load_dict({"type": "scene", "s": {"type": "ply", "filename": str(folder / "square.ply"), "bsdf": bsdf}})


@dataclass(frozen=True)
class InMitsuba:
    """A plugin of Mitsuba's as `Scatters`; mirrors in it are seen by `weighted` alone."""

    plugin: Any

    def eval(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return np.nan_to_num(f_cos(self.plugin, wi, wo)) / np.maximum(np.abs(wi[:, 2:]), 1e-6)

    def pdf(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        import mitsuba as mi

        return np.nan_to_num(np.array(self.plugin.pdf(mi.BSDFContext(), interaction(wo), vectors(wi)), dtype=float))

    def sample(self, wo: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Samples `wi` (N, 3); rejected ones are (1, 0, 0)."""
        one, _ = self._sampled(wo, u)
        return np.where(np.array(one.pdf)[:, None] > 0, np.array(one.wo).T, [1.0, 0.0, 0.0]).astype(float)

    def weighted(self, wo: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Samples `wi` and their weights f cos / pdf, (N, 3) each."""
        one, weight = self._sampled(wo, u)
        return np.array(one.wo, dtype=float).T, np.array(weight, dtype=float).T

    def _sampled(self, wo: np.ndarray, u: np.ndarray) -> tuple[Any, Any]:
        import mitsuba as mi

        u = u.astype(np.float32)
        picked = np.ascontiguousarray(u[:, 1:].T)
        return self.plugin.sample(mi.BSDFContext(), interaction(wo), mi.Float(u[:, 0]), mi.Point2f(picked))


def furnace_box(bsdf: dict[str, Any]) -> Any:
    """A closed cube seen from inside, whose sides emit a radiance of .5."""
    import mitsuba as mi

    sides = {"flip_normals": True, "bsdf": bsdf, "emitter": {"type": "area", "radiance": 0.5}}
    return mi.load_dict({
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 40, "rr_depth": 100},
        "sensor": {"type": "perspective", "film": {"type": "hdrfilm", "width": 8, "height": 8}},
        "box": {"type": "cube", **sides},
    })  # fmt: skip
