"""Files that never end, block, claim to be huge or nest without end: one line, soon, before memory is taken."""

from __future__ import annotations

import ast
import gc
import json
import os
import re
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest
from PIL import Image

import lambent
from lambent.core import ceilings
from lambent.core.ceilings import Ceiling
from lambent.core.errors import UserError
from lambent.core.inputs import open_input, parse_json, read_bytes, read_head, sha256_of
from lambent.core.pictures.images import read_encoded, read_image
from lambent.materials.document import load_material
from lambent.materials.measured.registry import load
from lambent.published.merl_fits import read_fits
from lambent.scenes.loaders.load import load_scene
from lambent.store.kept.session import read_session
from lambent.store.kept.views import read_views
from lambent.viewer.editor.files import kind_of
from tests.scenes.loaders.gltf.test_gltf import document
from tests.scenes.loaders.test_scene_hostile import _png_of as png_of

OPENERS: dict[str, Callable[[Path], Any]] = {
    "measured": load, "material.json": load_material, "a.fit": read_fits, "a.hdr": read_image, "a.png": read_encoded,
    "scene.toml": load_scene, "scene.gltf": load_scene, "scene.glb": load_scene, "scene.obj": load_scene,
    "scene.ply": load_scene, "scene.xml": load_scene, "views.json": lambda path: read_views(path.parent),
    "session.json": read_session,
    "edited": kind_of, "hashed": sha256_of, "head": lambda path: read_head(path, 64),
}  # fmt: skip
SIZES = {
    "material.json": ceilings.MATERIAL_BYTES, "a.fit": ceilings.FITS_BYTES, "a.hdr": ceilings.PICTURE_BYTES,
    "a.png": ceilings.PICTURE_BYTES, "scene.toml": ceilings.SCENE_TOML_BYTES, "scene.gltf": ceilings.GLTF_BYTES,
    "scene.glb": ceilings.GLTF_BYTES, "scene.obj": ceilings.OBJ_BYTES, "scene.ply": ceilings.PLY_BYTES,
    "scene.xml": ceilings.MITSUBA_BYTES, "views.json": ceilings.VIEWS_BYTES,
    "session.json": ceilings.SESSION_BYTES,
}  # fmt: skip


@pytest.mark.parametrize("name", OPENERS)
def test_devices_and_pipes_are_refused(tmp_path: Path, name: str) -> None:
    """A link to an endless device, and a pipe that nobody writes to."""
    path = tmp_path / name
    path.symlink_to("/dev/zero")
    with pytest.raises(UserError, match=r"cannot be read; found a device; expected a file"):
        OPENERS[name](path)
    path.unlink()
    os.mkfifo(path)
    done = threading.Event()

    def wake() -> None:  # a reader that waits for the pipe would wait for ever
        if not done.wait(5):
            path.open("wb").close()

    waker = threading.Thread(target=wake)
    waker.start()
    with pytest.raises(UserError, match=r"cannot be read; found a pipe; expected a file; write its content to a file"):
        OPENERS[name](path)
    assert not done.is_set() and waker.is_alive()
    done.set()
    waker.join()


@pytest.mark.parametrize("name", SIZES)
def test_a_file_beyond_its_ceiling_is_not_read(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.touch()
    os.truncate(path, SIZES[name] + 1)  # a sparse file takes no room on the disk
    start = time.process_time()
    with pytest.raises(UserError, match=f"too large; found {SIZES[name] + 1} bytes; expected at most {SIZES[name]}"):
        OPENERS[name](path)
    assert time.process_time() - start < 1


def test_what_is_read_is_bounded_where_the_size_lies(tmp_path: Path) -> None:
    """Files of the system say that they hold nothing; files that grow hold more than they said."""
    if Path("/proc/self/maps").exists():
        assert len(read_bytes(Path("/proc/self/maps"), 1 << 22)) > 100
        with pytest.raises(UserError, match="too large"):
            read_bytes(Path("/proc/self/maps"), 100)
    path = tmp_path / "a"
    path.write_bytes(b"abc" * 100_000)
    assert read_bytes(path, 300_000) == path.read_bytes()
    with pytest.raises(UserError, match="found 300000 bytes; expected at most 299999"):
        read_bytes(path, 299_999)
    with open_input(path) as file:
        assert file.read(3) == b"abc"
    for name in ("a\0b", "\ud800", "n" * 5000):
        with pytest.raises(UserError, match=r"is not a file name|cannot be read"):
            read_bytes(tmp_path / name, 100)


def test_texts_that_no_file_can_hold() -> None:
    assert parse_json(b'"\\ud83d\\ude00"', Path("a")) == "\U0001f600"
    with pytest.raises(UserError, match="unpaired surrogate"):
        parse_json(b'{"name": "\\ud800"}', Path("a"))
    for text in (b"[" + b"9" * 5000 + b"]", b"[" * 100_000, b"\xff", b"{"):
        with pytest.raises(UserError, match="JSON cannot be read"):
            parse_json(text, Path("a"))


def _raw_opens() -> Iterator[str]:
    """Every place of the package that opens a file by its own means."""
    allowed = {"core/inputs.py"}
    package = Path(lambent.__file__).parent
    for file in sorted(package.rglob("*.py")):
        name = file.relative_to(package).as_posix()
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call) or name in allowed:
                continue
            called = ast.unparse(node.func)
            mode = next((a.value for a in node.args if isinstance(a, ast.Constant) and isinstance(a.value, str)), "r")
            reads = called in ("open", "os.open", "np.load", "np.memmap", "np.fromfile", "np.genfromtxt") or (
                called.rpartition(".")[2] in ("read_bytes", "read_text") and "." in called
            )
            if reads or (called.endswith(".open") and mode[:1] == "r" and "path" in called):
                yield f"{name}: {called}"


