"""`answer`: how exactly and how fast baked light answers other colours, against path tracing with those colours.

Rows are scene x edit. Errors are those at texels that viewers see, drawn at random, all channels alike, in percent:
`rms` and `mean_error` over the mean of the truth, the others texel by texel (over at least LEAST of that mean). The
truth has the direct sun, which texels show beside the light map and no edit changes. The light that is answered from is
path traced, too, with the same random numbers, so that errors are those of the answer alone;
of it, as much is direct as of the light map, which may lie a texel beside it at edges of light.
`shown_rms` has those of the light map besides, of which `baked_rms` is there before any edit. Where light is sorted by
group, `shown_rms` is of the sum of the groups' own answers. `rms` and `relative_rms` are roots of mean products of the
errors in two independent halves of the paths, which noise (`noise`, of one whole) does not enter; so is
`relative_rms_contacts`. 95 % of contacts err less than `p95_contacts`, by `contact_paths` from each: noise is in this
figure, `p95_contacts_noise` is that of noise alone. `naive` is the light
as it was baked. `likely_error` is the bound on `rms` that the window shows.

Contacts are texels from which a quarter of cosine distributed rays meet something within CONTACT_M.
Times are those of `answer_times`. `everything white` has albedos of .85, light that surfaces let through included:
more than 1 together would be no surface.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lambent.bench.answer_times import Edit, changed, darkened, dragged, timed
from lambent.bench.views import given_or_baked
from lambent.core.answer import answered, upsampled
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.geometry import triangle_areas
from lambent.core.plain import Triple
from lambent.core.progress import Progress, silent
from lambent.materials.diffuse_albedos import edited_albedos
from lambent.materials.document import Material
from lambent.scenes.scene import Scene
from lambent.store.answer import StoredAnswer, answer_name, read_answer
from lambent.store.contract import PROCESSOR_TIMINGS, TIMINGS
from lambent.store.store import Store

if TYPE_CHECKING:
    from lambent.bake.context import BakeContext

NAME = "answer"
LEAST = 0.01  # of the mean light, in relative errors
CONTACT_M, CONTACT_SHARE, CONTACT_RAYS = 0.1, 0.25, 64
SEED = 1
WHITE = 0.85  # albedo, light that goes through included


@dataclass(frozen=True)
class Effort:
    """Texels that are compared, paths from each, edits at most, turns of timing, and the scene baked without inputs.

    Contacts among the texels get `contact_paths` besides. A colour is dragged for `drag_s` seconds.
    """

    texels: int = 3000
    paths: int = 1024
    edits: int = 6
    turns: int = 5
    scene: str = "builtin:room"
    contact_paths: int = 4096
    drag_s: float = 5.0


FULL, QUICK = Effort(), Effort(300, 256, 2, 5, "builtin:box", 1024, 2.0)


def run(effort: Effort, inputs: Sequence[Path] = (), progress: Progress = silent) -> dict[str, Any]:
    """Rows of the inputs, baked stores; without one, of a scene that is baked here in `preview`."""
    with given_or_baked(inputs, effort.scene, progress) as stores:
        rows = [row for store in stores for row in rows_of(store, effort, progress)]
    return {"rows": rows, "summary": {f"{row['scene']} {row['edit']}": row["rms"] for row in rows}}


def edits_of(scene: Scene, most: int) -> dict[str, Edit]:
    """Edits of the spec's scenes by name; elsewhere some colours for the materials of the largest area."""
    known = ROOM if scene.materials.keys() >= ROOM_MATERIALS else {}
    whole = {
        "everything half": {name: darkened(m.kd, 0.5) for name, m in scene.materials.items()},
        "everything white": {
            name: (WHITE - m.kt_d[0], WHITE - m.kt_d[1], WHITE - m.kt_d[2])
            for name, m in scene.materials.items()
            if any(m.kd) and max(m.kt_d) < WHITE
        },
    }
    if known:
        return dict(list({**known, **whole}.items())[:most])
    area: dict[str, float] = dict.fromkeys(scene.materials, 0.0)
    for o in scene.objects:
        area[o.material] += float(triangle_areas(o.mesh.corners).sum())
    largest = sorted((name for name in area if any(scene.materials[name].kd)), key=lambda name: -area[name])
    single = {f"{name} {word}": {name: colour} for name in largest for word, colour in COLOURS.items()}
    return dict(list({**dict(list(single.items())[: max(most - 2, 1)]), **whole}.items())[:most])


