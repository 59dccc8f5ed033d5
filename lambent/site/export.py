"""`lambent export`: a store as a folder that any static host serves."""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from lambent.core.errors import UserError
from lambent.core.light.exposure import metered
from lambent.core.light.light_mix import MixTrack
from lambent.core.progress import Progress, silent, tracked
from lambent.realtime.frame_state import VIEW_TRANSFORMS, FrameState
from lambent.realtime.gpu.described import DescribedDevice
from lambent.realtime.gpu.device import open_device
from lambent.realtime.light.baked import read_baked
from lambent.realtime.renderer import Renderer
from lambent.realtime.resources import device_needs
from lambent.render.applied_materials import AppliedMaterials
from lambent.render.output import ignore
from lambent.scenes.scene import Variant
from lambent.site.cameras import cameras_of, frames_of, widest
from lambent.site.manifest import Manifest, camel
from lambent.site.memory import graphics_bytes, needs_of, script_bytes, transferred
from lambent.site.mixing import mixing_of
from lambent.site.replacing import check_folder, replacing
from lambent.site.things import things
from lambent.store.kept.states import lamps_of, variants_of
from lambent.store.kept.views import read_views
from lambent.store.light_groups import light_groups
from lambent.store.store import Store

Note = Callable[[str], None]
FORMAT, VERSION = "lambent-site", 1
NAMED_BY_CONTENT = "data", "shaders"  # folders
SIZE = 640, 360  # of the frame that is described; the page's follows its canvas
POSTER = 960, 540  # a picture for browsers without WebGPU, and while the room loads
DISPLAY, BAKED = "site", "as baked"


def export(store: Store, folder: Path, progress: Progress = silent, note: Note = ignore) -> dict[str, Any]:
    """Write a site of a baked scene; returns its figures: bytes, files, pipelines, memory, bytes by light group.

    Parameters
    ----------
    store : Store
    folder : Path
        New, empty, or a site that is replaced.

    Raises
    ------
    UserError
        If the folder holds something else, the scene has no camera, or there is no graphics adapter.
    """
    check_folder(folder, FORMAT, "a site")
    baked = read_baked(store)
    if not baked.record.cameras:
        raise UserError("has no camera", file=store.folder, hint="add [[cameras]] to its scene.toml")
    with replacing(folder, FORMAT, NAMED_BY_CONTENT) as site:
        device = DescribedDevice(open_device(device_needs(baked)))
        renderer = Renderer(device, baked)
        saved = read_views(store.folder).cameras
        names = {one.name for one in baked.record.cameras}
        cameras = [*baked.record.cameras, *(one for one in saved if one.name not in names)]
        state = FrameState(cameras[0], *SIZE)
        exposure_ev = baked.record.exposure_ev
        if exposure_ev is None:
            exposure_ev = metered(renderer.image(state)) or 0.0
        poster = _poster(renderer, replace(state, exposure_ev=exposure_ev))
        shown = renderer.target(DISPLAY, SIZE).create_view()
        manifest, states = Manifest(device, folder, SIZE, shown, in_blocks=baked.groups is None), []
        rooms = list(_states(store, renderer, state, note))
        of_cameras, mixing = cameras_of(renderer, manifest, state), mixing_of(manifest, renderer, note)
        for room, now in tracked(rooms, progress, "states"):
            one = now()
            said = {"name": room.name or BAKED, "m": widest(renderer, one)}
            states.append({**said, **manifest.state(frames_of(renderer, one, shown))})
            if mixing is not None:
                states[-1]["mixing"] = mixing.state(room.light)
        document = {
            "name": baked.record.name,
            "cameras": [camel(asdict(one)) for one in cameras],
            "bounds": np.asarray(baked.record.bounds).tolist(), "exposureEv": exposure_ev, "unit": baked.unit,
            "viewTransform": VIEW_TRANSFORMS[state.view_transform],
            **of_cameras,
            "visit": things(store.folder, baked.record, renderer.resources, manifest, [room for room, _ in rooms]),
            "needs": needs_of(manifest.tables), "tables": manifest.tables, "passes": manifest.passes, "states": states,
            **({} if mixing is None else mixing.said),
        }  # fmt: skip
        site.named.update(manifest.chunks.files, (one["file"] for one in manifest.tables["shader_module"]))
        site.add("manifest.json", manifest_text(document).encode())
        site.add("poster.jpg", poster)
        site.add_page("page", (".html", ".js", ".css"))
    return {
        "written": folder, "bytes": transferred(document), "files": len(manifest.chunks.files),
        "folder_bytes": sum(manifest.chunks.files.values()),
        "pipelines": len(manifest.tables["render_pipeline"]), "graphics_bytes": graphics_bytes(manifest.tables),
        "script_bytes": script_bytes(document, len(baked.faces)),
        "by_light_group": mixing.bytes_of if mixing else {},
    }  # fmt: skip


def manifest_text(document: Mapping[str, Any]) -> str:
    """The manifest, which begins with its format and the SHA-256 of all that follows it and its comma."""
    rest = json.dumps(document, separators=(",", ":"), allow_nan=False)[1:]
    digest = hashlib.sha256(rest.encode()).hexdigest()
    return f'{{"format":"{FORMAT}","version":{VERSION},"sha256":"{digest}",{rest}'


def _states(
    store: Store, renderer: Renderer, state: FrameState, note: Note
) -> Iterator[tuple[Variant, Callable[[], FrameState]]]:
    """The room's states, the first without a name, and what shows each and returns the state of its frame."""
    applied = AppliedMaterials(store, renderer, note)

    def shown(variant: Variant) -> FrameState:
        applied.apply(variant.looks, {}, {}, lamps_of(store, variant.name) if variant.name else {})
        light = MixTrack.of(variant.light).factors_at(0.0)
        return replace(state, light=light, materials=applied.materials, maps=renderer.light_version)

    for variant in states_of(store, note):
        yield variant, partial(shown, variant)


def states_of(store: Store, note: Note) -> Iterator[Variant]:
    """The room as baked, which has no name, and the variants whose light the store has."""
    yield Variant("")
    groups = {group.name for group in light_groups(store)}
    for variant in variants_of(store):
        if missing := sorted(set(variant.light.groups) - groups):
            note(f"{variant.name} is left out: the store has no light group {', '.join(missing)}")
        else:
            yield variant


def _poster(renderer: Renderer, state: FrameState) -> bytes:
    """A picture, as JPEG."""
    from PIL import Image

    made, (width, height) = io.BytesIO(), POSTER
    Image.fromarray(renderer.still(replace(state, width=width, height=height))).save(made, "jpeg", quality=85)
    return made.getvalue()
