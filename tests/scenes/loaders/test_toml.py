"""scene.toml: what it may say, and that what it may not is one clear line."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.triangles import triangle_areas
from lambent.core.light.exposure import exposure_of
from lambent.core.light.photometry import photometric
from lambent.materials.document import Material
from lambent.scenes.camera_paths import camera_at
from lambent.scenes.geometry import patch
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.loaders.scene_toml.assembly import assigned
from lambent.scenes.scene import (
    ConstantEnvironment,
    DirectionalLight,
    IesLight,
    ImageEnvironment,
    LightFieldWish,
    PointLight,
    SceneObject,
)

HEAD = 'format = "lambent-scene"\nversion = 1\ngeometry = "builtin:box"\n'
MATERIALS = """
[materials]
white = { kd = 0.7 }
red = { kd = [0.6, 0.05, 0.05] }
green = { kd = [0.1, 0.45, 0.1] }
black = { kd = 0.0 }
metal = { lobes = [{ mx = 0.15, my = 0.15, r0 = 0.9 }] }
"""


def written(folder: Path, text: str, head: str = HEAD) -> Path:
    path = folder / "scene.toml"
    path.write_text(head + text, encoding="utf-8")
    return path


def test_everything_a_scene_may_say(tmp_path: Path) -> None:
    Material(name="gold", lobes=[{"mx": 0.1, "my": 0.2}]).save(tmp_path / "gold.json")
    (tmp_path / "sky.hdr").write_bytes(b"not opened here")
    path = written(
        tmp_path,
        """exposure_ev = 1.5
[environment]
kind = "image"
file = "sky.hdr"
rotation_deg = 30.0
layout = "angular"
up = "+z"
"""
        + MATERIALS
        + """
