"""The relight mode without its window: the sky, the view baked for it, and the picture under that sky."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from lambent.baking.running.relit import Relit
from lambent.core.arrays import Image
from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.core.light.exposure import metered
from lambent.core.light.false_colour import Range
from lambent.core.light.light_mix import LightMix
from lambent.editing.relit_view import RelitView
from lambent.store.contract import scene_record
from lambent.store.kept.session import RelitSky, RoomState, Surroundings
from lambent.store.store import Store
from lambent.viewer.background.work import Work, pending
from lambent.viewer.editor.files import typed_path
from lambent.viewer.edits.edits import MaterialEdits
from lambent.viewer.edits.keeping import SessionKeeper
from lambent.viewer.edits.rooms_view import RoomsView
from lambent.viewer.edits.shown import Backend, Look, Shown
from lambent.viewer.exchange import RELIGHT, WALK, exchanged
from lambent.viewer.look import Look as Settings
from lambent.viewer.modes.relight.baking import ViewBake
from lambent.viewer.modes.relight.view import cameras_of, sky_of, view_of
from lambent.viewer.screen import Screen

NO_SKY = "this scene has no sky to turn: drop a .hdr or .exr to light it with"


@dataclass(frozen=True)
class Frame:
    """A picture, and the view, sky and look that it shows."""

    view: RelitView
    sky: RelitSky
    look: Look
    shown: Shown
    seconds: float
    compared: None = None


@dataclass(frozen=True)
class Found:
    """A view, None where it is not baked; whether its scene has a sky, and a line for the user."""

    view: RelitView | None = None
    has_sky: bool = True
    line: str = ""


class RelightState:
    """State of the relight mode; see the module.

    Parameters
    ----------
    camera
        Name of a camera of the scene, or of a saved or baked view; by default the session's, or the first.
    environment, turn_deg
        The sky to start with, in place of the session's: arguments of `view.sky_of`, and degrees.
    fitting
        Size with the aspect of a view whose bake has not begun.

    Attributes
    ----------
    frame : Frame or None
        The last picture.
    trouble : str
        A line on a failure, else empty.
    """

    def __init__(
        self, store: Store, screen: Screen, backend: Backend, *, camera: str | None = None,
        environment: dict[str, Any] | None = None, turn_deg: float | None = None,
        fitting: tuple[int, int] | None = None,
    ) -> None:  # fmt: skip
        self.folder, self.screen, record, cameras = store.folder, screen, scene_record(store), cameras_of(store)
        chosen = None if camera is None else cameras[known("camera", camera, cameras, field="--camera")]
        sky = None if environment is None else sky_of(**environment, folder=store.folder)
        self.name, self.bounds, self.edits = record.name, record.bounds, MaterialEdits(record.materials)
        self.has_room = bool(record.objects)  # else it is a store of views alone
        self.keeper = SessionKeeper(self.edits, store.folder, screen)
        self.lines = self.keeper.open(None)
        self.look = Settings(exposure_ev=record.exposure_ev or 0.0, shows=("full",))
        self.room = RoomsView(self.keeper, self.look)
        self._metered = record.exposure_ev is not None or self.room.has_exposure
        left = None if self.room.opened is None else cameras.get(self.room.opened.camera.name)
        self.view = view_of(store, chosen or left or next(iter(cameras.values())), fitting)
        self.pixel_exact, self.trouble, self.typed = False, "", dict[str, str]()
        self.frame: Frame | None = None
        self.baking: ViewBake | None = None
        self._backend = backend
        self._work: Work | None = None
        self._room: RoomState | None = None  # of the last search
        self._relit = Relit(self.folder, RoomState(), self.view)  # what is searched for, or baked
        self._searches = self._was_baked = False  # whether a search is due, and whether it is the one after a bake
        self._found = Found()
        self._refused: tuple[Surroundings | None, str] = None, ""  # an image that cannot be read, and why
        self._lit: tuple[RelitView, RelitSky, Image] | None = None  # the last radiance
        if sky is not None:
            self.edits.change_sky(environment=sky)
        if turn_deg is not None:
            self.turn(turn_deg)
        self.edits.end_stroke()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture in pixels."""
        return self.view.width, self.view.height

    @property
    def scale(self) -> Range | None:
        """Scale of the picture's false colours, if any."""
        return self.look.scale if self.look.is_false_coloured else None

    def take(self) -> Frame | None:
        """The last picture."""
        return self.frame

    @property
    def has_sky(self) -> bool:
        """Whether there is a sky to turn."""
        return self._found.has_sky or self.edits.sky.environment is not None

    @property
    def busy(self) -> bool:
        """Whether background work goes on."""
        return self._work is not None or self.baking is not None

    @property
    def said(self) -> list[str]:
        """Lines on what is not shown as wanted, and on background work."""
        doing = "looking for this view" if self._work is not None and self._found.view is None else ""
        doing, sky = doing if self.baking is None else self.baking.line, "" if self.has_sky else NO_SKY
        mix = "shown as baked here: the room's light mix" if self.edits.light != LightMix() else ""
        lines = (self.keeper.fault, self.trouble, self._found.line, self._refusal, sky, mix, doing)
        return [line for line in lines if line]

    def turn(self, turn_deg: float) -> None:
        """Rotate the sky about +y, from that of the bake or as the image is, within a stroke."""
        self.edits.change_sky(turn_deg=(turn_deg + 180) % 360 - 180)

    def open(self, text: str) -> None:
        """Light the view with a typed or dropped image, as one step, or say why not."""
        try:
            self.light(sky_of(typed_path(text), self.folder))
        except UserError as error:
            self.screen.say(f"not loaded: {error}")

    def light(self, environment: Surroundings | None) -> None:
        """Light the view with an image, None for the sky of the bake, as one step."""
        self.edits.end_stroke()
        self.edits.change_sky(environment=environment)
        self.edits.end_stroke()

    def enter_room(self) -> None:
        """Go to the room, at the camera of this view."""
        self.room.leave(self.view.camera, self.room.selected)
        self.screen.enter = partial(exchanged, store=self.folder, before=RELIGHT, name=WALK)

    def tick(self) -> None:
        """Take results of background work, and begin the next."""
        self.keeper.tick()
        self._work = pending(self._work)
        if self.edits.room is not self._room:
            first, self._room = self._room is None, self.edits.room
            relit = replace(self._relit, room=self._room.model_copy(update={"light": LightMix()}))
            if first or relit != self._relit:
                self.stop_baking()
                self._relit, self._searches, self._was_baked, self.trouble = relit, True, False, ""
        if self._work is None:
            self._go_on()

    def close(self) -> None:
        """Stop background work, whose finished part stays, and keep the session."""
        self.stop_baking()
        if self._work is not None:
            self._work.wait()
        self.keeper.close()

    def stop_baking(self) -> None:
        """Stop the bake; finished work stays in the store."""
        if self.baking is not None:
            self.baking.close()
            self.baking = None

    def _go_on(self) -> None:
        """Search for the view, bake it, or draw it."""
        if self._searches:
            self._searches = False
            self._begin(partial(_find, self._relit), partial(self._take, self._relit), self._fail)
        elif self.baking is not None and not self.baking.running:
            error = self.baking.error
            self.stop_baking()
            self._searches, self._was_baked, self.trouble = not error, True, f"not baked: {error}" if error else ""
        elif (view := self._found.view) is not None and not self.is_current:
            self._begin(partial(self._draw, view, self._sky, self._look), self._show, self._refuse)

    def _begin(self, run: Callable[[], Any], done: Callable[[Any], None], failed: Callable[[UserError], None]) -> None:
        self._work = Work(lambda _: run(), done, failed, self.screen.wake)

    def _take(self, relit: Relit, found: Found) -> None:
        """Show what was found, or bake it, unless the room has changed since."""
        if relit is not self._relit:
            return
        if found.view is None and not self._was_baked:
            self.baking = ViewBake(relit, self.screen.wake)
        elif found.view is None:
            self.trouble = "not baked: the scene has changed meanwhile"
        self._found = replace(found, view=found.view or self._found.view)

    def _fail(self, error: UserError) -> None:
        self.trouble = f"not baked: {error}"

    @property
    def _refusal(self) -> str:
        """Why the wanted image is not shown; empty if it may be."""
        return self._refused[1] if self._refused[0] == self.edits.sky.environment else ""

    @property
    def _sky(self) -> RelitSky:
        sky = self.edits.sky
        return sky.model_copy(update={"environment": None}) if self._refusal else sky

    @property
    def _look(self) -> Look:
        return self.look.view_transform, self.look.exposure_ev, self.look.scale

    @property
    def is_current(self) -> bool:
        """Whether the picture shows what is wanted."""
        frame, wanted = self.frame, (self._found.view, self._sky, self._look)
        return frame is not None and (frame.view, frame.sky, frame.look) == wanted

    def _draw(self, view: RelitView, sky: RelitSky, look: Look) -> Frame:
        """Sum and show the picture; runs in the thread."""
        began_s, lit, self._lit = time.perf_counter(), self._lit, None
        if lit is None or lit[:2] != (view, sky):
            if lit is None or (lit[0], lit[1].environment) != (view, sky.environment):
                view.light(None if sky.environment is None else sky.environment.image(self.folder))
            view.turn(sky.turn_deg)
            view.draw()
            lit = view, sky, view.image()
        self._lit = lit
        return Frame(view, sky, look, self._backend.still(lit[2], look), time.perf_counter() - began_s)

    def _show(self, frame: Frame) -> None:
        self.frame = frame
        if not self._metered and (found := metered(frame.shown.radiance)) is not None:  # None where it is dark
            self._metered = True
            if self.look.exposure_ev == 0.0:  # not chosen by hand meanwhile
                self.look.expose(found)

    def _refuse(self, error: UserError) -> None:
        """Go on under the sky of the bake."""
        self._refused = self.edits.sky.environment, f"shown under its own sky: {error}"


def _find(relit: Relit) -> Found:
    """The view, if it is baked. That of a store that does not know its scene is shown as it was baked."""
    view = relit.view
    try:
        scene = relit.scene()
    except UserError as error:
        try:
            there = RelitView(Store.open(relit.folder), view.camera, view.width, view.height)
        except UserError:
            raise error from None
        return Found(there, line=f"materials and light as baked: {error}")
    baked = relit.is_baked(scene)
    found = RelitView(Store.open(relit.place), view.camera, view.width, view.height) if baked else None
    return Found(found, scene.environment is not None)
