"""Mitsuba scenes, against Mitsuba itself: geometry, texture coordinates, cameras, skies, colours of BSDFs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baking.engine import engine
from lambent.baking.tracing.scene_builder import SceneBuilder, environment_dict
from lambent.core.geometry.directions import normalize
from lambent.core.pictures.images import write_image
from lambent.core.views.camera import camera_axes
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Material
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.scene import (
    SUN_RADIUS_DEG,
    ConstantEnvironment,
    DirectionalLight,
    ImageEnvironment,
    PointLight,
    Scene,
    SunSky,
)
from lambent.scenes.validation import validate
from tests.scenes.loaders.pictures import png

BALL = '<shape type="sphere" id="ball"/>'


def written(folder: Path, body: str, version: str = "3.0.0") -> Path:
    path = folder / "scene.xml"
    path.write_text(f'<scene version="{version}">{body}</scene>', encoding="utf-8")
    return path


def both(folder: Path, body: str, version: str = "3.0.0") -> tuple[Any, Scene]:
    """What Mitsuba and what Lambent makes of a scene."""
    engine()
    import mitsuba as mi

    path = written(folder, body, version)
    return mi.load_file(str(path)), load_scene(path)


SHAPES = """
<shape type="rectangle"><transform name="to_world"><rotate y="1" angle="20"/><translate x="-6"/></transform></shape>
<shape type="cube">
  <transform name="to_world"><rotate x="1" angle="33"/><rotate y="1" angle="20"/><translate x="-3"/></transform></shape>
<shape type="sphere"><point name="center" x="0.1" y="0" z="0"/><float name="radius" value="0.9"/>
  <transform name="to_world"><scale value="0.9"/><rotate x="1" angle="50"/></transform></shape>
<shape type="disk"><transform name="to_world"><rotate x="1" angle="-30"/><translate x="3"/></transform></shape>
<shape type="cylinder"><point name="p0" value="6, -1, 0"/><point name="p1" value="6.3, 1, 0.2"/>
  <float name="radius" value="0.8"/></shape>
<shape type="obj"><string name="filename" value="quad.obj"/>
  <transform name="to_world"><matrix value="-1 0 0 9  0 1 0 0  0 0 1 0  0 0 0 1"/></transform></shape>
<shape type="ply"><string name="filename" value="quad.ply"/>
  <transform name="to_world"><lookat origin="12, 0, 0" target="12.5, 0, 1" up="0, 1, 0"/></transform></shape>
