"""Unseen surfaces: flush sheets, odd uv and textures, extreme materials, measured tables, odd cameras."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image

import lambent
from lambent.materials.document import Material
from tests.generated.light import lit
from tests.generated.measurements import ANGLES, GLOSSY, damaged, grid, measured, written
from tests.generated.rooms import between
from tests.generated.written import Look, Piece, Room, glb, lamp, metallic, panel


def flush(folder: Path) -> Path:
    """Pictures on the back wall at 0, .1 and 1 mm from it, and a rug in the floor."""
    room = lit("flush", assign={"picture*": "red", "rug*": "red"})
    for number, gap in enumerate((0.0, 0.0001, 0.001)):
        x = -1.4 + 0.9 * number
        room.add(between((x, 1.2, -2.5 + gap), (x + 0.6, 1.8, -2.5 + gap)), f"picture_{number}")
        room.add(between((x, 0.7, -2.5), (x + 0.6, 1.0, -2.5 + max(gap, 1e-6))), f"picture_solid_{number}")
    room.add(between((-0.9, 0.0, 0.2), (0.9, 0.0, 1.4)), "rug")
    return room.written(folder)


def _textured(folder: Path, name: str, picture: Image.Image, uv: str) -> Path:
    """A room open to the sky, whose floor, wall and box have one image; `uv` is how they are laid out."""
    folder.mkdir(parents=True, exist_ok=True)
    picture.save(folder / "image.png", optimize=False)
    pieces = []
    for name_of, mesh in (
        ("floor", between((-2, -0.1, -2), (2, 0, 2))), ("wall", between((-2, 0, -2.1), (2, 2.4, -2))),
        ("box", between((-0.4, 0, -0.4), (0.4, 0.8, 0.4))),
    ):  # fmt: skip
        mesh.unmerge_vertices()
        normals = np.repeat(mesh.face_normals, 3, axis=0)
        axes = np.array([(2, 1), (0, 2), (0, 1)])[np.abs(normals).argmax(axis=1)]
        metres = np.take_along_axis(np.asarray(mesh.vertices), axes, axis=1)
        coordinates = {"huge": np.add(metres, (12345.0, -54321.0)), "zero": 0 * metres, "overlapping": metres % 1.0,
                       "metres": metres}[uv]  # fmt: skip
        pieces.append(Piece(name_of, mesh, 0, None, normals, coordinates))
    base = {"baseColorTexture": {"index": 0}, "roughnessFactor": 0.5, "metallicFactor": 0.0}
    return glb(folder / f"{name}.glb", pieces, [{"pbrMetallicRoughness": base}], images=[{"uri": "image.png"}],
               textures=[{"source": 0}])  # fmt: skip


def checks(side: int) -> Image.Image:
    cell = np.indices((side, side)).sum(axis=0) // max(side // 16, 1) % 2
    return Image.fromarray(np.array([[200, 190, 170], [60, 30, 25]], np.uint8)[cell])


def uv_huge(folder: Path) -> Path:
    """uv of 12,345 and -54,321 units, as of georeferenced models."""
    return _textured(folder, "uv_huge", checks(256), "huge")


def uv_zero(folder: Path) -> Path:
    """All uv are 0."""
    return _textured(folder, "uv_zero", checks(256), "zero")


def uv_overlapping(folder: Path) -> Path:
    """Every face has the same uv."""
    return _textured(folder, "uv_overlapping", checks(256), "overlapping")


def texture_8k(folder: Path) -> Path:
    """An image of 8192 x 8192."""
    return _textured(folder, "texture_8k", checks(8192), "metres")


def texture_1(folder: Path) -> Path:
    """An image of one pixel."""
    return _textured(folder, "texture_1", Image.new("RGB", (1, 1), (180, 90, 40)), "metres")


def _closed(folder: Path, name: str, wall: str) -> Path:
    room = Room(Look(name, {"walls": wall, "floors": wall}, more=lamp(400.0))).furnish()
    panel(room.add)
    return room.written(folder)


def albedo_one(folder: Path) -> Path:
    """A closed room whose walls reflect all light: it never ends."""
    return _closed(folder, "albedo_one", "kd = 1.0")


def mirror_box(folder: Path) -> Path:
    """A closed room of mirrors."""
    return _closed(folder, "mirror_box", "lobes = [{ mx = 0.001, my = 0.001, r0 = 0.97 }]")


def glass_stack(folder: Path) -> Path:
    """Five panes of glass one before the other, and a frosted one."""
    glass = (
        "lobes = [{ mx = 0.003, my = 0.003, r0 = 0.04 }, "
        '{ side = "transmission", mx = 0.003, my = 0.003, r0 = 0.04, k = 0.97 }]'
    )
    room = lit("glass_stack", materials={"glass": glass, "frost": "kt_d = 0.6, kd = 0.1"},
               assign={"pane*": "glass", "frost*": "frost"})  # fmt: skip
    for number in range(5):
        room.add(between((-0.6, 0.75, 0), (0.6, 1.7, 0)), f"pane_{number}", (-0.2, 0, -0.1 + 0.06 * number), 20)
    room.add(between((-0.3, 0, 0), (0.3, 1.4, 0)), "frost", (1.3, 0, -0.6), 20)
    return room.written(folder)


def camera_in_wall(folder: Path) -> Path:
    """A camera in the middle of a wall that is 20 cm thick."""
    return lit("camera_in_wall", eye=(2.1, 1.5, 0.0), target=(-1.0, 1.0, 0.0)).written(folder)


def camera_down(folder: Path) -> Path:
    """A plan from above: the camera looks along its own up."""
    return lit("camera_down", eye=(0.0, 2.4, 0.0), target=(0.0, 0.0, 0.0)).written(folder)


def kd_over_one(folder: Path) -> Path:
    """A diffuse reflectance of 1.4."""
    return lit("kd_over_one", materials={"red": "kd = [1.4, 0.2, 0.2]"}).written(folder)


def perfect_lobes(folder: Path) -> Path:
    """Metals that reflect everything, rough and smooth."""
    return lit("perfect_lobes", materials={
        "steel": "lobes = [{ mx = 0.2, my = 0.2, r0 = 1.0 }]", "red": "lobes = [{ mx = 0.02, my = 0.02, r0 = 1.0 }]",
    }).written(folder)  # fmt: skip


def sharpest(folder: Path) -> Path:
    """Lobes of roughness 1e-4."""
    sharp = "kd = 0.1, lobes = [{ mx = 0.0001, my = 0.0001, r0 = 0.5 }]"
    return lit("sharpest", materials={"steel": sharp, "floors": sharp}).written(folder)


def brushed(folder: Path) -> Path:
    """Lobes a hundred times as wide along as across."""
    brush = "lobes = [{ mx = 0.5, my = 0.005, r0 = [0.9, 0.7, 0.4] }]"
    return lit("brushed", materials={"steel": brush, "wood": brush}).written(folder)


def gltf_extremes(folder: Path) -> Path:
    """Factors that glTF does not allow or hardly allows: colours of 3, roughness 0, emission of 1e5."""
    ball = trimesh.creation.icosphere(3, 0.3)
    pieces = [Piece("floor", between((-2, -0.1, -2), (2, 0, 2)), 0)]
    kinds = [metallic((0.5, 0.5, 0.5)), metallic((3.0, 3.0, 0.1)), metallic((1, 1, 1), 0.0, 1.0),
             metallic((0.2, 0.2, 0.2), emissiveFactor=[1, 0.5, 0.2],
                      extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 1e5}})]  # fmt: skip
    for number in range(1, 4):
        place = np.eye(4)
        place[:3, 3] = (-1.6 + 0.8 * number, 0.31, 0)
        pieces.append(Piece(f"ball {number}", ball, number, place))
    return glb(folder / "extremes.glb", pieces, json.loads(json.dumps(kinds)),
               extensionsUsed=["KHR_materials_emissive_strength"])  # fmt: skip


def _tabled(folder: Path, room: Room, text: str) -> Path:
    """A room whose steel and wood are a measured table, as docs/fitting.md has it: fitted, and scattering by itself."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "table.txt").write_text(text)
    lambent.read(folder / "table.txt").fit(progress=False).material.save(folder / "table.json")
    return room.written(folder)


