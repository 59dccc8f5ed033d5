"""A lane: a renderer with its own baked light, its picture, and the light that follows its edits.

The edited room has a lane. A state shown beside it has a second lane, because light maps and probes of two states
differ; geometry and textures are then on the GPU twice. Swapping the states swaps the lanes, without recomputation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from lambent.core.errors import UserError
from lambent.core.plain import Triple
from lambent.realtime.frame_state import FrameState
from lambent.realtime.renderer import Renderer
from lambent.scenes.lamp_edits import LampEdit
from lambent.scenes.scene import ImageTexture, Look
from lambent.store.kept.images import readable
from lambent.store.kept.session import RoomState
from lambent.viewer.modes.walk.light.answering import Answering, AnsweringLight
from lambent.viewer.picture import Picture
from lambent.viewer.screen import Screen

Lamps = Mapping[int, LampEdit]
MIX_S = 0.01  # interval of polling for a light mix
ANSWER_S = 0.01  # interval of polling for computed light


@dataclass
class Lane:
    """A lane; see the module. `room` is the last drawn state."""

    renderer: Renderer
    picture: Picture
    answering: AnsweringLight | None
    shown: Answering
    say: Callable[[str], None]
    folder: Path | None = None  # of the store
    room: RoomState = field(default_factory=RoomState)
    lamps: Lamps = field(default_factory=dict)  # of `room`, without files that cannot be read
    textures: Mapping[str, str | ImageTexture] = field(default_factory=dict)  # of `room`, images that can be read alone

    @classmethod
    def of(
        cls, renderer: Renderer, screen: Screen, answering: AnsweringLight | None, shown: Answering,
        folder: Path | None = None,
    ) -> Lane:  # fmt: skip
        """Make a lane. Its frames do not wait for light field maps; it is drawn again when maps arrive."""
        renderer.waits = False
        return cls(renderer, Picture(renderer, screen), answering, shown, screen.say, folder)

    def another(self, screen: Screen) -> Lane:
        """A second lane of the same scene, with light as baked."""
        renderer = Renderer(self.renderer.device, self.renderer.scene, kin=self.renderer)
        shown = Answering()
        answering = None if self.answering is None else self.answering.another(renderer, shown)
        return Lane.of(renderer, screen, answering, shown, self.folder)

    def answer(self, room: RoomState) -> None:
        """Set the textures of this state, and advance its light."""
        if room.textures != self.room.textures:
            self.textures, faults = readable(room.textures, self.folder)
            show_textures(self.renderer, self.textures)
            for fault in faults:
                self.say(fault)
        if room.lamps != self.room.lamps:
            self.lamps = show_lamps(self.renderer, room.lamps, self.say)
        self.room = room
        if self.answering is not None:
            self.answering.update(room.materials, self.textures, self.lamps)

    def frame(self, wanted: FrameState, light: Mapping[str, Triple]) -> FrameState:
        """A frame of this lane's state with these factors of light groups."""
        renderer = self.renderer
        return replace(
            wanted, materials=dict(self.room.materials), maps=renderer.light_version, light=dict(light),
            mixed=renderer.mixer.version,
        )  # fmt: skip

    @property
    def busy(self) -> bool:
        """Whether light for the picture is still being computed."""
        return self.renderer.mixer.busy or (self.answering is not None and self.answering.busy)

    def wait_s(self) -> float | None:
        """Seconds until more light may be ready; None: never."""
        if self.renderer.mixer.busy:
            return MIX_S
        return ANSWER_S if self.answering is not None and self.answering.busy else None

    def close(self) -> None:
        """Stop computing light."""
        if self.answering is not None:
            self.answering.close()

    def lend_light(self, other: Renderer) -> None:
        """Let another renderer of the scene show this lane's state in any light mix."""
        show_textures(other, self.textures)
        show_lamps(other, self.lamps, self.say)
        if (groups := self.renderer.mixer.groups) is not None:
            other.mixer.answer(groups)


def show_lamps(renderer: Renderer, edits: Lamps, say: Callable[[str], None]) -> Lamps:
    """Show edits of lamps that are drawn, if a file cannot be read all with their own light; return what is shown."""
    lamps, drawn = renderer.resources.changed_lamps, renderer.scene.lamps
    known = () if drawn is None else [record.number for record in drawn.records]
    edits = {number: edit for number, edit in edits.items() if number in known}
    try:
        lamps.show(edits)
    except UserError as error:
        say(f"luminaire not shown: {error}")
        edits = {number: replace(edit, file="") for number, edit in edits.items()}
        lamps.show(edits)
    return edits


def show_textures(renderer: Renderer, textures: Mapping[str, str | ImageTexture]) -> None:
    """Show textures by material, images with their paths."""
    scene = renderer.scene.record.materials
    renderer.resources.show_textures({name: Look(scene[name], of) for name, of in textures.items()})
