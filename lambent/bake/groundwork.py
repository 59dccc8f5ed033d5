"""What several steps of a bake stand on, each made once: texels, traced scenes, which points are lit and seen.

All of it follows from the scene and the split meshes alone, so that a bake that was interrupted finds the same again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.bake.atlas import Atlas
from lambent.bake.emitters import balance_emitters
from lambent.bake.light_map import Sides
from lambent.bake.measured_materials import lookups_of
from lambent.bake.mitsuba_scene import EmitterSampling, SceneBuilder
from lambent.bake.solids import SolidTest
from lambent.bake.texels import POINTS, Texels, chart_labels, texels_of
from lambent.bake.viewers import seen, viewing_places, without_hidden
from lambent.core.progress import Progress, silent

Array = NDArray[np.floating]
Mask = NDArray[np.bool_]
Labels = NDArray[np.integer]


class Groundwork:
    """Shared by the steps of a bake.

    Parameters
    ----------
    atlas : Atlas
        The scene with the coordinates of its light map.
    merged : dict
        Its geometry in one, as in `atlas.merged`.
    two_sided : list of bool
        Of each object, whether its far side has a light map too.
    """

    def __init__(
        self, atlas: Atlas, merged: dict[str, Array], two_sided: list[bool], progress: Progress = silent
    ) -> None:
        self.atlas, self.scene, self.merged, self.progress = atlas, atlas.scene, merged, progress
        self._two_sided = np.repeat(two_sided, [len(o.mesh.faces) for o in self.scene.objects])
        self._builder: tuple[tuple[bool, bool], SceneBuilder] | None = None
        self._whole: Any = None
        self._sampling: EmitterSampling | None = None
        self._sides: dict[float, Sides] = {}
        self._views: dict[float, tuple[Sides, Labels]] = {}

    def builder(self, *, diffuse: bool, photons: bool = False) -> SceneBuilder:
        """Builder of the scene, with or without diffuse terms; kept until another is asked for.

        What lives, traced or not, is in every kernel: two builders would double the time to compile. Emitters are
        sampled by the pilots of the first.
        """
        kind = diffuse, photons
        if self._builder is None or self._builder[0] != kind:
            self._builder = self._whole = None
            tables = lookups_of(self.scene, photons=photons, progress=self.progress)
            builder = SceneBuilder(
                self.scene, self.atlas.uv2, diffuse=diffuse, measured=tables, sampling=self._sampling
            )
            if self._sampling is None:
                balance_emitters(builder)
                self._sampling = builder.sampling()
            self._builder = kind, builder
        return self._builder[1]

    def whole(self, *, diffuse: bool, photons: bool = False) -> Any:
        """mi.Scene of that builder, nothing left out."""
        builder = self.builder(diffuse=diffuse, photons=photons)
        if self._whole is None:
            self._whole = builder.build()
        return self._whole

    @cached_property
    def texels(self) -> Texels:
        return texels_of(self.merged, self.atlas.width, self.atlas.height)

    @cached_property
    def labels(self) -> Labels:
        """(H, W) chart of each texel."""
        return chart_labels(self.merged, self.texels)

    def lit_sides(self, sign: float) -> Sides:
        """Which points are lit on the side of this sign."""
        if sign not in self._sides:
            ours = np.ones(self.texels.face.shape, bool) if sign > 0 else self._two_sided[self.texels.face]
            kind = self._at_hand
            solids = SolidTest(self.builder(**kind), self.whole(**kind))
            within = self._of_points(ours, sign, solids.embedded)
            self._sides[sign] = Sides(self.texels, sign, ours & ~within)
        return self._sides[sign]

    def in_view(self, sign: float) -> tuple[Sides, Labels]:
        """The sides without points that viewers do not see, where a texel has others, and labels that say so."""
        if sign not in self._views:
            sides = self.lit_sides(sign)
            self.progress(0, 1, "what viewers see")
            whole = self.whole(**self._at_hand)
            found = self._of_points(sides.valid, sign, lambda p, n: seen(whole, self.places, p, n))
            valid, labels = without_hidden(self.texels, sides.valid, found, self.labels)
            self._views[sign] = replace(sides, valid=valid), labels
        return self._views[sign]

    @cached_property
    def places(self) -> Array:
        """(n, 3) where viewers may stand."""
        return viewing_places(self.scene, self.whole(**self._at_hand))

    @property
    def _at_hand(self) -> dict[str, bool]:
        """The kind of scene that there is already, if there is one: the shapes of all are the same."""
        diffuse, photons = self._builder[0] if self._builder else (False, False)
        return {"diffuse": diffuse, "photons": photons}

    def _of_points(self, asked: Mask, sign: float, test: Callable[[Array, Array], Mask]) -> Mask:
        """What a test of points (n, 3) and normals of triangles (n, 3) says of those asked for: (K, POINTS)."""
        t = self.texels
        same = (t.face[:, :, None] == t.face[:, None]) & (t.positions[:, :, None] == t.positions[:, None]).all(axis=-1)
        first = np.argmax(same & asked[:, None], axis=2)  # points that repeat are tested once
        once = asked & (first == np.arange(POINTS))
        found = np.zeros(asked.shape, bool)
        found[once] = test(t.positions[once], sign * t.flat[once])
        return np.asarray(np.take_along_axis(found, first, axis=1) & asked)
