"""A room in centimetres, exported from Blender and read back: places, sizes, lamps, materials, and what is left out."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lambent.core.geometry.latlong import lat_long_directions
from lambent.core.light.photometry import LM_PER_W
from lambent.core.pictures.images import read_image
from lambent.core.views.camera import clip_from_world
from lambent.materials.document import Material
from lambent.scenes.loaders.gltf.container import read
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.scene import IesLight, ImageEnvironment
from tests.integrations.blender_scenes.ies import write_constant

CM = 0.01
UPRIGHT = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])  # y up of z up
CANDELA = 1000.0


@pytest.fixture(scope="module")
def room(blender, tmp_path_factory):
    """What Blender says of the room, and the scene that Lambent reads of the same file."""
    folder = tmp_path_factory.mktemp("room")
    write_constant(folder / "lamp.ies", CANDELA)
    (folder / "measured").mkdir()
    Material(name="measured oak", kd=(0.5, 0.25, 0.1)).save(folder / "measured/oak.json")
    (folder / "measured/tile.txt").write_text("a table\n")
    return blender("room", folder), load_scene(folder / "room.blend")


def lights_of(scene):
    return {light.name: light for light in scene.lights}


def boxes(scene):
    return {o.name: np.array([o.mesh.positions.min(axis=0), o.mesh.positions.max(axis=0)]) for o in scene.objects}


def in_metres(box):
    turned = np.array(box) @ UPRIGHT.T * CM
    return np.array([turned.min(axis=0), turned.max(axis=0)])


def test_evaluated_meshes_stand_where_blender_has_them(room):
    truth, scene = room
    found = boxes(scene)
    expected = {name: [in_metres(box) for box in copies] for name, copies in truth["boxes"].items()}
    for name in ("back", "Stuhl/0", "Stuhl/1", "Stuhl/2", "row", "sign"):
        assert found[name] == pytest.approx(expected[name][0], abs=2e-4), name  # flush surfaces are raised by less
    copies = sorted((found[name] for name in ("floor", "floor_2", "floor_3")), key=lambda box: box[0, 0])
    assert np.array(copies) == pytest.approx(np.array(sorted(expected["floor"], key=lambda box: box[0, 0])), abs=2e-4)
    parts = np.array([found["two_Wand ä/1"], found["two_tile"]])
    assert [parts[:, 0].min(axis=0), parts[:, 1].max(axis=0)] == pytest.approx(expected["two"][0], abs=2e-4)


def test_modifiers_are_applied_and_hidden_things_left_out(room):
    _, scene = room
    assert len(scene.object("row").mesh.faces) == 4 * 12
    assert not [o.name for o in scene.objects if "hidden" in o.name or "excluded" in o.name]


def test_linked_duplicates_share_their_mesh(room):
    path = next(p for p in room[1].sources if p.suffix == ".glb")
    document = read(path, None).document
    meshes = {node.name: node.mesh for node in document.nodes if node.mesh is not None}
    assert len({meshes[f"Stuhl/{i}"] for i in range(3)}) == 1
    kits = [node.mesh for node in document.nodes if node.name == "floor"]
    assert len(kits) == 3 and len(set(kits)) == 2


def test_faces_look_outwards_after_the_change_of_axes(room):
    _, scene = room
    mesh = scene.object("Stuhl/1").mesh
    a, b, c = (mesh.positions[mesh.faces[:, i]] for i in range(3))
    outward = (a + b + c) / 3 - mesh.positions.mean(axis=0)
    assert ((np.cross(b - a, c - a) * outward).sum(axis=1) > 0).all()


@pytest.mark.parametrize("name", ["door", "upright"])
def test_cameras_project_as_blenders(room, name):
    truth, scene = room
    camera = next(c for c in scene.cameras if c.name == name)
    points = np.random.default_rng(1).uniform((-200, -150, 0), (200, 150, 250), (50, 3))
    ours = np.c_[points @ UPRIGHT.T * CM, np.ones(50)] @ clip_from_world(camera, 800, 600, 0.1).T
    blenders = np.c_[points, np.ones(50)] @ np.array(truth["cameras"][name]).T
    assert ours[:, :2] / ours[:, 3:] == pytest.approx(blenders[:, :2] / blenders[:, 3:], rel=1e-4, abs=1e-4)


def test_the_active_camera_is_the_first(room):
    assert [c.name for c in room[1].cameras] == ["door", "upright", "shifted"]


def test_point_and_spot_have_watts_over_the_sphere(room):
    lights = lights_of(room[1])
    assert lights["bulb"].intensity == pytest.approx(40 / (4 * math.pi) * np.array([1, 0.5, 0.25]), rel=1e-5)
    assert lights["bulb"].position == pytest.approx((0, 2, 0), abs=1e-6)
    spot = lights["spot"]
    assert spot.intensity == pytest.approx([60 / (4 * math.pi)] * 3, rel=1e-5)
    assert spot.position == pytest.approx((0.5, 2.4, -0.2), abs=1e-6)
    edge = math.cos(0.5)
    assert spot.outer_deg == pytest.approx(math.degrees(0.5), rel=1e-5)
    assert math.cos(math.radians(spot.inner_deg)) == pytest.approx(edge + 0.4 * (1 - edge), rel=1e-6)
    x, y = math.radians(20), math.radians(10)  # turned about x, then about y
    assert spot.direction == pytest.approx(
        (-math.sin(y) * math.cos(x), -math.cos(y) * math.cos(x), -math.sin(x)), abs=1e-6
    )


def test_a_sun_has_its_irradiance(room):
    sun = lights_of(room[1])["sharp sun"]
    assert sun.irradiance == pytest.approx([2, 2, 2])
    assert sun.direction == pytest.approx(UPRIGHT @ turned_down(10, 60), abs=1e-6)


def turned_down(x_deg, z_deg):
    """-z turned about x, then about z, in Blender's space."""
    x, z = math.radians(x_deg), math.radians(z_deg)
    return np.array([-math.sin(z) * math.sin(x), math.cos(z) * math.sin(x), -math.cos(x)])