def _of_table(name: str, more: str = "") -> Look:
    drawn = 'file = "table.json"'
    table = '\n[measured]\nsteel = "table.txt"\nwood = "table.txt"\n'
    return Look(name, {"steel": drawn, "wood": drawn}, more=table + more)


def damaged_table(folder: Path) -> Path:
    """Under a lamp, a gloss whose peak is cut off at a third, and of whose rows an eighth are below zero."""
    angles_deg = grid(theta_o=range(0, 86, 2), phi_o=range(0, 360, 10))
    f = measured(angles_deg, GLOSSY)
    text, _ = damaged(written(angles_deg, np.minimum(f, 0.3 * f.max())), 0.12, "-.01 -.01 -.01")
    room = Room(_of_table("damaged_table", lamp())).furnish()
    panel(room.add)
    return _tabled(folder, room, text)


def one_wavelength(folder: Path) -> Path:
    """By a window, a gloss that was measured at 550 nm alone."""
    angles_deg = grid(theta_i=range(0, 76, 15), theta_o=range(0, 86, 5))
    text = written(angles_deg, measured(angles_deg, GLOSSY)[:, :1], (*ANGLES, "f_550nm"))
    return _tabled(folder, _windowed(_of_table("one_wavelength")), text)


def sixteen_wavelengths(folder: Path) -> Path:
    """By a window, a glossy red from 400 to 700 nm in steps of 20, more saturated than a screen's."""
    wavelengths_nm = np.arange(400, 701, 20)
    angles_deg = grid(theta_i=range(0, 76, 15), theta_o=range(0, 86, 5))
    red = 0.4 / np.pi / (1 + np.exp((610 - wavelengths_nm) / 5))
    f = measured(angles_deg, Material(name="gloss", kd=0.0, lobes=GLOSSY.lobes))[:, :1] + red
    text = written(angles_deg, f, (*ANGLES, *(f"f_{nm}nm" for nm in wavelengths_nm)))
    return _tabled(folder, _windowed(_of_table("sixteen_wavelengths")), text)


def _windowed(look: Look) -> Room:
    """The furnished room, in daylight that enters by a window of 2 m by 1.3 m."""
    room = Room(look).furnish()
    room.scene.delete_geometry("wall_right")
    for number, (low, high) in enumerate([((0, -2.7), (2.6, -1.8)), ((0, 0.2), (2.6, 2.7)), ((0, -1.8), (0.9, 0.2)),
                                          ((2.2, -1.8), (2.6, 0.2))]):  # fmt: skip
        room.add(between((2.0, *low), (2.2, *high)), f"wall_right_{number}")
    return room
