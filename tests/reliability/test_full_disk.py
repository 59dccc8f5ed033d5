"""A disk that fills up: one line with the file's name, exit code 2, the former file whole, nothing temporary left."""

from __future__ import annotations

import ast
import json
import re
import shutil
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.transport.view import View
from lambent.bench import card
from lambent.bench.card_rows.ledger import FIGURE
from lambent.cli import main
from lambent.core.discovery import modules_in
from lambent.core.errors import UserError
from lambent.core.pictures.images import write_image
from lambent.core.views.camera import Camera, CameraPath
from lambent.editing.session.session import Session
from lambent.materials import export
from lambent.materials.document import Lobe, Material
from lambent.scenes.loaders.load import load_scene
from lambent.store.kept import session, views
from lambent.store.store import Store
from lambent.viewer.modes.edit import worker
from lambent.viewer.modes.walk.views.views import write_alone
from lambent.viewer.settings import Remembered
from tests.reliability import full_disks

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="neither volumes nor limits on files' sizes")
ROOT = Path(__file__).parents[2]
GLOSSY = Material(name="glossy", kd=0.3, lobes=(Lobe(mx=0.2, my=0.2, r0=(0.2, 0.1, 0.05)),))
EYE = Camera("a", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
SAYS = re.compile(r"(cannot|could not) be written \(.*(No space left|File too large|is the disk full)")
COMMANDS = {  # by name and options: arguments; OUT is the file before its ending
    "bake -o": "bake builtin:box -o OUT --quality preview --only geometry --seed SEED",
    "check -o": "check loud.json --normalise -o OUT.json --force",
    "compare -o": "compare a.png b.png -o OUT.png",
    "glare -o": "glare box.store -o OUT.png --integrator lamps",
    "inspect --plot .pdf": "inspect glossy.json --plot OUT.pdf",
    "inspect --plot .svg": "inspect glossy.json --plot OUT.svg",
    "lightmap -o": "lightmap box.store -o OUT.exr --force",
    "export -o": "export boxSEED.store -o OUT",
    "export -o --as html": "export boxSEED.store -o OUT --as html --size 16x16",
    "fit -o": "fit glossy.txt --lobes 1 -o OUT.json --force",
    "fit --plot": "fit glossy.txt --lobes 1 --plot OUT.png",
    "fit --report": "fit glossy.txt --lobes 1 --report OUT.html",
    "illuminance -o .csv": "illuminance box.store --object floor -o OUT.csv --force",
    "illuminance -o .pdf": "illuminance box.store --object floor -o OUT.pdf",
    "relight -o .png": "relight tray.store -o OUT.png",
    "relight -o .exr": "relight tray.store -o OUT.exr --force",
    "render -o .png": "render box.store -o OUT.png --size 16x16 --samples 1",
    "render -o .exr": "render box.store -o OUT.exr --size 16x16 --samples 1 --force",
    "render -o .hdr": "render box.store -o OUT.hdr --size 16x16 --samples 1 --force",
    "render -o .mp4": "render box.store -o OUT.mp4 --path tour --size 32x32 --fps 1 --integrator diffuse",
    "render -o ####": "render box.store -o OUT-####.png --path tour --size 16x16 --fps 1 --integrator diffuse",
    "render -o --variants": "render box1.store -o OUT.png --variants --size 16x16 --samples 1",
}
ALONE = ("bench -o", "edit -o")  # tried below
UNTRIED = ("demo --out",)
FOLDERS = ("bake -o",)  # a store is changed in place
KEPT: dict[str, tuple[str, Callable[[Path], object]]] = {  # file of a window, and its writer
    "session": (session.FILE, lambda file: session.write_session(file, WALKED)),
    "views": (views.FILE, lambda file: views.change_views(file.parent, lambda _: views.Views(cameras=(EYE,)))),
    "walk alone": ("walk.json", lambda file: write_alone(file, TOUR)),
    "material": ("glossy.json", GLOSSY.save),
    "chunk": ("s.store", lambda file: put(file)),
}
TOUR = CameraPath(
    name="tour", keys=(EYE, replace(EYE, name="b", position=(0.0, 0.2, 0.0))), seconds=2.0, times_s=(0.0, 2.0)
)
WALKED = session.WalkSession(states={"glossy": session.RoomState(materials={"red": GLOSSY})})


def put(folder: Path) -> None:
    with Store.open(folder) if folder.exists() else Store.create(folder, {}) as store:
        store.put("a", "geometry", np.random.default_rng().random((64, 64)), key=str(np.random.default_rng().random()))


@pytest.fixture(scope="module")
def inputs(baked_box: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Files that the commands read."""
    folder = tmp_path_factory.mktemp("inputs")
    for name in ("box", "box0", "box1"):
        shutil.copytree(baked_box, folder / f"{name}.store")
    views.change_views(folder / "box.store", lambda _: views.Views(paths=(TOUR,)))
    session.write_session(folder / "box1.store" / session.FILE, WALKED)
    tray = load_scene("builtin:teatray")
    bake(tray, folder / "tray.store", only={"relighting"}, views=[View(tray.cameras[0], 16, 12)]).close()
    for name, value in (("a", 0.2), ("b", 0.4)):
        write_image(folder / f"{name}.png", np.full((16, 16, 3), value, np.float32))
    GLOSSY.save(folder / "glossy.json")
    GLOSSY.model_copy(update={"kd": (0.9,) * 3, "lobes": (Lobe(mx=0.2, my=0.2, r0=1.0),)}).save(folder / "loud.json")
    assert main.run(["convert", str(folder / "glossy.json"), str(folder / "glossy.txt")]) == 0
    return folder


Full = Callable[[], AbstractContextManager[None]]


@pytest.fixture(params=["limit", "volume"])
def disk(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[tuple[Path, Full]]:
    """A folder, and the context in which its disk is full."""
    if request.param == "limit":
        yield tmp_path, lambda: full_disks.limited(tmp_path)
        return
    with full_disks.volume(tmp_path / "volume"):
        yield tmp_path / "volume", lambda: full_disks.filled(tmp_path / "volume")


def content(folder: Path) -> dict[str, bytes]:
    """All files but the lock, which names a process, and what fills the disk."""
    files = (one for one in folder.rglob("*") if one.is_file() and one.name not in (".writer.lock", "ballast"))
    return {one.relative_to(folder).as_posix(): one.read_bytes() for one in files}


def words_of(name: str, folder: Path, inputs: Path, seed: int) -> list[str]:
    return [
        str(inputs / word) if (inputs / word).exists() else word.replace("OUT", str(folder / "out"))
        for word in COMMANDS[name].replace("SEED", str(seed)).split()
    ]


def refused(error: str, folder: Path) -> None:
    """Check what is said of a full disk."""
    assert error.count("\n") == 0 and SAYS.search(error) and str(folder) in error and ".lambent-" not in error, error


@pytest.mark.long
@pytest.mark.parametrize("disk", ["limit"], indirect=True)
@pytest.mark.parametrize("name", COMMANDS)
def test_commands(
    name: str, disk: tuple[Path, Full], inputs: Path, capsys: pytest.CaptureFixture[str], device: Any
) -> None:
    folder, full = disk
    assert main.run(words_of(name, folder, inputs, 0)) == 0, capsys.readouterr()
    former = content(folder)
    assert former
    capsys.readouterr()
    with full():
        code, said = main.run(words_of(name, folder, inputs, 1)), capsys.readouterr()
    *_, error = said.err.splitlines() or [""]
    assert code == 2 and error.startswith("lambent: error: "), said
    refused(error, folder)
    left = content(folder)
    assert not [one for one in left if ".lambent-" in one]
    if name not in FOLDERS:
        assert left == former
    assert main.run(words_of(name, folder, inputs, 1)) == 0, "once there is room again"


@pytest.mark.long
@pytest.mark.parametrize("disk", ["volume"], indirect=True)
@pytest.mark.parametrize("free", [1 << 14, 1 << 17, 1 << 18])
def test_a_site_stays_where_its_successor_does_not_fit(
    free: int, disk: tuple[Path, Full], inputs: Path, device: Any
) -> None:
    """The disk is full after some of its data, all of them, and some of the page."""
    folder, _ = disk
    assert main.run(words_of("export -o", folder, inputs, 0)) == 0
    former = content(folder)
    with full_disks.filled(folder, free):
        assert main.run(words_of("export -o", folder, inputs, 1)) == 2
        assert content(folder) == former
    assert main.run(words_of("export -o", folder, inputs, 1)) == 0 and content(folder) != former


@pytest.mark.parametrize("disk", ["limit"], indirect=True)
def test_rows_of_a_bench(
    disk: tuple[Path, Full], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Measured ones are kept; figures of another source stand for those of a card."""
    folder, full = disk
    monkeypatch.setattr(card, "figures", lambda *_: iter([dict.fromkeys(FIGURE, 1.0)]))
    words = ["bench", "card", "--quick", "-o", str(folder / "card.json")]
    with full():
        assert main.run(words) == 2
    refused(capsys.readouterr().err.splitlines()[-1], folder)
    assert not content(folder)
    assert main.run(words) == 0 and json.loads((folder / "card.json").read_text())["done"]
    former = content(folder)
    with full():
        assert main.run(words) == 0, "nothing is left to measure or to write"
    assert content(folder) == former


@pytest.mark.long
def test_the_store_of_edits(disk: tuple[Path, Full], mi: Any) -> None:
    """What the window's worker bakes into it."""
    folder, full = disk
    tray = load_scene("builtin:teatray")
    name = tray.objects[0].material
    edits, store = folder / "tray.edits.json", folder / "tray.store"
    Session.new("builtin:teatray", tray.cameras[0], {name: tray.materials[name]}, size=(8, 6)).save(edits)
    for lights in (1, 2):
        with full(), pytest.raises(UserError) as caught:
            worker.main(edits, store, [lights])
        refused(str(caught.value), folder)
        worker.main(edits, store, [lights])  # once there is room again
        with Store.open(store) as whole:
            assert all(whole.availability(one.name)[0] == "complete" for one in whole.artefacts())


@pytest.mark.parametrize("name", KEPT)
def test_what_a_window_saves(name: str, disk: tuple[Path, Full]) -> None:
    folder, full = disk
    file, write = folder / KEPT[name][0], KEPT[name][1]
    write(file)
    former = content(folder)
    with full(), pytest.raises(UserError) as caught:
        write(file)
    refused(str(caught.value), folder)
    assert content(folder) == former


@pytest.mark.parametrize("number", range(len(modules_in(export, having="ENDINGS"))))
def test_formats_of_other_tools(number: int, disk: tuple[Path, Full]) -> None:
    folder, full = disk
    writer = sorted(modules_in(export, having="ENDINGS").items())[number][1]
    file, matt = folder / f"out{writer.ENDINGS[-1]}", Material(name="matt", kd=0.3)
    file.write_text("former")
    former = content(folder)
    with full(), pytest.raises(UserError) as caught:
        writer.write(matt, file)
    refused(str(caught.value), folder)
    assert content(folder) == former


def test_settings_are_told_not_raised(disk: tuple[Path, Full]) -> None:
    folder, full = disk
    said: list[str] = []
    remembered = Remembered(said.append)
    remembered.open(folder / "window.json")
    remembered.set(size="design")
    former = content(folder)
    with full():
        remembered.set(size="measure")
    assert len(said) == 1 and SAYS.search(said[0]) and content(folder) == former


def test_every_command_that_writes_is_here() -> None:
    import typer

    known = {" ".join(name.split()[:2]) for name in COMMANDS} | {*ALONE, *UNTRIED}
    group: Any = typer.main.get_command(main.build_app())
    found = {
        f"{name} {option}"
        for name, command in group.commands.items()
        for parameter in command.params
        for option in parameter.opts
        if option in ("-o", "--out", "--plot", "--report")
    }
    assert found == known


def test_every_writer_is_atomic() -> None:
    """Files are written within `atomic_path`, or by `core.files`."""
    loose = []
    for path in sorted((ROOT / "lambent").rglob("*.py")):
        where = path.relative_to(ROOT).as_posix()
        if where in ("lambent/core/files.py", "lambent/bench/scenes/below_zero.py"):  # of a temporary folder
            continue
        loose += [f"{where}:{line}" for line in unprotected(ast.parse(path.read_text(encoding="utf-8")))]
    assert not loose


WRITES = ("write_bytes", "write_text", "copyfile", "copy", "copy2")  # of paths, then of shutil


def unprotected(tree: ast.AST, within: bool = False) -> Iterator[int]:
    """Lines that call a method of WRITES outside `atomic_path`, or on another path than it gives."""
    for node in ast.iter_child_nodes(tree):
        inner = within
        if isinstance(node, ast.With):
            inner |= any("atomic_path" in ast.dump(item.context_expr) for item in node.items)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and not within:
            if "atomic_path" in ast.dump(node.func.value):  # enter_context(atomic_path(...)).write_bytes(...)
                continue
            of_shutil = isinstance(node.func.value, ast.Name) and node.func.value.id == "shutil"
            if node.func.attr in WRITES[:2] or (of_shutil and node.func.attr in WRITES[2:]):
                yield node.lineno
        yield from unprotected(node, inner)
