"""What the walk window draws: the picture, the one it is compared with, their difference, marks, readings and films."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.errors import UserError
from lambent.core.images import write_shown
from lambent.realtime.frame_state import FALSE_COLOUR
from lambent.realtime.renderer import Renderer
from lambent.viewer.comparison import REFERENCE, Errors
from lambent.viewer.filming import QUALITIES, SIZES, Filming, FilmOptions, film_file
from lambent.viewer.input import Rect
from lambent.viewer.markers import Markers, outline
from lambent.viewer.metering import read
from lambent.viewer.picture import Picture, frame_state
from lambent.viewer.quantity import is_false_coloured, set_shown_scale, shown_quantity, shown_scale, shows_noise
from lambent.viewer.readback import read_picture, read_pixel
from lambent.viewer.state import ViewerState

METER_S = 0.2  # between two readings of the meter while something moves
SHARED = 0.5  # of the frame time that each of two pictures may take


class Pictures:
    """Takes the place of one `Picture`; the second is made when it is first wanted."""

    def __init__(self, renderer: Renderer) -> None:
        self.device = renderer.device
        self._renderer, self._a = renderer, Picture(renderer)
        self._b: Picture | None = None
        self._film_renderer: Renderer | None = None
        self._errors, self._markers = Errors(), Markers(renderer.scene.probes)
        self._comparing = False
        self._read_version, self._read_s = -1, -1e9
        self.images: Mapping[str, NDArray[np.uint8]] = {}

    @property
    def views(self) -> tuple[Any, ...]:
        """A, and B where they stand side by side."""
        return (self._a.view, self._b.view) if self._comparing and self._b is not None else (self._a.view,)

    def update(self, state: ViewerState, rect: Rect, pixel_ratio: float) -> None:
        """Draw what is due, and read what somebody looks at."""
        comparison = state.comparison
        compared = comparison is not None and comparison.on
        self._film(state)
        if state.filming is not None:
            compared = False
        if compared:
            self._compare(state, rect, pixel_ratio)
        else:
            self._errors.forget()
            if comparison is not None:
                comparison.figures = None
            self._a.update(state, rect, pixel_ratio, refine=False if state.filming is not None else None)
        self._comparing = compared
        self._mark(state, rect)
        self._meter(state)
        images: dict[str, NDArray[np.uint8]] = dict(self._markers.images)
        if self._errors.picture is not None:
            images["error map"] = self._errors.picture
        self.images = images

    def wait_s(self, state: ViewerState) -> float | None:
        """Seconds until something is due although nothing changes; None: never."""
        if state.filming is not None:
            return 0.0
        waits = [self._a.wait_s(state)]
        if self._comparing and self._b is not None:
            waits += [self._b.wait_s(state), 0.1 if self._errors.busy else None]
        return min((wait for wait in waits if wait is not None), default=None)

    @property
    def under_way(self) -> bool:
        """Whether a frame at rest is being drawn in parts."""
        return any(picture.under_way for picture in self._pictures)

    def work(self, state: ViewerState) -> bool:
        """Draw a part of it; whether there is a new picture to show."""
        busy = next((picture for picture in self._pictures if picture.under_way), None)
        return busy is not None and busy.work(state)

    @property
    def _pictures(self) -> tuple[Picture, ...]:
        return (self._b, self._a) if self._comparing and self._b is not None else (self._a,)

    def save(self, state: ViewerState) -> None:
        """Write the picture A, and the error map where one is shown."""
        name = self._a.save(state)
        if name is None or self._errors.picture is None:
            return
        try:
            write_shown(state.folder / f"{name}-error.png", np.ascontiguousarray(self._errors.picture[..., :3]))
        except (UserError, OSError) as error:
            state.say(f"error map not saved: {error}")
        else:
            state.say(f"saved {name}-error.png")

    def close(self, state: ViewerState) -> None:
        """End what goes on in the background."""
        self._errors.forget()
        if state.filming is not None:
            state.filming.cancel()

    # comparing

    def _compare(self, state: ViewerState, rect: Rect, pixel_ratio: float) -> None:
        comparison = state.comparison
        assert comparison is not None
        if self._b is None:
            self._b = Picture(Renderer(self.device, self._renderer.scene, beside=self._renderer))
        a, b = self._a, self._b
        refine = comparison.integrator == REFERENCE
        # A looks through the middle of each pixel: so does B where the difference is to be that of the integrators.
        edges = comparison.mode == "side by side"
        b.update(
            state, rect, pixel_ratio, integrator=comparison.integrator, refine=refine, share=SHARED, antialias=edges
        )
        a.update(state, rect, pixel_ratio, refine=False, share=SHARED)  # last: its figures are the window's
        comparison.a_label = state.integrator
        comparison.b_label = f"{comparison.integrator}, {b.samples} samples" if b.samples else comparison.integrator
        self._measure(state, a, b)

    def _measure(self, state: ViewerState, a: Picture, b: Picture) -> None:
        """Compare A and B where both are whole and at rest."""
        comparison = state.comparison
        assert comparison is not None
        done = not a.under_way and a.wait_s(state) is None
        at_rest = done and (b.samples > 0 or not (b.under_way or b.wait_s(state) is not None))
        if a.drawn is None or b.drawn is None or a.radiance.size != b.radiance.size or not at_rest:
            comparison.figures = None if not at_rest else comparison.figures
            self._errors.forget()
        else:
            what = (a.version, comparison.integrator, comparison.mode)
            if self._errors.due(what, max(1, b.accumulated)):
                view = "filmic" if state.view_transform == FALSE_COLOUR else state.view_transform
                pictures = (read_picture(self.device, a.radiance), read_picture(self.device, b.radiance))
                self._errors.compare(comparison, *pictures, view, state.exposure_ev, b.accumulated, b.samples)
        self._errors.tick(comparison)

    # marks and readings

    def _mark(self, state: ViewerState, rect: Rect) -> None:
        marks, aspect = state.marks, rect.width / max(1, rect.height)
        if marks.probes:
            view = "filmic" if state.view_transform == FALSE_COLOUR else state.view_transform
            self._markers.update(state.camera, aspect, rect.height, view, state.exposure_ev)
        else:
            self._markers.clear()
        marks.balls = self._markers.balls
        lines = []
        if marks.reflectors:
            for record in state.scene.reflectors:
                name = ", ".join(part.object for part in record.parts)
                lines.append(outline(name, np.array(record.outline), state.camera, aspect))
        marks.lines = tuple(line for line in lines if line is not None)

    def _meter(self, state: ViewerState) -> None:
        meter, now_s = state.meter, state.clock()
        a, b = self._a, self._b
        if not a.readable:
            return
        stale = a.version != self._read_version and now_s - self._read_s >= METER_S
        if is_false_coloured(state) and shows_noise(state) not in meter.fitted:
            meter.fit_wanted = True  # for the first time
        asked = meter.expose_wanted or (meter.fit_wanted and is_false_coloured(state))
        if (meter.wanted and stale) or asked:
            meter.reading = read(read_picture(self.device, a.radiance), shown_quantity(state))
            self._read_version, self._read_s = a.version, now_s
            self._apply(state)
        meter.under_cursor = None
        if meter.cursor is not None and (meter.readout_on or is_false_coloured(state)):
            x, y = meter.cursor
            beyond = self._comparing and state.comparison is not None and state.comparison.mode == "side by side"
            picture = b if beyond and b is not None and state.comparison and x > state.comparison.split else a
            if not picture.readable:
                return
            width, height = picture.radiance.size[:2]
            meter.under_cursor = read_pixel(self.device, picture.radiance, int(x * width), int(y * height))

    def _apply(self, state: ViewerState) -> None:
        """Set what was to follow from a reading."""
        meter = state.meter
        if meter.expose_wanted and shows_noise(state):
            state.say("nothing to meter: the picture shows noise, not light")
        elif meter.expose_wanted and meter.reading is not None:
            state.exposure_ev = meter.reading.exposure_ev
        elif meter.expose_wanted:
            state.say("nothing to meter: the picture is black")
        if meter.fit_wanted and is_false_coloured(state) and meter.reading is not None:
            set_shown_scale(state, meter.reading.ranges[0 if shown_scale(state).log else 1])
            meter.fit_wanted = False
            meter.fitted.add(shows_noise(state))
        meter.expose_wanted = False

    # films

    def _film(self, state: ViewerState) -> None:
        wanted, state.film_wanted = state.film_wanted, None
        if wanted is not None and state.filming is None:
            try:
                state.filming = self._filming(state, wanted)
            except UserError as error:
                state.say(f"no film: {error}")
        # A frame of a film can be slow: events are answered first, so that it can be cancelled.
        if state.filming is None or state.answering or not state.filming.step():
            return
        film, state.filming = state.filming, None
        state.say(f"no film: {film.error}" if film.error else f"saved {film.file}, {film.done} frames")

    def _filming(self, state: ViewerState, path: Any) -> Filming:
        options = state.film or FilmOptions()
        file = film_file(state.folder, options.file_name)
        if self._film_renderer is None:
            self._film_renderer = Renderer(self.device, self._renderer.scene, beside=self._renderer)
        frame = replace(frame_state(state, *SIZES[options.size]), materials=dict(state.edits.edited))
        return Filming(self._film_renderer, file, path, frame, options.fps, QUALITIES[options.quality])
