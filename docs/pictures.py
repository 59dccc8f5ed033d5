"""Makes the pictures of the README from what the demo wrote, those of the scenes to edit by path tracing, and those of
edits from their transport.

python3 run.py demo --headless && .venv/bin/python docs/pictures.py [out/demo]
.venv/bin/python docs/pictures.py scenes [NAME...]
.venv/bin/python docs/pictures.py edit
.venv/bin/python docs/pictures.py interreflections
.venv/bin/python docs/pictures.py light-fields
.venv/bin/python docs/pictures.py light-groups [STORE]
.venv/bin/python docs/pictures.py window [STORE]              # needs Xvfb, xdotool and xprop
"""

from __future__ import annotations

import itertools
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

from lambent.core.light.colour import filmic, srgb_encode
from lambent.core.light.exposure import exposure_of
from lambent.core.pictures import metrics
from lambent.core.pictures.images import read_encoded, read_image, to_bytes

if TYPE_CHECKING:
    from lambent.baked.light_fields.light_field import LightField
    from lambent.bench.scenes.light_field_view import LightFieldView

PICTURES = Path(__file__).parent / "pictures"
sys.path.insert(0, str(PICTURES.parents[1]))  # for the driver of windows, which the tests have
LIMIT_BYTES = 300_000
EXPOSURE_EV = exposure_of(11.1)  # of the built-in room
SCENES = {
    "teatray": (512, 512),
    "earrings": (512, 512),
    "cornell": (450, 450),
    "vase": (512, 512),
    "loft": (640, 480),
    "ring": (400, 400),
    "pavilion": (640, 480),
}


def main(demo: Path) -> None:
    PICTURES.mkdir(exist_ok=True)
    for name, number in (("room", 1), ("sphere", 5), ("screen", 8)):
        save(f"{name}.jpg", shown(demo / f"walk_{number}.png"), width=1120)
    views = [radiance(demo / "compare" / f"{name}.exr") for name in ("moving", "path")]
    save("compare.jpg", np.concatenate([*views, shown(demo / "compare" / "moving.png")], axis=1), width=1680)
    save("fit.jpg", shown(demo / "materials" / "brushed_aluminium_polar.png"), width=1400)


def scenes(names: Sequence[str], samples: int = 1024) -> None:
    """Path trace scenes for editing by their cameras, in the sizes of the published pictures; all without names."""
    from lambent.baking.engine import engine
    from lambent.baking.reference.path_traced import render_reference
    from lambent.scenes.loaders.load import load_scene

    engine()
    for name in names or SCENES:
        scene = load_scene(f"builtin:{name}")
        width, height = SCENES[name]
        image, _ = render_reference(scene, scene.cameras[0], width, height, samples)
        save(f"{name}.jpg", to_bytes(srgb_encode(filmic(image, scene.exposure_ev))), width=width)


def edit() -> None:
    """The teapot of `builtin:teatray` before and after edits of its curves, 4000 lights."""
    from tempfile import TemporaryDirectory

    from lambent.baking.bake import bake
    from lambent.baking.quality import quality_named
    from lambent.baking.transport.view import View
    from lambent.editing.curves.nodes import Which, values_of, with_values
    from lambent.editing.session.session import Session
    from lambent.editing.stored import edited_picture
    from lambent.scenes.loaders.load import load_scene

    scene, which = load_scene("builtin:teatray"), Which("shape")
    glaze = scene.materials["glaze"]
    session = Session.new("builtin:teatray", scene.cameras[0], {"glaze": glaze})
    quality = quality_named("normal").changed("picture", visibility={"lights": (4000,)})
    with TemporaryDirectory() as folder:
        views = [View(scene.cameras[0], 512, 512)]
        picture = edited_picture(bake(scene, Path(folder), quality=quality, only={"transport"}, views=views), session)
        before = picture.image()
        values = values_of(glaze, which)
        values[10:14] += 0.016  # between 6 and 16 degrees
        session.change("glaze", with_values(glaze, which, values).model_copy(update={"kd": (0.22, 0.1, 0.05)}))
        picture.show("glaze", session.editable("glaze"))
        picture.draw()
        both = [to_bytes(srgb_encode(filmic(image, scene.exposure_ev))) for image in (before, picture.image())]
    save("edit.jpg", np.concatenate(both, axis=1), width=1024)


