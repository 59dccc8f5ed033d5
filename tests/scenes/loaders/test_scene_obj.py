"""OBJ and MTL: what is read comes out true, quickly; what is broken is one line with its number."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from lambent.core.errors import UserError
from lambent.core.geometry.triangles import triangle_areas
from lambent.materials.bsdf import MaterialBSDF
from lambent.scenes.geometry import signed_volume
from lambent.scenes.loaders.contents import Contents
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.loaders.obj import load as read_obj
from lambent.scenes.loaders.obj import text as obj_text
from tests.scenes.loaders.pictures import png

QUAD = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\n"


def parts_of(folder: Path, text: str, library: str = "") -> Contents:
    (folder / "thing.mtl").write_text(library)
    path = folder / "thing.obj"
    path.write_text(text)
    return read_obj(path)


def test_a_quad_with_uv_up(tmp_path: Path) -> None:
    parts = parts_of(tmp_path, QUAD + "f 1/1/1 2/2/1 3/3/1 4/4/1\n")
    (o,) = parts.objects
    assert len(o.mesh.faces) == 2 and len(o.mesh.positions) == 4 and parts.warnings == ()
    assert np.array_equal(o.mesh.uv, o.mesh.positions[:, :2]) and np.allclose(o.mesh.normals, (0, 0, 1))
    assert np.allclose(o.mesh.tangents, (1, 0, 0)) and o.material == "default"


@pytest.mark.parametrize("corner", ["{0}", "{0}/{0}", "{0}//1", "{0}/{0}/1", "{1}", "{1}/{1}", "{1}//-1", "{1}/{1}/-1"])
def test_all_ways_to_name_a_corner(tmp_path: Path, corner: str) -> None:
    face = "f " + " ".join(corner.format(i, i - 5) for i in (1, 2, 3)) + "\n"
    text = QUAD + face + "v 9 9 9\n"  # negative places count from where they stand
    (o,) = parts_of(tmp_path, text).objects
    assert np.allclose(sorted(map(tuple, o.mesh.positions)), [(0, 0, 0), (1, 0, 0), (1, 1, 0)])


def test_as_another_reader_has_it(tmp_path: Path) -> None:
    """Written by trimesh: a closed solid, its volume and area."""
    ball = trimesh.creation.torus(1.0, 0.3)
    ball.export(tmp_path / "torus.obj")
    (o,) = read_obj(tmp_path / "torus.obj").objects
    assert signed_volume(o.mesh) == pytest.approx(float(ball.volume), rel=1e-5)
    assert float(triangle_areas(o.mesh.corners).sum()) == pytest.approx(float(ball.area), rel=1e-5)


def test_hollow_polygons(tmp_path: Path) -> None:
    """An L and a star, in a slanted plane, turned both ways round: their area, and nothing outside them."""
    ell = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
    angles = np.arange(10) * np.pi / 5
    radius = np.where(np.arange(10) % 2 == 0, 1.0, 0.4)
    star = list(zip(radius * np.cos(angles) + 5, radius * np.sin(angles), strict=True))
    for shape, area in ((ell, 3.0), (star, 10 * 0.5 * 0.4 * np.sin(np.pi / 5))):
        for order in (shape, shape[::-1]):
            places = " ".join(map(str, range(1, len(order) + 1)))
            text = "".join(f"v {x} {y} {0.5 * x}\n" for x, y in order) + f"f {places}"
            (o,) = parts_of(tmp_path, text + "\n").objects
            a, b, c = (o.mesh.positions[o.mesh.faces[:, i], :2].astype(float) for i in range(3))
            signed = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
            assert abs(signed.sum()) == pytest.approx(area, rel=1e-5) and np.abs(signed).sum() == pytest.approx(area)
            assert (signed > 0).all() == (order is shape)


def test_objects_groups_and_materials(tmp_path: Path) -> None:
    text = (
        QUAD
        + "mtllib thing.mtl\n"
        + ("o table\nusemtl wood\nf 1 2 3\nusemtl metal\nf 1 3 4\no lamp\nf 1 2 4\nusemtl wood\no table\nf 2 3 4\n")
    )
    parts = parts_of(tmp_path, text, "newmtl wood\nKd .5 .25 .125\nnewmtl metal\nKd 0 0 0\nKs .9 .8 .7\n")
    found = {o.name: (o.material, len(o.mesh.faces)) for o in parts.objects}
    assert found == {"table_wood": ("wood", 2), "table_metal": ("metal", 1), "lamp": ("metal", 1)}
    assert parts.materials["wood"].kd == (0.5, 0.25, 0.125) and parts.materials["wood"].lobes == ()
    assert parts.materials["metal"].lobes[0].r0 == (0.9, 0.8, 0.7)
    grouped = parts_of(tmp_path, QUAD + "g a\nf 1 2 3\ng b c\nf 1 3 4\n")
    assert [o.name for o in grouped.objects] == ["a", "b c"]


def test_smoothing_groups_make_normals(tmp_path: Path) -> None:
    """A roof: one group makes its ridge round, none keeps it sharp."""
    roof = "v 0 0 -1\nv 1 0 -1\nv 1 1 0\nv 0 1 0\nv 1 0 1\nv 0 0 1\n"
    faces = "f 1 4 3 2\nf 4 6 5 3\n"
    (sharp,) = parts_of(tmp_path, roof + faces).objects
    (smooth,) = parts_of(tmp_path, roof + "s 1\n" + faces).objects
    ridge = smooth.mesh.normals[smooth.mesh.positions[:, 1] == 1]
    assert np.allclose(ridge, (0, 1, 0), atol=1e-6)
    assert np.allclose(np.abs(sharp.mesh.normals[:, 2]), np.sqrt(0.5)) and len(sharp.mesh.positions) > 6


def test_what_a_library_says(tmp_path: Path) -> None:
    (tmp_path / "maps").mkdir()
    png(tmp_path / "maps" / "wood grain.png", [[[255, 255, 255], [0, 0, 0]]])
    png(tmp_path / "holes.png", [[255, 0]])
    png(tmp_path / "flat.png", np.full((2, 2, 3), (128, 128, 255)))
    png(tmp_path / "bumps.png", [[[0, 0, 0], [255, 255, 255]]])
    library = r"""
