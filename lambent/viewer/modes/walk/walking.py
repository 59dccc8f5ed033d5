"""The walk mode without its interface: a store is opened, the eye walks, background work goes on."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lambent.baked.light_fields.map_cache import LEAST_RECENT
from lambent.realtime.answering.texture_detail import without_uv
from lambent.realtime.gpu.device import open_device
from lambent.realtime.light.baked import BakedScene, read_baked
from lambent.realtime.objects.replaced import with_replacements
from lambent.realtime.renderer import Renderer
from lambent.realtime.resources import device_needs
from lambent.realtime.sun.turned_sky import under_turned_sky
from lambent.scenes.replacement import parse_replacements
from lambent.store.source import SOURCE
from lambent.store.store import Store
from lambent.viewer.background.lost import rescued
from lambent.viewer.background.work import POLL_S
from lambent.viewer.cameras.navigation import Movement
from lambent.viewer.cameras.picking import Geometry
from lambent.viewer.mode import Drawing, Mode, Panel
from lambent.viewer.modes.walk.input import WalkInput
from lambent.viewer.modes.walk.light.answering import AnsweringLight
from lambent.viewer.modes.walk.pictures import Pictures
from lambent.viewer.modes.walk.session.kept_view import restore
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.screen import Screen, least


@dataclass(frozen=True)
class Opened:
    """A store that is open for a walk."""

    state: WalkState
    input: WalkInput
    pictures: Pictures
    baked: BakedScene
    store: Store


def opened(
    path: Path, movement: Movement, screen: Screen, light_field_mb: float | None = None, policy: str = LEAST_RECENT,
    sky_turn_deg: float = 0.0, replaced: tuple[str, ...] = (), fresh: bool = False, device: Any = None,
    session: bool = True,
) -> Opened:  # fmt: skip
    """Open a store with at least geometry and the scene record; else raise `UserError`.

    `light_field_mb` is the GPU memory for light field maps, cached by a `policy` of `baked.light_fields.map_cache`;
    `sky_turn_deg` rotates the sky; `replaced` are meshes in place of objects (`scenes.replacement`); `fresh` leaves the
    store's session aside; the room is drawn on a `device`, by default its own. Without a `session`, none is read,
    locked or written, nor is edited light baked beside the store.
    """
    store = Store.open(path)
    baked = with_replacements(read_baked(store, light_field_mb, policy), parse_replacements(replaced))
    baked = under_turned_sky(baked, sky_turn_deg)
    state = WalkState.of(baked.record, movement, screen, store.folder, session=session)
    state.marks.sources, state.fields.fields = baked.probes, baked.light_fields
    state.lights.groups = baked.groups.records if baked.groups is not None else ()
    state.lamps.records = () if baked.lamps is None else baked.lamps.records
    state.lights.fields = bool(baked.light_fields)
    state.sky_turn_deg, state.replaced = sky_turn_deg, replaced
    from_scene = isinstance(store.documents.get(SOURCE), str) and not replaced
    state.rebaking.possible = from_scene and sky_turn_deg % 360 == 0  # the light map keeps the sky as baked
    of_session = state.session.open([group.name for group in state.lights.groups], fresh=fresh)
    if not session:
        state.session.fault, state.rebaking.on = "", False  # that nothing is kept is no fault
    state.missing = (*baked.missing, *state.missing, *of_session, *restore(state))
    state.texturing.textures, state.texturing.without_uv = baked.textures, without_uv(baked)
    state.texturing.keeps = lambda: state.session.has_lock
    state.notes, state.knows_noise = light_map_notes(store), baked.noise is not None
    geometry = Geometry(baked.positions, baked.faces, state.selection.objects)
    renderer = Renderer(device or open_device(device_needs(baked)), baked)
    pictures = Pictures(renderer, state, AnsweringLight(store, renderer, state.answering))
    return Opened(state, WalkInput(state, geometry), pictures, baked, store)


def light_map_notes(store: Store) -> tuple[str, ...]:
    """Lines on noise and samples of the light map, per side, from the bake."""
    notes = []
    for name in ("light_map/irradiance", "light_map/irradiance_back"):
        meta = store.artefact(name).meta if name in store else {}
        noise, samples = meta.get("noise"), meta.get("samples")
        if isinstance(noise, float) and isinstance(samples, float):
            side = "far side" if name.endswith("back") else "light map"
            notes.append(f"{side}: noise {100 * noise:.1f} % before denoising, {samples:.0f} samples per texel")
    return tuple(notes)


class Walking(Mode):
    """A walk through a room whose materials and light can be changed."""

    input: WalkInput

    def __init__(self, state: WalkState, input: WalkInput, drawing: Drawing, panels: Sequence[Panel] = ()) -> None:
        super().__init__(state.scene.name, state.screen, input, drawing, panels)
        self.state = state

    @property
    def moving(self) -> bool:
        return self.input.walking or self.state.navigation.playing

    def advance(self, dt_s: float) -> None:
        self.input.walk(dt_s)
        self.state.navigation.play(dt_s)
        self.state.recordings.follow()
        self.state.session.tick()

    def wait_s(self) -> float | None:
        busy = self.state.recordings.recorder.on or self.state.texturing.thumbnails.busy
        return least(POLL_S if busy else None, self.state.session.wait_s())

    @property
    def unsaved(self) -> tuple[str, ...]:
        walk = ("the recorded walk",) if self.state.recordings.unsaved else ()
        return (*self.state.session.unsaved, *walk)

    def close(self) -> None:
        rescued("the recorded walk", self.state.recordings.rescue)
        self.state.session.close()
        if names := ", ".join(self.state.session.unsaved):
            sys.stderr.write(f"lambent: note: changes not saved: {names}\n")