OWN_FILES = {
    "baking/engine.py: file.read_text": "the cache of what Mitsuba can do here",
    "api/pictures.py: file.read_bytes": "the plot that was just written",
    "core/light/observer.py: (files('lambent.core.light') / 'cie_1931.csv').read_text": "the package's table",
    "core/pictures/exr.py: open": "the null device",
    "core/files.py: beside.open": "a file that is being written",
    "core/files.py: os.open": "a file that is about to be written",
    "core/pictures/film.py: path.open": "the film that was just written",
    "cli/main.py: os.open": "the null device",
    "core/machine.py: info.read_text": "what the system says of the processor",
    "materials/models/model.py: file.read_text": "the package's shader",
    "materials/shader_layout.py: files('lambent.materials').joinpath('lobes.wgsl').read_text": "the package's shader",
    "realtime/incident/__init__.py: Path(look_up.__file__).with_suffix('.wgsl').read_text": "the package's shader",
    "realtime/gpu/shader_source.py: _path(name).read_text": "the package's shader",
    "bench/measuring/switches.py: path.read_text": "the package's shader",
    "bench/measuring/switches.py: Path(module.__file__).read_text": "the package's source",
    "site/replacing.py: file.read_bytes": "the package's page",
    "site/stills.py: files('lambent.site').joinpath('stills_page/index.html').read_text": "the package's page",
    "viewer/modes/walk/comparison.py: np.load": "what its own worker wrote",
    "viewer/modes/walk/comparison.py: words.read_text": "what its own worker wrote",
}
STORE = "store/"  # whose files are its own; `lambent.store` bounds them by the manifest


@pytest.mark.long
def test_every_file_of_a_user_is_opened_by_one_function() -> None:
    found = {place for place in _raw_opens() if not place.startswith(STORE)}
    assert found - set(OWN_FILES) == set(), "open it by lambent.core.inputs"


def test_ceilings_are_documented() -> None:
    """docs/reliability.md lists each with its number."""
    page = (Path(__file__).parents[2] / "docs" / "reliability.md").read_text(encoding="utf-8")
    listed = dict(re.findall(r"^.*? \| `(\w+)` \| ([\d,]+)", page, re.MULTILINE))
    known = {n: v.most if isinstance(v, Ceiling) else v for n, v in vars(ceilings).items() if n.isupper()}
    assert {name: int(number.replace(",", "")) for name, number in listed.items()} == known


