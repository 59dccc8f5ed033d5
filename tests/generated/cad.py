"""Unseen geometry: exports of CAD programs, other units and sizes, broken and mirrored meshes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh
from numpy.random import default_rng
from trimesh.creation import box, cone, cylinder, icosphere, torus
from trimesh.transformations import rotation_matrix, scale_matrix, translation_matrix

from tests.generated.rooms import between
from tests.generated.written import Look, Piece, Room, glb, lamp, metallic, moved, obj, panel

Z_UP = rotation_matrix(np.pi / 2, (1, 0, 0))


def cad_nodes(folder: Path) -> Path:
    """30,000 nodes of eight parts without normals and uv, stacked on racks in a hall."""
    rng = default_rng(1)
    parts = [box((0.09, 0.05, 0.07)), cylinder(0.03, 0.08, sections=12), cone(0.04, 0.07, sections=10),
             box((0.04, 0.09, 0.04)), torus(0.03, 0.01, 8, 6), icosphere(1, 0.035),
             cylinder(0.02, 0.09, sections=6), box((0.08, 0.02, 0.08))]  # fmt: skip
    pieces = [Piece("hall floor", between((-6, -0.2, -6), (6, 0, 6)), 0)]
    for number in range(30_000 - 61):
        row, column = divmod(number, 500)
        at = (-5 + 0.1 * (column % 100), 0.3 + 0.25 * (column // 100), -5 + 0.16 * row)
        place = translation_matrix(at) @ rotation_matrix(rng.uniform(0, 6.28), (0, 1, 0))
        pieces.append(Piece(f"part:{number}", parts[int(rng.integers(8))], 1 + number % 3, place))
    for row in range(60):
        pieces.append(Piece(f"rack {row}", box((10.2, 0.02, 0.1)), 1, translation_matrix((0, 0.2, -5 + 0.16 * row))))
    colours = [metallic((0.5, 0.5, 0.5)), metallic((0.6, 0.6, 0.62), 0.4, 1.0), metallic((0.7, 0.3, 0.1)),
               metallic((0.1, 0.2, 0.5), 0.3)]  # fmt: skip
    return glb(folder / "cad.glb", pieces, colours)


def _kitchen() -> dict[str, trimesh.Trimesh]:
    """A room of 3.6 m in centimetres, z up, walls as plates."""
    pieces = {
        "Boden": ((0, 0, -10), (360, 300, 0)), "Decke": ((0, 0, 250), (360, 300, 260)),
        "Wand_W": ((-10, 0, 0), (0, 300, 250)), "Wand_O": ((360, 0, 0), (370, 300, 250)),
        "Wand_N": ((0, 300, 0), (360, 310, 250)), "Wand_S1": ((0, -10, 0), (100, 0, 250)),
        "Wand_S2": ((260, -10, 0), (360, 0, 250)), "Wand_S3": ((100, -10, 0), (260, 0, 90)),
        "Wand_S4": ((100, -10, 210), (260, 0, 250)),
        "Zeile": ((0, 240, 0), (300, 300, 90)), "Tisch": ((130, 80, 70), (250, 160, 74)),
    }  # fmt: skip
    return {name: between(*corners) for name, corners in pieces.items()}


def centimetres_obj(folder: Path) -> Path:
    """A kitchen in centimetres, z up, which OBJ cannot say."""
    return obj(folder / "kueche.obj", _kitchen())


def centimetres_glb(folder: Path) -> Path:
    """The same, written into glTF as it was."""
    return glb(folder / "kueche.glb", [Piece(name, mesh) for name, mesh in _kitchen().items()])


def kitchen_in_metres(folder: Path) -> Path:
    """The same with the scale and the axis that a scene.toml gives it."""
    centimetres_obj(folder)
    geometry = '{ file = "kueche.obj", scale = 0.01, up = "+z" }'
    look = Look("kitchen", geometry=geometry, assign={"*": "walls"}, eye=(3.2, 1.6, -0.4), target=(0.8, 0.9, -2.4))
    (folder / "scene.toml").write_text(look.toml(["Boden"]))
    return folder / "scene.toml"


def terrain(folder: Path) -> Path:
    """8 km of hills with a house of 12 m on them."""
    side = np.linspace(-4000, 4000, 161)
    x, z = np.meshgrid(side, side, indexing="ij")
    y = 120 * np.sin(x / 900) * np.cos(z / 700) * np.clip(np.hypot(x, z) / 800, 0, 1)
    index = np.arange(161 * 161).reshape(161, 161)
    a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]))
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    ground = trimesh.Trimesh(np.stack([x, y, z], -1).reshape(-1, 3), faces, process=False)
    look = Look("terrain", assign={"ground*": "red", "house*": "walls"}, eye=(14.0, 3.0, 18.0), target=(0.0, 2.0, 0.0),
                materials={"red": "kd = [0.12, 0.2, 0.06]"})  # fmt: skip
    room = Room(look)
    room.add(ground, "ground")
    room.add(between((-6, 0, -4), (6, 0.2, 4)), "floor_house")
    for side_x in (-6, 5.7):
        room.add(between((side_x, 0.2, -4), (side_x + 0.3, 3, 4)), f"house_{side_x}")
    room.add(between((-5.7, 0.2, -4), (5.7, 3, -3.7)), "house_back")
    room.add(between((-5.7, 0.2, 3.7), (-1, 3, 4)), "house_front")
    room.add(between((-6.5, 3, -4.5), (6.5, 3.2, 4.5)), "wood_roof")
    room.add(between((1, 0.2, -1), (2.5, 0.9, 0)), "steel_table")
    return room.written(folder)


def ground_50km(folder: Path) -> Path:
    """Two things of a metre on a plane of 50 km."""
    look = Look("plain", eye=(2.5, 1.6, 3.0), target=(0.0, 0.5, 0.0), assign={"ground": "floors"})
    room = Room(look)
    room.add(between((-25000, -1, -25000), (25000, 0, 25000)), "ground")
    room.add(between((-0.5, 0, -0.5), (0.5, 1, 0.5)), "red_box", (0.6, 0, -0.2), 30)
    room.add(icosphere(4, 0.4), "steel_ball", (-0.7, 0.401, 0.2))
    return room.written(folder)


def millimetre(folder: Path) -> Path:
    """Screws on a plate of 6 mm."""
    pieces = [Piece("plate", box((0.006, 0.0004, 0.005)), 0, translation_matrix((0, -0.0002, 0)))]
    for number in range(6):
        at = (-0.002 + 0.002 * (number % 3), 0.0006, -0.001 + 0.002 * (number // 3))
        place = translation_matrix(at) @ rotation_matrix(np.pi / 2, (1, 0, 0))
        pieces.append(Piece(f"pin {number}", cylinder(0.0004, 0.0012, sections=32), 1, place))
    return glb(folder / "pins.glb", pieces, [metallic((0.4, 0.4, 0.4)), metallic((0.8, 0.6, 0.3), 0.3, 1.0)])


def million(folder: Path) -> Path:
    """Over 1,000,000 triangles in a room: thirteen dense statues."""
    return _statues(folder, "million", 6)


def statues_1k(folder: Path) -> Path:
    """The same room with fewer triangles."""
    return _statues(folder, "statues_1k", 1)


def statues_17k(folder: Path) -> Path:
    """With 17,000."""
    return _statues(folder, "statues_17k", 3)


def statues_266k(folder: Path) -> Path:
    """With 266,000."""
    return _statues(folder, "statues_266k", 5)


def _statues(folder: Path, name: str, subdivisions: int) -> Path:
    room = Room(Look(name, more=lamp())).furnish(ball=min(subdivisions, 4))
    panel(room.add)
    rng = default_rng(3)
    for number in range(13):
        statue = icosphere(subdivisions, 0.16)
        bumps = 1 + 0.15 * np.sin(9 * statue.vertices / 0.16 + rng.uniform(0, 6, 3)).prod(axis=1, keepdims=True)
        statue.vertices *= bumps
        at = (-1.6 + 0.55 * (number % 4), 0.2, -2.0 + 0.6 * (number // 4))
        room.add(statue, f"red_{number}" if number % 2 else f"steel_{number}", at)
    return room.written(folder)


def doubled(folder: Path) -> Path:
    """Every face twice, the copies turned round: two-sided exports of old programs."""
    room = Room(Look("doubled", more=lamp()))
    source = Room(room.look).furnish()
    panel(source.add)
    for name, mesh in source.scene.geometry.items():
        place = source.scene.graph[name][0]
        both = np.concatenate([mesh.faces, mesh.faces[:, ::-1]])
        twice = trimesh.Trimesh(mesh.vertices, both, process=False)
        room.scene.add_geometry(twice, node_name=name, geom_name=name, transform=place)
    return room.written(folder)


def _lit_room(name: str) -> Room:
    room = Room(Look(name, more=lamp(20000.0))).furnish()
    panel(room.add)
    return room


def against_winding(folder: Path) -> Path:
    """A lit room with all triangles wound against their normals."""
    room = _lit_room("against_winding")
    for mesh in room.scene.geometry.values():
        normals = mesh.vertex_normals.copy()
        mesh.invert()
        mesh.vertex_normals = normals
    return room.written(folder)


def inside_out(folder: Path) -> Path:
    """A lit room whose solids, the closed lamp too, all look inwards."""
    room = _lit_room("inside_out")
    pieces = []
    for name, mesh in room.scene.geometry.items():
        mesh.invert()
        pieces.append(Piece(name, mesh, 0, room.scene.graph[name][0]))
    glb(folder / "inside_out.glb", pieces)
    (folder / "scene.toml").write_text(room.look.toml(room.scene.geometry))
    return folder / "scene.toml"


def mirrored(folder: Path) -> Path:
    """Halves of a thing that are instances of negative scale, with normals, as symmetric models are exported."""
    half = trimesh.util.concatenate([between((0, 0, -0.3), (0.3, 0.8, 0.3)), moved(icosphere(3, 0.2), (0.35, 1.0, 0))])
    half.unmerge_vertices()
    normals = np.repeat(half.face_normals, 3, axis=0)
    floor = between((-3, -0.1, -3), (3, 0, 3))
    pieces = [Piece("floor", floor, 0)]
    for number, scale in enumerate(((1, 1, 1), (-1, 1, 1), (1, 1, -1), (-1, -1, -1))):
        at = (-1.2 + 0.8 * number, 1.3 if number == 3 else 0.0, -0.5 + 0.1 * number)
        place = translation_matrix(at) @ np.diag([*scale, 1.0])
        pieces.append(Piece(f"half {number}", half, 1, place, normals))
    colours = [metallic((0.6, 0.6, 0.6)), metallic((0.7, 0.2, 0.1), 0.3)]
    return glb(folder / "mirrored.glb", pieces, colours)


def names(folder: Path) -> Path:
    """Names of 300 letters, in other scripts, with line breaks, twice, and none."""
    said = [
        "Küche/Fläche №1",
        "椅子",
        "كرسي",
        "🪑" * 40,
        "long " * 60,
        "a\nb\tc",
        "dup",
        "dup",
        "dup",
        "",
        "..",
        "con?*[x]",
    ]
    pieces = [Piece("floor", between((-2, -0.1, -2), (2, 0, 2)), 0)]
    for number, name in enumerate(said):
        at = (-1.4 + 0.9 * (number % 4), 0.25, -1.2 + 0.9 * (number // 4))
        pieces.append(Piece(name, box((0.4, 0.5, 0.4)), 1, translation_matrix(at)))
    materials = [metallic((0.5, 0.5, 0.5)), metallic((0.2, 0.4, 0.6), name="Stoff „blau“ " * 25)]
    return glb(folder / "Größe 1 – kopie.glb", pieces, materials)


def broken(folder: Path) -> Path:
    """Empty nodes, a mesh of slivers, one with NaN and infinite corners, one wholly degenerate, and a sound one."""
    nan = icosphere(2, 0.4)
    nan.vertices[::7] = np.nan
    nan.vertices[1::31] = np.inf
    flat = trimesh.Trimesh(np.zeros((6, 3)), [[0, 1, 2], [3, 4, 5]], process=False)
    slivers = trimesh.Trimesh(
        [[0, 0, 0], [1, 0, 0], [0.5, 1e-9, 0], [0, 0.6, 0], [1, 0.6, 0]], [[0, 1, 2], [0, 1, 4], [0, 0, 4], [0, 4, 3]],
        process=False,
    )  # fmt: skip
    empty = trimesh.Trimesh()
    pieces = [
        Piece("floor", between((-2, -0.1, -2), (2, 0, 2))), Piece("empty", empty), Piece("flat", flat),
        Piece("slivers", slivers, 0, translation_matrix((-1, 0.2, -1))),
        Piece("nan", nan, 0, translation_matrix((-0.6, 0.5, 0))),
        Piece("shrunk", box((0.5, 0.5, 0.5)), 0, scale_matrix(0.0)),
        Piece("sound", box((0.5, 0.5, 0.5)), 0, translation_matrix((0.8, 0.25, 0))),
    ]  # fmt: skip
    return glb(folder / "broken.glb", pieces)
