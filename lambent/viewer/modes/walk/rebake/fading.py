"""Blends rebaked light into a lane's picture, one step per frame, each prepared in a thread."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor

from lambent.core.light.light_mix import Factors
from lambent.core.views.camera import Camera
from lambent.realtime.light.group_arrays import GroupArrays
from lambent.realtime.resources import SceneResources
from lambent.viewer.modes.walk.lanes import Lane
from lambent.viewer.modes.walk.rebake.rebaked_light import Rebaked, Step, probe_users, steps


class Fade:
    """Blend from the light of a lane to the arrived light of a bake.

    Attributes
    ----------
    lane : Lane
    shown : Rebaked or None
        Light in the picture, or being blended in.
    """

    def __init__(self, lane: Lane, light: Factors) -> None:
        self.lane, self._light = lane, dict(light)
        self.shown: Rebaked | None = None
        self._room, self._answered = lane.room, lane.shown.on
        self._before = list(self._resources.light_layers), [item.light for item in self._resources.objects]
        self._thread = ThreadPoolExecutor(1, "rebaked")
        self._next: Future[Step | None] | None = None  # None: nothing is blended

    def bring(self, rebaked: Rebaked, camera: Camera, size: tuple[int, int]) -> None:
        """Start to blend in the light that arrived since `shown`, in the order seen by a camera at picture `size`."""
        assert not self.moves, "one after the other"
        scene = self.lane.renderer.scene
        self._steps = steps(rebaked, self.shown, scene, self._resources, self._light, camera, size)
        self.shown = rebaked
        self._next = self._thread.submit(next, self._steps, None)

    @property
    def moves(self) -> bool:
        """Whether light is being blended."""
        return self._next is not None

    @property
    def done(self) -> bool:
        """Whether all light of the bake is in the picture."""
        return not self.moves and self.shown is not None and self.shown.arrived.whole

    @property
    def left(self) -> tuple[str, ...]:
        """Objects without a probe in the bake; they keep their light."""
        scene, resources = self.lane.renderer.scene, self._resources
        owners = probe_users(scene, resources, range(len(resources.objects)))
        return tuple(name for name in owners if self.shown is None or name not in self.shown.scene.probes)

    @property
    def _resources(self) -> SceneResources:
        return self.lane.renderer.resources

    @property
    def _groups(self) -> GroupArrays | None:
        """The bake's light by group, if the scene has light groups."""
        return None if self.shown is None or self.lane.renderer.scene.groups is None else self.shown.scene.groups

    def serves(self, lane: Lane, light: Factors) -> bool:
        """Whether this light applies to the lane's state; once complete, it serves every light mix."""
        same_mix = light == self._light or (self.done and self._groups is not None)
        state = lane.room.model_copy(update={"light": self._room.light})
        same_lane = lane is self.lane and lane.shown.on == self._answered
        return same_lane and state == self._room and same_mix

    def step(self) -> None:
        """Upload the next step if the thread has prepared it."""
        if self._next is None or not self._next.done():
            return
        upload = self._next.result()
        if upload is not None:
            upload(self._resources)
            self._resources.light_version += 1
            self._next = self._thread.submit(next, self._steps, None)
            return
        self._next = None
        if self.done and (groups := self._groups) is not None:
            self.lane.renderer.mixer.answer(groups)

    @property
    def _answers(self) -> bool:
        """Whether the lane has estimated light for its edits."""
        return self.lane.answering is not None and self.lane.shown.possible and self._answered

    def end(self) -> None:
        """Return the lane to its own light.

        Complete light stays until that light changes, because it may belong to the state on the other side. Without an
        answer to its edits, the lane shows its earlier light.
        """
        self._thread.shutdown(cancel_futures=True)
        lane, own = self.lane, self.lane.renderer.scene.groups
        if self._answers:
            if not self.done and lane.answering is not None:
                lane.answering.again()
        elif own is not None:
            lane.renderer.mixer.answer(own)
        else:
            layers, lights = self._before
            self._resources.show_light_map(layers)
            for item, light in zip(self._resources.objects, lights, strict=True):
                item.relight(light, item.emission)
            self._resources.light_version += 1
