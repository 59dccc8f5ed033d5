"""The drawing of the walk mode: the picture, comparisons, marks, meter readings and films."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from lambent.core.errors import UserError
from lambent.core.pictures.images import write_shown
from lambent.core.plain import triple
from lambent.core.views.camera import CameraPath
from lambent.realtime.frame_state import FrameState
from lambent.realtime.light.group_arrays import GroupArrays
from lambent.realtime.renderer import Renderer
from lambent.viewer.background.work import POLL_S
from lambent.viewer.mode import Divider
from lambent.viewer.modes.walk.at_rest.traced import Appearance, AtRest, TracedFrames, TracedPicture, is_traceable
from lambent.viewer.modes.walk.at_rest.tracing import ALL_LIGHT, Kind
from lambent.viewer.modes.walk.comparison import AS_A
from lambent.viewer.modes.walk.lanes import Lane
from lambent.viewer.modes.walk.light.answering import AnsweringLight
from lambent.viewer.modes.walk.light.glare import SAMPLES, GlareDrawing
from lambent.viewer.modes.walk.light.light_fields import FieldDrawing
from lambent.viewer.modes.walk.light.metering import read
from lambent.viewer.modes.walk.outlining import Outlining
from lambent.viewer.modes.walk.rebake.rebaking import RebakedLight
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.modes.walk.views.filming import QUALITIES, SIZES, Filming, film_file
from lambent.viewer.picture import Pair, Picture, Shown, size_px
from lambent.viewer.screen import Rect, least

METER_S = 0.2  # time between two meter readings in motion
SHARED = 0.5  # share of the frame time for each of two pictures


class Pictures(Pair):
    """Draws the picture A; the renderers of B and of films are made at their first use."""

    def __init__(self, renderer: Renderer, state: WalkState, answering: AnsweringLight | None = None) -> None:
        super().__init__(renderer.device)
        self._state = state
        self._lane = Lane.of(renderer, state.screen, answering, state.answering, state.store)
        self._other_lane: Lane | None = None  # lane of the state that the room is compared with
        self._rebaked = (
            None if state.store is None else RebakedLight(state.store, renderer.scene, state.screen, state.rebaking)
        )
        self._b: Picture | None = None
        self._at_rest = AtRest(
            lambda: self._renderer.uploaded_picture(), state.screen, state.store, state.sky_turn_deg, state.replaced
        )
        self._said = ""  # the last reason for which nothing is traced
        self._stands_for: Any = None
        self._stand_in: Any = None
        self.shown: tuple[Shown, ...] = (self._a,)
        self._film_renderer: Renderer | None = None
        self._outlining = Outlining(renderer)
        self._fields = FieldDrawing(renderer.discs(), state.fields)
        self._read_of: object = None  # picture of the last meter reading
        self._read_s = -1e9
        self._glare = GlareDrawing(state.meter.glare)
        self._glare_renderer: Renderer | None = None

    @property
    def _renderer(self) -> Renderer:
        return self._lane.renderer

    @property
    def _a(self) -> Picture:
        return self._lane.picture

    @property
    def images(self) -> Mapping[str, Any]:
        """Mirror balls, outline and light field of the selection, the error map in place of A, what A replaces."""
        error, (before, _) = self._state.comparison.map, self._fading
        own = {} if before is None else {"before A": before}
        own |= {} if error is None else {"picture A": error}
        return {**self._state.marks.images, **self._outlining.images, **self._fields.images, **own}

    @property
    def light_groups(self) -> GroupArrays | None:
        """Light maps by group of the present room, before the mix; None without groups."""
        return self._renderer.mixer.groups

    @property
    def share(self) -> float:
        return self._fading[1]

    @property
    def _fading(self) -> tuple[Any, float]:
        a = self.shown[0]
        return a.fading if isinstance(a, TracedPicture) and self._state.comparison.map is None else (None, 1.0)

    @property
    def views(self) -> tuple[Any, ...]:
        """Views of A and B; before B exists, a second view of A's texture: Dear ImGui drops views one by one."""
        if any(picture.view is None for picture in self.shown) and self._stands_for is not self._a.view:
            self._stands_for, self._stand_in = self._a.view, self._a.view.texture.create_view()
        return tuple(self._stand_in if picture.view is None else picture.view for picture in self.shown)

    @property
    def divider(self) -> Divider | None:
        return self._state.divider if len(self.shown) == 2 else None

    def update(self, place: Rect, pixel_ratio: float) -> None:
        """Draw the due frames, and read the picture for an open meter."""
        state = self._state
        self._film()
        self._follow_exchange()
        self._lane.answer(state.materials.edits.room)
        size = size_px(place, pixel_ratio)
        in_stroke = state.screen.pace.dragging = state.materials.edits.in_stroke
        if self._rebaked is not None and state.films.under_way is None:
            self._rebaked.update(self._lane, state.recordings.light, state.navigation.camera, size, in_stroke=in_stroke)
        wanted = self._frame(size)
        self._outlining.update(wanted, state.selection.record)
        filming, before = state.films.under_way is not None, self.shown[0].view
        kinds = self._traced_kinds(wanted)
        self._glare.step(wanted, self._renderer_of_glare, self._traced_glare)
        self._at_rest.update(wanted, self._appearance, kinds, before, paused=self._glare.waits)
        if state.states.split and not filming:
            self._compare_states(wanted)
        elif state.comparison.on and not filming:
            self._compare(wanted)
        else:
            state.comparison.forget()
            state.comparison.figures = None
            self.shown = (self._picture_a(wanted),)
        self._say_at_rest()
        look, size = state.look, (max(1, place.width), max(1, place.height))
        exposure_ev = look.exposure_ev + math.log2(self._renderer.scene.unit)  # probes have these units
        state.marks.update(state.navigation.camera, size, look.display_transform, exposure_ev)
        state.fields.follow(state.selected_parts)
        self._fields.update(wanted, look.display_transform, exposure_ev, pixel_ratio)
        self._meter()

    def _frame(self, size: tuple[int, int]) -> FrameState:
        state = self._state
        frame = state.look.frame(state.navigation.camera, size, state.materials.edits.edited)
        return self._lane.frame(frame, state.recordings.light)

    # at rest

    @property
    def _appearance(self) -> Appearance:
        """The materials' textures and the light of the room."""
        lane, answers = self._lane, self._lane.shown.on and self._lane.shown.possible
        copied = self._rebaked is not None and self._rebaked.is_copied(lane.room)
        self._state.rebaking.copied = copied
        return Appearance(lane.textures, lane.lamps, answers, copied)

    def _traced_kinds(self, wanted: FrameState) -> tuple[Kind, ...]:
        """Kinds of traced pictures that the window shows at rest."""
        state, comparison = self._state, self._state.comparison
        if state.films.under_way is not None or state.states.split:
            return ()
        b = comparison.traced_kind if comparison.on else None
        traceable = is_traceable(wanted)
        kinds: list[Kind] = ["traced"] if traceable and state.screen.pace.traces and b != "traced" else []
        if b is not None and (wanted.show == ALL_LIGHT or (b == "traced" and traceable)):
            kinds.append(b)
        return tuple(kinds)

    def _picture_a(self, wanted: FrameState, share: float = 1.0) -> Shown:
        """The picture A: traced if it is at rest and there is one, else drawn."""
        a, traces = self._a, self._state.screen.pace.traces and self._state.comparison.traced_kind != "traced"
        traced = self._at_rest.picture("traced") if traces and self._at_rest.still else None
        if traced is not None:
            self._renderer.mixer.follow(wanted.light, waits=False)  # as a frame would
            a.stand_in(traced.texture, wanted)
            return traced
        a.update(wanted, sharpen=not (traces and self._at_rest.coming), share=share)
        if a.version > 0:
            self._at_rest.start()
        return a

    def _say_at_rest(self) -> None:
        """Update the line on the picture at rest; say once why nothing is traced."""
        fault, screen = self._at_rest.fault, self._state.screen
        traces = screen.pace.traces and self._state.store is not None
        if fault != self._said and traces:
            self._said = fault
            screen.say(f"not traced at rest: {fault}")
        screen.at_rest = self._at_rest.line if traces and self._state.films.under_way is None else ""

    def wait_s(self) -> float | None:
        film = self._state.films.under_way
        if (film is not None and not film.waits) or (self._glare.busy and not self._glare.waits):
            return 0.0
        draws = any(isinstance(one, Picture) for one in self.shown)
        loading = POLL_S if draws and self._renderer.streaming.busy else None
        light = self._lane.wait_s()
        if light is not None and not draws:
            light = POLL_S  # it is not shown
        other = self._other_lane.wait_s() if self._other_lane is not None and self._state.states.split else None
        compares = POLL_S if len(self.shown) == 2 and self._state.comparison.busy else None
        rebakes = None if self._rebaked is None else self._rebaked.wait_s()
        resting = self._at_rest.wait_s()
        return least(super().wait_s(), loading, light, other, compares, rebakes, resting)

    def save(self) -> None:
        """Write the picture A, and a shown error map."""
        a = self.shown[0]
        shown = self._a if isinstance(a, TracedPicture) and not a.is_whole else a
        name = shown.save(self._state.scene.name)
        screen, error_map = self._state.screen, self._state.comparison.map
        if name is None or error_map is None:
            return
        try:
            write_shown(screen.folder / f"{name}-error.png", np.ascontiguousarray(error_map[..., :3]))
        except (UserError, OSError) as error:
            screen.say(f"error map not saved: {error}")
        else:
            screen.say(f"saved {name}-error.png")

    def close(self) -> None:
        """Cancel FLIP, path tracing, the running film, and light computations."""
        if self._rebaked is not None:
            self._rebaked.close()
        for lane in (self._lane, self._other_lane):
            if lane is not None:
                lane.close()
        self._state.comparison.forget()
        self._at_rest.close()
        if self._state.films.under_way is not None:
            self._state.films.under_way.cancel()

    # comparing

    def _follow_exchange(self) -> None:
        """Swap the lanes after the room and the other state were swapped."""
        edits, lane, other = self._state.materials.edits, self._lane, self._other_lane
        if other is None or edits.room == edits.other:
            return
        if other.room == edits.room and lane.room == edits.other:
            self._lane, self._other_lane, self._state.answering = other, lane, other.shown
            self._b = self._film_renderer = self._glare_renderer = None  # they share the light of the previous lane

    def _compare_states(self, wanted: FrameState) -> None:
        """Draw the room and the other state, each in half of a frame's time."""
        state, edits = self._state, self._state.materials.edits
        state.comparison.forget()
        state.comparison.figures = None
        if self._other_lane is None:
            self._other_lane = self._lane.another(state.screen)
        other, lane = edits.other, self._other_lane
        assert other is not None, "no split without a second lane"
        lane.shown.on = state.answering.on
        lane.answer(other.only(state.scene.materials))
        self.shown = (self._a, lane.picture)
        lane.picture.update(lane.frame(wanted, state.lights.known(other.light.factors)), share=SHARED)
        self._a.update(wanted, share=SHARED)  # last, because the window shows its statistics
        state.states.label()

    def _compare(self, wanted: FrameState) -> None:
        """Show B beside A: by another integrator, each in half of a frame's time, or traced."""
        comparison, kind = self._state.comparison, self._state.comparison.traced_kind
        comparison.fault = self._fault_of_b(kind, wanted)
        if kind is not None:
            a, label = self._picture_a(wanted), self._at_rest.label(kind)
            if comparison.fault:
                self.shown = (a,)
                return
            b: Shown = self._at_rest.held(kind)
        else:
            b = self._b_drawn(wanted)
            a, label = self._picture_a(wanted, SHARED), comparison.integrator
            label += f", {comparison.look_up}" if comparison.look_up != AS_A else ""
        self.shown = (a, b)
        comparison.divider.a_label = f"traced, {a.counted}" if isinstance(a, TracedPicture) else wanted.integrator
        comparison.divider.b_label = label
        of = a.drawing, b.drawing, comparison.integrator, comparison.look_up, comparison.mode
        self._measure(a, b, of)

    def _fault_of_b(self, kind: Kind | None, wanted: FrameState) -> str:
        """Why there is no traced B, in one line; else empty."""
        if kind is None or self._at_rest.fault:
            return "" if kind is None else f"not traced: {self._at_rest.fault}"
        if kind == "path" and wanted.show != ALL_LIGHT:
            return "The path tracer shows all light: set 'show' to full."
        return "" if kind in self._traced_kinds(wanted) else "This light is drawn, not traced."

    def _b_drawn(self, wanted: FrameState) -> Picture:
        comparison = self._state.comparison
        if self._b is None:
            renderer = self._another_renderer()
            renderer.waits = False
            self._b = Picture(renderer, self._state.screen)
        frame = replace(wanted, integrator=comparison.integrator)
        if comparison.look_up != AS_A:
            frame = replace(frame, lookup=comparison.look_up, lookups={})
        self._b.update(frame, share=SHARED)
        return self._b

    def _another_renderer(self) -> Renderer:
        return Renderer(self.device, self._renderer.scene, beside=self._renderer)

    def _measure(self, a: Shown, b: Shown, of: object) -> None:
        """Compare A and B, the pictures of `of`, where both are complete and at rest."""
        comparison, look = self._state.comparison, self._state.look
        at_rest = a.rests and b.rests
        if not at_rest or not a.readable or not b.readable or a.size != b.size:
            comparison.figures = comparison.figures if at_rest else None
            comparison.forget()
        elif comparison.due(of, (a.samples, b.samples)):
            view, exposure_ev = look.display_transform, look.exposure_ev
            comparison.compare(a.read(), b.read(), view, exposure_ev, (a.samples, b.samples))
        comparison.tick()

    # readings

    def _renderer_of_glare(self) -> Renderer:
        self._glare_renderer = self._glare_renderer or self._another_renderer()
        return self._glare_renderer

    def _traced_glare(self, frame: FrameState) -> TracedFrames | None:
        """Makes the faces that glare is rated in; None if they are drawn."""
        if not (self._state.screen.pace.traces and self._at_rest.ready and is_traceable(frame)):
            return None
        return self._at_rest.frames(frame, self._appearance, SAMPLES)

    def _meter(self) -> None:
        meter, look, now_s, a = self._state.meter, self._state.look, self._state.screen.clock(), self.shown[0]
        if not a.readable:
            return
        wanted, meter.wanted = meter.wanted, False
        if look.is_false_coloured and look.shows_noise not in meter.fitted:
            meter.fit_wanted = True  # the first time
        asked = meter.expose_wanted or (meter.fit_wanted and look.is_false_coloured)
        if asked or (wanted and (a, a.version) != self._read_of and now_s - self._read_s >= METER_S):
            meter.reading = read(a.read(), look.quantity)
            self._read_of, self._read_s = (a, a.version), now_s
            self._apply()
        meter.under_cursor = None
        if meter.cursor is not None and (meter.readout_on or look.is_false_coloured):
            x, y = meter.cursor
            beyond = self.divider is not None and x > self.divider.share
            picture = self.shown[-1] if beyond else a
            if picture.readable:
                meter.under_cursor = triple(picture.read((x, y))[0, 0])

    def _apply(self) -> None:
        """Set the exposure and the range that wait for this reading."""
        meter, look, say = self._state.meter, self._state.look, self._state.screen.say
        if meter.expose_wanted and look.shows_noise:
            say("nothing to meter: the picture shows noise, not light")
        elif meter.expose_wanted and meter.reading is not None:
            look.expose(meter.reading.exposure_ev)
        elif meter.expose_wanted:
            say("nothing to meter: the picture is black")
        if meter.fit_wanted and look.is_false_coloured and meter.reading is not None:
            look.shown_scale = meter.reading.ranges[0 if look.shown_scale.log else 1]
            meter.fit_wanted = False
            meter.fitted.add(look.shows_noise)
        meter.expose_wanted = False

    # films

    def _film(self) -> None:
        films, screen = self._state.films, self._state.screen
        wanted, films.wanted = films.wanted, None
        if wanted is not None and films.under_way is None:
            try:
                films.under_way = self._filming(wanted)
            except UserError as error:
                screen.say(f"no film: {error}")
        film = films.under_way
        # A film's frame can be slow: handle events first, so that it can be cancelled.
        if film is None or screen.pace.answering or not film.step():
            return
        films.under_way = None
        screen.say(f"no film: {film.error}" if film.error else f"saved {film.file}, {film.done} frames")

    def _filming(self, path: CameraPath) -> Filming:
        films = self._state.films
        file = film_file(self._state.screen.folder, films.file_name)
        if self._film_renderer is None:
            # A film's light may change over time and needs its own copy.
            scene = self._renderer.scene
            self._film_renderer = self._another_renderer() if scene.groups is None else Renderer(self.device, scene)
        if self._film_renderer.resources is not self._renderer.resources:
            self._lane.lend_light(self._film_renderer)
        frame = replace(self._frame(SIZES[films.size]), mixed=0)
        track = self._state.recordings.track_of(path)
        light = None if track is None else lambda time_s: self._state.lights.known(track.factors_at(time_s))
        samples, traced = QUALITIES[films.quality], None
        if samples:
            traced = self._at_rest.frames(frame, self._appearance, samples)
        return Filming(self._film_renderer, file, path, frame, films.fps, traced, light)