[materials.gold]
file = "gold.json"
[objects."*"]
light_map_scale = 2.0
[objects.sphere]
material = "gold"
probe_centre = [0.0, 0.5, 0.0]
probe_planes = [[0.0, 2.0, 0.0, 0.0]]
light_field = { points = 64, texels = 48, offset_m = 0.01, error = 0.05 }
[objects.lamp]
emission = [1.0, 2.0, 3.0]
[[lights]]
kind = "spot"
position = [0.0, 0.9, 0.0]
intensity = [1.0, 1.0, 1.0]
direction = [0.0, -2.0, 0.0]
outer_deg = 30.0
[[lights]]
kind = "directional"
direction = [0.0, -1.0, 0.0]
irradiance = [1.0, 1.0, 1.0]
[[cameras]]
name = "front"
position = [0.0, 0.5, 2.0]
target = [0.0, 0.5, 0.0]
[[paths]]
name = "pass"
keys = [
    { position = [0.0, 0.5, 2.0], target = [0.0, 0.5, 0.0] },
    { position = [1.0, 0.5, 2.0], target = [0.0, 0.5, 0.0] },
]
""",
    )
    scene = load_scene(path)
    assert scene.exposure_ev == 1.5 and scene.environment == ImageEnvironment(
        tmp_path / "sky.hdr", 1.0, 30.0, "angular", "+z"
    )
    assert scene.object("sphere").material == "gold" and scene.materials["gold"].lobes[0].my == 0.2
    assert {o.light_map_scale for o in scene.objects} == {2.0}
    assert scene.object("lamp").emission == (1.0, 2.0, 3.0)
    assert scene.lights == (
        PointLight((0, 0.9, 0), (1, 1, 1), (0, -1, 0), 0, 30),
        DirectionalLight((0, -1, 0), (1, 1, 1)),
    )
    assert scene.probe_centres == {"sphere": (0, 0.5, 0)} and np.array_equal(
        scene.probe_planes["sphere"], [[0, 1, 0, 0]]
    )
    assert scene.light_fields == {"sphere": LightFieldWish(64, 48, 0.01, 0.05)}
    assert [c.name for c in scene.cameras] == ["front"] and scene.paths[0].keys[1].position == (1, 0.5, 2)
    assert set(scene.sources) == {path, tmp_path / "gold.json", tmp_path / "sky.hdr"}


LAMPS = """
[[lights]]
kind = "point"
position = [0.0, 1.0, 0.0]
lumens = 1256.637
colour = [1.0, 0.5, 0.25]
[[lights]]
kind = "spot"
position = [0.0, 1.0, 0.0]
direction = [0.0, -1.0, 0.0]
inner_deg = 20.0
outer_deg = 50.0
lumens = 1000.0
[[lights]]
kind = "directional"
direction = [0.0, -1.0, 0.0]
lux = 1790.0
[[lights]]
kind = "directional"
direction = [0.0, -1.0, 0.0]
lux = 0.0
[[lights]]
kind = "ies"
file = "lamp.ies"
position = [0.0, 2.0, 0.0]
direction = [1.0, 0.0, 0.0]
lumens = 628.3185
[objects.lamp]
lumens = 500.0
[objects.sphere]
luminance = 1790.0
"""


def test_lamps_in_photometric_units(tmp_path: Path) -> None:
    even = "TILT=NONE\n1 -1 1 3 1 1 2 0 0 0 1 1 1\n0 90 180\n0\n7 7 7\n"
    (tmp_path / "lamp.ies").write_text(even)
    scene = load_scene(written(tmp_path, MATERIALS + LAMPS))
    point, spot, far, unlit, luminaire = scene.lights
    assert isinstance(point, PointLight) and isinstance(spot, PointLight) and isinstance(luminaire, IesLight)
    assert photometric(np.array(point.intensity)) == pytest.approx(100, rel=1e-5)
    assert point.intensity[0] == pytest.approx(4 * point.intensity[2])
    x = np.radians(np.linspace(0, 50, 20_001))
    falloff = np.clip((50 - np.degrees(x)) / 30, 0, 1) * np.sin(x)
    lumens = 2 * np.pi * photometric(np.array(spot.intensity)) * (falloff[1:] + falloff[:-1]).sum() / 2 * x[1]
    assert lumens == pytest.approx(1000, rel=1e-4)
    assert isinstance(far, DirectionalLight) and far.irradiance == pytest.approx((10, 10, 10))
    assert isinstance(unlit, DirectionalLight) and unlit.irradiance == (0, 0, 0)
    assert 7 * photometric(np.array(luminaire.scale)) == pytest.approx(50, rel=1e-5)
    assert luminaire.aim == (1, 0, 0) and tmp_path / "lamp.ies" in scene.sources
    lamp, ball = scene.object("lamp"), scene.object("sphere")
    assert photometric(np.array(lamp.emission)) * np.pi * triangle_areas(lamp.mesh.corners).sum() == pytest.approx(500)
    assert ball.emission == pytest.approx((10, 10, 10))


def test_a_luminaire_is_scaled_and_turned(tmp_path: Path) -> None:
    (tmp_path / "lamp.ies").write_text("TILT=NONE\n1 -1 1 3 1 1 2 0 0 0 1 1 1\n0 90 180\n0\n7 7 7\n")
    lamp = "[[lights]]\nkind = 'ies'\nfile = 'lamp.ies'\nposition = [0.0, 2.0, 0.0]\n"
    scene = load_scene(written(tmp_path, f"{MATERIALS}{lamp}{lamp}scale = 0.5\nacross = [0.0, 3.0, -4.0]"))
    plain, changed = scene.lights
    assert isinstance(plain, IesLight) and isinstance(changed, IesLight)
    assert np.array(changed.scale) == pytest.approx(0.5 * np.array(plain.scale))
    assert plain.axes[0] == pytest.approx((1, 0, 0)) and changed.axes[0] == pytest.approx((0, 0, -1), abs=1e-9)


def test_keys_of_a_path_have_times(tmp_path: Path) -> None:
    keys = ", ".join(f"{{ position = [{x}.0, 0.5, 2.0], target = [0.0, 0.5, 0.0] }}" for x in range(3))
    path = f"[[paths]]\nname = 'slowing'\nseconds = 4.0\ntimes_s = [0.0, 1.0, 4.0]\nkeys = [{keys}]"
    (found,) = load_scene(written(tmp_path, MATERIALS + path)).paths
    assert found.times_s == (0, 1, 4) and camera_at(found, 1).position == (1, 0.5, 2)
    for times in ("[0.0, 4.0]", "[0.0, 2.0, 3.0]", "[0.0, 5.0, 4.0]", "[1.0, 2.0, 4.0]"):
        with pytest.raises(
            UserError, match=r"paths\.0.*times_s has an increasing time for each key, from 0 to seconds"
        ):
            load_scene(written(tmp_path, MATERIALS + path.replace("[0.0, 1.0, 4.0]", times)))


def test_exposure_as_ev100_or_none(tmp_path: Path) -> None:
    exposures = [
        load_scene(written(tmp_path, text + MATERIALS)).exposure_ev for text in ("", "exposure_ev100 = 12.0\n")
    ]
    assert exposures == [None, pytest.approx(exposure_of(12))]


def test_geometry_can_be_scaled(tmp_path: Path) -> None:
    head = HEAD.replace('"builtin:box"', '{ file = "builtin:box", scale = 0.01 }')
    scene = load_scene(written(tmp_path, MATERIALS, head))
    assert scene.bounds[1][1] == pytest.approx(0.0101, abs=1e-6)
    assert any("is its unit the metre?" in warning for warning in scene.warnings)


def test_a_light_field_is_asked_for_by_pattern_and_taken_back(tmp_path: Path) -> None:
    text = MATERIALS + '[objects."s*"]\nlight_field = true\n[objects.%s]\nlight_field = %s'
    assert load_scene(written(tmp_path, text % ("lamp", "true"))).light_fields == dict.fromkeys(
        ("sphere", "lamp"), LightFieldWish()
    )
    assert load_scene(written(tmp_path, text % ("sphere", "false"))).light_fields == {}
    only = load_scene(written(tmp_path, text % ("sphere", "{ points = 9 }"))).light_fields
    assert only == {"sphere": LightFieldWish(points=9)}


WRONG = {
    "exposure = 1.0": (r"exposure: unknown key; did you mean 'exposure_ev'\?"),
    "[environment]\nkind = 'sunsky'\nsun_direction = [0.0,-1.0,0.0]": r"below the horizon",
    "[environment]\nkind = 'image'\nfile = '../sky.hdr'": r"environment.file.*leaves its folder",
    "[environment]\nkind = 'image'\nfile = 'none.hdr'": r"file not found",
    "[materials.white]\nfile = '/etc/passwd'": r"materials.white.file.*leaves its folder",
    "[materials.white]\nfile = 'a.json'\nkd = 0.5": r"has other keys beside file; found kd",
    "[materials.white]\nkdd = 0.5": r"materials.white: kdd: unknown key; did you mean 'kd'\?",
    "[objects.sphre]\nmaterial = 'white'": r"objects.sphre: matches no object; did you mean 'sphere'\?",
    MATERIALS + "[objects.sphere]\nmaterial = 'wite'": r"unknown material; found wite; did you mean 'white'\?",
    "[[cameras]]\nname='a'\nposition=[0.0,0.0,0.0]\ntarget=[0.0,0.0,0.0]": r"cameras.0.*coincide",
    "[[cameras]]\nname='a'\nposition=[0.0,nan,0.0]\ntarget=[0.0,0.0,0.0]": r"cameras.0.position.1.*finite",
    MATERIALS + "[assign]\nsphere = 'metall'": r"assign.sphere: unknown material; found metall; did you mean 'metal'",
    "variant = 'oak'": r"variant: unknown variant; found oak; the geometry has no variants",
    "[[paths]]\nname='a'\nkeys=[]": r"paths.0.keys.*at least 2",
    "[[lights]]\nkind='laser'": r"lights.0.kind: unknown kind; found laser; expected one of point, spot",
    "[environment]\nfile='sky.hdr'": r"environment.kind: is missing",
    "[[lights]]\nkind='point'\nposition=[0.0,0.0,0.0]": r"has no intensity: set one of intensity",
    "[[lights]]\nkind='point'\nposition=[0.0,0.0,0.0]\ncandela=1\nlumens=2": r"has two intensities",
    "[[lights]]\nkind='directional'\ndirection=[0.0,1.0,0.0]\nlux=1\ncolour=[0.0,0.0,0.0]": r"cannot be black",
    MATERIALS + "[[lights]]\nkind='ies'\nfile='../a.ies'\nposition=[0.0,0.0,0.0]": r"lights.file.*leaves its folder",
    "[objects.lamp]\nemission=[1.0,1.0,1.0]\nlumens=5": r"has two intensities, emission and lumens",
    "[objects.sphere]\nlight_field = 'yes'": r"light_field: must be true, false, or a table of points.*; found yes",
    "[objects.sphere]\nlight_field = { poins = 9 }": r"light_field.poins: unknown key; did you mean 'points'",
    "[objects.sphere]\nlight_field = { points = 0 }": r"light_field.points.*greater than or equal to 1; found 0",
    "[objects.sphere]\nlight_field = { volume = true, refracts = true }": r"light_field.*exclude each other",
    "[objects.sphere]\nlight_field = { volume = true, offset_m = 0.1 }": r"light_field.*offset_m and error apply",
    "[objects.sphere]\nlight_field = { offset_m = -0.1 }": r"light_field.offset_m.*greater than 0; found -0.1",
    "exposure_ev = 1.0\nexposure_ev100 = 9.0": r"has two exposures",
    "name = ": r"not a TOML document",
}


@pytest.mark.parametrize("text", WRONG)
def test_what_is_wrong_is_one_line_that_names_file_and_field(tmp_path: Path, text: str) -> None:
    path = written(tmp_path, text)
    with pytest.raises(UserError) as caught:
        load_scene(path)
    said = str(caught.value)
    assert re.search(WRONG[text], said), said
    assert "\n" not in said and said.startswith(str(path)), said


ABOVE, OUTSIDE = 'format = "lambent-scene"\n', r"leaves its folder.*put the file into the scene's folder or below"
WRONG_HEADS = {
    "": r'format: is missing; write format = "lambent-scene" above the first \[table\]',
    ABOVE: r"version: is missing; write version = 1 above the first",
    f"{ABOVE}version = 1\n": r'geometry: is missing; write geometry = "model.glb" above',
    **{HEAD.replace('"builtin:box"', geometry): said for geometry, said in (
        ("3", r"geometry: names no file; found 3"),
        ('{ file = "builtin:box", scale = 0.0 }', r"geometry.0.scale: must be greater than 0; found 0.0"),
        ('["builtin:box", { file = "builtin:box", sclae = 2.0 }]', r"geometry.1.sclae: unknown key; did you mean 'sc"),
        ('"../room.glb"', OUTSIDE), ('"/etc/passwd"', OUTSIDE), ('"a/../../b.glb"', OUTSIDE),
    )},
}  # fmt: skip


@pytest.mark.parametrize("head", WRONG_HEADS)
def test_a_wrong_head_is_said_where_it_is_wrong(tmp_path: Path, head: str) -> None:
    with pytest.raises(UserError, match=WRONG_HEADS[head]):
        load_scene(written(tmp_path, MATERIALS, head))


ASSIGN = (
    MATERIALS
    + """