<shapegroup/>
"""
QUAD = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
UV = [(0, 0), (1, 0), (1, 1), (0, 1)]


def _quads(folder: Path) -> None:
    lines = [f"v {x} {y} {z}" for x, y, z in QUAD] + [f"vt {u} {v}" for u, v in UV] + ["f 1/1 2/2 3/3 4/4"]
    (folder / "quad.obj").write_text("\n".join(lines) + "\n")
    head = "ply\nformat ascii 1.0\nelement vertex 4\n" + "".join(
        f"property float {c}\n" for c in ("x", "y", "z", "u", "v")
    )
    head += "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    rows = [f"{x} {y} {z} {u} {v}" for (x, y, z), (u, v) in zip(QUAD, UV, strict=True)]
    (folder / "quad.ply").write_text(head + "\n".join([*rows, "3 0 1 2", "3 0 2 3"]) + "\n")


@pytest.mark.long
def test_shapes_lie_where_mitsuba_has_them(tmp_path: Path) -> None:
    """Rays meet the same points, normals and texture coordinates (whose v is turned), whatever the shape."""
    _quads(tmp_path)
    theirs, scene = both(tmp_path, SHAPES.replace("<shapegroup/>", ""))
    import mitsuba as mi

    ours = SceneBuilder(scene).build()
    random = np.random.default_rng(1)
    target = np.stack([random.uniform(-7.5, 13.5, 6000), *random.uniform(-1, 1, (2, 6000))])
    origin = target + 20 * normalize(random.normal(size=(6000, 3))).T
    way = normalize((target - origin).T).T
    ray = mi.Ray3f(mi.Point3f(origin.astype(np.float32)), mi.Vector3f(way.astype(np.float32)))
    a, b = theirs.ray_intersect(ray), ours.ray_intersect(ray)
    t_a, t_b = np.array(a.t), np.array(b.t)
    hit = np.isfinite(t_a) & np.isfinite(t_b)
    assert hit.sum() > 2000 and (np.isfinite(t_a) != np.isfinite(t_b)).mean() < 0.002  # tessellated rims
    with np.errstate(invalid="ignore"):
        near = hit & (np.abs(t_a - t_b) < 0.02)
    assert near.sum() > 0.995 * hit.sum()
    normals = np.sum(np.array(a.sh_frame.n) * np.array(b.sh_frame.n), axis=0)[near]
    assert np.quantile(normals, 0.01) > 0.995 and normals.min() > 0.9
    uv_a, uv_b = np.array(a.uv)[:, near], np.array(b.uv)[:, near]
    off = np.abs(np.stack([uv_a[0] - uv_b[0], 1 - uv_a[1] - uv_b[1]]))
    assert np.quantile(np.minimum(off, np.abs(1 - off)), 0.99) < 0.03
    # u runs the same way: what is brushed is brushed alike
    along_a, along_b = normalize(np.array(a.dp_du).T)[near], normalize(np.array(b.dp_du).T)[near]
    assert np.quantile(np.sum(along_a * along_b, axis=-1), 0.02) > 0.99
    assert validate(scene) == []


CAMERAS = [
    ("perspective", '<float name="fov" value="40"/>', 640, 360),
    ("perspective", '<float name="fov" value="40"/><string name="fov_axis" value="y"/>', 640, 360),
    ("perspective", '<float name="fov" value="40"/><string name="fov_axis" value="smaller"/>', 300, 400),
    ("thinlens", '<float name="fov" value="70"/><string name="fov_axis" value="larger"/>', 300, 400),
    ("perspective", '<float name="fov" value="70"/><string name="fov_axis" value="diagonal"/>', 640, 360),
    ("perspective", '<string name="focal_length" value="35mm"/>', 640, 360),
]
STANDS = [
    '<lookat origin="1, 2, 3" target="-1, 0.5, 0" up="0, 1, 0"/>',
    '<matrix value="0.264209 0.071763 -0.961792 5 -2.8e-008 0.997228 0.074407 0.7 '
    '0.964465 -0.019659 0.263476 -2 0 0 0 1"/>',
]


@pytest.mark.parametrize("kind,said,width,height", CAMERAS)
def test_cameras_see_what_mitsubas_see(tmp_path: Path, kind: str, said: str, width: int, height: int) -> None:
    import mitsuba as mi

    if kind == "thinlens":
        said += '<float name="aperture_radius" value="0.0001"/>'
    film = (
        f'<film type="hdrfilm"><integer name="width" value="{width}"/><integer name="height" value="{height}"/></film>'
    )
    for stand in STANDS:
        body = f'<sensor type="{kind}">{said}<transform name="to_world">{stand}</transform>{film}</sensor>{BALL}'
        theirs, scene = both(tmp_path, body)
        (camera,) = scene.cameras
        right, up, ahead = camera_axes(camera)
        for x, y in ((0.5, 0.5), (0.0, 0.0), (1.0, 0.25)):
            ray, _ = theirs.sensors()[0].sample_ray(0, 0.5, mi.Point2f(x, y), mi.Point2f(0.5, 0.5))
            half = np.tan(np.radians(camera.fov_y_deg) / 2)
            way = normalize(ahead + right * (2 * x - 1) * half * width / height + up * (1 - 2 * y) * half)
            assert np.allclose(np.array(ray.d).ravel(), way, atol=2e-4)
        assert camera.position == pytest.approx(
            np.array(theirs.sensors()[0].world_transform().matrix)[:3, 3].ravel(), abs=1e-4
        )


def test_a_scene_that_stands_along_z_is_turned(tmp_path: Path) -> None:
    """Seen through its camera it looks the same, sky and lamps included."""
    write_image(tmp_path / "sky.exr", np.random.default_rng(0).random((16, 32, 3)).astype(np.float32))
    body = """
    <sensor type="perspective"><float name="fov" value="60"/>
      <transform name="to_world"><lookat origin="3, -4, 2" target="0, 0, 0.5" up="0, 0, 1"/></transform></sensor>
    <shape type="cube" id="box"><transform name="to_world"><translate z="1"/></transform></shape>
    <emitter type="point"><point name="position" value="1, 2, 5"/><rgb name="intensity" value="1 2 3"/></emitter>
    <emitter type="envmap"><string name="filename" value="sky.exr"/>
      <transform name="to_world"><rotate x="1" angle="90"/><rotate z="1" angle="40"/></transform></emitter>"""
    theirs, scene = both(tmp_path, body)
    import mitsuba as mi

    assert any("z up" in w for w in scene.warnings)
    low, high = scene.object("box").mesh.bounds
    assert np.allclose(low, (-1, 0, -1), atol=1e-6) and np.allclose(high, (1, 2, 1), atol=1e-6)
    camera, (lamp,) = scene.cameras[0], scene.lights
    assert camera.position == pytest.approx((3, 2, 4), abs=1e-6) and camera.up[1] > 0.9
    assert isinstance(lamp, PointLight) and lamp.position == pytest.approx((1, 5, -2), abs=1e-6)
    assert isinstance(scene.environment, ImageEnvironment)
    ways = normalize(np.random.default_rng(2).normal(size=(500, 3)))
    turned = ways @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], float).T  # ours to theirs: y to z
    emitter = mi.load_dict(environment_dict(scene.environment))
    emitter.set_scene(mi.load_dict({"type": "scene", "environment": emitter}))
    import drjit as dr

    looks = []
    for light, w in ((emitter, ways), (theirs.environment(), turned)):
        si = dr.zeros(mi.SurfaceInteraction3f, len(w))
        si.wi = mi.Vector3f(np.ascontiguousarray(-w.T, dtype=np.float32))
        looks.append(np.array(light.eval(si)))
    assert np.allclose(*looks, atol=2e-3)


def test_textures_lie_as_mitsubas(tmp_path: Path) -> None:
    """A picture of eight colours, scaled, moved and turned: what Mitsuba reads at uv is what we read at (u, 1 - v)."""
    engine()
    import mitsuba as mi

    texels = np.random.default_rng(3).integers(0, 255, (4, 2, 3))
    png(tmp_path / "eight.png", texels)
    moves = [
        ("", {}),
        ('<transform name="to_uv"><scale x="2" y="3"/><translate x="0.25" y="0.125"/></transform>',
         mi.ScalarTransform4f().translate([0.25, 0.125, 0]).scale([2, 3, 1])),
        ('<transform name="to_uv"><rotate z="1" angle="30"/></transform>',
         mi.ScalarTransform4f().rotate([0, 0, 1], 30)),
    ]  # fmt: skip
    for text, move in moves:
        body = f"""<shape type="rectangle"><bsdf type="diffuse" id="m"><texture type="bitmap" name="reflectance">
            <string name="filename" value="eight.png"/>{text}</texture></bsdf></shape>"""
        scene = load_scene(written(tmp_path, body))
        texture = scene.textures["m"].diffuse
        assert texture is not None
        plugin = {"type": "bitmap", "filename": str(tmp_path / "eight.png"), "filter_type": "nearest"}
        theirs = mi.load_dict(plugin | ({"to_uv": move} if text else {}))
        import drjit as dr

        uv = np.random.default_rng(4).random((200, 2))
        si = dr.zeros(mi.SurfaceInteraction3f, len(uv))
        si.uv = mi.Point2f(uv.T.astype(np.float32))
        u, v = np.array(texture.uv_transform) @ np.stack([uv[:, 0], 1 - uv[:, 1], np.ones(200)])
        ours = texture.texels[((1 - v) % 1 * 4).astype(int), (u % 1 * 2).astype(int)] * np.array(
            scene.materials["m"].kd
        )
        same = np.abs(ours - np.array(theirs.eval(si)).T).max(axis=1) < 2e-3
        assert same.mean() > 0.98  # a point may lie on a border


def test_old_scales_and_a_checkerboard(tmp_path: Path) -> None:
    body = """<shape type="rectangle"><bsdf type="diffuse" id="m"><texture type="checkerboard" name="reflectance">
        <rgb name="color0" value="0.8, 0.4, 0.2"/><rgb name="color1" value="0"/>
        <float name="uscale" value="4"/><float name="voffset" value="0.25"/></texture></bsdf></shape>"""
    scene = load_scene(written(tmp_path, body, "0.6.0"))
    texture = scene.textures["m"].diffuse
    assert texture is not None and scene.materials["m"].kd == pytest.approx((0.4, 0.2, 0.1))
    assert texture.uv_transform == ((4, 0, 0), (0, 1, -0.25))
    assert np.allclose(texture.texels[[0, -1, 0, -1], [0, -1, -1, 0], 0], [2, 2, 0, 0])


@pytest.mark.long
def test_sheets_masks_and_what_is_lost(tmp_path: Path) -> None:
    png(tmp_path / "leaf.png", [[[0, 255, 0, 255], [0, 0, 0, 0]]])
    body = """
    <bsdf type="dielectric" id="glass"/><bsdf type="thindielectric" id="pane"/>
    <bsdf type="mask" id="leaf">
      <texture type="bitmap" name="opacity"><string name="filename" value="leaf.png"/></texture>
      <bsdf type="twosided"><bsdf type="diffuse"><texture type="bitmap" name="reflectance">
        <string name="filename" value="leaf.png"/></texture></bsdf></bsdf></bsdf>
    <bsdf type="mask" id="veil"><float name="opacity" value="0.25"/><bsdf type="diffuse"/></bsdf>
    <bsdf type="bumpmap" id="bump"><texture type="checkerboard"/><bsdf type="diffuse"/></bsdf>
    <bsdf type="hair" id="fur"/>
    <shape type="sphere"><ref id="glass"/></shape><shape type="sphere"><ref id="pane"/></shape>
    <shape type="sphere"><ref id="leaf"/></shape><shape type="sphere"><ref id="veil"/></shape>
    <shape type="sphere"><ref id="bump"/></shape><shape type="sphere" id="beast"><ref id="fur"/></shape>
    <shape type="sphere"><bsdf type="null"/></shape><shape type="sdfgrid"/>
    <shape type="sphere"><bsdf type="diffuse"><float name="shine" value="1"/></bsdf></shape>"""
    scene = load_scene(written(tmp_path, body))
    m, said = scene.materials, "\n".join(scene.warnings)
    glass, pane = m["glass"], m["pane"]
    assert 0.04 < glass.lobes[0].r0[0] < 0.05 and glass.transmits and 0.07 < pane.lobes[0].r0[0] < 0.1
    assert MaterialBSDF(glass).albedo(np.array([0.0, 0, 1]))[0] == pytest.approx(1, abs=0.01)
    leaf = scene.textures["leaf"]
    assert leaf.opacity is not None and leaf.opacity.texels.ravel().tolist() == [1, 0]
    assert m["leaf"].kd == pytest.approx((0, 1, 0))  # the mean of what is to be seen
    assert m["veil"].kd == pytest.approx((0.125,) * 3) and m["veil"].lobes[0].k == (0.75,) * 3
    for words in ("light is not refracted", "alpha channel", "bump map is ignored", "no surface (null)", "unknown kind",
                  "fur (hair): unknown, it becomes grey", "ignored: shine"):  # fmt: skip
        assert said.count(words) == 1, (words, said)
    assert len(scene.objects) == 7 and m["fur"].kd == (0.5,) * 3


def test_old_names_defaults_includes_and_instances(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "materials.xml").write_text(
        '<scene version="0.6.0"><default name="tone" value="0.9"/><bsdf type="diffuse" id="paint">'
        '<srgb name="reflectance" value="#ff8000"/></bsdf></scene>'
    )
    body = """
    <default name="size" value="2"/><default name="tone" value="0.25"/>
    <include filename="parts/materials.xml"/>
    <shape type="shapegroup" id="group"><shape type="rectangle"><ref id="paint"/></shape></shape>
    <shape type="instance"><ref id="group"/><transform name="toWorld"><scale value="$size"/></transform></shape>
    <shape type="instance"><ref id="group"/><transform name="toWorld"><translate x="5"/></transform></shape>
    <shape type="disk" id="grey"><bsdf type="diffuse"><spectrum name="reflectance" value="$tone"/></bsdf>
      <boolean name="flipNormals" value="true"/>
      <emitter type="area"><spectrum name="radiance" value="3"/></emitter></shape>
    <emitter type="directional"><vector name="direction" x="0" y="-2" z="0"/>
      <spectrum name="irradiance" value="2"/></emitter>
    <emitter type="constant"><rgb name="radiance" value="0.1, 0.2, 0.3"/></emitter>
    <emitter type="sunsky"/>"""
    scene = load_scene(written(tmp_path, body, "0.6.0"))
    first, second, grey = scene.objects
    assert np.allclose(first.mesh.bounds, [(-2, -2, 0), (2, 2, 0)]) and second.mesh.bounds[0][0] == pytest.approx(4)
    assert first.material == second.material == "paint"
    assert scene.materials["paint"].kd == pytest.approx((1, 0.2159, 0), abs=1e-3)
    assert scene.materials[grey.material].kd == (0.25,) * 3 and grey.emission == (3, 3, 3)
    assert np.allclose(grey.mesh.normals, (0, 0, -1)) and [c.name for c in scene.cameras] == ["overview"]
    (sun,) = scene.lights
    assert isinstance(sun, DirectionalLight) and sun.direction == (0, -1, 0) and sun.irradiance == (2, 2, 2)
    assert scene.environment == ConstantEnvironment((0.1, 0.2, 0.3)) and scene.exposure_ev is None
    assert "a scene has one environment" in " ".join(scene.warnings)
    assert {p.name for p in scene.sources} == {"scene.xml", "materials.xml"}


@pytest.mark.long
def test_the_living_room(shared_data: Path) -> None:
    """A real interior of version 0.6 loads as it is."""
    scene = load_scene(shared_data / "scenes" / "living-room" / "scene.xml")
    assert len(scene.objects) == 65 and sum(len(o.mesh.faces) for o in scene.objects) == pytest.approx(
        143_000, rel=0.01
    )
    assert set(scene.textures) == {"Floor", "TableWood", "Painting", "Leaves"}
    assert scene.textures["Leaves"].opacity is not None and scene.textures["Floor"].diffuse is not None
    assert isinstance(scene.environment, ImageEnvironment) and scene.environment.rotation_deg == -90
    assert scene.environment.file.name == "Sky 19.exr" and len(scene.sources) == 1 + 65 + 4 + 1
    assert scene.cameras[0].fov_y_deg == pytest.approx(2 * np.degrees(np.arctan(9 / 16)), abs=1e-6)
    assert scene.materials["Floor"].lobes[0].mx == pytest.approx(0.15) and scene.materials["Floor"].kd_coupled
    assert not any("is missing" in w or "unknown" in w for w in scene.warnings)


@pytest.mark.parametrize(
    ("said", "inner", "outer"),
    [
        ("", 15.0, 20.0),
        ('<float name="cutoff_angle" value="40"/>', 30.0, 40.0),
        ('<float name="cutoff_angle" value="40"/><float name="beam_width" value="10"/>', 10.0, 40.0),
    ],
)
def test_a_spots_beam_is_three_quarters_of_its_cone(tmp_path: Path, said: str, inner: float, outer: float) -> None:
    (lamp,) = load_scene(written(tmp_path, f'<emitter type="spot">{said}</emitter>{BALL}')).lights
    assert isinstance(lamp, PointLight)
    assert (lamp.inner_deg, lamp.outer_deg) == pytest.approx((inner, outer))


@pytest.mark.parametrize(("kind", "sun", "sky"), [("sunsky", 6.0, 15.0), ("sky", 0.0, 15.0), ("sun", 6.0, 0.0)])
def test_daylight_is_scaled_as_a_whole_and_by_parts(tmp_path: Path, kind: str, sun: float, sky: float) -> None:
    body = f"""<emitter type="{kind}"><vector name="sun_direction" value="0, 0.6, 0.8"/><float name="scale" value="3"/>
        <float name="sun_scale" value="2"/><float name="sky_scale" value="5"/><float name="turbidity" value="4"/>
        </emitter>{BALL}"""
    made = load_scene(written(tmp_path, body)).environment
    assert isinstance(made, SunSky)
    assert (made.sun_scale, made.sky_scale, made.turbidity) == pytest.approx((sun, sky, 4))
    assert np.linalg.norm(made.sun_direction) == pytest.approx(1)


@pytest.mark.long
@pytest.mark.parametrize(
    ("said", "radius_deg"),
    [
        ("", SUN_RADIUS_DEG),
        ('<float name="sunRadiusScale" value="18.8131"/>', 18.8131 * SUN_RADIUS_DEG),
        ('<float name="sun_aperture" value="2"/>', 1.0),
        ('<float name="sunRadiusScale" value="0"/>', 0.05),
        ('<float name="sun_aperture" value="170"/>', 30.0),
    ],
)
def test_the_suns_radius_is_read(tmp_path: Path, said: str, radius_deg: float) -> None:
    sky = f'<emitter type="sunsky"><vector name="sunDirection" x="0" y="1" z="0"/>{said}</emitter>'
    scene = load_scene(written(tmp_path, sky + BALL))
    assert isinstance(scene.environment, SunSky)
    assert scene.environment.sun_radius_deg == pytest.approx(radius_deg)
    notes = " ".join(scene.warnings)
    assert "ignored: sun" not in notes and "ground of its albedo" in notes
    assert ("sun's radius" in notes) == (radius_deg in (0.05, 30.0))


@pytest.mark.long
def test_lamps_beside_a_sky_are_in_its_unit(tmp_path: Path) -> None:
    """Mitsuba's sky is in W/(sr m^2 nm): of equal light, both are as bright as before beside each other."""
    lamp = '<emitter type="point"><rgb name="intensity" value="2"/></emitter>'
    glow = '<shape type="sphere"><emitter type="area"><rgb name="radiance" value="1"/></emitter></shape>'
    sky = '<emitter type="sunsky"><vector name="sunDirection" x="0" y="1" z="0"/></emitter>'
    for more, unit in (("", 1.0), (sky, 683 * 106.856 / 179)):
        scene = load_scene(written(tmp_path, lamp + glow + more + BALL))
        (point,) = scene.lights
        assert isinstance(point, PointLight) and point.intensity == pytest.approx((2 * unit,) * 3)
        assert max(o.emission for o in scene.objects) == pytest.approx((unit,) * 3)
        assert ("in the unit of its sky" in " ".join(scene.warnings)) == bool(more)