def test_lobes_of_a_document(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_text(json.dumps({"kd": 0, "lobes": [{"mx": 0.1, "my": 0.1}] * 20_000}))
    with pytest.raises(UserError, match="lobes: too many lobes; found 20000 lobes; expected at most 64 lobes"):
        load_material(path)
    path.write_text(json.dumps({"kd": 0, "lobes": [{"mx": 0.1, "my": 0.1}] * 64}))
    assert len(load_material(path).lobes) == 64


def _gltf(folder: Path, content: dict[str, Any]) -> Path:
    path = folder / "scene.gltf"
    path.write_text(json.dumps(content))
    return path


def _nodes(count: int, *, chained: bool) -> dict[str, Any]:
    nodes: list[dict[str, Any]] = [
        {"mesh": 0, "name": "wheel", "translation": [i % 300, 0, i // 300]} for i in range(count)
    ]
    if chained:
        nodes = [{"mesh": 0, "name": "wheel", "translation": [0.001, 0, 0], "children": [i + 1]} for i in range(count)]
        del nodes[-1]["children"]
    return document(nodes=nodes, scenes=[{"nodes": [0] if chained else list(range(count))}])


def _lines_run(work: Callable[[], object]) -> int:
    """How many lines of Python `work` runs: a measure of time that no other process changes."""
    count = 0

    def trace(frame: FrameType, event: str, argument: object) -> Callable[..., Any]:
        nonlocal count
        count += event == "line"
        return trace

    before = sys.gettrace()
    gc.collect()
    gc.disable()  # finalizers of other tests' objects would be counted
    sys.settrace(trace)
    try:
        work()
    finally:
        sys.settrace(before)
        gc.enable()
    return count


@pytest.mark.long
@pytest.mark.parametrize("chained", [False, True])
def test_time_of_nodes_is_linear(tmp_path: Path, chained: bool) -> None:
    """Of one name, side by side or each the child of the last: each node more runs as many lines as the one before."""
    runs = []
    for count in (10, 510, 1010):
        path = _gltf(tmp_path, _nodes(count, chained=chained))
        load_scene(path)
        runs.append(_lines_run(lambda path=path: load_scene(path)))  # type: ignore[misc]
    assert runs[2] - runs[1] < 1.1 * (runs[1] - runs[0]), runs
    scene = load_scene(_gltf(tmp_path, _nodes(2_000, chained=chained)))
    names = [o.name for o in scene.objects]
    assert names[:2] == ["wheel", "wheel_2"] and names[-1] == "wheel_2000" and len(set(names)) == 2_000
    assert [w for w in scene.warnings if "name" in w] == [
        "wheel: the name is used 2000 times; the others are renamed to wheel_2 ... wheel_2000"
    ]
    last = scene.objects[-1].mesh.positions[0]
    np.testing.assert_allclose(last, (2.0, 0, 0) if chained else (1999 % 300, 0, 6), atol=2e-3)  # flush ones are raised


def _zeros(count: int, **more: Any) -> dict[str, Any]:
    content = document()
    content["accessors"][0] = {"componentType": 5126, "count": count, "type": "VEC3"} | more
    return content


@pytest.mark.long
def test_accessors_without_a_buffer_view(tmp_path: Path) -> None:
    """One that is too large, and thousands that are small."""
    with pytest.raises(UserError, match=r"accessors.0: too many zeros; found 6000000 numbers"):
        load_scene(_gltf(tmp_path, _zeros(2_000_000)))
    many = _zeros(100_000)
    many["meshes"][0]["primitives"] = [{"attributes": {"POSITION": 0}} for _ in range(1000)]
    with pytest.raises(UserError, match="too many zeros"):
        load_scene(_gltf(tmp_path, many))
    indices = {"bufferView": 3, "componentType": 5123}
    sparse = {"count": 10**6, "indices": indices, "values": {"bufferView": 0}}
    with pytest.raises(UserError, match="has more values than its accessor"):
        load_scene(_gltf(tmp_path, _zeros(3, sparse=sparse)))


def test_include_chains_end(tmp_path: Path) -> None:
    for i in range(70):
        (tmp_path / f"{i}.xml").write_text(f'<scene version="3.0.0"><include filename="{i + 1}.xml"/></scene>')
    with pytest.raises(UserError, match="too many included files"):
        load_scene(tmp_path / "0.xml")
    (tmp_path / "2.xml").write_text('<scene version="3.0.0"><include filename="1.xml"/></scene>')
    with pytest.raises(UserError, match="includes itself"):
        load_scene(tmp_path / "0.xml")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a." * 100_000 + "a = 1", "too many levels; found 100000 levels"),
        ("[" + "a." * 100_000 + "a]", "too many levels"),
        ("a = " + "[" * 100_000, "not a TOML document"),
        ("a = " + "9" * 5000, "not a TOML document"),
    ],
)
def test_toml_that_nests(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(text)
    with pytest.raises(UserError, match=said):
        load_scene(path)


def test_pictures_that_claim_too_much(tmp_path: Path) -> None:
    claims = {
        "a.png": png_of(60_000, 60_000),
        "a.hdr": b"#?RADIANCE\n\n-Y 60000 +X 60000\n" + b"\1\2\3\200" + b"\1\1\1\377" * 4,
    }
    for name, content in claims.items():
        (tmp_path / name).write_bytes(content)
        with pytest.raises(UserError, match=r"picture (is too large|is damaged)"):
            read_image(tmp_path / name)


_PEAK = """
import resource, sys
from pathlib import Path
from lambent.core.pictures.images import read_image
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
assert read_image(Path(sys.argv[1])).shape == (4096, 4096, 3)
print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024)
"""


@pytest.mark.long
def test_a_small_file_of_a_large_picture_takes_its_own_memory(tmp_path: Path) -> None:
    """200 MB of pixels in a few kB: the picture, its bytes as Pillow has them, and little besides."""
    Image.new("RGB", (4096, 4096)).save(tmp_path / "a.png")
    done = subprocess.run([sys.executable, "-c", _PEAK, str(tmp_path / "a.png")], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) < 2 * 4096 * 4096 * 3 * 4