[assign]
"s*" = "metal"
"gre?n" = "red"
"Wood*" = "white"
"""
)


def test_materials_are_assigned_by_pattern(tmp_path: Path) -> None:
    """Patterns fit names of objects and of the materials they came with; [objects] has the last word."""
    plain = load_scene(written(tmp_path, MATERIALS))
    green = [o.name for o in plain.objects if o.material == "green"]
    scene = load_scene(written(tmp_path, ASSIGN))
    assert green and all(scene.object(name).material == "red" for name in green)
    assert scene.object("sphere").material == "metal"
    assert [w for w in scene.warnings if "assign" in w] == [
        "assign.Wood* matches no object and no material: see the names with `lambent inspect`"
    ]
    over = load_scene(written(tmp_path, ASSIGN + '[objects.sphere]\nmaterial = "black"\n'))
    assert over.object("sphere").material == "black"
    idle = load_scene(written(tmp_path, ASSIGN + '"Oak*" = "metal"\n'))
    assert "assign.Wood* and assign.Oak* match no object and no material: see" in "\n".join(idle.warnings)
    near = load_scene(written(tmp_path, MATERIALS + '[assign]\nspher = "metal"\n'))
    assert "assign.spher matches no object and no material: did you mean 'sphere'?" in near.warnings
    named = load_scene(written(tmp_path, MATERIALS + '[materials."g*"]\nkd = 0.1\n'))
    assert [w for w in named.warnings if "g*" in w] == [
        "materials.g* is a name, not a pattern, and no object has it: assign it under [assign]"
    ]


def test_a_material_of_the_scene_puts_away_the_files_picture(tmp_path: Path) -> None:
    """Described anew or assigned, a material of the geometry file loses its texture; two files' names stay apart."""
    from PIL import Image

    Image.fromarray(np.uint8([[[255, 0, 0], [0, 0, 0]]])).save(tmp_path / "wood.png")
    square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nmtllib {}.mtl\nusemtl Wood_01\nf 1/1 2/2 3/3\n"
    for name, line in (("a", "map_Kd wood.png"), ("b", "Kd 0.1 0.1 0.1")):
        (tmp_path / f"{name}.obj").write_text(f"o {name}\n" + square.format(name))
        (tmp_path / f"{name}.mtl").write_text(f"newmtl Wood_01\n{line}\n")
    head = HEAD.replace('"builtin:box"', '["a.obj", "b.obj"]')
    scene = load_scene(written(tmp_path, "", head))
    assert set(scene.textures) == {"Wood_01"} and scene.object("b").material == "Wood_01_2"
    assert "the second is renamed to Wood_01_2" in " ".join(scene.warnings)
    walnut = "[materials.walnut]\nkd = 0.3\n"
    scene = load_scene(written(tmp_path, walnut + '[assign]\n"Wood*" = "walnut"\n', head))
    assert {o.material for o in scene.objects} == {"walnut"} and "walnut" not in scene.textures
    scene = load_scene(written(tmp_path, "[materials.Wood_01]\nkd = 0.3\n", head))
    assert scene.object("a").material == "Wood_01" and scene.textures == {}


