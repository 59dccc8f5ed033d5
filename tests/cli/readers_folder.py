"""A folder of small files under the names that the documentation uses: measurements, materials, a room, its store."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image
from trimesh.creation import icosphere

from lambent.baking.bake import bake
from lambent.core.pictures.images import write_image
from lambent.core.views.camera import CameraPath
from lambent.demo.flow import DRAFT, SPECIMEN_OF
from lambent.editing.session.session import Session
from lambent.materials.document import Lobe, Material
from lambent.materials.measured.inspecting.synthetic import Setup, synthesise
from lambent.materials.measured.parts.gonio_text import write_gonio
from lambent.scenes.loaders.load import load_scene
from lambent.store.kept.session import FILE as SESSION
from lambent.store.kept.session import RoomState, WalkSession, write_session
from lambent.store.kept.views import Views, change_views
from tests.generated.rooms import adding_to, between, saved
from tests.materials.measured.measured_files import merl_bytes

COARSE = DRAFT.changed(
    "coarse",
    geometry={"texels": 64},
    light_map={"samples": (4, 4), "noise": 9.0, "max_depth": 3, "gather_samples": 0},
    environment={"texels": 32},
    probe={"texels": 16, "samples": 1},
    answer={"patches": 48, "gather_rays": 64, "direct_samples": 8},
    light_field={"points": 25, "texels": 30},
    relighting={"depth": 2, "samples": 8, "paths": 8},
)
BRUSHED = Material(name="brushed", kd=0.05, lobes=(Lobe(k=0.9, mx=0.15, my=0.15, r0=0.9, alpha=0.5),))
KEYS = [([0.4, 1.6, 1.4], [0.0, 1.0, -1.0]), ([-0.4, 1.5, 1.2], [0.2, 0.9, -1.0]), ([0.0, 1.4, 0.9], [0.0, 0.8, -1.0])]
ROOM = """format = "lambent-scene"
version = 1
name = "room"
geometry = "room.glb"
exposure_ev100 = 9.0

[environment]
kind = "sunsky"
sun_direction = [0.5, 0.6, 0.6]

[materials.brushed_aluminium]
lobes = [{ mx = 0.05, my = 0.2, r0 = 0.9 }]

[materials.copper]
lobes = [{ mx = 0.13, my = 0.13, r0 = [0.95, 0.64, 0.54] }]

[materials]
wall_paint = { kd = 0.8 }
oak = { kd = [0.4, 0.27, 0.155] }
dark_oak = { kd = [0.12, 0.08, 0.05] }
tiles = { kd = 0.5 }
rug = { kd = [0.4, 0.2, 0.2] }
floor = { kd = 0.4 }

[assign]
"*" = "floor"
"wall*" = "wall_paint"
"chair_*" = "oak"
"bowl" = "copper"
"teapot" = "brushed_aluminium"
"floor" = "tiles"
"mat" = "rug"

[objects.lamp]
lumens = 600.0

[objects.teapot]
light_field = { volume = true, points = 9, texels = 14 }

[[light_groups]]
name = "reading"
members = ["lamp"]

[[grids]]
name = "desks"
object = "floor"
spacing_m = 1.5

[[variants]]
name = "evening"
light = { sun = "off", sky = "off" }