COLOURS: dict[str, Triple] = {"blue": (0.03, 0.06, 0.2), "light": (0.8, 0.8, 0.8), "black": (0.02, 0.02, 0.02)}
ROOM: dict[str, Edit] = {
    "walls dark blue": {"wall_paint": (0.03, 0.06, 0.2)},
    "floor terracotta": dict.fromkeys(("tile_light", "tile_dark"), (0.45, 0.15, 0.07)),
    "rug white": {"rug": (0.8, 0.8, 0.8)},
    "wood black": dict.fromkeys(("oak", "dark_oak", "varnished_wood"), (0.02, 0.02, 0.02)),
}
ROOM_MATERIALS = {name for edit in ROOM.values() for name in edit}


def rows_of(store: Store, effort: Effort, progress: Progress = silent) -> list[dict[str, Any]]:
    """One row per edit of a store's scene."""
    stored = read_answer(store)
    truth = Truth(store, stored, effort, progress)
    edits = edits_of(truth.scene, effort.edits)
    times = timed(store, stored, truth.scene.materials, edits, effort.turns)
    drag = dragged(store, truth.scene.materials, next(iter(edits.values())), effort.drag_s)
    seconds = {name: store.documents.get(name, {}) for name in (TIMINGS, PROCESSOR_TIMINGS)}
    cost = {
        "precompute_s": seconds[TIMINGS].get("answer"),
        "precompute_cpu_s": seconds[PROCESSOR_TIMINGS].get("answer"),
        "light_map_cpu_s": seconds[PROCESSOR_TIMINGS].get("light_map"),
        "bytes": sum(path.stat().st_size for path in (store.folder / answer_name("")).rglob("*") if path.is_file()),
        "patches": len(stored.answer.patches.material),
        "texels": len(truth.at),
        "groups": len(stored.answer.baked),
    }
    rows = []
    for number, (name, edit) in enumerate(edits.items()):
        progress(number, len(edits), name)
        rows.append({"scene": truth.scene.name, "edit": name, **truth.errors(edit), **times[name], **drag, **cost})
    return rows


