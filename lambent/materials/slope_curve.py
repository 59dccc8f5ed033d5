"""The density of slopes of a lobe as a curve over the slope's radius, normalised, with its quantiles.

    P(rho) = D(h) h_z^4 pi mx my,  rho^2 = (h_x/mx)^2/h_z^2 + (h_y/my)^2/h_z^2,  2 integral of P rho drho = 1

Beckmann is exp(-rho^2), GGX (1 + rho^2)^-2. Nodes are evenly spaced in asinh(rho / CORE), STEP apart: evenly in rho
within CORE, evenly in ln rho beyond. Between them ln P is linear in ln(1 + rho^2): every interval is a power of
1 + rho^2 (Burley 2012's GTR), so its mass and its inverse have closed forms, and GGX is exact. Beyond the last node the
last power continues, at least TAIL.

All functions take the array library `ops`, as `lobes`.

Hazard: the exponent of an interval's mass is c + 1; its inverse needs |c + 1| > 0, which LEAST_POWER ensures.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from lambent.core.arrays import Floats
from lambent.materials.document import COSINE_NODES, SHAPE_NODES, Material

CORE, STEP = 0.25, 0.3  # the first node beyond the centre is at a rho of .076, the last one at 1370
ROW = 4  # numbers of a node: ln P, the power c from there on, the mass inside, ln(1 + rho^2)
TAIL = -1.25  # of c beyond the last node; the mass is finite below -1
LEAST_POWER = 1e-3
LEAST_DENSITY = 1e-30  # of the largest

NODES_RHO = CORE * np.sinh(STEP * np.arange(SHAPE_NODES))
NODES_LOG = np.log1p(NODES_RHO**2)
NODES_COSINE = np.linspace(0, 1, COSINE_NODES)
WEIGHTS = tuple(((1 - NODES_COSINE) ** 5).tolist())


@lru_cache(maxsize=512)
def slope_table(shape: tuple[float, ...]) -> Floats:
    """(SHAPE_NODES ROW,) rows of the nodes, from their relative densities `shape`."""
    relative = np.asarray(shape, float)
    log_p = np.log(np.maximum(relative / relative.max(), LEAST_DENSITY))
    power = np.diff(log_p) / np.diff(NODES_LOG)
    power = np.append(power, min(power[-1], TAIL))
    bent = np.where(power + 1 < 0, -LEAST_POWER, LEAST_POWER) - 1
    power = np.where(np.abs(power + 1) < LEAST_POWER, bent, power)
    weight = np.exp(log_p + NODES_LOG)
    mass = weight[:-1] * np.expm1((power[:-1] + 1) * np.diff(NODES_LOG)) / (power[:-1] + 1)
    total = mass.sum() - weight[-1] / (power[-1] + 1)
    inside = np.append(0.0, np.cumsum(mass)) / total
    table = np.column_stack([log_p - np.log(total), power, inside, NODES_LOG]).ravel()
    table.flags.writeable = False
    return table


def log_density(slope2: Any, shape: tuple[float, ...], ops: Any) -> Any:
    """ln P at the squared radius rho^2 `slope2`."""
    table, one = slope_table(shape), 1 + slope2
    rho = ops.sqrt(slope2) * (1 / CORE)
    asinh = ops.log(rho + ops.sqrt(rho * rho + 1))
    first = ROW * ops.whole(ops.minimum(ops.floor(asinh * (1 / STEP)), SHAPE_NODES - 1.0))
    log_p, power, at = (ops.gather(table, first + k) for k in (0, 1, 3))
    return log_p + power * (ops.log(one) - at)


def quantile(mass: Any, shape: tuple[float, ...], ops: Any) -> Any:
    """The radius rho inside which `mass` in [0, 1) lies."""
    table = slope_table(shape)
    first = ops.whole(0 * mass)
    for half in (16, 8, 4, 2, 1):
        further = first + half
        first = ops.select(ops.gather(table, ROW * further + 2) <= mass, further, first)
    log_p, power, inside, at = (ops.gather(table, ROW * first + k) for k in range(ROW))
    grown = 1 + (mass - inside) * (power + 1) * ops.exp(-log_p - at)
    one = ops.exp(at + ops.log(ops.maximum(grown, 1e-7)) / (power + 1))
    return ops.sqrt(ops.maximum(one - 1, 0.0))


@lru_cache(maxsize=512)
def normalised(nodes: tuple[float, ...]) -> tuple[float, ...]:
    """A curve over the cosine mu, as `at_cosine` has it, with 2 integral of c(mu) mu dmu = 1."""
    c, m = np.asarray(nodes), 1 - NODES_COSINE
    rise = np.diff(c) / np.diff(m**5)
    flat = (c[:-1] - rise * m[:-1] ** 5) * np.diff(NODES_COSINE**2)
    mean = (flat - 2 * rise * np.diff(m**6 / 6 - m**7 / 7)).sum()
    return tuple((c / mean).tolist())


def curve_rows(material: Material) -> tuple[Floats, list[tuple[int, int]], int]:
    """Rows (R, 4) of a material's curves for shaders; the first rows of shape and Fresnel of each lobe, and that of kd.

    A row of a shape is a node of `slope_table`, a row of a curve over the cosine its RGB and (1 - cosine)^5. A missing
    curve is at -1.
    """
    rows: list[Floats] = []
    count = 0

    def add(block: Floats | None) -> int:
        nonlocal count
        if block is None:
            return -1
        rows.append(block)
        count += len(block)
        return count - len(block)

    of_lobes = [
        (
            add(None if lobe.shape is None else slope_table(lobe.shape).reshape(-1, ROW)),
            add(None if lobe.fresnel is None else np.column_stack([np.transpose(lobe.fresnel), WEIGHTS])),
        )
        for lobe in material.lobes
    ]
    nodes = material.kd_curve
    of_kd = add(None if nodes is None else np.column_stack([np.tile(normalised(nodes), (3, 1)).T, WEIGHTS]))
    return np.concatenate([np.zeros((0, ROW)), *rows]), of_lobes, of_kd


def half_density(shape: tuple[float, ...]) -> float:
    """The squared radius at which the density has first fallen to half of its largest value."""
    rows = slope_table(shape).reshape(-1, ROW)
    log_p, limit = rows[:, 0], rows[:, 0].max() - np.log(2)
    peak = int(np.argmax(log_p))
    low = next((i for i in range(peak, SHAPE_NODES - 1) if log_p[i + 1] <= limit), SHAPE_NODES - 1)
    return float(np.expm1(rows[low, 3] + (limit - log_p[low]) / rows[low, 1]))


@lru_cache(maxsize=512)
def by_cosine(nodes: tuple[float, ...]) -> Floats:
    """The nodes as a table for `at_cosine`."""
    table = np.asarray(nodes, float)
    table.flags.writeable = False
    return table


def at_cosine(cosine: Any, nodes: tuple[float, ...], ops: Any) -> Any:
    """Value at a cosine in [0, 1] of a curve of COSINE_NODES nodes.

    Between nodes it is linear in (1 - cosine)^5, so that Schlick's approximation is exact, and nothing overshoots.
    """
    table, weights = by_cosine(nodes), by_cosine(WEIGHTS)
    cosine = ops.minimum(ops.maximum(cosine, 0.0), 1.0)
    first = ops.whole(ops.minimum(ops.floor(cosine * (COSINE_NODES - 1.0)), COSINE_NODES - 2.0))
    m = 1 - cosine
    m2 = m * m
    low, high = (ops.gather(weights, first + k) for k in (0, 1))
    share = (low - m2 * m2 * m) / (low - high)
    return ops.gather(table, first) * (1 - share) + ops.gather(table, first + 1) * share
