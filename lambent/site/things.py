"""What a visitor of a site asks for: things that can be clicked, their finishes, walks, and whose room it is."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lambent.core.views.camera import CameraPath
from lambent.materials.document import Provenance
from lambent.realtime.frame_state import FALSE_COLOUR, VIEW_TRANSFORMS
from lambent.realtime.gpu.pipelines import VERTEX_FLOATS
from lambent.realtime.resources import SceneResources
from lambent.scenes.scene import ImageTexture, Look, Variant
from lambent.site.manifest import Manifest
from lambent.site.walks import walk_of
from lambent.store.contract import SceneRecord, whole_objects
from lambent.store.kept.views import read_views, with_views

Facts = list[tuple[str, str]]  # of a finish: what each is, and its text


def things(
    folder: Path, record: SceneRecord, resources: SceneResources, manifest: Manifest, states: Sequence[Variant]
) -> dict[str, Any]:
    """For the manifest of a site that shows `states`.

    `geometry` names the buffers with the triangles of all objects; `finishes` are listed once, and each state has the
    number of the finish of every material that an object has.
    """
    objects, finishes = whole_objects(record.objects), list[dict[str, Any]]()
    numbers = dict[str, int]()

    def finish(name: str, state: Variant) -> int:
        textured = name if name in record.textures else ""
        look = state.looks.get(name) or Look(record.materials[name], textured)
        key = look.material.model_dump_json() + repr(look.textures)
        if key not in numbers:
            numbers[key] = len(finishes)
            finishes.append({"name": look.material.name, "facts": facts_of(look, textured)})
        return numbers[key]

    used = list(dict.fromkeys(one.material for one in objects))
    return {
        "caption": record.caption, "credit": record.credit,
        "viewTransforms": {name: number for name, number in VIEW_TRANSFORMS.items() if name != FALSE_COLOUR},
        "geometry": {
            "vertices": manifest.refer(resources.vertices), "indices": manifest.refer(resources.indices),
            "stride": VERTEX_FLOATS,
        },
        "objects": [
            {"name": one.name, "material": one.material, "first": one.first_face, "count": one.face_count,
             "bounds": one.bounds}
            for one in objects
        ],
        "finishes": finishes,
        "finishesOfStates": [{name: finish(name, state) for name in used} for state in states],
        "paths": [_walk(path, manifest) for path in with_views(record, read_views(folder)).paths],
    }  # fmt: skip


def _walk(path: CameraPath, manifest: Manifest) -> dict[str, Any]:
    return {"name": path.name, "seconds": path.seconds, "cameras": manifest.chunks.add_table(walk_of(path))}


def facts_of(look: Look, textured: str) -> Facts:
    """Where the numbers of a finish come from, as far as its document says, and its texture, if not its own."""
    facts = _source(look.material.provenance or Provenance())
    if isinstance(look.textures, ImageTexture):
        facts.append(("Texture", Path(look.textures.file).name))
    elif look.textures != textured:
        facts.append(("Texture", look.textures or "none"))
    return facts


def _source(known: Provenance) -> Facts:
    errors = [f"{error:.3g}, {metric}" for metric, error in known.errors.items() if metric == (known.metric or metric)]
    found = {
        "Measurement": ", ".join(filter(None, (known.source, known.source_format))),
        "Fit": known.method or "",
        "Error": "; ".join(errors),
        "Readings": f"{known.samples['used']:,}" if "used" in known.samples else "",
        "Notes": "; ".join(known.notes),
    }
    return [(name, text) for name, text in found.items() if text]
