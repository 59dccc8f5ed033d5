"""Contact sheets: all variants of a scene from one view, with captions."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lambent.baked.answering.stored import has_answer
from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.core.light.exposure import ev100_of
from lambent.core.light.light_mix import LightMix
from lambent.core.pictures.images import check_writable, write_shown
from lambent.core.plain import printable
from lambent.core.progress import Progress, part_of, silent
from lambent.core.views.camera import Camera
from lambent.render.images import PATH_TRACER, Settings
from lambent.render.output import DEFAULT, Note, Rendered, displayed_as, ignore, images, opened_with_views, view_of
from lambent.scenes.looks.variants import NO_VARIANTS, NO_VARIANTS_HINT
from lambent.scenes.scene import Variant
from lambent.store.kept.states import says_light, variants_of
from lambent.store.kept.views import read_views
from lambent.store.light_groups import light_groups
from lambent.store.store import Store

AS_BAKED = "as baked"
MOST_PIXELS = 1 << 27  # largest sheet
LEAST_INK_PX = 14  # height of the letters
PAPER, INK = (255, 255, 255), (30, 30, 30)
STAYS = "light as baked"
ONE, EACH, BY_LIGHT = EXPOSURES = ("one", "each", "light")


def sheet(
    store: Store | Path | str,
    file: Path | str,
    camera: Camera | str | None = None,
    settings: Settings = DEFAULT,
    *,
    exposures: str = BY_LIGHT,
    scene: str | None = None,
    note: Note = ignore,
    progress: Progress = silent,
) -> Rendered:
    """Draw every variant of a store's scene from one view into one contact sheet.

    Parameters
    ----------
    file : path
        .png.
    settings : Settings
        As for a still. The size is that of each picture; an exposure, if set, applies to all.
    exposures : {"light", "each", "one"}
        "light": pictures with the same light mix share an exposure; "each": every picture is metered; "one": all have
        the exposure of the first. Captions show EV100 if exposures differ. The scene's exposure applies to its baked
        light; other mixes are metered.

    Other parameters as in `output.still`.

    Raises
    ------
    UserError
        If the store has no variants, the sheet would be too large, or `output.still` would raise it.
    """
    began, file = time.perf_counter(), Path(file)
    known("exposure of a sheet", exposures, EXPOSURES, field="--exposure")
    check_writable(file, (".png",))
    opened, record = opened_with_views(store)
    found = variants_of(opened, saved=False)
    if not found:
        raise UserError(NO_VARIANTS, field="--variants", hint=NO_VARIANTS_HINT)
    variants = with_the_baked_state(found)
    columns, rows = shape_of(len(variants), settings.width / settings.height)
    pixels = columns * rows * settings.width * settings.height
    if pixels > MOST_PIXELS:
        got, hint = f"{len(variants)} pictures of {settings.width}x{settings.height}", "choose a smaller --size"
        raise UserError("contact sheet is too large", field="--variants", got=got, hint=hint)
    view = view_of(record, camera)
    saved = read_views(opened.folder).lights.get(view.name, LightMix()) if camera is not None else LightMix()
    drawn = images(opened, replace(settings, variant=""), scene=scene, note=note)
    pictures, names = list[NDArray[np.uint8]](), list[str]()
    metered = Exposures(ONE if settings.exposure_ev is not None else exposures, drawn.exposure_ev)
    for number, variant in enumerate(variants):
        part = part_of(progress, number / len(variants), (number + 1) / len(variants), variant.name)
        lit = variant if says_light(opened, variant.name) else replace(variant, light=saved)
        shown, stays = _as_possible(lit, opened, settings, note)
        drawn.apply_variant(shown)
        drawn.exposure_ev = metered.wanted(shown.light if settings.light is None else LightMix())
        pictures.append(drawn.displayed(view, part))
        metered.take(drawn.exposure_ev)
        names.append(f"{variant.name} ({STAYS})" if stays else variant.name)
    picture = laid_out(pictures, names, columns, metered.notes)
    write_shown(file, picture)
    drawn.exposure_ev = metered.used[0]
    seconds, said = time.perf_counter() - began, displayed_as(file, drawn)
    if metered.differ:
        said["ev100_by_name"] = {
            one.name: ev100_of(ev) for one, ev in zip(variants, metered.used, strict=True) if ev is not None
        }
    height, width = picture.shape[:2]
    return Rendered(file, width, height, drawn.settings.integrator, len(pictures), seconds, **said)


class Exposures:
    """Exposures of the pictures of a sheet, in EV, in drawing order.

    `how` is one of EXPOSURES, `of_scene` the scene's exposure for its baked light, if any.
    """

    def __init__(self, how: str, of_scene: float | None) -> None:
        self.used: list[float | None] = []
        self._how, self._of_scene = how, of_scene
        self._by_light: dict[object, float] = {}
        self._light: object = ()

    def wanted(self, light: LightMix) -> float | None:
        """The exposure of the next picture, lit by this mix; None if it must be metered."""
        self._light = () if self._how == ONE else tuple(sorted(light.factors.items()))
        if self._how == EACH:
            return None
        return self._by_light.get(self._light, None if self._light else self._of_scene)

    def take(self, exposure_ev: float | None) -> None:
        """Record the exposure of the drawn picture; None for false colours."""
        self.used.append(exposure_ev)
        if exposure_ev is not None:
            self._by_light[self._light] = exposure_ev

    @property
    def differ(self) -> bool:
        return len(set(self.used)) > 1

    @property
    def notes(self) -> list[str]:
        """The note in each caption."""
        return [f", EV100 {ev100_of(ev):.1f}" if self.differ and ev is not None else "" for ev in self.used]


def with_the_baked_state(variants: Sequence[Variant]) -> list[Variant]:
    """The variants, preceded by the baked state unless one of them equals it."""
    is_there = any(not one.looks and not one.light.groups for one in variants)
    return [*variants] if is_there else [Variant(AS_BAKED), *variants]


def _as_possible(variant: Variant, store: Store, settings: Settings, note: Note) -> tuple[Variant, bool]:
    """The variant reduced to what the store can show, and whether light stays as baked although it should change."""
    stays = bool(variant.looks) and settings.integrator != PATH_TRACER and not has_answer(store)
    missing = sorted(set(variant.light.groups) - {group.name for group in light_groups(store)})
    if settings.light is None and missing:
        note(f"{variant.name}: light mix not applied: the store has no light group {', '.join(missing)}")
        return replace(variant, light=LightMix()), True
    return variant, stays


def shape_of(count: int, aspect: float) -> tuple[int, int]:
    """Columns and rows for `count` pictures of `aspect` (width / height): a sheet near 4:3 with few empty cells."""
    fits = [(columns, math.ceil(count / columns)) for columns in range(1, count + 1)]
    return min(fits, key=lambda c: abs(math.log(c[0] * aspect / c[1] * 3 / 4)) + 0.5 * (c[0] * c[1] / count - 1))


def laid_out(
    pictures: Sequence[NDArray[np.uint8]], names: Sequence[str], columns: int, notes: Sequence[str] = ()
) -> NDArray[np.uint8]:
    """Pictures (H, W, 3) of one size in rows, with captions: a name, shortened if too long, and a note."""
    from PIL import Image, ImageDraw

    from lambent.render.captions import caption_font

    height, width = pictures[0].shape[:2]
    size = max(LEAST_INK_PX, height // 20)
    gap, caption = size // 2, 2 * size
    rows = math.ceil(len(pictures) / columns)
    page = Image.new("RGB", (columns * (width + gap) + gap, rows * (height + caption) + gap), PAPER)
    draw, font = ImageDraw.Draw(page), caption_font(size)
    for number, (picture, name, note) in enumerate(zip(pictures, names, notes or [""] * len(names), strict=True)):
        row, column = divmod(number, columns)
        x, y = gap + column * (width + gap), gap + row * (height + caption)
        page.paste(Image.fromarray(picture), (x, y))
        kept = words = printable(name)
        while kept and draw.textlength(words + note, font) > width:
            kept = kept[:-1]
            words = f"{kept}..." if kept else ""
        draw.text((x + width / 2, y + height + caption / 2), words + note, font=font, fill=INK, anchor="mm")
    return np.asarray(page, np.uint8)
