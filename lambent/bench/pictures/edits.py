"""`edits`: traced pictures of edited rooms against path tracing of the edited scenes.

Rows are scene x edit, after one for the room as baked. The edited materials are those of which the first camera sees
most. Light between surfaces is the answer to the edit, and under a turned sky the baked light; so the difference of
`flip` to that of the first row is the error of the answered light. `relative_error` is the mean difference of luminance
over tiles, relative to the mean luminance. `unedited_flip` is the error of the picture as baked. `left_unedited` is the
share of tiles where that error is visible and the edited picture differs from the one as baked by less than half of
it. The truth is path traced in two halves; `reference_flip` is the FLIP between them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise, zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from lambent.bench.measuring.reference import Truth, path_traced_parts, with_samples
from lambent.bench.scenes.views import first_camera, inputs_or_baked
from lambent.core.arrays import Floats
from lambent.core.light.colour import luminance
from lambent.core.light.light_mix import Factors
from lambent.core.pictures import metrics
from lambent.core.plain import Triple
from lambent.core.progress import Progress, silent
from lambent.core.views.camera import Camera, pixel_rays
from lambent.editing.curves.nodes import curves_of, pulled, values_of, with_values
from lambent.render.edits import edits_of
from lambent.scenes.looks.retexturing import diffuse_textures, materials_without_uv
from lambent.scenes.scene import Look, Scene
from lambent.store.consistency import read_geometry
from lambent.store.contract import scene_record
from lambent.store.light_groups import light_groups
from lambent.store.source import scene_of
from lambent.store.store import Store
from lambent.traced.picture import TracedPicture
from lambent.traced.room import TracedRoom, room_of_paths, room_of_store
from lambent.viewer.cameras.picking import Geometry

if TYPE_CHECKING:
    from lambent.baking.pictures.tracer import Tracer

NAME = "edits"
T = TypeVar("T")
COLOURS: dict[str, Triple] = {"blue": (0.03, 0.06, 0.2), "light": (0.8, 0.8, 0.8)}
WARM: Triple = (1.0, 0.5, 0.15)  # factors of a coloured lamp
PULL = 3.0  # factor on the middle node of a curve
TURNS_DEG = 90.0, 180.0
SEEN_FROM = 24, 14  # rays that find what the camera sees most of
VISIBLE = 0.1  # mean FLIP of a tile, above that of the truth's noise


@dataclass(frozen=True)
class Effort:
    """Pixels, samples of the truth and of the picture, the most edits; the scene if no store is given."""

    width: int = 480
    height: int = 270
    truth_spp: int = 256
    samples: int = 64
    edits: int = 20
    scene: str = "builtin:room"


FULL, QUICK = Effort(), Effort(160, 90, 64, 24, 4, "builtin:box")


@dataclass(frozen=True)
class Edit:
    """A state of a room: as of `render.edits.edits_of`, factors of light groups, and the turn of the sky."""

    looks: Mapping[str, Look] = field(default_factory=dict)
    colours: Mapping[str, Triple] = field(default_factory=dict)
    textures: Mapping[str, str] = field(default_factory=dict)
    light: Factors = field(default_factory=dict)
    sky_turn_deg: float = 0.0


def run(effort: Effort, inputs: Sequence[Path] = (), progress: Progress = silent) -> dict[str, Any]:
    """Rows of the inputs, which are baked stores; without inputs, of a scene baked here in `preview`."""
    with inputs_or_baked(inputs, effort.scene, progress) as stores:
        rows = [row for store in stores for row in rows_of(store, effort, progress)]
    return {"rows": rows, "summary": {f"{row['scene']} {row['edit']}": row["flip"] for row in rows}}


def rows_of(store: Store, effort: Effort, progress: Progress = silent) -> Iterator[dict[str, Any]]:
    """One row per edit of a store's room, after one for the room as baked."""
    camera, size, scene = first_camera(store, scene_record(store)), (effort.width, effort.height), scene_of(store)
    edits = {"as baked": Edit(), **edits_for(store, scene, camera, effort.edits)}

    def picture(tracer: Tracer) -> Floats:
        return with_samples(TracedPicture(tracer, camera, size), effort.samples).denoised()

    def truth(tracer: Tracer) -> list[Floats]:
        return path_traced_parts(tracer, camera, size, effort.truth_spp, 2, silent)

    traced = dict(_in_states(lambda turn: room_of_store(store, scene, sky_turn_deg=turn), scene, edits, picture))
    truths = _in_states(lambda turn: room_of_paths(scene, sky_turn_deg=turn), scene, edits, truth)
    for number, (name, parts) in enumerate(truths):
        yield {"scene": store.folder.name, "edit": name, **_errors(traced[name], traced["as baked"], parts)}
        progress(number + 1, len(edits), name)