[[variants]]
name = "day"
materials.oak.use = "dark_oak"
"""


def furnish(folder: Path) -> None:
    """Write the files; the room is a closed box of 3 x 2.5 x 3 m with a window."""
    (folder / "out/demo/measured").mkdir(parents=True)
    (folder / "lambent/scenes/builtin").mkdir(parents=True)
    _materials(folder)
    _pictures(folder)
    _room(folder)


def bake_store(folder: Path) -> None:
    """Bake room.toml into room.store, as a window leaves it: a saved view, a recorded walk, a stored state."""
    bake(load_scene(str(folder / "room.toml")), folder / "room.store", quality=COARSE, light_groups="scene").close()
    camera = load_scene(str(folder / "room.toml")).cameras[0]
    view = replace(camera, name="view 1")
    walk = CameraPath(name="walk 1", keys=(camera, view), seconds=0.1, times_s=(0.0, 0.1))
    change_views(folder / "room.store", lambda views: Views(cameras=(view,), paths=(walk,)))
    write_session(folder / "room.store" / SESSION, WalkSession(states={"before": RoomState()}))


def _materials(folder: Path) -> None:
    table = synthesise(BRUSHED, Setup((0.0, 30.0, 60.0), step_deg=30, fine_deg=10, noise=0, floor=0))
    for name in (*(f"out/demo/measured/{name}.txt" for name in SPECIMEN_OF), "brushed.bsdf", "oak.bsdf", "satin.bsdf"):
        write_gonio(folder / name, table)
    for name in ("brushed", "copper", "slate", "satin"):
        BRUSHED.save(folder / f"{name}.json")
    view = load_scene("builtin:teatray")
    edits = Session.new("builtin:teatray", view.cameras[0], {"nickel": view.materials["nickel"]}, size=(320, 240))
    edits.save(folder / "tray.edits.json")
    peak = 0.1 + 20 * np.exp(-((np.arange(18) / 3.6) ** 2))  # over theta_h
    (folder / "chrome.binary").write_bytes(merl_bytes(np.broadcast_to(peak[:, None, None, None], (18, 18, 36, 3))))


def _pictures(folder: Path) -> None:
    rows = np.arange(64)[:, None, None] // 8 % 2 * np.full((64, 64, 3), 120)
    for name in ("bricks.jpg", "weave.jpg"):
        Image.fromarray((60 + rows).astype(np.uint8)).save(folder / name)
    sky = np.linspace(2.0, 0.2, 32, dtype=np.float32)[:, None, None] * np.ones((32, 64, 3), np.float32)
    for name in ("sky.hdr", "grace.hdr"):
        write_image(folder / name, sky)


def _room(folder: Path) -> None:
    scene = trimesh.Scene()
    add = adding_to(scene)
    add(between((-1.5, -0.1, -1.5), (1.5, 0, 1.5)), "floor")
    add(between((-1.5, 2.5, -1.5), (1.5, 2.6, 1.5)), "wall_top")
    for side, name in ((-1, "west"), (1, "east")):
        add(between((side * 1.55 - 0.05, 0, -1.5), (side * 1.55 + 0.05, 2.5, 1.5)), f"wall_{name}")
    add(between((-1.5, 0, -1.6), (1.5, 2.5, -1.5)), "wall_north")
    add(between((-1.5, 0, 1.5), (1.5, 1.7, 1.6)), "wall_south")  # a window above it
    add(between((-0.4, 0, -0.9), (0.4, 0.7, -0.3)), "chair_1")
    add(between((-0.4, 0.001, 0.2), (0.4, 0.02, 0.8)), "mat")
    add(between((0.9, 1.6, -1.3), (1.1, 1.8, -1.1)), "lamp")
    for name, x in (("teapot", -0.2), ("bowl", 0.2)):
        add(icosphere(2, 0.15), name, (x, 0.851, -0.6))
    cameras = "".join(
        f'\n[[cameras]]\nname = "{name}"\nposition = {at}\ntarget = {to}\nfov_y_deg = 60.0\n'
        for name, (at, to) in zip(("entrance", "table"), KEYS, strict=False)
    )
    keys = ", ".join(f"{{ position = {at}, target = {to} }}" for at, to in KEYS)
    paths = "".join(f'\n[[paths]]\nname = "{name}"\nseconds = 0.1\nkeys = [{keys}]\n' for name in ("walk", "tour"))
    saved(scene, "room", folder, ROOM + cameras + paths)
    (folder / "scene.toml").rename(folder / "room.toml")
    shutil.copy(folder / "room.toml", folder / "lambent/scenes/builtin/room.toml")
    shutil.copy(folder / "room.glb", folder / "house.glb")
    for sample in (Path(__file__).parents[2] / "docs/tutorials/files").iterdir():
        shutil.copy(sample, folder / sample.name)
    (folder / "vase.obj").write_text(trimesh.exchange.obj.export_obj(icosphere(2, 0.2)))