newmtl plastic
Kd 0.8 0.8 0.8
Ks 0.5 0.5 0.5
Ns 198
map_Kd -blendu on -blendv on -boost 1 -cc on -clamp off -type sphere -mm 0 1 -s 2 3 1 -o 0.5 0 0 maps\wood grain.png
map_d holes.png
map_Bump flat.png
newmtl mirror
Kd 0.1 0.1 0.1
Ks 0.9 0.9 0.9
illum 3
newmtl pbr
Kd 1 0.8 0.3
Pr 0.5
Pm 1
aniso 0.5
bump bumps.png
newmtl pane
Kd 1 1 1
d 0.25
newmtl lamp
Ke 5 4 3
Kd 0 0 0
map_Kd gone.png
"""
    faces = "".join(f"usemtl {n}\nf 1/1 2/2 3/3\n" for n in ("plastic", "mirror", "pbr", "pane", "lamp"))
    parts = parts_of(tmp_path, QUAD + "mtllib thing.mtl\n" + faces, library)
    m, notes = parts.materials, " ".join(parts.warnings)
    plastic, textures = m["plastic"], parts.textures["plastic"]
    assert plastic.kd == pytest.approx((0.8 * 0.96 * 0.5,) * 3) and plastic.kd_coupled
    assert plastic.lobes[0].mx == pytest.approx(0.1) and plastic.lobes[0].r0 == pytest.approx((0.04,) * 3)
    assert textures.diffuse is not None and textures.diffuse.uv_transform == ((2, 0, 0.5), (0, 3, 0))
    assert np.allclose(textures.diffuse.texels[0], [[2] * 3, [0] * 3])
    assert textures.opacity is not None and textures.opacity.texels.ravel().tolist() == [1, 0]
    assert textures.normal is not None and np.allclose(textures.normal.texels, (0, 0, 1), atol=0.01)
    assert m["mirror"].lobes[0].r0 == (0.9,) * 3 and m["mirror"].kd == pytest.approx((0.01,) * 3)
    gold = m["pbr"].lobes[0]
    assert gold.r0 == pytest.approx((1, 0.8, 0.3)) and m["pbr"].kd == (0, 0, 0)
    assert gold.mx * gold.my == pytest.approx(0.25**2) and gold.mx > gold.my
    assert "material pbr: its bump map is ignored" in notes
    assert m["pane"].transmission_lobes[0].k == (0.75,) * 3 and "is transparent (75%)" in notes
    lamp = next(o for o in parts.objects if o.material == "lamp")
    assert lamp.emission == (5, 4, 3) and "material lamp: picture gone.png is missing" in notes
    assert {p.name for p in parts.sources} == {
        "thing.obj", "thing.mtl", "wood grain.png", "holes.png", "flat.png", "bumps.png"
    }  # fmt: skip
    wo = np.array([[np.sin(t), 0, np.cos(t)] for t in np.radians([0, 40, 70])])
    for material in m.values():
        assert MaterialBSDF(material).albedo(wo).max() < 1.03, material.name


@pytest.mark.parametrize("said", ["d 0.25", "Tr 0.75"])
def test_transparency_is_what_covers_or_what_passes(tmp_path: Path, said: str) -> None:
    library = f"newmtl pane\nKd 1 1 1\n{said}\nTf 0.5 1 1\n"
    parts = parts_of(tmp_path, QUAD + "mtllib thing.mtl\nusemtl pane\nf 1/1 2/2 3/3\n", library)
    (through,) = parts.materials["pane"].transmission_lobes
    assert through.k == pytest.approx((0.375, 0.75, 0.75)) and parts.materials["pane"].kd == pytest.approx((0.25,) * 3)


def test_names_from_another_machine(tmp_path: Path) -> None:
    """A picture named by a path that leads elsewhere is taken from beside the library, and only from there."""
    png(tmp_path / "wood.png", [[[255, 0, 0], [0, 0, 0]]])
    library = "newmtl a\nmap_Kd C:\\textures\\wood.png\n"
    parts = parts_of(tmp_path, QUAD + "mtllib thing.mtl\nusemtl a\nf 1/1 2/2 3/3\n", library)
    assert "a" in parts.textures and "was found beside thing.mtl" in " ".join(parts.warnings)
    for name in ("../secret.png", "/etc/passwd", "D:\\a.png"):
        with pytest.raises(UserError, match=r"thing.mtl: line 2 map_Kd: path leaves its folder"):
            parts_of(tmp_path, QUAD + "mtllib thing.mtl\nusemtl a\nf 1 2 3\n", f"newmtl a\nmap_Kd {name}\n")
    with pytest.raises(UserError, match=r"line 10 mtllib: path leaves its folder"):
        parts_of(tmp_path, QUAD + "mtllib ../thing.mtl2\nf 1 2 3\n")


def test_pictures_above_the_geometry_but_within_the_scene(tmp_path: Path) -> None:
    (tmp_path / "models").mkdir()
    png(tmp_path / "wood.png", [[[255, 0, 0], [0, 0, 0]]])
    library = "newmtl a\nmap_Kd ../wood.png\n"
    (tmp_path / "models" / "thing.mtl").write_text(library)
    (tmp_path / "models" / "thing.obj").write_text(QUAD + "mtllib thing.mtl\nusemtl a\nf 1/1 2/2 3/3\n")
    head = 'format = "lambent-scene"\nversion = 1\ngeometry = "models/thing.obj"\n'
    (tmp_path / "scene.toml").write_text(head)
    assert "a" in load_scene(tmp_path / "scene.toml").textures
    with pytest.raises(UserError, match="leaves its folder"):
        load_scene(tmp_path / "models" / "thing.obj")


def test_odd_but_sound(tmp_path: Path) -> None:
    text = (
        "\ufeff# from somewhere\r\n\tv  0 0 0 1.0 # the origin\r\nv 1 0 0 \\\r\n 1 0 0\r\nv 1 1 0\r\nvt 0.5\r\n"
        "l 1 2\r\nf 1/1\t2/1  3/1   # a face\r\nvp 1 2\r\n"
    )
    parts = parts_of(tmp_path, text)
    assert len(parts.objects[0].mesh.faces) == 1 and "lines are ignored" in parts.warnings
    head = "v 0 0 0\nv 1 0 0\nv nan 1 0\nv 0 1 0\n"
    parts = parts_of(tmp_path, head + "f 1 2 3\nf 1 2 4\nf 1 1 2\n")
    notes = " ".join(parts.warnings)
    assert "a vertex is not finite" in notes and "no area" in notes and len(parts.objects[0].mesh.faces) == 1


WRONG = {
    "v 1 2\n": r"line 10: v with too few numbers",
    "v 1 2 x\n": r"line 10: not a number; found x",
    "v 1 2 - 3\n": r"line 10: not a number; found -",
    "v 1 2 3 v 4 5 6\n": r"line 10: not a number; found v",
    "f 1 2 3 f 2 3 4\n": r"line 10: not a number; found f",
    "f - 3 - 2 - 1\n": r"line 10: not a number; found -",
    "f 1 2 9\n": r"line 10: corner has an unknown v; found 9; expected at most 4",
    "f 0 1 2\n": r"line 10: corner has an unknown v; found 0",
    "f 1 2/2 3\n": r"line 10: face cannot be read",
    "f a b c\n": r"line 10: not a number; found a",
    "": r"holds no triangles",
    "f 1 2\n": r"holds no triangles",
    "mtllib thing.mtl\nusemtl a\nf 1 2 3\n": r"thing.mtl: line 2 Kd: not a finite number; found nan",
}


@pytest.mark.parametrize("text", WRONG)
def test_what_is_wrong_is_one_line(tmp_path: Path, text: str) -> None:
    with pytest.raises(UserError, match=WRONG[text]) as caught:
        parts_of(tmp_path, QUAD + text, "newmtl a\nKd nan 0 0\n")
    assert "\n" not in str(caught.value) and str(tmp_path) in str(caught.value)


def test_blocks_do_not_show(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Read in blocks of a few lines, a file is the same, and so are the numbers of its lines."""
    text = (QUAD + "o a\nf 1/1/1 2/2/1 3/3/1\nv 5 5 5\nf -1 1 2\n# nothing\nf -1/1 \\\n-2/1 1/1\nusemtl x\n") * 3
    whole = obj_text.parse(text.encode(), tmp_path)
    monkeypatch.setattr(obj_text, "BLOCK_BYTES", 40)
    cut = obj_text.parse(text.encode(), tmp_path)
    for name in ("v", "vt", "vn", "corners", "sizes", "lines"):
        assert np.array_equal(getattr(whole, name), getattr(cut, name)), name
    assert whole.words == cut.words and whole.lines[:3].tolist() == [11, 13, 15]


