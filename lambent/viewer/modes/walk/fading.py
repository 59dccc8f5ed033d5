"""Light that was baked anew going over into a lane's picture, a step a frame, each made in a thread beforehand."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor

from lambent.core.camera import Camera
from lambent.core.light_mix import Factors
from lambent.realtime.group_arrays import GroupArrays
from lambent.realtime.resources import SceneResources
from lambent.viewer.modes.walk.lanes import Lane
from lambent.viewer.modes.walk.rebaked_light import Rebaked, Step, probe_users, steps


class Fade:
    """From what a lane shows to the light of a bake; seen by a camera in a picture of `size`.

    Attributes
    ----------
    lane : Lane
    done : bool
        Whether all of it is in the picture.
    left : tuple of str
        Objects whose probes the bake does not have: they stay as they were.
    """

    def __init__(self, rebaked: Rebaked, lane: Lane, light: Factors, camera: Camera, size: tuple[int, int]) -> None:
        self.lane, self.done, self._light, self._rebaked = lane, False, dict(light), rebaked
        self._room, self._answered = lane.room, lane.shown.on
        resources, scene = self._resources, lane.renderer.scene
        self._before = list(resources.light_layers), [item.light for item in resources.objects]
        owners = probe_users(scene, resources, range(len(resources.objects)))
        self.left = tuple(name for name in owners if name not in rebaked.scene.probes)
        self._steps = steps(rebaked, scene, resources, light, camera, size)
        self._thread = ThreadPoolExecutor(1, "rebaked")
        self._next: Future[Step | None] = self._thread.submit(next, self._steps, None)

    @property
    def _resources(self) -> SceneResources:
        return self.lane.renderer.resources

    @property
    def _groups(self) -> GroupArrays | None:
        """Light by group of the bake, where the scene has light groups, too."""
        return None if self.lane.renderer.scene.groups is None else self._rebaked.scene.groups

    def serves(self, lane: Lane, light: Factors) -> bool:
        """Whether this is the light of what the lane shows; once it is there, mixes of its light groups are, too."""
        same_mix = light == self._light or (self.done and self._groups is not None)
        worn = lane.room.materials, lane.room.textures
        same_lane = lane is self.lane and lane.shown.on == self._answered
        return same_lane and worn == (self._room.materials, self._room.textures) and same_mix

    def step(self) -> None:
        """Upload what is ready; nothing where the thread is not done with it."""
        if self.done or not self._next.done():
            return
        upload = self._next.result()
        if upload is not None:
            upload(self._resources)
            self._resources.light_version += 1
            self._next = self._thread.submit(next, self._steps, None)
            return
        self.done = True
        self._thread.shutdown()
        if (groups := self._groups) is not None:
            self.lane.renderer.mixer.answer(groups)

    @property
    def _answers(self) -> bool:
        """Whether light followed edits of the lane by itself before."""
        return self.lane.answering is not None and self.lane.shown.possible and self._answered

    def end(self) -> None:
        """Leave the lane to its own light.

        What is whole stays until that changes: it may be the light of a state that is beside now. Where edits have no
        answer, the lane shows what it did before.
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
