"""Sizes of bench `card`."""

from __future__ import annotations

from dataclasses import dataclass

from lambent.baking.quality import Quality, quality_named

BUDGET_S = 720.0


@dataclass(frozen=True)
class Effort:
    """Sizes of all rows; the whole ends within `budget_s`.

    Frames are drawn in `sizes`, repeated `rounds` times, with `ns` samples per lobe. `scene` is baked in `quality`, and
    so is `field_scene`, where `field_object` has the light field. Pictures of paths have `path_samples` a pixel in the
    first of `sizes`; those at rest have `rest_sizes` and run for `rest_s` seconds. `edit_px` is the side of edited
    views, with `lights`; with interreflections they are smaller by `shrink`, with `samples` a pixel.
    """

    budget_s: float
    sizes: tuple[tuple[int, int], ...]
    ns: tuple[int, ...]
    rounds: int
    scene: str
    quality: Quality
    path_samples: int
    rest_sizes: tuple[tuple[int, int], ...]
    rest_s: float
    edit_px: int
    lights: int
    shrink: int
    samples: int
    field_scene: str
    field_object: str


COARSE = quality_named("draft").changed(
    "rehearsal",
    geometry={"texels": 96},
    light_map={"samples": (8, 8), "gather_samples": 16},
    environment={"texels": 32},
    probe={"texels": 32, "samples": 4},
    light_field={"points": 32, "texels": 30},
)
FULL = Effort(
    BUDGET_S, ((1680, 1050), (3840, 2160)), (3, 7, 11, 15, 19), 25, "builtin:room", quality_named("preview"), 64,
    ((960, 540), (1680, 1050)), 5.0, 512, 4000, 1, 64, "builtin:pavilion", "teapot",
)  # fmt: skip
QUICK = Effort(
    300.0, ((168, 105), (384, 216)), (3, 7, 15), 2, "builtin:box", COARSE, 4, ((96, 54), (168, 105)), 0.5, 64, 100,
    10, 16, "builtin:box", "sphere",
)  # fmt: skip
