"""Lamps that were moved, aimed or exchanged: their records, profiles, and shadow maps drawn anew."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.geometry.cubemap import faces_at
from lambent.core.plain import triple
from lambent.realtime.gpu.layouts import Layouts
from lambent.realtime.gpu.pipelines import cover, screen_pipeline
from lambent.realtime.lamps.drawn import DrawnLamps, ShadowedLamp
from lambent.realtime.sun.solid_depths import SolidDepths, depth_texture
from lambent.scenes.lamp_edits import LampEdit, exchanged
from lambent.scenes.photometry.distribution import Photometry
from lambent.scenes.photometry.luminous_surfaces import placement
from lambent.scenes.scene import IesLight
from lambent.store.lamp_discs import profile, reach_deg
from lambent.store.lamps import LampRecord

NEAR_M = 1e-3  # a lamp's own socket, nearer than this, casts no shadow
FACE = 1024  # texels along a face of the cube: as wide as those of a disc for a hemisphere, or narrower
FOCAL = 1 - 4 / FACE
EVENLY = Photometry((0.0, 180.0), (0.0, 360.0), ((1.0, 1.0), (1.0, 1.0)))
Profile = NDArray[np.float16]


def as_baked(record: LampRecord) -> LampEdit:
    """The edit that leaves a lamp as it is."""
    light = IesLight(record.position, EVENLY, (1.0, 1.0, 1.0), record.axes[2]).turned_to(np.array(record.axes[0]))
    return LampEdit(record.position, record.axes[2], light.rotation_deg)


def changed(record: LampRecord, edit: LampEdit, unit: float) -> tuple[LampRecord, Profile | None]:
    """The record after an edit, in units of the scene, and the profile of the edit's file, if it has one.

    Raises
    ------
    UserError
        If the file cannot be read.
    """
    placed = IesLight(edit.position, EVENLY, (1.0, 1.0, 1.0), edit.axis, edit.rotation_deg)
    update: dict[str, Any] = {"position": edit.position, "axes": tuple(map(triple, placed.axes))}
    shape = None
    if edit.file:
        light = exchanged(edit, record.intensity)
        shape, intensity = _profile_of(light)
        update |= {"intensity": triple(intensity / unit), "reach_deg": reach_deg(light)}
    return record.model_copy(update=update), shape


@cache
def _unit_profile(photometry: Photometry) -> tuple[Profile, float]:
    shape, most = profile(IesLight((0.0, 0.0, 0.0), photometry, (1.0, 1.0, 1.0)))
    return shape, float(most[0])


def _profile_of(light: IesLight) -> tuple[Profile, Floats]:
    shape, most = _unit_profile(light.photometry)
    return shape, np.array(light.scale) * most


def faces(record: LampRecord) -> Iterator[tuple[int, Floats]]:
    """Faces of a cube around a lamp, in its axes, that its light may reach: number, and clip from world (4, 4)."""
    axes, position = np.array(record.axes), np.array(record.position)
    middle = faces_at(0.0, 0.0)
    for number, (right, below) in enumerate(zip(faces_at(1.0, 0.0), faces_at(0.0, 1.0), strict=True)):
        forward = np.array(middle[number])
        widest = np.cos(np.radians(min(record.reach_deg + 56.0, 180.0)))  # a corner is 54.7 degrees off the middle
        if forward[2] < widest:
            continue
        rows = np.array([FOCAL * (np.array(right) - forward), -FOCAL * (np.array(below) - forward), forward]) @ axes
        clip = np.zeros((4, 4))
        clip[[0, 1, 3], :3] = rows
        clip[:, 3] = -clip[:, :3] @ position
        clip[2, 3] = NEAR_M
        yield number, clip


class ChangedLamps:
    """Shows edits of the lamps of `resources`, a `SceneResources`."""

    def __init__(self, layouts: Layouts, resources: Any) -> None:
        self._layouts, self._resources = layouts, resources
        self._drawn: DrawnLamps | None = resources.scene.lamps
        self._edits: dict[int, LampEdit] = {}
        self._shadows: dict[int, object] = {}  # place and reach of the drawn shadow maps, by place in the records

    def show(self, edits: Mapping[int, LampEdit]) -> None:
        """Show these edits of lamps by their number in the scene; those left out, or not drawn, are as baked.

        Raises
        ------
        UserError
            If a file cannot be read; then nothing changes.
        """
        if self._drawn is None or edits == self._edits:
            return
        records, profiles = list(self._drawn.records), list[Profile]()
        mine = {place: edits[record.number] for place, record in enumerate(records) if record.number in edits}
        for place, edit in mine.items():
            records[place], shape = changed(records[place], edit, self._resources.scene.unit)
            if shape is not None:
                number = len(self._drawn.profiles) + len(profiles)
                records[place] = records[place].model_copy(update={"profile": number})
                profiles.append(shape)
        for place in {*mine, *self._shadows}:
            self._move_opening(place, records[place])
        self._edits, lamps = dict(edits), self._resources.lamps
        if lamps.change(replace(self._drawn, records=tuple(records)), profiles, frozenset(mine)):
            self._shadows = {}
        for place in self._shadows.keys() - mine.keys():
            lamps.restore(place)
            del self._shadows[place]
        for place in mine:
            if self._shadows.get(place) != (of := _shadow_key(records[place])):
                self._shadows[place] = of
                self._draw(records[place], lamps.disc(place))
        self._resources.light_version += 1

    def _move_opening(self, place: int, now: LampRecord) -> None:
        assert self._drawn is not None, "there are lamps"
        baked = self._drawn.records[place]
        before = placement(baked.axes, baked.position)
        moved = placement(now.axes, now.position) @ np.linalg.inv(before) @ np.array(baked.moved or np.eye(4))
        for item in self._resources.objects:
            if item.lamp == place + 1:
                self._resources.move(item.record, moved)

    def pairs(self) -> list[tuple[ShadowedLamp, ShadowedLamp]]:
        """The edited lamps as baked and as they are; waits for the GPU."""
        drawn, lamps = self._drawn, self._resources.lamps
        if drawn is None:
            return []
        return [
            (ShadowedLamp(was, drawn.profiles[was.profile], drawn.distances[k]), lamps.shadowed(k))
            for k, was in enumerate(drawn.records) if k in self._shadows
        ]  # fmt: skip

    @cached_property
    def _solid(self) -> SolidDepths:
        openings = {item.record.material for item in self._resources.objects if item.record.luminaire is not None}
        return SolidDepths(self._layouts, self._resources, openings)

    @cached_property
    def _pipeline(self) -> Any:
        return screen_pipeline(
            self._layouts.device, "lamp_shadow", [self._layouts.of("uniform", "depth layers")], ["r16float"]
        )

    @cached_property
    def _depths(self) -> Any:
        return depth_texture(self._layouts.device, FACE, FACE, 6)

    def _draw(self, record: LampRecord, disc: Any) -> None:
        """Draw a lamp's shadow map into the view of its disc."""
        layouts, encoder = self._layouts, self._layouts.device.create_command_encoder()
        for face, clip in faces(record):
            view = self._depths.create_view(dimension="2d", base_array_layer=face, array_layer_count=1)
            self._solid.draw(encoder, view, clip)
        numbers = np.array([np.sin(np.radians(record.reach_deg) / 2), NEAR_M, FOCAL, 0.0], np.float32)
        group = layouts.group(
            layouts.of("uniform", "depth layers"), layouts.buffer("UNIFORM", numbers),
            self._depths.create_view(dimension="2d-array"),
        )  # fmt: skip
        cover(encoder, [disc], self._pipeline, [group], {})
        layouts.device.queue.submit([encoder.finish()])


def _shadow_key(record: LampRecord) -> object:
    return record.position, record.axes, record.reach_deg