@pytest.mark.parametrize(("channel", "byte"), [("r", 40), ("g", 120), ("b", 200), ("a", 90)])
def test_one_channel_of_a_bitmap(tmp_path: Path, channel: str, byte: int) -> None:
    png(tmp_path / "four.png", np.full((2, 2, 4), (40, 120, 200, 90)))
    body = f"""<shape type="rectangle"><bsdf type="diffuse" id="m"><texture type="bitmap" name="reflectance">
        <string name="filename" value="four.png"/><boolean name="raw" value="true"/>
        <string name="channel" value="{channel}"/></texture></bsdf></shape>"""
    kd = load_scene(written(tmp_path, body)).materials["m"].kd
    assert kd == pytest.approx((byte / 255,) * 3, rel=2e-3)


@pytest.mark.long
def test_parameters_of_principled_are_kept_within_their_ranges(tmp_path: Path) -> None:
    def mirror(metallic: float, roughness: float) -> Material:
        made = f"""<bsdf type="principled" id="m"><rgb name="base_color" value="1 .5 .2"/>
            <float name="metallic" value="{metallic}"/><float name="roughness" value="{roughness}"/></bsdf>"""
        return load_scene(written(tmp_path, f'{made}<shape type="sphere"><ref id="m"/></shape>')).materials["m"]

    assert mirror(2.0, 3.0) == mirror(1.0, 1.0) and mirror(-1.0, -2.0) == mirror(0.0, 0.0)
