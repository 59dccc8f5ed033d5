"""Worker process that path traces views of a store's scene for the window, pass after pass.

python -m lambent.viewer.modes.walk.tracing_worker STORE DEGREES  (rotation of the sky)

Every line on stdin is a `Wish` as a JSON object; a newer wish ends older ones at the next pass, and the end of stdin
ends the process. Every line on stdout is a JSON object: "error", a line for the user; "what", a step; or "number" (of
the wish), "samples", "width" and "height", followed by the bytes of the mean so far, float32 (height, width, 3).
"""

from __future__ import annotations

import json
import os
import sys
import threading
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, BinaryIO

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.camera import Camera
from lambent.core.errors import UserError
from lambent.materials.document import Material
from lambent.scenes.replacement import parse_replacements, with_replacements
from lambent.scenes.scene import ImageTexture, Look, Scene
from lambent.scenes.turned_sky import under_turned_sky
from lambent.scenes.variants import textures_worn
from lambent.store.source import SOURCE, scene_of
from lambent.store.store import Store
from lambent.viewer.modes.walk.tracing import MOST_SAMPLES, Wish

NICENESS = 10  # the window has priority
COARSE, COARSE_SAMPLES = 4, 4  # the first picture is reduced by this factor, to appear at once


class Wishes:
    """Reads wishes from a stream; `newest` waits for a wish other than `but`, and is None at the stream's end."""

    def __init__(self, stream: Iterable[bytes]) -> None:
        self._changed = threading.Condition()
        self._last: Wish | None = None
        self._ended = False
        threading.Thread(target=self._read, args=(stream,), daemon=True).start()

    def newest(self, but: Wish | None) -> Wish | None:
        with self._changed:
            self._changed.wait_for(lambda: self._ended or self._last is not but)
            return None if self._ended else self._last

    def stands(self, wish: Wish) -> bool:
        """Whether a wish is still the newest."""
        return not self._ended and self._last is wish

    def _read(self, stream: Iterable[bytes]) -> None:
        for line in stream:
            with self._changed:
                self._last = Wish.of(json.loads(line))
                self._changed.notify()
        with self._changed:
            self._ended = True
            self._changed.notify()


class Views:
    """Path traced views of a scene, in the materials that the window shows."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._applied: tuple[Mapping[str, Material], Mapping[str, str | ImageTexture]] | None = None
        self._built: Any = None

    def traced(self, camera: Camera, size: tuple[int, int], samples: int, seed: int) -> Floats:
        """Mean radiance (height, width, 3) of a number of paths per pixel."""
        from lambent.bake.reference.path_traced import traced

        return traced(self._built, camera, *size, samples, seed)[0]

    def apply_materials(self, materials: Mapping[str, Material], textures: Mapping[str, str | ImageTexture]) -> bool:
        """Set materials and textures that replace the scene's; return whether the scene must be rebuilt."""
        if self._built is not None and (materials, textures) == self._applied:
            return False
        from lambent.bake.reference.path_traced import built

        self._applied = materials, textures
        scene = self._scene
        looks = {name: Look(scene.materials[name], of) for name, of in textures.items()}
        applied = textures_worn(scene.textures, looks)
        self._built = built(replace(scene, materials={**scene.materials, **materials}, textures=applied))[1]
        return True


def main(folder: Path, sky_turn_deg: float, replaced: Sequence[str], wishes: Wishes, out: BinaryIO) -> None:
    """Trace wishes until the stream ends; `replaced` as `scenes.replacement` reads it."""
    from lambent.bake.engine import engine

    store = Store.open(folder)
    if not isinstance(store.documents.get(SOURCE), str):
        raise UserError(
            "the store has no path of its scene file", file=folder, hint="bake the scene again from its file"
        )
    say(out, what="loading the scene")
    engine()
    with TemporaryDirectory() as images:
        scene = with_replacements(scene_of(store), parse_replacements(replaced))
        views, wish = Views(under_turned_sky(scene, sky_turn_deg, Path(images))), wishes.newest(None)
        while wish is not None:
            if wish.camera is not None:
                trace(views, wish, wish.camera, wishes, out)
            wish = wishes.newest(wish)


def trace(views: Views, wish: Wish, camera: Camera, wishes: Wishes, out: BinaryIO) -> None:
    """Write pictures of a wish with more and more samples, while it is the newest."""
    say(out, what="building the scene")
    views.apply_materials(wish.materials, wish.textures)
    coarse = max(1, wish.size[0] // COARSE), max(1, wish.size[1] // COARSE)
    if wishes.stands(wish):
        send(out, wish, views.traced(camera, coarse, COARSE_SAMPLES, 0), COARSE_SAMPLES)
    total = np.zeros((wish.size[1], wish.size[0], 3))
    for samples in range(1, MOST_SAMPLES + 1):
        if not wishes.stands(wish):
            return
        total += views.traced(camera, wish.size, 1, samples)
        send(out, wish, total / samples, samples)


def say(out: BinaryIO, **words: object) -> None:
    """Write a line."""
    out.write(json.dumps(words).encode() + b"\n")
    out.flush()  # BrokenPipeError ends this process when the window is gone


def send(out: BinaryIO, wish: Wish, mean: Floats, samples: int) -> None:
    """Write a picture."""
    height, width = mean.shape[:2]
    say(out, number=wish.number, samples=samples, width=width, height=height)
    out.write(np.ascontiguousarray(mean, np.float32).tobytes())
    out.flush()


if __name__ == "__main__":
    if hasattr(os, "nice"):
        os.nice(NICENESS)
    own = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # libraries' output must not mix with the pictures
    try:
        main(
            Path(sys.argv[1]), float(sys.argv[2]), sys.argv[3:], Wishes(os.fdopen(os.dup(0), "rb", buffering=0)), own
        )  # no lock to end with
    except UserError as error:
        say(own, error=str(error))
