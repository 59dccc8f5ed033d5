"""Triangles that viewers of a scene see, computed once for all steps of a bake."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from lambent.core.arrays import Flags, Floats, Indices
from lambent.scenes.scene import Scene

if TYPE_CHECKING:
    from lambent.baking.tracing.seen.viewers import Viewers


@dataclass(frozen=True)
class TriangleVisibility:
    """A scene with properties computed on first use; choose the engine before."""

    scene: Scene

    @cached_property
    def owner(self) -> Indices:
        """(F,) object index of each triangle."""
        return np.repeat(np.arange(len(self.scene.objects)), [len(o.mesh.faces) for o in self.scene.objects])

    @cached_property
    def is_opaque(self) -> Flags:
        """(F,) whether each triangle is opaque: its material neither transmits light nor has holes."""
        masked = {name for name, textures in self.scene.textures.items() if textures.opacity is not None}
        clear = masked | {name for name, material in self.scene.materials.items() if material.transmits}
        return ~np.array([o.material in clear for o in self.scene.objects], bool)[self.owner]

    @cached_property
    def opaque(self) -> Indices:
        """Indices of the opaque triangles."""
        return np.flatnonzero(self.is_opaque)

    @cached_property
    def everything(self) -> Any:
        """mi.Scene of all triangles."""
        from lambent.baking.tracing.scene_builder import bare_scene

        return bare_scene(self.scene.corners)

    @cached_property
    def traced(self) -> Any:
        """mi.Scene of the opaque triangles; None without any."""
        from lambent.baking.tracing.scene_builder import bare_scene

        if not len(self.opaque):
            return None
        return self.everything if self.is_opaque.all() else bare_scene(self.scene.corners[self.opaque])

    @cached_property
    def viewers(self) -> Viewers | None:
        """The viewers found by `tracing.viewers.viewers_of`, if any."""
        from lambent.baking.tracing.seen.viewers import viewers_of

        return viewers_of(self.scene, self.traced)

    @cached_property
    def met(self) -> tuple[Floats, Indices, Floats]:
        """Viewers' rays that hit an opaque triangle: directions (M, 3), triangle indices (M,), distances (M,), m."""
        from lambent.baking.tracing.seen.viewers import RAYS, met

        assert self.viewers is not None, "without viewers there are no rays"
        directions, face, distance = met(self.traced, self.viewers.eyes, RAYS)
        return directions, self.opaque[face], distance

    def forget(self) -> None:
        """Release the computed properties; they are computed again on demand."""
        for name in ("owner", "is_opaque", "opaque", "everything", "traced", "viewers", "met"):
            self.__dict__.pop(name, None)
