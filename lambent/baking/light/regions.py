"""Finished regions of an unfinished light map, denoised for observers of the bake."""

from __future__ import annotations

import time

import numpy as np

from lambent.baking.light.sampling import cleaned, plus, sampled_halves, variance_of
from lambent.baking.light.stitching import Cuts
from lambent.baking.running.watch import Watch
from lambent.baking.surfaces.texels import Texels
from lambent.core.arrays import Flags, Floats, Indices
from lambent.store.store import Store


class FinishedRegions:
    """Sends the light of written tiles to a watch, no more often than it requests.

    Parameters
    ----------
    whole, parts : str
        Names of the arrays of samples, (2, H, W, 4), and by group (1, H, W, 3 n or more).
    groups : int
        Number of light groups; 0 if light is not separated.
    surface : tuple
        Texels, their charts (H, W) and their cuts, as for `sampling.cleaned`.
    lamps : (G, H, W, 3)
        Direct light that samples do not have, by light group.
    """

    def __init__(
        self, watch: Watch, store: Store, whole: str, parts: str, groups: int,
        surface: tuple[Texels, Indices, Cuts], lamps: Floats,
    ) -> None:  # fmt: skip
        self._watch, self._store, self._whole, self._parts, self._groups = watch, store, whole, parts, groups
        self._surface, self._lamps = surface, lamps if groups else lamps.sum(axis=0, keepdims=True)
        self._next_s = -np.inf

    def wrote(self) -> None:
        """To be called after each written tile."""
        began_s, pause = time.monotonic(), self._watch.region_pause
        if pause is None or began_s < self._next_s:
            return
        raw, written = self._store.read_partial(self._whole)
        if written.all():
            return  # the complete light map follows
        halves, known = sampled_halves(raw)
        light = [halves.mean(axis=0)]
        variance = variance_of(halves)
        if self._groups:
            by_group = self._store.read_partial(self._parts)[0][0]
            light = [by_group[..., 3 * number : 3 * number + 3] for number in range(self._groups)]
        shown = plus(np.stack([self._clean(one, known, variance) for one in light]), self._lamps)
        self._watch.region(shown, self._finished())
        now_s = time.monotonic()
        self._next_s = now_s + pause * (now_s - began_s)

    def _clean(self, light: Floats, known: Flags, variance: Floats) -> Floats:
        return cleaned(light, known, *self._surface, variance) if light.any() else np.zeros(light.shape, np.float16)

    def _finished(self) -> Flags:
        """(H, W) texels of written tiles."""
        artefact = self._store.artefact(self._whole)
        found = np.zeros(artefact.shape[1:3], bool)
        for chunk in artefact.chunk_grid:
            if artefact.version(chunk) is not None:
                found[artefact.region(chunk)[1:3]] = True
        return found
