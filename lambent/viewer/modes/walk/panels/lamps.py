"""The Lamps panel: position, aim and photometric file of a lamp, and marks of lamps over the picture."""

from __future__ import annotations

from dataclasses import replace

from imgui_bundle import imgui

from lambent.core.plain import triple
from lambent.core.views.camera import Camera
from lambent.viewer.modes.walk.light.lamps import Lamps, aim_of, tilt_and_bearing_deg
from lambent.viewer.modes.walk.markers import NEAR_M, projected
from lambent.viewer.panels.widgets import AMBER, buttons, choice, explain, path_field, shadowed, slider
from lambent.viewer.screen import Rect

NONE = "none"
STEP_M = 0.01
MARK_PX = 7.0


def draw(lamps: Lamps) -> None:
    lamps.wanted = True
    names = {lamps.name(record.number): record.number for record in lamps.records}
    now = NONE if lamps.chosen is None else lamps.name(lamps.chosen)
    chosen = choice("lamp", now, [NONE, *sorted(names)], "the lamp to edit; or click or drag its mark in the picture")
    lamps.chosen = names.get(chosen)
    if lamps.chosen is not None:
        _numbers(lamps, lamps.chosen)
        _actions(lamps, lamps.chosen)


def _numbers(lamps: Lamps, number: int) -> None:
    lamp = lamps.of(number)
    moved, place = imgui.drag_float3("position", list(lamp.position), STEP_M, format="%.3f m")
    explain("x, y (up), z of the photometric centre; Ctrl+click to type")
    tilt, bearing = tilt_and_bearing_deg(lamp.aim)
    aimed = (
        slider("tilt", tilt, 0.0, 180.0, "angle of the axis from straight down", unit=" deg"),
        slider("bearing", bearing, -180.0, 180.0, "direction of a tilted axis, from -z towards +x", unit=" deg"),
    )
    turn = slider("rotation", lamp.rotation_deg, -180.0, 180.0, "rotation of the luminaire about its axis", unit=" deg")
    aim = aim_of(*aimed) if aimed != (tilt, bearing) else lamp.aim
    edit = replace(lamp, position=triple(place) if moved else lamp.position, aim=aim, rotation_deg=turn)
    if edit != lamp:
        lamps.edits.edit_lamp(number, edit)


def _actions(lamps: Lamps, number: int) -> None:
    hint, meaning = "luminaire.ies", "path of an IES or EULUMDAT file (or drop it on the window): its flux, this colour"
    lamps.typed, entered = path_field("luminaire", lamps.typed, "exchange", hint, meaning)
    if entered:
        lamps.exchange(lamps.typed)
    if file := lamps.of(number).file:
        imgui.text_disabled(file.rpartition("/")[2])
    edited = number in lamps.edits.room.lamps

    def aim() -> None:
        lamps.aiming = not lamps.aiming

    buttons([
        ("click the target" if lamps.aiming else "aim", True, aim, "aims the lamp at the next clicked point"),
        ("reset lamp", edited, lamps.reset, "returns the lamp to the bake"),
    ])  # fmt: skip


def draw_over(lamps: Lamps, camera: Camera, picture: Rect) -> None:
    """Draw marks of lamps while the panel is open."""
    lamps.shown, lamps.wanted = lamps.wanted, False
    if not lamps.shown:
        return
    lines = imgui.get_background_draw_list()
    places, depths_m = projected(camera, lamps.places, (max(1, picture.width), max(1, picture.height)))
    for record, (x, y), depth_m in zip(lamps.records, places.tolist(), depths_m, strict=True):
        if depth_m > NEAR_M and 0 <= x <= 1 and 0 <= y <= 1:
            at, is_chosen = picture.point(x, y), record.number == lamps.chosen
            lines.add_circle(at, MARK_PX + 1, imgui.get_color_u32((0, 0, 0, 0.8)), 0, 1.5)
            (lines.add_circle_filled if is_chosen else lines.add_circle)(at, MARK_PX, imgui.get_color_u32(AMBER))
            if is_chosen:
                shadowed(lines, (at[0] + 12, at[1] - 8), lamps.name(record.number), AMBER)