def interreflections(samples: int = 512) -> None:
    """`builtin:cornell` after edits: direct light, with interreflections, and path traced."""
    from tempfile import TemporaryDirectory

    from lambent.baking.bake import bake
    from lambent.baking.interreflection.settings import Bounces
    from lambent.baking.quality import quality_named
    from lambent.baking.reference.path_traced import render_reference
    from lambent.baking.transport.view import View
    from lambent.editing.curves.nodes import Which, values_of, with_values
    from lambent.editing.interreflection.stored import interreflections as stored
    from lambent.editing.interreflection.whole import WholePicture
    from lambent.editing.session.session import Session
    from lambent.editing.stored import edited_picture
    from lambent.scenes.loaders.load import load_scene

    scene, size = load_scene("builtin:cornell"), (450, 450)
    camera = scene.cameras[0]
    session = Session.new("builtin:cornell", camera, scene.materials, size=size)
    start = {name: session.editable(name) for name in scene.materials}
    quality = quality_named("normal").changed("picture", visibility={"lights": (1000,)})
    with TemporaryDirectory() as folder:
        store = bake(
            scene, Path(folder), quality=quality, only={"transport", "interreflection"}, views=[View(camera, *size)],
            bounces=Bounces((64, 1, 1, 1), samples),
        )  # fmt: skip
        whole = WholePicture(edited_picture(store, session))
        whole.give(stored(store, camera, size, start), start)
        for wall, kd in (("left_wall", (0.19, 0.26, 0.45)), ("right_wall", (0.63, 0.45, 0.07))):
            session.change(wall, scene.materials[wall].model_copy(update={"kd": kd}))
        values = values_of(scene.materials["floor"], Which("shape"))
        values[:8] += 0.35  # up to 9 degrees
        session.change("floor", with_values(scene.materials["floor"], Which("shape"), values))
        edited = {name: session.editable(name) for name in scene.materials}
        for name, material in edited.items():
            whole.show(name, material)
        whole.draw()
        views = [whole.direct.image(), whole.image()]
    views.append(render_reference(scene, camera, *size, samples, max_depth=4, edited=edited)[0])
    row = [to_bytes(srgb_encode(filmic(image, scene.exposure_ev))) for image in views]
    save("interreflections.jpg", np.concatenate(row, axis=1), width=1200)


LIGHTS = (  # of light-groups.jpg: as baked, without the sun, and by night
    ((), 0.0),
    (("sun=off",), 1.0),
    (("sun=off", "sky=0.01,12000K"), 3.0),
)


def light_groups(store: Path | None = None) -> None:
    """`builtin:room` in three mixes of its light groups, from one bake, each with the exposure that it needs."""
    from dataclasses import replace
    from tempfile import TemporaryDirectory

    from lambent.baking.bake import bake
    from lambent.core.light.light_mix import parse_light
    from lambent.render import Settings, images
    from lambent.scenes.loaders.load import load_scene
    from lambent.store.contract import scene_record
    from lambent.store.store import Store

    with TemporaryDirectory() as folder:
        opened = Store.open(store) if store else bake(load_scene("builtin:room"), Path(folder), light_groups="scene")
        camera = scene_record(opened).cameras[0]
        settings = Settings(560, 350, exposure_ev=EXPOSURE_EV)
        mixes = [replace(settings, light=parse_light(light), exposure_ev=EXPOSURE_EV + ev) for light, ev in LIGHTS]
        row = [images(opened, mix).displayed(camera) for mix in mixes]
    save("light-groups.jpg", np.concatenate(row, axis=1), width=1680)


WINDOW_SAMPLES = 6  # denoised, of the pictures at rest
WINDOWS = {  # by size: a key, a place to click, panels to open
    "show": ("1", None, ()),
    "design": ("2", (560, 560), ()),
    "measure": ("3", (300, 600), ("View", "Scene", "Light meter", "Statistics")),
}


def window(store: Path | None = None) -> None:
    """The sizes of the window on `builtin:room`: at 1280x800 here, at 2560x1600 and twice the scale in out/window.

    `store` was baked with light groups.
    """
    import shutil
    from tempfile import TemporaryDirectory

    from lambent.baking.bake import bake
    from lambent.core.light.light_mix import LightMix, parse_light
    from lambent.scenes.loaders.load import load_scene
    from lambent.store.kept.session import FILE, RoomState, WalkSession, write_session

    large = PICTURES.parents[1] / "out" / "window"
    large.mkdir(parents=True, exist_ok=True)
    states = {}
    for name, (light, _) in zip(("overcast", "night"), LIGHTS[1:], strict=True):
        mixes = {group: keys[0][1] for group, keys in parse_light(light).groups.items()}
        states[name] = RoomState(light=LightMix(mixes))
    with TemporaryDirectory() as folder:
        room = Path(folder) / "room.store"
        if store:
            shutil.copytree(store, room)
        else:
            bake(load_scene("builtin:room"), room, light_groups="scene").close()
        for size, ratio in itertools.product(WINDOWS, (1, 2)):
            write_session(room / FILE, WalkSession(states=states))
            picture = window_picture(room, Path(folder) / f"{size}-{ratio}", size, ratio)
            if ratio == 1:
                save(f"window-{size}.jpg", picture, width=1280)
            else:
                Image.fromarray(picture).save(large / f"window-{size}.png")


