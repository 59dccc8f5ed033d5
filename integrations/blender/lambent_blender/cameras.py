"""Cameras, and the paths of animated ones."""

from __future__ import annotations

import math

from .files import UniqueNames
from .units import behind, upright

MOST_KEYS = 120  # of a path
NARROWEST_DEG, WIDEST_DEG = 1.0, 150.0


def cameras_of(scene, frame, depsgraph, note):
    """The [[cameras]] of a scene.toml, the active one first."""
    objects = sorted((o for o in scene.objects if o.type == "CAMERA"), key=lambda o: o is not scene.camera)
    views, names = ((o.name, _checked_view(o, scene, frame, depsgraph, note)) for o in objects), UniqueNames()
    return [{"name": names.unique(name), **view} for name, view in views if view is not None]


def paths_of(scene, frame, depsgraph, note):
    """The [[paths]] of a scene.toml: cameras that move between the first and the last frame."""
    objects = [o for o in scene.objects if o.type == "CAMERA" and o.data.type == "PERSP" and _may_move(o)]
    first, last = scene.frame_start, scene.frame_end
    if not objects or last <= first:
        return []
    count = min(last - first + 1, MOST_KEYS)
    frames = [first + round(i * (last - first) / (count - 1)) for i in range(count)]
    found, now = [(o, []) for o in objects], (scene.frame_current, scene.frame_subframe)
    try:
        for number in frames:
            scene.frame_set(number)
            for o, keys in found:
                keys.append(_view(o, scene, frame, depsgraph))
    finally:
        scene.frame_set(now[0], subframe=now[1])
    per_second = scene.render.fps / scene.render.fps_base
    times = [(number - first) / per_second for number in frames]
    if len(frames) < last - first + 1:
        note(f"camera paths: {count} keys of {last - first + 1} frames")
    names = UniqueNames()
    return [
        {"name": names.unique(o.name), "seconds": times[-1], "times_s": times, "keys": keys}
        for o, keys in found
        if any(key != keys[0] for key in keys)
    ]


def _checked_view(o, scene, frame, depsgraph, note):
    """The view of a camera, with notes on what it loses; None if it is not a perspective one."""
    camera = o.data
    if camera.type != "PERSP":
        note(f"camera {o.name}: left out, it has no perspective ({camera.type.lower()})")
        return None
    if abs(camera.shift_x) + abs(camera.shift_y) > 1e-6:
        note(f"camera {o.name}: its shift is not carried")
    if camera.dof.use_dof:
        note(f"camera {o.name}: its depth of field is not carried")
    view = _view(o, scene, frame, depsgraph)
    if not NARROWEST_DEG < view["fov_y_deg"] < WIDEST_DEG:
        note(f"camera {o.name}: its field of view is cut to {view['fov_y_deg']:g} degrees")
    return view


def _view(o, scene, frame, depsgraph):
    seen = o.evaluated_get(depsgraph)
    matrix, position = seen.matrix_world, frame.place(seen.matrix_world.translation)
    ahead, up = behind(matrix), upright(matrix.col[1].xyz.normalized())
    target = [p + a for p, a in zip(position, ahead, strict=True)]
    return {"position": position, "target": target, "up": up, "fov_y_deg": _fov_y_deg(seen, scene, depsgraph)}


def _fov_y_deg(o, scene, depsgraph):
    """Of a picture with the scene's size and pixels: from Blender's own projection."""
    render = scene.render
    projection = o.calc_matrix_camera(
        depsgraph, x=render.resolution_x, y=render.resolution_y, scale_x=render.pixel_aspect_x,
        scale_y=render.pixel_aspect_y,
    )  # fmt: skip
    return min(max(math.degrees(2 * math.atan(1 / projection[1][1])), NARROWEST_DEG), WIDEST_DEG)


def _may_move(o):
    """Whether a camera, or what it hangs on, is animated or constrained."""
    while o is not None:
        if o.animation_data or o.constraints or (o.data is not None and o.data.animation_data):
            return True
        o = o.parent
    return False
