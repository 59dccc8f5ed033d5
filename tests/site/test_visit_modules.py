"""What a visitor does, as Python does it: picks, floors, orbits, walks, gamepads. Shared links, offered finishes."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from lambent.core.views.camera import Camera, CameraPath, rays_through
from lambent.scenes.builtin.box import objects as objects_of_the_box
from lambent.scenes.camera_paths import camera_at
from lambent.scenes.geometry import merge
from lambent.site.walks import walk_of
from lambent.store.contract import ObjectRecord
from lambent.viewer.cameras import cameras
from lambent.viewer.cameras.picking import Geometry
from lambent.viewer.gamepad import stick
from lambent.viewer.modes.walk.views.walls import Walls
from tests.site.test_page_modules import BOUNDS, CAMERAS, assert_same, said

PIVOT = (0.5, 0.7, -0.4)
GEOMETRY = """import {Geometry} from './picking.js';
const geometry = new Geometry(Float32Array.from(given.vertices), 3, Uint32Array.from(given.indices), given.things);"""
NEAR_M, NEAR_DEG = 0.006, 0.02  # between cameras of a walk, 30 a second: here it goes at up to 13 m/s
NO_PAGE = "globalThis.document = { getElementById: () => ({}) };"


class Room:
    """Meshes, as Python and as the page pick them."""

    def __init__(self, meshes) -> None:
        whole, first, records = merge(meshes.values()), 0, []
        for name, mesh in meshes.items():
            bounds = tuple(tuple(map(float, corner)) for corner in mesh.bounds)
            records.append(
                ObjectRecord(name=name, material="m", first_face=first, face_count=len(mesh.faces), bounds=bounds)
            )
            first += len(mesh.faces)
        positions = whole.positions.astype(np.float32)
        self.geometry = Geometry(positions, whole.faces, records)
        self.walls = Walls(self.geometry.triangles)
        self.bounds = tuple(tuple(map(float, corner)) for corner in whole.bounds)
        self.given = {
            "vertices": positions.ravel().tolist(), "indices": whole.faces.ravel().tolist(),
            "things": [
                {"name": one.name, "material": "m", "first": one.first_face, "count": one.face_count,
                 "bounds": one.bounds} for one in records
            ],
            "bounds": self.bounds,
        }  # fmt: skip


@pytest.fixture(scope="module")
def box():
    return Room({one.name: one.mesh for one in objects_of_the_box()})


def test_picks_are_those_of_the_window(javascript, box):
    low, high = map(np.array, box.bounds)
    middle, half, size = (low + high) / 2, (high - low) / 2, (64, 48)
    eyes = [middle + half * at for at in ([0, 0, 0.8], [0.6, 0.5, -0.7], [-0.5, -0.8, 0.2], [0.1, 0.2, 5.0])]
    seen = [Camera("eye", tuple(map(float, eye)), tuple(map(float, middle + 0.1))) for eye in eyes]
    points = [(x + 0.37, y + 0.61) for x, y in product(range(0, 64, 7), range(0, 48, 7))]
    code = f"""{GEOMETRY} import {{rayThrough}} from './camera.js';
    say(given.cameras.map((one) => given.points.map(([x, y]) => {{
      const towards = rayThrough(one, x, y, ...given.size), {{thing, m}} = geometry.hit(one.position, towards);
      return [thing?.name ?? null, thing ? m : null, ...towards];
    }})));"""
    given = {**box.given, "cameras": [said(one) for one in seen], "points": points, "size": size}
    names = set()
    for camera, of_camera in zip(seen, javascript(code, given), strict=True):
        for (x, y), (name, distance_m, *towards) in zip(points, of_camera, strict=True):
            ray = rays_through(camera, x, y, *size)
            np.testing.assert_allclose(towards, ray, atol=1e-12)
            found, wanted_m = box.geometry.hit(camera.position, ray)
            names.add(name)
            assert name == (found.name if found else None), (camera, x, y)
            assert distance_m is None or distance_m == pytest.approx(wanted_m, rel=1e-5)
    assert len(names) >= 5 and None in names, "the rays meet several things, and nothing"


def test_floors_and_walls_are_those_of_the_window(javascript, box):
    low, high = map(np.array, box.bounds)
    rng = np.random.default_rng(3)
    eyes = rng.uniform(low + 0.1, high - 0.1, (40, 3)).tolist()
    ways = [(rng.uniform(low + 0.1, high - 0.1).tolist(), rng.uniform(low, high).tolist()) for _ in eyes]
    code = f"""{GEOMETRY} import {{openShare}} from './moves.js';
    say(given.eyes.map((eye, i) => [
      geometry.floorBelow(eye, 0.9) ?? null, openShare(eye, ...given.ways[i], given.bounds, geometry)]));"""
    found = javascript(code, {**box.given, "eyes": eyes, "ways": ways})
    for eye, (before, after), (floor_y, share) in zip(eyes, ways, found, strict=True):
        wanted = box.walls.floor_below(eye, 0.9)
        assert (floor_y is None) == (wanted is None) and (wanted is None or floor_y == pytest.approx(wanted, abs=1e-5))
        assert share == pytest.approx(box.walls.share(eye, before, after, box.bounds), rel=1e-4)
    assert len({floor_y is None for floor_y, _ in found}) == 2 and any(share < 1 for _, share in found)


@pytest.mark.parametrize("camera", CAMERAS[:3], ids=lambda camera: camera.name)
def test_orbits_are_those_of_the_window(javascript, camera):
    code = """import {nearer, orbit, zoom} from './camera.js';
    let camera = given.camera; const found = [];
    for (const pivot of [given.pivot, undefined]) for (const [dx, dy, steps] of given.moves) {
      found.push(camera = orbit(camera, dx, dy, pivot)); found.push(camera = zoom(camera, steps, given.bounds, pivot));
      found.push(camera = nearer(camera, pivot ?? camera.target, 0.9));
    }
    say(found);"""
    moves = [(31, -7, 1.5), (-120, 400, -3), (5, 2, 0.2), (0, -900, -60), (3, 3, 90)]
    found = iter(javascript(code, {"camera": said(camera), "moves": moves, "bounds": BOUNDS, "pivot": PIVOT}))
    for pivot in (PIVOT, None):
        for dx, dy, steps in moves:
            camera = cameras.orbit(camera, dx, dy, pivot)
            assert_same(next(found), camera)
            camera = cameras.zoom(camera, steps, BOUNDS, pivot)
            assert_same(next(found), camera)
            camera = cameras.nearer(camera, pivot or camera.target, 0.9)
            assert_same(next(found), camera)


def test_walks_are_those_of_python(javascript):
    """But for straight lines between samples."""
    keys = tuple(
        Camera(
            f"k{i}", (math.sin(i), 1.5 + 0.1 * i, 0.5 * i * i), (0.3 * i, 1.0, -2.0), (0.1 * i, 1.0, 0.0), 40.0 + 9 * i
        )
        for i in range(5)
    )
    times = (0.0, 1.0, 3.5, 4.0, 9.0)
    paths = [
        CameraPath("steady", keys, 9.0), CameraPath("recorded", keys, 9.0, times),
        CameraPath("two", keys[:2], 4.0, (0.0, 4.0)), CameraPath("one", keys[:1]),
        CameraPath("with a pause", (keys[0], replace(keys[0], target=(5.0, 1.0, 0.0)), *keys[3:]), 5.0),
        CameraPath("in place", (keys[0], replace(keys[0], target=(5.0, 1.0, 0.0))), 3.0),
    ]  # fmt: skip
    at = [-1.0, 0.0, 0.417, 1.0, 2.213, 3.99, 4.0, 7.317, 9.0, 20.0]
    code = """import {cameraAlong} from './paths.js';
    say(given.walks.map(([name, samples, seconds]) => {
      const at = cameraAlong(name, Float32Array.from(samples), seconds); return given.at.map(at); }));"""
    walks = [(path.name, walk_of(path).ravel().tolist(), path.seconds) for path in paths]
    found = javascript(code, {"walks": walks, "at": at})
    for path, of_path in zip(paths, found, strict=True):
        for time_s, camera in zip(at, of_path, strict=True):
            wanted = camera_at(path, time_s)
            for name in ("position", "target", "up"):
                np.testing.assert_allclose(
                    camera[name], getattr(wanted, name), atol=NEAR_M, err_msg=f"{path.name} {name}"
                )
            assert camera["fovYDeg"] == pytest.approx(wanted.fov_y_deg, abs=NEAR_DEG)


def test_sticks_are_those_of_the_window(javascript):
    given = [[0, 0], [0.1, 0.05], [0.5, -0.2], [1, 1], [-0.99, 0]]
    found = javascript("import {stick} from './gamepad.js'; say(given.map((one) => stick(...one)));", given)
    np.testing.assert_allclose(found, [stick(*one) for one in given])


def test_going_somewhere_keeps_the_height_of_the_eye_and_turns_the_shorter_way(javascript, box):
    code = f"""{GEOMETRY} import {{glide, standingAt}} from './moves.js';
    import {{eyeHeightOf, yawPitch}} from './camera.js';
    const camera = given.camera;
    const floor = standingAt(camera, given.place, true, geometry, given.bounds);
    const thing = standingAt(camera, given.thing, false, geometry, given.bounds);
    const to = {{...camera, position: [1, 1, 1], target: [1 + Math.sin(-3), 1, 1 - Math.cos(-3)]}};
    const [x, y, z] = camera.position, from = {{...camera, target: [x + Math.sin(3), y, z - Math.cos(3)]}};
    const motion = glide(from, to, 2);
    const passed = [0, 0.25, 0.5, 0.75, 1].map((s) => motion.at(s * motion.seconds));
    const yaws = passed.map((one) => yawPitch(one)[0]);
    say({{floor, thing, eyeHeightM: eyeHeightOf(given.bounds), passed, yaws}});"""
    low, high = map(np.array, box.bounds)
    x, z = ((low + high) / 2)[[0, 2]].tolist()
    camera = Camera("eye", (x, low[1] + 1.0, high[2] - 0.2), (x, low[1] + 0.8, low[2]))
    given = {**box.given, "camera": said(camera), "place": (x, low[1], z), "thing": (x, high[1] - 0.1, low[2])}
    found = javascript(code, given)
    eye, target = map(np.array, (found["floor"]["position"], found["floor"]["target"]))
    np.testing.assert_allclose(eye, [x, low[1] + found["eyeHeightM"], z], atol=1e-6)
    ahead, before = target - eye, np.subtract(camera.target, camera.position)
    np.testing.assert_allclose(ahead / np.linalg.norm(ahead), before / np.linalg.norm(before), atol=1e-9)
    thing = found["thing"]
    assert thing["target"] == list(given["thing"]) and thing["position"][2] > low[2] + 0.1, "before it, not within"
    assert thing["position"][1] == pytest.approx(eye[1], abs=0.01)
    yaws = np.unwrap(found["yaws"])
    assert np.all(np.diff(yaws) > 0) and yaws[-1] - yaws[0] == pytest.approx(2 * math.pi - 6), "not back through ahead"
    assert found["passed"][-1]["position"] == [1, 1, 1]


MANIFEST = {
    "cameras": [said(CAMERAS[0])], "exposureEv": -3.25, "viewTransform": 2,
    "states": [{"name": "as baked"}, {"name": "Eiche & Öl, 50 %+"}, {"name": "dark"}],
    "visit": {
        "viewTransforms": {"linear": 0, "neutral": 1, "filmic": 2},
        "finishes": [{"name": "oak"}, {"name": "oak"}, {"name": "red"}, {"name": "blue"}],
        "finishesOfStates": [{"floor": 0, "chair": 2}, {"floor": 1, "chair": 3}, {"floor": 1, "chair": 2}],
    },
}  # fmt: skip


def test_a_shared_link_brings_everything_back(javascript):
    shared = {
        "camera": said(replace(CAMERAS[1], name="free")), "state": 1, "exposureEv": -2.5834, "viewTransform": 1,
        "light": {"Fenster & Süd": [1, 0.5, 0], "sky": 2},
    }  # fmt: skip
    plain = {"camera": said(CAMERAS[0]), "state": 0, "exposureEv": -3.25, "viewTransform": 2, "light": {}}
    hostile = [
        "", "#1,2,3", "#1,2,3,4,5,6,400", "#a,b,c,d,e,f,g&state=nowhere&exposure=1e99&transform=false-colour&light={",
        '#0,0,0,0,0,-1,45&light={"a":"x","b":[-1],"c":null}&exposure=NaN', "#&light=null",
    ]  # fmt: skip
    code = """import {addressOf, readAddress} from './address.js';
    const {manifest, shared, plain, hostile} = given, address = addressOf(shared, manifest);
    const read = (hash) => readAddress(hash, manifest);
    say({address, back: read('#' + address), plain: addressOf(plain, manifest),
         old: read('#0,1.6,2,0,1.6,-1,45'), hostile: hostile.map(read)});"""
    found = javascript(code, {"manifest": MANIFEST, "shared": shared, "plain": plain, "hostile": hostile})
    old = {**plain, "camera": {**plain["camera"], "name": "free"}}
    assert found["plain"] == "0,1.6,2,0,1.6,-1,45" and found["old"] == json.loads(json.dumps(old))
    back = found["back"]
    assert back.pop("exposureEv") == pytest.approx(shared.pop("exposureEv"), abs=1e-4) and back == json.loads(
        json.dumps(shared)
    )
    for one in found["hostile"]:
        assert (one["state"], one["exposureEv"], one["viewTransform"], one["light"]) == (0, -3.25, 2, {})
    assert [one["camera"]["name"] for one in found["hostile"]] == [*["ahead"] * 4, "free", "ahead"]


def test_the_finishes_offered_are_those_of_the_states(javascript):
    code = f"""{NO_PAGE} const {{finishesOf, stateWith}} = await import('./card.js');
    say([finishesOf(given, 'floor'), finishesOf(given, 'chair'), stateWith(given, 0, 'floor', 1),
         stateWith(given, 1, 'floor', 1), stateWith(given, 2, 'chair', 3)]);"""
    floor, chair, *states = javascript(code, MANIFEST)
    assert [one["label"] for one in floor] == ["oak (as baked)", "oak (Eiche & Öl, 50 %+)"]
    assert [(one["finish"], one["label"]) for one in chair] == [(2, "red"), (3, "blue")]
    assert states == [2, 1, 1], "the state that differs least: with the chair as it is"


def test_pictures_have_names_that_files_can_have(javascript):
    code = f"""{NO_PAGE} const {{fileName}} = await import('./keeping.js'), {{inWords}} = await import('./controls.js');
    say([given.map(fileName), [0, 1, -2, 4, -15].map(inWords)]);"""
    (plain, hostile, long), words = javascript(
        code, [["Büro", "as baked", "Tür"], ["../a\\b:c", "x\n", "?"], ["ü" * 300]]
    )
    assert plain == "Büro - as baked - Tür.png" and hostile == ".._a_b_c - x_ - _.png"
    assert long == "ü" * 120 + ".png"
    assert words == ["0 EV", "+1/3 EV", "−2/3 EV", "+1 1/3 EV", "−5 EV"]
