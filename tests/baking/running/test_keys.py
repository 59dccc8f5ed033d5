"""Which arrays get new keys where one input of a bake changes, and which keep them: no array is baked, nor traced.

A key that misses an input reuses stale light silently; one with an input too many bakes again for nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baking.bake import found
from lambent.baking.context import BakeContext
from lambent.baking.interreflection.settings import Bounces
from lambent.baking.methods import chosen
from lambent.baking.quality import Quality
from lambent.baking.transport.view import View
from lambent.core.pictures.images import write_image
from lambent.core.views.camera import Camera, CameraPath
from lambent.materials.document import Lobe, Material, Provenance
from lambent.materials.factored.of_models import editable
from lambent.materials.models.phong import Phong
from lambent.materials.slope_curve import NODES_RHO
from lambent.scenes.geometry import patch, placed, sphere
from lambent.scenes.grids import Grid
from lambent.scenes.looks.textures import CHANNELS
from lambent.scenes.scene import (
    ComputedEnvironment,
    ConstantEnvironment,
    DirectionalLight,
    ImageEnvironment,
    LightFieldWish,
    LightGroup,
    Look,
    MaterialTextures,
    Mesh,
    PointLight,
    ReflectorRule,
    Scene,
    SceneObject,
    SunSky,
    Texture,
    Variant,
)
from lambent.store.store import Store
from tests.baking.small_scenes import GREY, MIRROR, TINY

NOTHING: tuple[str, ...] = ()
SHARES = "light_map/probe_share"
PROBES = ("probe/", "answer/probe/", SHARES)
FIELDS = ("light_field/",)
ANSWER = ("answer/",)
BAKED = ("light_map/", "lamps/", *PROBES, *FIELDS, *ANSWER)
OF_BALL = ("probe/ball/", "answer/probe/ball/", SHARES)
CAMERA = Camera("front", (0.0, 1.0, 2.0), (0.0, 1.0, 0.0))
SEEN = View(CAMERA, 8, 6)
REFLECTED = tuple(SEEN.name("relighting", part) for part in ("spans", "points", "values", "errors", "lamps"))
LIT = (*BAKED, *REFLECTED)  # whatever light falls on
BOUNCED = SEEN.name("interreflection", "")  # of every material, where one that is not Lambertian scatters otherwise
VISIBLE = (SEEN.name("visibility", ""), SEEN.name("transport", ""), SEEN.name("interreflection", ""))
POINTS = (SEEN.name("view_points", ""), *VISIBLE)
SHINING = (SEEN.name("view_points", "backdrop"), *VISIBLE)
LIGHTS = (*BAKED, *SHINING, SEEN.name("relighting", "lamps"))
LOOK = (*LIT, *POINTS)  # where light falls, and where on it the viewer looks
SKY = ("environment/", *BAKED, *SHINING, SEEN.name("relighting", "light"))
SURFACES = ("geometry/", *LOOK)


def of_terms(*terms: str) -> tuple[str, ...]:
    """Transport of terms MATERIAL/NUMBER, and its list."""
    return tuple(SEEN.name("transport", f"{n}/{part}") for n in (400,) for part in ("terms", *terms))


Keys = Callable[..., dict[str, str]]
Answers = dict[str, tuple[Any, tuple[str, ...]]]  # by field: a value that it has not yet, and prefixes of stale arrays
VIEW = Camera("view", (0.0, 1.0, 3.0), (0.0, 1.0, 0.0))

MESH: Answers = {
    "positions": (lambda a: a + np.float32(0.001), SURFACES),
    "normals": (lambda a: -a, SURFACES),
    "tangents": (lambda a: -a, SURFACES),
    "uv": (lambda a: a[:, ::-1], SURFACES),
    "faces": (lambda a: np.roll(a, 1, axis=1), SURFACES),
}
OBJECT: Answers = {
    "name": ("parquet", SURFACES),
    "mesh": (patch((-2, 0, 2), (4, 0, 0), (0, 0, -3)), SURFACES),
    "material": ("worn", LOOK),
    "emission": ((0.0, 0.0, 0.1), LIGHTS),
    "light_map_scale": (0.5, SURFACES),
    "luminaire": (0, LIGHTS),
    "moved": (tuple(map(tuple, np.eye(4).tolist())), NOTHING),
}
MATERIAL: Answers = {
    "name": ("renamed", NOTHING),
    "provenance": (Provenance(source="other.brdf"), NOTHING),
    "kd": ((0.1, 0.2, 0.31), (*LIT, BOUNCED)),
    "kd_coupled": (True, (*LIT, *of_terms("sheet/0/"), BOUNCED)),
    "kd_curve": (lambda _: (1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.9), (*LIT, BOUNCED)),
    "kt_d": ((0.1, 0.1, 0.2), (*LIT, BOUNCED)),
    "lobes": (lambda lobes: lobes * 2, (*LIT, *of_terms("sheet/3/"), BOUNCED)),
}
CURVE = tuple((1 + NODES_RHO**2) ** -3.0)
LOBE: Answers = {
    "side": ("transmission", (*LIT, *of_terms("sheet/2/"), BOUNCED)),
    "distribution": ("ggx", (*LIT, BOUNCED)),
    "shape": (CURVE, (*LIT, BOUNCED)),
    "fresnel": (((0.9,) * 8,) * 3, (*LIT, BOUNCED)),
    "k": ((0.9, 1.0, 1.0), (*LIT, BOUNCED)),
    "mx": (0.02, (*LIT, *of_terms("sheet/2/", "sheet/3/"), BOUNCED)),
    "my": (0.02, (*LIT, *of_terms("sheet/2/", "sheet/3/"), BOUNCED)),
    "r0": ((0.04, 0.04, 0.05), (*LIT, BOUNCED)),
    "alpha": (0.5, (*LIT, *of_terms("sheet/2/"), BOUNCED)),
    "retro": (True, (*LIT, *of_terms("sheet/2/"), BOUNCED)),
}
IN_VIEWS = {part: POINTS if part in ("normal", "direction", "opacity") else (BOUNCED,) for part in CHANNELS}
IN_VIEWS["diffuse"] = IN_VIEWS["specular"] = (SEEN.name("transport", "400/worn/"), *of_terms(), BOUNCED)
TEXTURES: Answers = {
    **{part: (lambda t: replace(t, texels=t.texels * np.float16(0.5)), (*LIT, *IN_VIEWS[part])) for part in CHANNELS},
    "cutoff": (0.25, LOOK),
}
TEXTURE: Answers = {
    "texels": (lambda a: a * np.float16(0.75), (*LIT, BOUNCED)),
    "uv_transform": (((2.0, 0.0, 0.0), (0.0, 1.0, 0.0)), (*LIT, BOUNCED)),
}
SUN_SKY: Answers = {
    "sun_direction": ((0.6, 0.8, 0.0), SKY),
    "turbidity": (4.0, SKY),
    "albedo": (0.2, SKY),
    "sun_scale": (0.5, SKY),
    "sky_scale": (0.5, SKY),
    "sun_radius_deg": (1.0, SKY),
    "ground": ("black", SKY),
}
IMAGE: Answers = {
    "file": (lambda file: file.with_name("dusk.exr"), SKY),
    "scale": (2.0, SKY),
    "rotation_deg": (90.0, SKY),
    "layout": ("cross", SKY),
    "up": ("+z", SKY),
}
CONSTANT: Answers = {"radiance": ((1.0, 1.0, 1.1), SKY)}
POINT: Answers = {
    "name": ("renamed", NOTHING),  # of its light group
    "position": ((0.0, 2.0, 0.1), LIGHTS),
    "intensity": ((5.0, 5.0, 4.0), LIGHTS),
    "direction": ((0.0, -0.6, 0.8), LIGHTS),
    "inner_deg": (5.0, LIGHTS),
    "outer_deg": (40.0, LIGHTS),
}
DIRECTIONAL: Answers = {
    "name": ("renamed", NOTHING),
    "direction": ((0.0, -0.6, 0.8), LIGHTS),
    "irradiance": ((1.0, 1.0, 0.5), LIGHTS),
}
WISH: Answers = {
    "points": (9, FIELDS),
    "texels": (12, FIELDS),
    "offset_m": (0.02, FIELDS),
    "error": (0.1, FIELDS),
    "volume": (True, FIELDS),
    "refracts": (True, FIELDS),
}
SCENE: Answers = {
    "name": ("renamed", NOTHING),
    "objects": (lambda objects: objects[::-1], SURFACES),
    "environment": (None, SKY),
    "lights": (lambda lights: lights[:1], LIGHTS),
    "cameras": ((VIEW,), NOTHING),
    "paths": ((CameraPath("path", (VIEW, replace(VIEW, position=(0.0, 1.0, 2.0)))),), NOTHING),
    "exposure_ev": (2.0, NOTHING),
    "crease_deg": (30.0, NOTHING),  # the meshes have it already
    "sources": ((Path("other.toml"),), NOTHING),
    "warnings": (("a face is missing",), NOTHING),
    "caption": ("A house by the lake", NOTHING),
    "credit": ("Anna Weber", NOTHING),
    "probe_planes": (lambda planes: {name: 2 * plane for name, plane in planes.items()}, ("probe/ball/planes", SHARES)),
    "probe_centres": ({"ball": (0.0, 1.0, 0.2)}, OF_BALL),
    "light_fields": ({"ball": LightFieldWish(), "other ball": LightFieldWish()}, FIELDS),
    "reflector_rules": ((ReflectorRule("floor", use=False),), NOTHING),
    "variants": ((Variant("walnut", {"worn": Look(Material(kd=0.1))}),), NOTHING),
    "light_groups": ((LightGroup("all", ("sky",)),), NOTHING),  # sorted by them where a bake is asked to
    "parts": ({"ball": "balls"}, NOTHING),  # given by the names of the objects, which are in the key
    "grids": ((Grid("desk", np.zeros(3), np.eye(3)[:2], np.eye(3)[2], np.ones((1, 1), bool)),), NOTHING),
    "borders": ({"ball": ((1.0, 0.0, 0.0, 0.0),)}, NOTHING),  # given by the faces of the parts, likewise
    "origin": ("builtin:room", NOTHING),
    "measured": (lambda files: {"grey": files["grey"].with_name("dusk.exr")}, LIT),
    "materials": (lambda materials: {**materials, "grey": Material(kd=0.4)}, LIT),
    "textures": ({}, None),  # names of arrays change with them: TEXTURES says it part by part
}
CASES: list[tuple[type, Answers, Callable[[Scene], Any], Callable[[Scene, Any], Scene]]] = [
    (Scene, SCENE, lambda scene: scene, lambda scene, new: new),
    (SceneObject, OBJECT, lambda scene: scene.objects[0], lambda scene, new: with_floor(scene, new)),
    (
        Mesh, MESH, lambda scene: scene.objects[0].mesh,
        lambda scene, new: with_floor(scene, replace(scene.objects[0], mesh=new)),
    ),
    (Material, MATERIAL, lambda scene: scene.materials["sheet"], lambda scene, new: with_sheet(scene, new)),
    (
        Lobe, LOBE, lambda scene: scene.materials["sheet"].lobes[0],
        lambda scene, new: with_sheet(scene, changed(scene.materials["sheet"], "lobes", (new,))),
    ),
    (
        MaterialTextures, TEXTURES, lambda scene: scene.textures["worn"],
        lambda scene, new: replace(scene, textures={"worn": new}),
    ),
    (
        Texture, TEXTURE, lambda scene: scene.textures["worn"].roughness,
        lambda scene, new: replace(scene, textures={"worn": replace(scene.textures["worn"], roughness=new)}),
    ),
    (
        ImageEnvironment, IMAGE, lambda scene: scene.environment,
        lambda scene, new: replace(scene, environment=new),
    ),
    (
        PointLight, POINT, lambda scene: scene.lights[0],
        lambda scene, new: replace(scene, lights=(new, scene.lights[1])),
    ),
    (
        DirectionalLight, DIRECTIONAL, lambda scene: scene.lights[1],
        lambda scene, new: replace(scene, lights=(scene.lights[0], new)),
    ),
    (
        LightFieldWish, WISH, lambda scene: scene.light_fields["ball"],
        lambda scene, new: replace(scene, light_fields={"ball": new}),
    ),
]  # fmt: skip
SETTINGS: dict[str, dict[str, tuple[object, tuple[str, ...]]]] = {
    "geometry": {"texels": (64, ("geometry/", *BAKED))},
    "environment": {"texels": (32, ("environment/",))},
    "light_map": {
        "samples": ((64, 128), BAKED),
        "noise": (0.1, BAKED),
        "max_depth": (33, BAKED),
        "gather_samples": (16, BAKED),
        "photons_per_texel": (65, NOTHING),  # of the other method
        "gather_noise": (0.1, BAKED),
        "tile_texels": (128, BAKED),
    },
    "view_points": {},
    "visibility": {"lights": ((400, 500), (SEEN.name("visibility", "500"), SEEN.name("transport", "500/")))},
    "transport": {
        "sharp": (512, NOTHING),  # no term has one narrow curve alone; see below
        "sharp_of_two": (64, of_terms("mirror/0/", "sheet/2/")),
        "smooth": (32, of_terms("grey/0/", "sheet/0/", "sheet/1/", "worn/0/")),
        "smooth_of_two": (8, of_terms("mirror/0/", "sheet/2/")),
    },
    "relighting": {
        "depth": (2, (*REFLECTED[:4], SEEN.name("relighting", "light"))),
        "levels": (2, REFLECTED[:4]),
        "samples": (8, REFLECTED[:4]),
        "tolerance": (0.5, REFLECTED[:4]),
        "paths": (3, REFLECTED[4:]),
    },
    "interreflection": {},
    "probe": {"texels": (32, PROBES), "samples": (17, PROBES), "noise": (0.2, PROBES)},
    "probe_share": {},
    "sunlit": {},
    "lamps": {},
    "light_field": {
        "points": (15, NOTHING),  # the scene says how many
        "texels": (12, FIELDS),
        "strata": (3, FIELDS),
        "onward": (3, FIELDS),
    },
    "answer": {
        "patches": (8, ANSWER),
        "gather_rays": (32, ANSWER),
        "receiver_rays": (8, ANSWER),
        "block": (2, ANSWER),
        "direct_samples": (16, ANSWER),
        "lobe_samples": (16, NOTHING),  # where light is sorted alone
        "importance_rays": (8, ANSWER),
    },
}


def changed(one: Any, field: str, value: Any) -> Any:
    """A dataclass or document with another value, or with a function of the one that it has."""
    value = value(getattr(one, field)) if callable(value) else value
    if is_dataclass(one):
        return replace(one, **{field: value})
    own = {"distribution": "curve"} if field == "shape" else {}  # which alone has a shape
    return type(one)(**{**dict(one), **own, field: value})


def with_floor(scene: Scene, floor: SceneObject) -> Scene:
    return replace(scene, objects=(floor, *scene.objects[1:]))


def with_sheet(scene: Scene, sheet: Material) -> Scene:
    return replace(scene, materials={**scene.materials, "sheet": sheet})


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("keys")


@pytest.fixture(scope="module")
def scene(folder: Path) -> Scene:
    """Something of everything that a bake can depend on."""
    for name, radiance in {"noon": 1.0, "dusk": 0.25}.items():
        write_image(folder / f"{name}.exr", np.full((4, 8, 3), radiance, np.float32))
    textures = {part: Texture(np.full((2, 2, n), 0.75, np.float16)) for part, n in CHANNELS.items()}
    objects = (
        SceneObject("floor", patch((-2, 0, 2), (4, 0, 0), (0, 0, -4)), "grey"),
        SceneObject("ball", placed(sphere(0.3, 8, 4), (0, 1, 0)), "mirror"),
        SceneObject("other ball", placed(sphere(0.3, 8, 4), (1, 1, 0)), "mirror"),
        SceneObject("curtain", patch((-2, 0, -2), (4, 0, 0), (0, 2, 0)), "sheet"),
        SceneObject("wall", patch((-2, 0, 2), (0, 0, -4), (0, 2, 0)), "worn"),
    )
    rough = Lobe(mx=1.0, my=1.0)
    return Scene(
        "small",
        objects,
        {"grey": GREY, "mirror": MIRROR, "sheet": Material(kd=0.2, kt_d=0.1, lobes=(rough,)), "worn": GREY},
        environment=ImageEnvironment(folder / "noon.exr"),
        lights=(
            PointLight((0.0, 2.0, 0.0), (5.0, 5.0, 5.0), (0.0, -1.0, 0.0), 10.0, 30.0),
            DirectionalLight((0.0, -1.0, 0.0), (1.0, 1.0, 1.0)),
        ),
        textures={"worn": MaterialTextures(**textures)},
        probe_planes={"ball": np.array([[0.0, 1.0, 0.0, 0.0]])},
        probe_centres={"ball": (0.0, 1.0, 0.0)},
        light_fields={"ball": LightFieldWish(points=8)},
        measured={"grey": folder / "noon.exr"},
    )


@pytest.fixture(scope="module")
def keys(folder: Path) -> Keys:
    """The key of every array of a bake, by name."""
    store = Store.create(folder / "store", {})

    def found_keys(
        scene: Scene,
        quality: Quality = TINY,
        seed: int = 0,
        editables: Any = None,
        bounces: Bounces | None = None,
        **methods: str | None,
    ) -> dict[str, str]:
        how = chosen({}, **{"light_map": None, "probes": None, **methods})
        context = BakeContext(scene, store, found(), quality, how, seed, views=(SEEN,), editables=editables or {})
        context.bounces = bounces or Bounces()
        return {name: key for kind in found() for name, key in context.keys(kind).items()}

    return found_keys


@pytest.fixture(scope="module")
def before(scene: Scene, keys: Keys) -> dict[str, str]:
    return keys(scene)


def stale(before: dict[str, str], after: dict[str, str]) -> set[str]:
    return {name for name in before.keys() | after.keys() if before.get(name) != after.get(name)}


def starting(names: dict[str, str], prefixes: tuple[str, ...]) -> set[str]:
    return {name for name in names if name.startswith(prefixes)}


def test_the_scene_has_every_array(scene: Scene, keys: Keys, before: dict[str, str]) -> None:
    names, balls, parts = set(before), ("ball", "other ball"), ("radiance", "distance", "planes")
    assert {f"probe/{ball}/{part}" for ball in balls for part in parts} < names
    assert {"light_map/irradiance", "light_map/irradiance_back", "light_map/noise_back", "light_map/lean"} < names
    assert {"geometry/tangents", "environment/radiance"} < names
    assert before == keys(replace(scene)), "the same inputs, the same keys"


ANSWERS = [(kind, field) for kind, answers, _, _ in CASES for field in answers if answers[field][1] is not None]


@pytest.mark.parametrize(("kind", "field"), ANSWERS, ids=[f"{kind.__name__}.{field}" for kind, field in ANSWERS])
def test_a_change_of_the_scene(scene: Scene, keys: Keys, before: dict[str, str], kind: type, field: str) -> None:
    _, answers, inner, outer = next(case for case in CASES if case[0] is kind)
    value, prefixes = answers[field]
    after = keys(outer(scene, changed(inner(scene), field, value)))
    assert stale(before, after) == starting(before | after, prefixes)


def of_daylight() -> Iterator[tuple[Any, str, Any]]:
    sky, even = SunSky((0.0, 1.0, 0.0)), ConstantEnvironment((1.0, 1.0, 1.0))
    yield from ((sky, field, value) for field, (value, _) in SUN_SKY.items())
    yield from ((even, field, value) for field, (value, _) in CONSTANT.items())


@pytest.mark.parametrize(("environment", "field", "value"), list(of_daylight()))
def test_a_change_of_the_environment(scene: Scene, keys: Keys, environment: Any, field: str, value: Any) -> None:
    before = keys(replace(scene, environment=environment))
    after = keys(replace(scene, environment=changed(environment, field, value)))
    assert stale(before, after) == starting(before, SKY)


@pytest.mark.long
def test_kinds_of_environments_differ(scene: Scene, keys: Keys) -> None:
    computed = (ComputedEnvironment("gallery"), ComputedEnvironment("nave"))
    environments = (None, scene.environment, SunSky((0.0, 1.0, 0.0)), ConstantEnvironment((1.0, 1.0, 1.0)), *computed)
    some = [keys(replace(scene, environment=environment)) for environment in environments]
    for i, one in enumerate(some):
        assert all(stale(one, other) == starting(one, SKY) for other in some[:i])


def test_files_count_by_their_content(scene: Scene, keys: Keys, before: dict[str, str], folder: Path) -> None:
    moved = folder / "moved.exr"
    moved.write_bytes((folder / "noon.exr").read_bytes())
    elsewhere = replace(scene, environment=ImageEnvironment(moved), measured={"grey": moved})
    assert not stale(before, keys(elsewhere))
    moved.write_bytes((folder / "dusk.exr").read_bytes())
    assert stale(before, keys(replace(scene, environment=ImageEnvironment(moved)))) == starting(before, SKY)
    assert stale(before, keys(replace(scene, measured={"grey": moved}))) == starting(before, LIT)


@pytest.mark.parametrize(("kind", "field"), [(kind, field) for kind, of in SETTINGS.items() for field in of])
def test_a_setting(scene: Scene, keys: Keys, before: dict[str, str], kind: str, field: str) -> None:
    value, prefixes = SETTINGS[kind][field]
    after = keys(scene, TINY.changed(**{kind: {field: value}}))
    assert stale(before, after) == starting(before | after, prefixes)


def test_the_bake_itself(scene: Scene, keys: Keys, before: dict[str, str]) -> None:
    assert not stale(before, keys(scene, TINY.changed("another name")))
    assert stale(before, keys(scene, seed=1)) == starting(before, (*LIT, BOUNCED))
    more = stale(before, keys(scene, bounces=Bounces(samples=4096)))
    assert more == {SEEN.name("interreflection", "samples")}, "samples are added to those that are there"
    for bounces in (Bounces((32, 1, 1, 1)), Bounces((64, 1, 1)), Bounces(fixed=frozenset({"sheet"}))):
        after = keys(scene, bounces=bounces)
        assert stale(before, after) == starting(before | after, (BOUNCED,))
    assert stale(before, keys(scene, probes="traced")) == starting(before, (*PROBES, *FIELDS))
    photons = keys(scene, light_map="photons")
    assert stale(before, photons) == starting(before | photons, BAKED)
    more = keys(scene, TINY.changed(light_map={"photons_per_texel": 65}), light_map="photons")
    assert stale(photons, more) == starting(photons, BAKED)


def test_what_a_material_is_edited_as(scene: Scene, keys: Keys) -> None:
    """The quotient and the angles are inputs of direct light; curves and scales are not, but of interreflections."""
    phong = {"sheet": editable(Phong())}
    before, mine = keys(scene, editables=phong), of_terms("sheet/0/")
    assert starting(before, (SEEN.name("transport", "400/sheet/"),)) == starting(before, mine[1:])
    other = keys(scene, editables={"sheet": editable(Phong(exponent=7.0))})
    assert stale(before, other) == starting(before, (BOUNCED,))
    more = keys(scene, TINY.changed(transport={"sharp": 512}), editables=phong)
    assert stale(before, more) == starting(before, mine)


def test_every_input_is_answered_for() -> None:
    """A new field of the scene, or a new setting, has to be added to the tables above."""
    more = [(SunSky, SUN_SKY), (ConstantEnvironment, CONSTANT)]
    for kind, answers in [(kind, answers) for kind, answers, _, _ in CASES] + more:
        names = {field.name for field in fields(kind)} if is_dataclass(kind) else set(kind.model_fields)
        assert names - {"format", "version"} == answers.keys(), kind.__name__
    kinds = found()
    assert kinds.keys() == SETTINGS.keys()
    for kind, of in SETTINGS.items():
        assert (
            {field.name for field in fields(kinds[kind].SETTINGS["preview"])} == of.keys()
            if of
            else not hasattr(kinds[kind], "SETTINGS")
        ), kind
