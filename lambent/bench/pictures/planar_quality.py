"""Errors of planar reflectors: every drawing method against exact ray casting.

The test is the specular light of the floor of planar_scene, for seven lobes. PSNR covers the floor's pixels; FLIP
covers the image, black outside the floor, and the floor's pixels alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from lambent.bench.measuring.reference import Reference, by_n, mean
from lambent.bench.scenes import planar_scene
from lambent.core.progress import Progress, part_of, silent
from lambent.materials.document import Lobe
from lambent.published import planar_thesis
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.device import open_device
from lambent.realtime.renderer import Renderer

NAME = "planar-quality"
METHODS = {
    "marched": "rings",
    "thesis": "lobe-4.25",
}
ROUGHNESSES = ((0.01, 0.01), (0.02, 0.02), (0.05, 0.05), (0.1, 0.1), (0.2, 0.2), (0.02, 0.1), (0.1, 0.02))


@dataclass(frozen=True)
class Effort:
    """Size in pixels, samples per pixel of the reference, and the cases."""

    width: int = 1024
    height: int = 768
    spp: int = 512
    ns: tuple[int, ...] = (3, 5, 7, 9, 11, 15, 19)
    roughnesses: tuple[tuple[float, float], ...] = ROUGHNESSES


FULL, QUICK = Effort(), Effort(192, 144, spp=64)


def lobe_of(mx: float, my: float) -> Lobe:
    """A bright metal."""
    return Lobe(mx=mx, my=my, r0=(0.9, 0.9, 0.9), alpha=0.5)


def run(effort: Effort, progress: Progress = silent) -> dict[str, Any]:
    """Rows roughness x n x method."""
    width, height, count = effort.width, effort.height, len(effort.roughnesses)
    renderer = Renderer(open_device(), planar_scene.planar_scene(lobe_of(*effort.roughnesses[0])))
    rows: list[dict[str, Any]] = []
    for done, (mx, my) in enumerate(effort.roughnesses):
        lobe, name = lobe_of(mx, my), f"roughness {mx}/{my}"
        casting = part_of(progress, done / count, (done + 1) / count, f"{name}, exact")
        radiance, floor = planar_scene.exact_reflection(lobe, planar_scene.CAMERA, width, height, effort.spp, casting)
        exact, state = Reference.of(radiance, floor), planar_scene.floor_state(lobe, width, height)
        with planar_thesis.offered():
            rows += [
                {"mx": mx, "my": my, "n": n, "way": method, **_errors(renderer, replace(state, n=n), method, exact)}
                for n in effort.ns
                for method in METHODS
            ]
        progress(done + 1, count, name)
    size = {"width": width, "height": height, "spp": effort.spp}
    return {"rows": rows, "summary": {**size, **summary(rows)}}


def _errors(renderer: Renderer, state: FrameState, method: str, exact: Reference) -> dict[str, float]:
    image = renderer.image(replace(state, integrator=METHODS[method]))
    return {f"{name.replace('shown', 'floor')}_path": value for name, value in exact.errors(image).items()}


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Means over the lobes by method and n; the maximum of the worst tiles."""
    keys = ("psnr_path", "flip_path", "flip_floor_path")
    found: dict[str, Any] = {key: by_n(rows, "way", key, mean(4)) for key in keys}
    found["flip_worst_tile_path"] = by_n(rows, "way", "flip_worst_tile_path", max)
    return found