def test_what_exporters_write_otherwise(tmp_path: Path) -> None:
    """Small letters, statements nobody knows, pictures that are gone, tinted glass, coats."""
    png(tmp_path / "wood.png", np.full((2, 2, 3), 188))
    library = """
newmtl small
kd 1 1 1
map_kd wood.png
newmtl gone
Kd 1 1 1
map_Kd nowhere.png
newmtl brown
Kd 0.4 0.3 0.2
map_Kd nowhere.png
newmtl glass
Kd 0.5 0.5 0.5
Ks 1 1 1
Ns 1000
Ni 1.5
Tf 0.5 1 0.5
d 0.1
illum 4
newmtl veil
Kd 0.5 0.5 0.5
Tf 0 0 0
Tr 0.5
newmtl coated
Kd 1 1 1
Pc 1
Frobnicate 3
"""
    names = ("small", "gone", "brown", "glass", "veil", "coated")
    faces = "".join(f"usemtl {n}\nf 1/1 2/2 3/3\n" for n in names)
    parts = parts_of(tmp_path, QUAD + "mtllib thing.mtl\n" + faces, library)
    m, notes = parts.materials, " ".join(parts.warnings)
    assert m["small"].kd == pytest.approx((0.5029,) * 3, abs=1e-3)
    assert m["gone"].kd == (0.5,) * 3 and m["brown"].kd == pytest.approx((0.4, 0.3, 0.2))
    back, through = m["glass"].lobes
    assert back.r0 == through.r0 == pytest.approx((0.04,) * 3) and back.k[0] > 1
    assert through.k == pytest.approx((0.45, 0.9, 0.45), rel=1e-3) and m["glass"].kd[0] < 0.06
    assert m["veil"].transmission_lobes[0].k == (0.5,) * 3
    for theta_deg in (0, 60, 80):
        wo = np.array([np.sin(np.radians(theta_deg)), 0, np.cos(np.radians(theta_deg))])
        for name in names:
            assert MaterialBSDF(m[name]).albedo(wo).max() < 1.01, (name, theta_deg)
    assert "Frobnicate is ignored" in notes and notes.count("nowhere.png is missing") == 2
