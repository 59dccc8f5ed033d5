"""Parity of the page's JavaScript with Python: the frame's camera, walking, and unpacked data."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from lambent.core.views.camera import Camera
from lambent.realtime.frame_state import FrameState, frame_data
from lambent.site.chunks import Packing
from lambent.viewer.cameras import cameras
from tests.site.conftest import PAGE, STILLS_PAGE

ROOT = Path(__file__).parents[2]

BOUNDS = ((-3.0, 0.0, -4.0), (5.0, 2.7, 6.0))
CAMERAS = [
    Camera("ahead", (0.0, 1.6, 2.0), (0.0, 1.6, -1.0)),
    Camera("tilted", (1.2, 0.4, -2.0), (3.0, 2.0, 0.5), (0.2, 1.0, 0.1), 71.0),
    Camera("down", (1.0, 2.0, 1.0), (1.0, 0.0, 1.0), fov_y_deg=20.0),
    Camera("nowhere", (1.0, 1.0, 1.0), (1.0, 1.0, 1.0)),
    Camera("far", (4000.0, 30.0, -7000.0), (4001.0, 30.5, -7000.2), fov_y_deg=110.0),
]


def said(camera: Camera) -> dict[str, object]:
    names = {"position": camera.position, "target": camera.target, "up": camera.up, "fovYDeg": camera.fov_y_deg}
    return {"name": camera.name, **names}


@pytest.mark.parametrize("jitter", [(0.0, 0.0), (0.3, -0.45)])
def test_frames_of_cameras_are_those_of_python(javascript, jitter):
    given = [[said(camera), 640, 360, 0.013, jitter] for camera in CAMERAS]
    found = javascript("import {frameOf} from './camera.js'; say(given.map((one) => frameOf(...one)));", given)
    for camera, fields in zip(CAMERAS, found, strict=True):
        data = frame_data(FrameState(camera, 640, 360, near_m=0.013, jitter_px=jitter), BOUNDS)
        rows = fields.pop("rows")
        assert np.array(rows).T.ravel().tolist() == fields["clip_from_world"]
        for name, values in fields.items():
            wanted = data[name].ravel()[: len(values)]
            np.testing.assert_allclose(
                np.float32(values), wanted, rtol=2e-6, atol=2e-7, err_msg=f"{camera.name} {name}"
            )


@pytest.mark.parametrize("camera", CAMERAS[:3], ids=lambda camera: camera.name)
def test_steps_and_looks_are_those_of_the_window(javascript, camera):
    steps = [
        (["w"], 0.1, 1),
        (["w", "d"], 0.05, 3),
        (["s"], 0.2, 1),
        (["ArrowLeft", "a"], 0.5, 1),
        (["w"] * 1, 0.25, 3),
    ] * 4
    code = """import {look, pushOf, walk} from './camera.js';
    let camera = given.camera; const found = [];
    for (const [keys, dt, fast] of given.steps) {
      camera = walk(camera, pushOf(keys), dt, given.bounds, fast); found.push(camera);
      camera = look(camera, 37, -11); found.push(camera);
    }
    say(found);"""
    found = iter(javascript(code, {"camera": said(camera), "steps": steps, "bounds": BOUNDS}))
    walker = cameras.Walker.of(BOUNDS)
    for keys, dt_s, fast in steps:
        camera = cameras.walk(camera, walker, set(keys), dt_s, bounds=BOUNDS, floor_y=None, fast=fast)
        assert_same(next(found), camera)
        camera = cameras.look(camera, 37, -11)
        assert_same(next(found), camera)


def assert_same(found, camera: Camera) -> None:
    np.testing.assert_allclose(found["position"], camera.position, atol=1e-9)
    np.testing.assert_allclose(found["target"], camera.target, atol=1e-9)


@pytest.mark.parametrize("word", [1, 2, 4])
def test_data_come_out_as_they_went_in(javascript, word):
    rng = np.random.default_rng(word)
    words = rng.integers(0, 1 << (8 * word), 7 * 12 * 3 + 5 * 3, np.uint64).astype(f"<u{word}")
    packing = Packing(word, 3, [(7 * 12 * 3, 12 * 3), (5 * 3, 0)])
    packed = packing.packed(words.tobytes())
    given = {"data": base64.b64encode(packed).decode(), "packing": packing.said()}
    code = """import {unpack} from './loading.js';
    const bytes = new Uint8Array(Buffer.from(given.data, 'base64'));
    say(Buffer.from(unpack(bytes, given.packing)).toString('base64'));"""
    assert base64.b64decode(javascript(code, given)) == words.tobytes() and packed != words.tobytes()


def test_data_of_another_length_are_refused(javascript):
    code = """import {unpack, SiteError} from './loading.js';
    let fault = null;
    try { unpack(new Uint8Array(12), given); } catch (error) { fault = error instanceof SiteError && error.message; }
    say(fault);"""
    assert "not as long" in javascript(code, {"word": 2, "channels": 1, "runs": [[4, 0]]})


@pytest.fixture
def node_packages():
    """The folder of what npm installed for the tests."""
    folder = ROOT / ".venv/node/node_modules"
    if not (folder / "typescript").is_dir() or not (folder / "prettier").is_dir() or shutil.which("node") is None:
        pytest.skip("typescript and prettier are not installed: `python3 run.py test` does it where there is npm")
    return folder


@pytest.mark.long
def test_types_fit(node_packages, tmp_path):
    options = {
        "allowJs": True, "checkJs": True, "noEmit": True, "strict": True, "target": "ES2022", "module": "ES2022",
        "moduleResolution": "bundler", "lib": ["ES2023", "DOM", "DOM.Iterable"], "types": ["@webgpu/types"],
        "typeRoots": [str(node_packages)],
    }  # fmt: skip
    (tmp_path / "tsconfig.json").write_text(
        json.dumps({"compilerOptions": options, "include": [f"{PAGE}/*.js", f"{STILLS_PAGE}/*.js"]})
    )
    command = ["node", node_packages / "typescript/bin/tsc", "-p", tmp_path]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


@pytest.mark.long
def test_the_page_is_formatted(node_packages):
    files = sorted([*PAGE.glob("*.*"), *STILLS_PAGE.glob("*.*")])
    command = ["node", node_packages / "prettier/bin/prettier.cjs", "--print-width", "120", "--check", *files]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_the_page_stays_small():
    assert sum(len(file.read_text("utf-8").splitlines()) for file in PAGE.glob("*.js")) <= 2720
    assert len((STILLS_PAGE / "stills.js").read_text("utf-8").splitlines()) <= 120