def test_a_soft_sun_is_a_disc_in_the_picture_of_the_world(room):
    environment = room[1].environment
    assert isinstance(environment, ImageEnvironment) and environment.rotation_deg == 0
    picture = read_image(environment.file)[..., :3]
    height, width = picture.shape[:2]
    w = lat_long_directions(height, width)
    solid_angle = (np.pi / height) ** 2 * np.sqrt(w[..., 0] ** 2 + w[..., 2] ** 2)
    towards = -(UPRIGHT @ turned_down(40, 30))
    cosine = w @ towards
    irradiance = (picture * (solid_angle * np.maximum(cosine, 0))[..., None]).sum(axis=(0, 1))
    assert irradiance == pytest.approx([3, 3, 3], rel=1e-3)
    shines = picture[..., 0] > picture.max() / 2
    assert np.degrees(np.arccos(cosine[shines].min())) == pytest.approx(math.degrees(0.1), abs=0.2)
    assert solid_angle[shines].sum() == pytest.approx(2 * np.pi * (1 - math.cos(0.1)), rel=0.01)


def test_area_lamps_emit_their_flux_downwards(room):
    scene = room[1]
    turned = np.array([0.6, 2 * 0.3])
    for name, watts, area in (
        ("panel", 20.0, turned.prod()),
        ("disc 1", 10.0, math.pi * 0.2**2),
        ("bare", 2.0 * 2 * 0.5**2, 0.5**2),
    ):
        o = scene.object(name)
        a, b, c = (o.mesh.positions[o.mesh.faces[:, i]] for i in range(3))
        normals = np.cross(b - a, c - a) / 2
        area_m2 = np.linalg.norm(normals, axis=1).sum()
        assert area_m2 == pytest.approx(area, rel=2e-3)
        assert np.array(o.emission) * math.pi * area_m2 == pytest.approx([watts] * 3, rel=1e-4), name
        assert (normals[:, 1] < 0).all() and not any(scene.materials[o.material].kd)


def test_luminaires_shine_from_their_files(room):
    lights = lights_of(room[1])
    down, washer = lights["downlight"], lights["washer"]
    assert isinstance(down, IesLight) and isinstance(washer, IesLight)
    assert np.array(down.scale) * down.photometry.table.max() == pytest.approx([CANDELA / LM_PER_W] * 3)
    # horizontal angle 0 is Blender's -y, turned by 25 degrees about z
    z = math.radians(25)
    assert down.axes[0] == pytest.approx(UPRIGHT @ [math.sin(z), -math.cos(z), 0], abs=1e-6)
    # 1e4 of Blender's watts are 1 W here, times .5 of the texture
    assert np.array(washer.scale) / down.scale == pytest.approx(0.5 * np.array([1, 0.9, 0.8]), rel=1e-3)


def test_materials_come_from_documents_images_and_principled_nodes(room):
    _, scene = room
    assert scene.materials["oak"].kd == (0.5, 0.25, 0.1)
    assert set(scene.measured) == {"tile"} and scene.measured["tile"].read_text() == "a table\n"
    texels = scene.textures["painted"].diffuse.texels[..., :3]
    left, right = texels[:, 0].mean(axis=0), texels[:, -1].mean(axis=0)
    assert left[0] > left[2] and right[2] > right[0]
    assert scene.object("sign").emission == pytest.approx((3, 3, 3))
    assert scene.exposure_ev == 1.5


def test_a_flagged_collection_is_a_light_group(room):
    (group,) = room[1].light_groups
    assert group.name == "evening" and set(group.members) == {"spot", "sign"}


def test_the_report_says_what_is_not_carried(room):
    said = "\n".join(room[1].warnings)
    for part in (
        "light disc 1: its spread of 57.3 degrees",
        "1 point and spot lights have a radius", "missing.json cannot be read (No such file or directory): it stays",
        "light follows the table tile.txt", "camera shifted: its shift", "camera plan: left out",
    ):  # fmt: skip
        assert part in said
