"""Noise of interreflections, from two pictures of which the second extends the samples of the first.

A bake whose progress goes through `PassNoise` stores the noise, for whoever opens the store later.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from lambent.core.light.colour import luminance
from lambent.core.progress import Progress
from lambent.core.views.camera import Camera
from lambent.editing.interreflection.entries import Cells
from lambent.editing.interreflection.picture import frozen_light
from lambent.editing.interreflection.powers import powers
from lambent.editing.interreflection.stored import Interreflections, interreflections
from lambent.editing.products import Pixels
from lambent.materials.factored.terms import Editable
from lambent.store.contract import view_artefact_name
from lambent.store.store import Store

NOISE = "interreflection_noise"  # document: by the name of a view's tails, their key, samples and noise
PASS = re.compile(r"interreflections, (\d+) samples")  # the bake's progress text for a pass
Shot = tuple[Camera, tuple[int, int]]


def light_of(light: Interreflections, materials: Mapping[str, Editable]) -> Pixels:
    """(3, P) interreflections of all points with these materials, part after part, in W/(sr m^2)."""
    frozen = powers(light.tails, materials, "")  # no material is edited: the only monomial is 1
    all_tails = Cells.of(frozen, np.arange(len(light.tails)))
    parts = [frozen_light(part, materials[name], frozen, all_tails)[0] for name, part in light.parts.items()]
    return np.concatenate(parts, axis=1)


def noise(before: Pixels, after: Pixels, samples: tuple[int, int]) -> float:
    """Standard error of a point's luminance in `after`, relative to the mean over all points.

    With variance s of a sample, n samples before and m after, the difference has variance s (1/n - 1/m), and `after`
    s/m.
    """
    fewer, more = samples
    difference, mean = luminance((after - before).T), float(luminance(after.T).mean())
    variance = float(np.mean(np.square(difference))) * fewer / (more - fewer)
    return float(variance**0.5 / max(mean, 1e-30))


class PassNoise:
    """Observes the progress of a bake, compares its last two passes, and writes their noise to the store.

    Parameters
    ----------
    folder
        Of the store.
    shots
        Camera, width and height of each view.
    materials
        All materials of the scene, as baked.
    samples
        Final number of samples of the bake.
    progress
        Receives all progress.
    """

    def __init__(
        self,
        folder: Path,
        shots: Sequence[Shot],
        materials: Mapping[str, Editable],
        samples: int,
        progress: Progress,
    ) -> None:
        self._folder, self._shots, self._materials, self._samples = folder, shots, materials, samples
        self._passed_on = progress
        self._before: dict[int, tuple[int, Pixels]] = {}
        self._found: dict[str, dict[str, object]] = {}

    def progress(self, done: float, total: float, what: str) -> None:
        """Callback of type `Progress`."""
        self._passed_on(done, total, what)
        said = PASS.fullmatch(what)
        if said and done == total and 2 * int(said[1]) >= self._samples:
            store = Store.open(self._folder)
            for k, shot in enumerate(self._shots):
                self._look(store, k, *shot)

    def note(self, store: Store) -> None:
        """Write the noise, once the bake has ended."""
        if self._found:
            store.set_document(NOISE, {**store.documents.get(NOISE, {}), **self._found})

    def _look(self, store: Store, k: int, camera: Camera, size: tuple[int, int]) -> None:
        pixels, samples = [], []
        for name, one in self._materials.items():  # one at a time: bands of all may not fit into memory
            light = interreflections(store, camera, size, {name: one})
            if light.parts:
                pixels.append(light_of(light, self._materials))
                samples.append(light.samples)
        before, self._before[k] = self._before.get(k), (min(samples), np.concatenate(pixels, axis=1))
        if before is not None and 0 < before[0] < min(samples):
            name = _tails(camera, size)
            share = noise(before[1], self._before[k][1], (before[0], min(samples)))
            self._found[name] = {"key": store.artefact(name).key, "samples": min(samples), "noise": share}


def noted_noise(store: Store, camera: Camera, size: tuple[int, int], samples: int) -> float | None:
    """Noise of a view with `samples` samples, as written by its bake; None if it was not."""
    name = _tails(camera, size)
    said = store.documents.get(NOISE, {}).get(name, {})
    is_of_it = name in store and said.get("key") == store.artefact(name).key and said.get("samples") == samples
    return float(said["noise"]) if is_of_it else None


def _tails(camera: Camera, size: tuple[int, int]) -> str:
    return view_artefact_name(camera, *size, "interreflection", "tails")
