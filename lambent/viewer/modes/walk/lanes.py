"""A lane: a renderer with baked light of its own, its picture, and the light that answers in it.

The room that is edited has one. A state that is shown beside it has another, because light maps and probes of two
states differ; geometry and textures are on the GPU twice then. When the two states change places the lanes do, too, so
that nothing is computed again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from lambent.core.plain import Triple
from lambent.realtime.frame_state import FrameState
from lambent.realtime.renderer import Renderer
from lambent.scenes.scene import Look
from lambent.store.session import RoomState
from lambent.viewer.modes.walk.answering import Answering, AnsweringLight
from lambent.viewer.picture import Picture
from lambent.viewer.screen import Screen

MIX_S = 0.01  # between two looks at a mix of light that is being made
ANSWER_S = 0.01  # between two looks at light that is being computed


@dataclass
class Lane:
    """See the module. `room` is the state that was drawn last."""

    renderer: Renderer
    picture: Picture
    answering: AnsweringLight | None
    shown: Answering
    room: RoomState = field(default_factory=RoomState)

    @classmethod
    def of(cls, renderer: Renderer, screen: Screen, answering: AnsweringLight | None, shown: Answering) -> Lane:
        """Frames do not wait for maps: the picture is drawn again when they are there."""
        renderer.waits = False
        return cls(renderer, Picture(renderer, screen), answering, shown)

    def another(self, screen: Screen) -> Lane:
        """A lane of the same scene, in light as baked."""
        renderer = Renderer(self.renderer.device, self.renderer.scene, kin=self.renderer)
        shown = Answering()
        answering = None if self.answering is None else self.answering.another(renderer, shown)
        return Lane.of(renderer, screen, answering, shown)

    def answer(self, room: RoomState) -> None:
        """Wear the textures of this state, and bring its light a step nearer."""
        if room.textures != self.room.textures:
            dress(self.renderer, room)
        self.room = room
        if self.answering is not None:
            self.answering.update(room.materials)

    def frame(self, wanted: FrameState, light: Mapping[str, Triple]) -> FrameState:
        """A frame of this lane's state, in the mix of these factors of light groups."""
        renderer = self.renderer
        return replace(
            wanted, materials=dict(self.room.materials), maps=renderer.light_version, light=dict(light),
            mixed=renderer.mixer.version,
        )  # fmt: skip

    @property
    def busy(self) -> bool:
        """Whether light is being computed that the picture does not have yet."""
        return self.renderer.mixer.busy or (self.answering is not None and self.answering.busy)

    def wait_s(self) -> float | None:
        """Seconds until more of its light may be there; None: never."""
        if self.renderer.mixer.busy:
            return MIX_S
        return ANSWER_S if self.answering is not None and self.answering.busy else None

    def close(self) -> None:
        """Stop computing light."""
        if self.answering is not None:
            self.answering.close()

    def lend_light(self, other: Renderer) -> None:
        """Let another renderer of the scene, with light of its own, show the state of this lane in any mix."""
        dress(other, self.room)
        if (groups := self.renderer.mixer.groups) is not None:
            other.mixer.answer(groups)


def dress(renderer: Renderer, room: RoomState) -> None:
    """Show the textures that a state wears."""
    scene = renderer.scene.record.materials
    renderer.resources.dress({name: Look(scene[name], of) for name, of in room.textures.items()})