def test_a_measurement_is_no_material_yet(tmp_path: Path) -> None:
    (tmp_path / "oak.txt").write_text("theta_i phi_i theta_o phi_o brdf\n" + "0 0 30 0 0.1\n0 0 60 0 0.1\n" * 4)
    with pytest.raises(UserError, match=r"materials.oak.file: is a measurement.*lambent fit oak.txt -o oak.json"):
        load_scene(written(tmp_path, '[materials.oak]\nfile = "oak.txt"\n'))


def test_a_mitsuba_scene_as_geometry(tmp_path: Path) -> None:
    """Its light and cameras come with it, unless the scene says otherwise."""
    (tmp_path / "room.xml").write_text("""<scene version="3.0.0"><shape type="cube" id="box"/>
        <emitter type="constant"><rgb name="radiance" value="0.5"/></emitter><sensor type="perspective" id="eye">
        <transform name="to_world"><lookat origin="0, 0, 5" target="0, 0, 0"/></transform></sensor></scene>""")
    head = HEAD.replace("builtin:box", "room.xml")
    scene = load_scene(written(tmp_path, "", head))
    assert scene.environment == ConstantEnvironment((0.5,) * 3) and [c.name for c in scene.cameras] == ["eye"]
    own = load_scene(written(tmp_path, "[environment]\nkind = 'constant'\nradiance = [1.0, 2.0, 3.0]\n", head))
    assert own.environment == ConstantEnvironment((1, 2, 3))


def test_of_two_rules_that_fit_the_later_wins() -> None:
    objects = [SceneObject(name, patch((0, 0, 0), (1, 0, 0), (0, 1, 0)), "plain") for name in ("chair_1", "chair_2")]
    rules, materials = {"chair_*": "oak", "chair_2": "ash"}, dict.fromkeys(("oak", "ash"), Material())
    found, warnings = assigned(rules, objects, materials, Path("scene.toml"))
    assert [o.material for o in found] == ["oak", "ash"] and not warnings