def _in_states(
    room_of: Callable[[float], TracedRoom], scene: Scene, edits: Mapping[str, Edit], found: Callable[[Tracer], T]
) -> Iterator[tuple[str, T]]:
    """What is found of a room in each state, by its name; one room serves all states under the same sky."""
    bare = materials_without_uv([(o.material, o.mesh.uv) for o in scene.objects])
    rooms: dict[float, TracedRoom] = {}
    for name, edit in edits.items():
        if edit.sky_turn_deg not in rooms:
            rooms = {edit.sky_turn_deg: room_of(edit.sky_turn_deg)}
        room = rooms[edit.sky_turn_deg]
        changed = edits_of(scene.materials, scene.textures, bare, edit.looks, edit.colours, edit.textures)
        room.set_materials(changed.looks, changed.materials)
        room.mix(edit.light)
        yield name, found(room.tracer)


def _errors(edited: Floats, unedited: Floats, halves: Sequence[Floats]) -> dict[str, Any]:
    truth = Truth.of(halves)

    def apart(one: Floats, other: Floats) -> Floats:
        """FLIP by tile."""
        return metrics.tile_means(metrics.flip_error(truth.shown(one), truth.shown(other)))

    stale, followed = apart(truth.radiance, unedited), apart(edited, unedited)
    left = (stale > VISIBLE + apart(*halves)) & (followed < stale / 2)
    light = np.abs(metrics.tile_means(luminance(edited) - luminance(truth.radiance)))
    return {
        **truth.errors(edited),
        "relative_error": round(float(light.mean() / luminance(truth.radiance).mean()), 4),
        "unedited_flip": round(float(stale.mean()), 4),
        "left_unedited": round(float(left.mean()), 4),
    }


def edits_for(store: Store, scene: Scene, camera: Camera, most: int) -> dict[str, Edit]:
    """Edits of each kind in turn, as far as the store has what they change."""
    seen = _seen(store, scene, camera)
    lamps = [group.name for group in sorted(light_groups(store), key=lambda group: -group.share)]
    bare = materials_without_uv([(o.material, o.mesh.uv) for o in scene.objects])
    images = sorted(diffuse_textures(scene.textures))
    placed = [(name, of) for name in seen if name not in bare for of in images if of != name]
    kinds = (
        {f"{name} {word}": Edit(colours={name: to}) for name in seen[:4] for word, to in COLOURS.items()},
        {f"{name} as {of}": Edit({name: _look(scene, name, of)}) for name, of in pairwise(seen[:5])},
        {f"texture of {of} on {name}": Edit(textures={name: of}) for name, of in placed[:2]},
        {f"{lamp} off": Edit(light={lamp: (0.0, 0.0, 0.0)}) for lamp in lamps[:2] if len(lamps) > 1},
        {f"{lamp} warm": Edit(light={lamp: WARM}) for lamp in lamps[:2]},
        {f"{name}, {what}": Edit({name: look}) for name in seen[:3] for what, look in _curved(scene, name).items()},
        {f"sky turned by {turn:g}": Edit(sky_turn_deg=turn) for turn in TURNS_DEG if scene.environment is not None},
    )
    in_turn = [one for turn in zip_longest(*(kind.items() for kind in kinds)) for one in turn if one is not None]
    return dict(sorted(in_turn[:most], key=lambda one: one[1].sky_turn_deg))


def _look(scene: Scene, name: str, of: str) -> Look:
    document = scene.materials[of].model_copy(update={"name": scene.materials[name].name})
    return Look(document, of if of in scene.textures else "")


def _curved(scene: Scene, name: str) -> dict[str, Look]:
    """Pulled curves of a material, as far as it has them."""
    material, found = scene.materials[name], dict[str, Look]()
    for which in curves_of(material):
        values = values_of(material, which)
        node = len(values) // 2
        pulled_to = pulled(values, node, PULL * float(values[node].max()), (0, 1, 2)[: values.shape[1]], soft=True)
        edited = with_values(material, which, pulled_to)
        found.setdefault(f"{which.kind} pulled", Look(edited, name if name in scene.textures else ""))
    return found


def _seen(store: Store, scene: Scene, camera: Camera) -> list[str]:
    """Names of materials with a diffuse colour, those first of which the camera sees most."""
    arrays = read_geometry(store)
    geometry = Geometry(arrays["positions"], arrays["faces"], scene_record(store).objects)
    rays = pixel_rays(camera, *SEEN_FROM).reshape(-1, 3)
    hit = [one.material for one in (geometry.pick(camera.position, ray) for ray in rays) if one is not None]
    return [name for name, _ in Counter(hit).most_common() if any(scene.materials[name].kd)]