class Truth:
    """Some texels of a store, and their light path traced before edits and after."""

    def __init__(self, store: Store, stored: StoredAnswer, effort: Effort, progress: Progress) -> None:
        self._context, self._stored, self._effort, self._progress = context_of(store), stored, effort, progress
        traced = self._context.traced
        self.scene = traced.scene
        sides, labels = traced.in_view(1.0)
        self._sides = sides
        self._chosen = _drawn(
            np.asarray(sides.valid.any(axis=1)), labels.reshape(-1)[sides.texels.index], effort.texels
        )
        self.at = np.searchsorted(stored.texels, sides.texels.index[self._chosen] * 2)
        self._contact = self._contacts()
        self._sun = self._direct_sun()
        self._before, self._before_contacts = self._traced({}), self._traced_contacts({})
        answer = stored.answer
        self._reference = answer.reference()
        direct, light = (of[:, self.at].sum(axis=0) for of in (answer.direct, answer.baked))
        self._share = np.divide(direct, light, out=np.ones_like(light), where=light > 0)

    def _traced(self, edited: dict[str, Material]) -> Floats:
        """Halves (2, n, 3) of path traced irradiance."""
        return self._halves(self._chosen, edited, self._effort.paths, SEED)

    def _traced_contacts(self, edited: dict[str, Material]) -> Floats:
        """The same of contacts, by more paths."""
        return self._halves(self._chosen[self._contact], edited, self._effort.contact_paths, SEED + 1)

    def _halves(self, texels: Indices, edited: dict[str, Material], paths: int, seed: int) -> Floats:
        from lambent.bake.reference.at_texels import retraced

        if not len(texels):
            return np.zeros((2, 0, 3))
        traced = retraced(self._context.traced, self._sides, texels, edited, paths, seed, self._progress)
        return traced.halves.astype(float)

    def _direct_sun(self) -> Floats:
        """(n, 3) W/m^2."""
        from lambent.bake.answering.spots import sun_at

        return np.asarray(sun_at(self._context.traced)[0][self._chosen])

    def _contacts(self) -> Flags:
        """(n,) texels that touch something."""
        from lambent.bake.tracing.rays import cosine_directions, distances, leaving

        t, whole = self._sides.texels, self._context.traced.whole(diffuse=True)
        p, n, flat = (
            np.repeat(of[self._chosen, 0].astype(float), CONTACT_RAYS, axis=0)
            for of in (t.positions, t.normals, t.flat)
        )
        found = distances(whole, leaving(whole, p, flat, cosine_directions(n)))
        return np.asarray((found.reshape(-1, CONTACT_RAYS) < CONTACT_M).mean(axis=1) > CONTACT_SHARE)

    def errors(self, edit: Edit) -> dict[str, Any]:
        """The fields of a row that are errors."""
        given, names = self.scene.materials, self._stored.materials
        edited = changed(given, edit)
        albedos = edited_albedos([given[name] for name in names], [edited.get(name, given[name]) for name in names])
        answer = self._stored.answer
        computed = upsampled(answer.indirect(albedos), answer.near)
        after, before = self._traced(edited), self._before
        by_group = [light[:, self.at] for light in (answer.direct, answer.baked, computed, self._reference)]
        map_before, map_after = by_group[1].sum(axis=0), answered(*by_group).sum(axis=0)
        now, then = (light.sum(axis=0) for light in by_group[2:])

        def answer_errors(lit: Floats, true: Floats, some: Flags | slice) -> list[Floats]:
            """Errors (n, 3) by halves, of some texels whose light was `lit` (2, n, 3) and is `true`."""
            given = now[some][None], then[some][None]
            found = (answered((self._share[some] * half)[None], half[None], *given)[0] for half in lit)
            return [light - half for light, half in zip(found, true, strict=True)]

        one, other = answer_errors(before, after, slice(None))
        naive = [half - true for half, true in zip(before, after, strict=True)]
        shown, as_baked = [map_after - half for half in after], [map_before - half for half in before]
        all_light = after.mean(axis=0) + self._sun
        mean, local = all_light.mean(), np.maximum(all_light, LEAST * all_light.mean())
        whole, contact = (one + other) / 2, self._contact
        true = self._traced_contacts(edited)
        first, second = answer_errors(self._before_contacts, true, contact)
        there = np.maximum(true.mean(axis=0) + self._sun[contact], LEAST * mean)
        halves = np.stack([first + second, first - second]) / 2 / there
        off, noise = np.quantile(np.abs(halves), 0.95, axis=(1, 2)) if halves.size else (None, None)
        own, left = figures(one, other, mean, local), figures(naive[0], naive[1], mean, local)
        return {
            "rms": own["rms"],
            "relative_rms": own["relative_rms"],
            "mean_error": percent(whole.mean() / mean),
            "relative_rms_contacts": figures(first, second, mean, there)["relative_rms"] if halves.size else None,
            "p95_contacts": None if off is None else percent(off),
            "p95_contacts_noise": None if noise is None else percent(noise),
            "naive_rms": left["rms"],
            "naive_relative_rms": left["relative_rms"],
            "shown_rms": figures(shown[0], shown[1], mean, local)["rms"],
            "baked_rms": figures(as_baked[0], as_baked[1], (before.mean(axis=0) + self._sun).mean(), local)["rms"],
            "noise": percent(np.sqrt(((one - other) ** 2).mean()) / 2 / mean),
        }


def percent(share: float) -> float:
    """With two decimals."""
    return round(100 * float(share), 2)


def figures(one: Floats, other: Floats, mean: float, local: Floats) -> dict[str, float]:
    """rms and relative_rms of the error that two halves (n, 3) have in common; 0 where that is lost in noise."""
    both = one * other
    return {
        "rms": percent(np.sqrt(max(float(both.mean()), 0.0)) / mean),
        "relative_rms": percent(np.sqrt(max(float((both / local**2).mean()), 0.0))),
    }


def _drawn(lit: Flags, label: Indices, count: int) -> Indices:
    """Texels drawn at random of those that viewers see."""
    from lambent.bake.surfaces.texels import BEYOND

    seen = np.flatnonzero(lit & (label < BEYOND))
    return np.sort(np.random.default_rng(SEED).permutation(seen)[:count])


def context_of(store: Store) -> BakeContext:
    """The bake context of a store, as far as geometry and light map need it."""
    from lambent.bake.bake import found
    from lambent.bake.context import BakeContext
    from lambent.bake.cuts import cut_for_viewers
    from lambent.bake.engine import engine
    from lambent.bake.methods import METHODS
    from lambent.bake.probes.division import divided
    from lambent.bake.quality import quality_named
    from lambent.bake.sight import Sight
    from lambent.bake.timing import untimed
    from lambent.scenes.textures import prepared
    from lambent.store.source import scene_of

    engine()
    scene = scene_of(store)
    ready = replace(scene, textures=prepared(scene.textures))
    as_baked = cut_for_viewers(divided(Sight(ready), store, silent, untimed), store, untimed).scene
    return BakeContext(as_baked, store, found(), quality_named("preview"), store.documents.get(METHODS, {}))
