"""Path traced light on points that face up."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baking.tracing import path_tracer
from lambent.baking.tracing.rays import array_of, independent, vectors
from lambent.core.arrays import Floats


def facing_up(places: Floats) -> path_tracer.Points:
    """Points at places (n, 3)."""
    up = np.broadcast_to([0.0, 1.0, 0.0], places.shape)
    return path_tracer.Points(*(vectors(mi.Vector3f, v) for v in (places, up, up)))


def irradiance(whole: Any, points: path_tracer.Points, seed: int, depth: int, unseen: Any = None) -> Floats:
    """(n, 3) estimates, one of each point."""
    sampler = independent(seed, dr.width(points.position))
    u = sampler.next_2d(), sampler.next_2d()
    return array_of(path_tracer.irradiance(whole, sampler, points, *u, depth, None, unseen)).astype(float)
