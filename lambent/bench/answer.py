"""`answer`: accuracy and speed of updating baked light after colour edits, against path tracing with those colours.

Rows are scene x edit. Errors are evaluated at random texels that viewers see, over all channels, in percent: `rms` and
`mean_error` relative to the mean of the truth, the others relative to each texel (to at least LEAST of that mean). The
truth includes the direct sun, which texels show in addition to the light map and which no edit changes. The baked light
is path traced here too, with the same random numbers, so that errors are those of the answer alone; its direct share
is the light map's, which may be a texel off at edges of light. `shown_rms` adds the light map's own error, which is
`baked_rms` before any edit; for light separated by group, it refers to the sum of the groups' own answers. `rms`,
`relative_rms` and `relative_rms_contacts` are roots of mean products of the errors in two independent halves of the
paths, which cancels noise (`noise`, of both halves together). `relative_rms_most_contacts` leaves out the WORST part of
contacts, with the largest error of both halves together. 95 % of contacts have an error below `p95_contacts`, with
`contact_paths` paths each; it includes noise, and `p95_contacts_noise` is its value for noise alone. `naive` is the
error of keeping the baked light. `likely_error` is the bound on `rms` that the window shows.

Contacts are texels from which a quarter of cosine-distributed rays hit something within CONTACT_M. `answer_times`
describes the times. In `everything white`, the albedos of reflection and transmission sum to WHITE, since no surface
can exceed 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lambent.baked.answering.albedos import edited_albedos
from lambent.baked.answering.answer import answered, upsampled
from lambent.baked.answering.stored import StoredAnswer, answer_name, read_answer
from lambent.bench.measuring.answer_times import Edit, changed, darkened, dragged, timed
from lambent.bench.measuring.bake_context import context_of
from lambent.bench.scenes.views import inputs_or_baked
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.geometry.triangles import triangle_areas
from lambent.core.plain import Triple
from lambent.core.progress import Progress, silent
from lambent.materials.document import Material
from lambent.scenes.scene import Scene
from lambent.store.contract import PROCESSOR_TIMINGS, TIMINGS
from lambent.store.store import Store

if TYPE_CHECKING:
    from lambent.baking.context import BakeContext

NAME = "answer"
LEAST = 0.01  # of the mean light, the least denominator of relative errors
CONTACT_M, CONTACT_SHARE, CONTACT_RAYS = 0.1, 0.25, 64
SEED = 1
WORST = 0.03  # of contacts, in gaps of one texel, where noise may be most of the error
WHITE = 0.85  # albedo of reflection plus transmission


@dataclass(frozen=True)
class Effort:
    """Compared texels, paths per texel, the most edits, rounds of timing, and the scene that is baked without inputs.

    Contacts among the texels get `contact_paths` in addition. A colour is dragged for `drag_s` seconds.
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
    """Rows of the inputs, which are baked stores; without inputs, of a scene baked here in `preview`."""
    with inputs_or_baked(inputs, effort.scene, progress) as stores:
        rows = [row for store in stores for row in rows_of(store, effort, progress)]
    return {"rows": rows, "summary": {f"{row['scene']} {row['edit']}": row["rms"] for row in rows}}


def edits_of(scene: Scene, most: int) -> dict[str, Edit]:
    """Named edits of the spec's scenes; for other scenes, some colours for the materials of largest area."""
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
    """Some texels of a store, with their light path traced before and after edits."""

    def __init__(self, store: Store, stored: StoredAnswer, effort: Effort, progress: Progress) -> None:
        self._context, self._stored, self._effort, self._progress = _context(store), stored, effort, progress
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
        """Path traced irradiance in two halves (2, n, 3)."""
        return self._halves(self._chosen, edited, self._effort.paths, SEED)

    def _traced_contacts(self, edited: dict[str, Material]) -> Floats:
        """Likewise for contacts, with more paths."""
        return self._halves(self._chosen[self._contact], edited, self._effort.contact_paths, SEED + 1)

    def _halves(self, texels: Indices, edited: dict[str, Material], paths: int, seed: int) -> Floats:
        from lambent.baking.reference.at_texels import retraced

        if not len(texels):
            return np.zeros((2, 0, 3))
        return retraced(self._context.traced, self._sides, texels, edited, paths, seed, self._progress)

    def _direct_sun(self) -> Floats:
        """Direct irradiance of the sun (n, 3), W/m^2."""
        from lambent.baking.answering.spots import sun_at

        return np.asarray(sun_at(self._context.traced)[0][self._chosen])

    def _contacts(self) -> Flags:
        """(n,) whether each texel is a contact."""
        from lambent.baking.tracing.rays import cosine_directions, distances, leaving

        t, whole = self._sides.texels, self._context.traced.whole(diffuse=True)
        p, n, flat = (
            np.repeat(of[self._chosen, 0].astype(float), CONTACT_RAYS, axis=0)
            for of in (t.positions, t.normals, t.flat)
        )
        found = distances(whole, leaving(whole, p, flat, cosine_directions(n)))
        return np.asarray((found.reshape(-1, CONTACT_RAYS) < CONTACT_M).mean(axis=1) > CONTACT_SHARE)

    def errors(self, edit: Edit) -> dict[str, Any]:
        """The error fields of a row."""
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
            """Errors (n, 3) per half, of texels `some` whose light was `lit` (2, n, 3) and is `true`."""
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
            "relative_rms_most_contacts": most_relative(first / there, second / there) if halves.size else None,
            "p95_contacts": None if off is None else percent(off),
            "p95_contacts_noise": None if noise is None else percent(noise),
            "naive_rms": left["rms"],
            "naive_relative_rms": left["relative_rms"],
            "shown_rms": figures(shown[0], shown[1], mean, local)["rms"],
            "baked_rms": figures(as_baked[0], as_baked[1], (before.mean(axis=0) + self._sun).mean(), local)["rms"],
            "noise": percent(np.sqrt(((one - other) ** 2).mean()) / 2 / mean),
        }


def percent(share: float) -> float:
    """A share in percent, with two decimals."""
    return round(100 * float(share), 2)


def figures(one: Floats, other: Floats, mean: float, local: Floats) -> dict[str, float]:
    """rms and relative_rms of the error common to two halves (n, 3); 0 if it is lost in noise."""
    both = one * other
    return {
        "rms": percent(np.sqrt(max(float(both.mean()), 0.0)) / mean),
        "relative_rms": percent(np.sqrt(max(float((both / local**2).mean()), 0.0))),
    }


def most_relative(one: Floats, other: Floats) -> float:
    """Root mean product in percent of two halves' relative errors (n, 3), less the WORST; 0 if it is lost in noise."""
    size = ((one + other) ** 2).mean(axis=1)
    kept = np.argsort(size, kind="stable")[: max(1, int(len(size) * (1 - WORST)))]
    return percent(np.sqrt(max(float((one * other)[kept].mean()), 0.0)))


def _drawn(lit: Flags, label: Indices, count: int) -> Indices:
    """Random texels among those that viewers see."""
    from lambent.baking.surfaces.texels import BEYOND

    seen = np.flatnonzero(lit & (label < BEYOND))
    return np.sort(np.random.default_rng(SEED).permutation(seen)[:count])


def _context(store: Store) -> BakeContext:
    from lambent.baking.engine import engine
    from lambent.baking.quality import quality_named
    from lambent.store.source import scene_of

    engine()
    return context_of(store, scene_of(store), quality_named("preview"))
