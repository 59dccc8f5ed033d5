"""Memory that a bake needs, checked before it is allocated.

Files store an instance as a transform, and loaders let instances share arrays. A bake cannot: each instance has its own
light, and so its own texels, vertices and triangles.
"""

from __future__ import annotations

from lambent.core.errors import UserError
from lambent.core.machine import memory_bytes
from lambent.scenes.scene import Scene, SceneObject

BYTES_PER_TRIANGLE = 650  # peak while baking geometry: 610 with 2000 objects of 352, 580 with one of a million


def check_memory(scene: Scene) -> None:
    """Raise `UserError` if the triangles of a scene do not fit into this machine's memory."""
    triangles = sum(len(o.mesh.faces) for o in scene.objects)
    needed, there = triangles * BYTES_PER_TRIANGLE, memory_bytes()
    if needed > there:
        raise UserError(
            "scene is too large to be baked here", field=scene.name,
            got=f"{triangles} triangles, {needed / 1e9:.0f} GB", expected=f"at most {there / 1e9:.0f} GB of memory",
            hint=_copies(scene.objects),
        )  # fmt: skip


def _copies(objects: tuple[SceneObject, ...]) -> str:
    """A remedy that names the mesh with the most copies."""
    shared: dict[int, list[SceneObject]] = {}
    for o in objects:
        shared.setdefault(id(o.mesh.faces), []).append(o)
    most = max(shared.values(), key=lambda copies: len(copies) * len(copies[0].mesh.faces))
    if len(most) == 1:
        return f"{most[0].name} is the largest of its objects: simplify it"
    return (
        f"{most[0].name} and {len(most) - 1} more objects are copies of {len(most[0].mesh.faces)} triangles, each with "
        "light of its own: leave some out, or simplify them"
    )