def window_picture(store: Path, out: Path, size: str, ratio: int) -> np.ndarray:
    """The window in a size, at rest, as (H, W, 3), with `ratio` pixels for one."""
    from tests.viewer.window_session import VirtualScreen, WindowSession

    out.mkdir()
    key, point, panels = WINDOWS[size]
    screen = VirtualScreen((1280 * ratio, 800 * ratio), dpi=96 * ratio)
    opened = WindowSession(screen, store, out, (1280, 800), settings={"size": size, "card_seen": True})
    try:
        opened.tool("key", key)
        if point:
            opened.click(*(ratio * at for at in point))
        for panel in panels:
            opened.click(*(ratio * at for at in opened.point(panel, 0.3)))
        opened.move(ratio * 640, ratio * 20)
        least = max(WINDOW_SAMPLES // ratio**2, 1)
        opened.wait_for(lambda state: int((re.findall(r"(\d+) sample", state["at_rest"]) or [0])[0]) >= least)
        opened.settle()
        return screen.picture()
    finally:
        opened.kill()
        screen.close()


def light_fields() -> None:
    """What the teapot of `builtin:pavilion` mirrors: one of its maps; by one map, by B_n, marched, and traced."""
    from tempfile import TemporaryDirectory

    from lambent.bench.oslf import FULL
    from lambent.bench.scenes.light_field_view import LightFieldView
    from lambent.scenes.loaders.load import load_scene

    with TemporaryDirectory() as folder:
        store = Path(folder) / "store"
        view = LightFieldView(load_scene(FULL.scene), FULL.object, 0, FULL.size, FULL.paths, store, FULL.quality)
        field, single = view.field(1156, 224, FULL.strata), view.single(224, FULL.strata)
        save("light-fields.jpg", light_field_row(view, field, single), width=1600)


def light_field_row(view: LightFieldView, field: LightField, single: LightField) -> np.ndarray:
    """The pictures of `light_fields` in a row, in a common exposure."""
    from lambent.bench.oslf import methods
    from lambent.bench.scenes.light_field_view import Compared

    compared = Compared.of(view.shown.pixel, view.size, view.truth)
    place = view.place(field)
    by_name = {m.name: m.radiance for m in methods(field, single, place, view)}
    lights = [by_name[name]() for name in ("single map", "B_n 4", "march 4, sky")] + [view.truth]
    row = [metrics.displayed(compared.image(light), compared.reference.exposure_ev) for light in lights]
    nearest = int(np.bincount(place.points[place.known]).argmax())  # the point that most pixels are near to
    one = metrics.displayed(field.radiance[nearest].astype(float), compared.reference.exposure_ev)
    side = row[0].shape[0]
    one = np.asarray(Image.fromarray(to_bytes(one)).resize((side, side), Image.Resampling.NEAREST))
    return np.concatenate([one, *map(to_bytes, row)], axis=1)


def shown(path: Path) -> np.ndarray:
    return to_bytes(read_encoded(path)[..., :3])


def radiance(path: Path) -> np.ndarray:
    return to_bytes(srgb_encode(filmic(read_image(path), EXPOSURE_EV)))


def save(name: str, picture: np.ndarray, width: int) -> None:
    image = Image.fromarray(picture)
    image = image.resize((width, round(image.height * width / image.width)), Image.Resampling.LANCZOS)
    path = PICTURES / name
    image.save(path, quality=88, optimize=True)
    assert path.stat().st_size < LIMIT_BYTES, f"{path}: {path.stat().st_size} bytes"
    print(path, path.stat().st_size)


if __name__ == "__main__":
    if sys.argv[1:2] == ["scenes"]:
        scenes(sys.argv[2:])
    elif sys.argv[1:] == ["edit"]:
        edit()
    elif sys.argv[1:] == ["interreflections"]:
        interreflections()
    elif sys.argv[1:] == ["light-fields"]:
        light_fields()
    elif sys.argv[1:2] == ["window"]:
        window(Path(sys.argv[2]) if len(sys.argv) > 2 else None)
    elif sys.argv[1:2] == ["light-groups"]:
        light_groups(Path(sys.argv[2]) if len(sys.argv) > 2 else None)
    else:
        main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("out/demo"))
