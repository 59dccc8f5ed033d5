"""Rows of edited views: frames of a drag on the graphics card, as the window draws them."""

from __future__ import annotations

import time
from collections.abc import Iterator
from functools import partial
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory

from lambent.bench.card_rows.effort import Effort
from lambent.bench.card_rows.row import THESIS_E, Figure, Published, Row, adapter_name, engine_name, median_ms
from lambent.bench.direct_edit import CASES, baked_view, drag
from lambent.bench.gi_edit import CASES as GI_CASES
from lambent.bench.gi_edit import Room, sharpest
from lambent.editing.interreflection.picture import FrozenPicture
from lambent.editing.interreflection.whole import WholePicture
from lambent.editing.session.session import Session
from lambent.editing.stored import edited_picture
from lambent.realtime.gpu.device import open_room_device
from lambent.scenes.loaders.load import load_scene
from lambent.viewer.edits.edited import ShadedCanvas

SCENE, BOX = "builtin:teatray", GI_CASES[0]
FEW_PX, FEW = 16, 16  # pixels a side, and lights or samples, of bakes that compile kernels


def direct(effort: Effort, work: Path) -> Iterator[Figure]:
    """Direct light: the bake of a view, frames of a drag, and a switch between curves."""
    engine, adapter = engine_name(), adapter_name()
    case, scene, size = CASES[SCENE], load_scene(SCENE), (effort.edit_px, effort.edit_px)
    start, said = scene.materials[case.material], f"{effort.edit_px} px, {effort.lights} lights"
    session = Session.new(SCENE, scene.cameras[0], {case.material: start}, size=size)
    with TemporaryDirectory(dir=work) as folder:
        baked_view(scene, Path(folder) / "warm", FEW, FEW_PX)
        began = time.perf_counter()
        store = baked_view(scene, Path(folder) / "view", effort.lights, effort.edit_px)
        yield Figure(f"{said}, bake", time.perf_counter() - began, "s", engine)
        picture = edited_picture(store, session, partial(ShadedCanvas, open_room_device()))
    canvas = picture.canvas
    states = list(islice(drag(start), effort.rounds + 1))  # curves are made before their frames
    assert isinstance(canvas, ShadedCanvas)

    def frame(k: int) -> None:
        picture.show(case.material, states[k])
        picture.step()
        picture.compose()
        canvas.finish()

    def switch(k: int) -> None:
        picture.activate(case.material, case.curves[k % 2])
        picture.compose()
        canvas.finish()

    yield Figure(f"{said}, frame of a drag", median_ms(frame, effort.rounds), "ms", adapter)
    yield Figure(f"{said}, switch of curves", median_ms(switch, effort.rounds), "ms", adapter)


def interreflections(effort: Effort, work: Path) -> Iterator[Figure]:
    """The Cornell box: the bake, extrapolated to the published samples; freezing a material; frames of a drag."""
    engine, adapter = engine_name(), adapter_name()
    width, height = (edge // effort.shrink for edge in BOX.size)
    said = f"{width}x{height}"
    with TemporaryDirectory(dir=work) as folder:
        Room(BOX, (FEW_PX, FEW_PX), Path(folder) / "warm", FEW).bake(BOX.series, FEW)
        room = Room(BOX, (width, height), Path(folder) / "view", effort.lights)
        seconds = room.bake(BOX.series, effort.samples)
        yield Figure(
            f"{said}, bake, {BOX.published} samples", seconds * BOX.published / effort.samples / 60, "min", engine
        )
        light, device = room.light(), open_room_device()
        whole = WholePicture(edited_picture(room.store, room.session, partial(ShadedCanvas, device)))
        whole.give(light, room.start)
    canvas, material = whole.direct.canvas, BOX.material
    assert isinstance(canvas, ShadedCanvas)

    def freeze(k: int) -> None:
        FrozenPicture(light, room.start, material, canvas, {sharpest(light.parts[material])})
        canvas.finish()

    yield Figure(f"{said}, freezing a material", median_ms(freeze, 1) / 1e3, "s", adapter)
    whole.draw()
    whole.activate(material, next(name for name in room.start[material].curves if "highlight" in name))
    whole.draw()
    states = list(islice(drag(room.scene.materials[material]), effort.rounds + 1))

    def frame(k: int) -> None:
        whole.show(material, states[k])
        whole.step()
        whole.compose()
        canvas.finish()

    yield Figure(f"{said}, frame of a drag", median_ms(frame, effort.rounds), "ms", adapter)
    whole.close()


DIRECT = {
    "512 px, 4000 lights, bake": Published("1020", THESIS_E),
    "512 px, 4000 lights, frame of a drag": Published("40", THESIS_E),
    "512 px, 4000 lights, switch of curves": Published("300 to 2300", THESIS_E),
}
INDIRECT = {
    f"450x450, bake, {BOX.published} samples": Published("358", THESIS_E),
    "450x450, freezing a material": Published("10", THESIS_E),
    "450x450, frame of a drag": Published("45", THESIS_E),
}
ROWS = {
    "edited view, direct": Row(direct, 60, 7, DIRECT),
    "edited view, interreflections": Row(interreflections, 80, 8, INDIRECT),
}
