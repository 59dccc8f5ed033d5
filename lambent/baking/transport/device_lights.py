"""Triangle lights on the device, and their light at a point."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.baking.tracing.lights.candela import Candela
from lambent.baking.tracing.rays import vectors
from lambent.baking.transport.pieces import solid_angle
from lambent.baking.transport.polygon_light import highest_part
from lambent.scenes.sky.triangle_lights import TriangleLights

WIDE_SR = 1e-3  # lights of the scene with a larger solid angle are integrated over their extent


def lights_on_device(lights: TriangleLights) -> dict[str, Any]:
    """The arrays of lights; those for points and cones only if there are any."""
    arrays = {
        "corners": [vectors(mi.Vector3f, lights.corners[:, c]) for c in range(3)],
        "centres": vectors(mi.Vector3f, lights.centres),
        "light": vectors(mi.Vector3f, lights.light),
    }
    if lights.near.any():
        arrays["near"] = mi.Bool(lights.near)
    if len(lights.cones):
        inner, outer = lights.cones[:, 3], lights.cones[:, 4]
        arrays["axes"] = vectors(mi.Vector3f, lights.cones[:, :3])
        arrays["cone"] = [
            mi.Float(outer.astype(np.float32)),
            mi.Float(np.maximum(outer - inner, 1e-4).astype(np.float32)),
        ]
    if lights.luminaires:
        arrays |= _luminaires(lights)
    return arrays


def _luminaires(lights: TriangleLights) -> dict[str, Any]:
    """Luminaire index of each light, one past the last for others; their axes and intensities."""
    those = list(lights.luminaires.values())
    which = np.full(len(lights), len(those), np.uint32)
    which[list(lights.luminaires)] = np.arange(len(those))
    axes = np.array([one.axes for one in those])
    return {
        "luminaire": mi.UInt32(which),
        "turned": [vectors(mi.Vector3f, axes[:, k]) for k in range(3)],
        "candela": Candela([one.photometry for one in those]),
    }


def light_at(lights: dict[str, Any], m: Any, p: Any, n: Any = None) -> tuple[Any, ...]:
    """Direction and corners of light m from p, its light, the solid angle that multiplies it, and whether it is wide.

    The last is None if all lights are at infinity. The direction to a wide light is above a surface with normal n, if n
    is given and any part of the light is above.
    """
    centre = dr.gather(mi.Vector3f, lights["centres"], m)
    a, b, c = [dr.gather(mi.Vector3f, corner, m) for corner in lights["corners"]]
    light = dr.gather(mi.Vector3f, lights["light"], m)
    if "near" not in lights:
        return centre, a, b, c, light, 1.0, None
    near = dr.gather(mi.Bool, lights["near"], m)
    here = mi.Vector3f(p)
    across = dr.cross(b - a, c - a)
    to = centre - here
    facing, is_point = dr.dot(across, to) < 0, dr.all(a == b)
    share = dr.select(facing, solid_angle(a - here, b - here, c - here, across), 0.0)
    wide = near & (share > WIDE_SR)
    if n is not None:
        to = dr.select(wide, highest_part(to, [v - here for v in (a, b, c)], n, dr), to)
    a, b, c = [dr.select(near, dr.normalize(v - here), v) for v in (a, b, c)]
    centre = dr.select(near, dr.normalize(to), centre)
    if "cone" in lights:
        angle = dr.acos(dr.clip(-dr.dot(centre, dr.gather(mi.Vector3f, lights["axes"], m)), -1, 1))
        outer, width = [dr.gather(mi.Float, one, m) for one in lights["cone"]]
        inside = dr.select(outer < np.float32(np.pi), dr.clip((outer - angle) / width, 0, 1), 1.0)
        share = dr.select(is_point, inside * _candela(lights, m, -centre) / dr.squared_norm(to), share)
        wide &= ~is_point
    return centre, a, b, c, light, dr.select(near, share, 1.0), wide


def _candela(lights: dict[str, Any], m: Any, w: Any) -> Any:
    """Factor on light m towards unit directions w: 1 if it is not a luminaire."""
    if "luminaire" not in lights:
        return 1.0
    which, axes = dr.gather(mi.UInt32, lights["luminaire"], m), lights["turned"]
    is_one = which < dr.width(axes[0])
    along = [dr.dot(w, dr.gather(mi.Vector3f, axis, which, is_one)) for axis in axes]
    return dr.select(is_one, lights["candela"].towards(which, *along, active=is_one), 1.0)


def brightest(p: NDArray[np.float32], lights: TriangleLights) -> float:
    """Largest sum of unshadowed light, W/m^2, at any of the points (P, 3)."""
    if not lights.near.any():
        return float(lights.light.max(axis=1).sum())
    here = vectors(mi.Vector3f, p)
    total = _reaching(here, lights_on_device(lights), dr.opaque(mi.UInt32, len(lights)))
    return float(np.array(total).max(initial=0.0))


@dr.syntax
def _reaching(here, lights, count):  # type: ignore[no-untyped-def]
    m = mi.UInt32(0)
    total = dr.zeros(mi.Float, dr.width(here))
    while m < count:
        light, share = light_at(lights, m, here)[4:6]
        total += dr.max(light) * dr.minimum(share, 2 * dr.pi)  # points can be very close to point lights
        m += 1
    return total
