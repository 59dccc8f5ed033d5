"""The writers that `endure` kills: each starts from a folder, writes into it, and can say whether it is sound."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import dataclass, replace
from functools import partial
from io import StringIO
from pathlib import Path

from lambent import site
from lambent.baking.bake import bake
from lambent.baking.running.relit import Relit
from lambent.baking.transport.view import View
from lambent.core.views.camera import Camera
from lambent.editing.session.session import Session
from lambent.materials.document import Material
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.scene import Scene
from lambent.site.export import export
from lambent.site.stills import export_stills
from lambent.store.kept.session import FILE, RoomState, WalkSession, read_session, write_session
from lambent.store.kept.views import Views, change_views, read_views
from lambent.store.store import Store
from lambent.viewer.modes.edit import worker
from tests.baking.small_scenes import TINY, room_with_step

PAGE = Path(site.__file__).parent / "page"
SAVES = 40  # of a session, in one run
QUALITY = TINY.changed(
    "endured", geometry={"texels": 96}, light_map={"samples": (32, 32), "gather_samples": 8, "tile_texels": 40}
)
EDITS, RELIT, VIEW_PX = "tray.edits.json", "store.relight.store", (16, 12)
EYE = Camera("eye", (0.6, 0.3, 0.8), (-0.8, -0.2, -0.4))


@dataclass(frozen=True)
class Job:
    """What is killed.

    Attributes
    ----------
    prepare : function of a folder
        Writes what is there before the first run; called once, the folder is then copied.
    work : function of a folder
        What a process does until it is killed, or ends.
    check : function of a folder
        Raises if what a dead process left cannot be used.
    content : function of a folder
        The result, compared bit for bit; files or arrays by name.
    """

    prepare: Callable[[Path], object]
    work: Callable[[Path], object]
    check: Callable[[Path], object]
    content: Callable[[Path], dict[str, bytes]]


def arrays(folder: Path, name: str = "store") -> dict[str, bytes]:
    """Keys and bytes of all arrays of a store; raises if one is not complete or not as it was written."""
    with Store.open(folder / name) as store:
        return {one.name: one.key.encode() + store.read(one.name).tobytes() for one in store.artefacts()}


def whole_arrays(folder: Path, name: str = "store") -> None:
    """Raise unless the store opens, and all arrays that claim to be complete can be read."""
    if (folder / name / "manifest.json").exists():
        with Store.open(folder / name) as store:
            for one in store.artefacts():
                if store.availability(one.name)[0] == "complete":
                    store.read(one.name)


def files(folder: Path) -> dict[str, bytes]:
    """All files of an export; raises if temporary ones were left."""
    found = {
        one.relative_to(folder).as_posix(): one.read_bytes() for one in (folder / "out").rglob("*") if one.is_file()
    }
    assert not [name for name in found if ".lambent-" in name], "temporary files are left"
    return found


def _step(kd: float) -> Scene:
    scene = room_with_step()
    return replace(scene, materials={**scene.materials, "grey": Material(kd=kd)}, cameras=(EYE,))


def bake_first(folder: Path) -> None:
    bake(_step(0.5), folder / "store", quality=QUALITY, only=("light_map", "probe")).close()


def bake_changed(folder: Path) -> None:
    bake(_step(0.3), folder / "store", quality=QUALITY, only=("light_map", "probe")).close()


def bake_box(folder: Path, former: Callable[[Path], object]) -> None:
    """A store, and an export of another state of its room, which the runs replace."""
    bake(load_scene("builtin:box"), folder / "store", quality=TINY).close()
    blue = RoomState(materials={"red": Material(name="red", kd=(0.05, 0.1, 0.7))})
    write_session(folder / "store" / FILE, WalkSession(states={"blue": blue}))
    former(folder)
    (folder / "store" / FILE).unlink()


def save_sessions(folder: Path) -> None:
    for number in range(1, SAVES + 1):
        states = {f"state {n}": RoomState(materials={"a": Material(kd=n / SAVES)}) for n in range(number)}
        write_session(folder / FILE, WalkSession(states=states))
        change_views(folder, lambda views, n=number: Views(cameras=(replace(EYE, name=f"view {n}"),)))


def whole_session(folder: Path) -> None:
    """Raise unless the session and the views are those of one save, and the views at most one behind."""
    session, views = read_session(folder / FILE), read_views(folder)
    saved = 0 if session is None else len(session.states)
    seen = int(views.cameras[0].name.split()[1]) if views.cameras else 0
    assert session is None or list(session.states) == [f"state {n}" for n in range(saved)]
    # A second run starts at 1 and leaves the views of the first until it writes its own.
    assert seen in (saved, saved - 1, SAVES) or saved == 1


def saved(folder: Path) -> dict[str, bytes]:
    return {name: (folder / name).read_bytes() for name in (FILE, "views.json")}


def export_site(folder: Path) -> None:
    with Store.open(folder / "store") as store:
        export(store, folder / "out")


def export_page(folder: Path) -> None:
    with Store.open(folder / "store") as store:
        export_stills(store, folder / "out", (96, 64))


def whole_site(folder: Path) -> None:
    """Raise unless the store is whole, and a site: the former, or the one that replaces it."""
    whole_arrays(folder)
    out = folder / "out"
    manifest = json.loads((out / "manifest.json").read_text())
    assert manifest["version"] == 1 and len(manifest["states"]) in (1, 2), "no whole manifest"
    assert {one.name for one in PAGE.iterdir()} <= {one.name for one in out.iterdir()}
    assert {name.split("/")[0] for name in files_of(manifest)} == {"data", "shaders"}
    for name, size in files_of(manifest).items():
        assert (out / name).is_file() and size in (None, (out / name).stat().st_size), name


def files_of(value: object) -> dict[str, int | None]:
    """All files that a manifest names, and their bytes where it says so."""
    if not isinstance(value, dict | list):
        return {}
    found = {value["file"]: value.get("packed")} if isinstance(value, dict) and "file" in value else {}
    if isinstance(value, dict) and "inline" in value:
        found = {}
    for one in value.values() if isinstance(value, dict) else value:
        found |= files_of(one)
    return found


def whole_stills(folder: Path) -> None:
    """Raise unless the store is whole, and a page of stills: the former, or the one that replaces it."""
    whole_arrays(folder)
    named = re.findall(r'src="(pictures/[^"]+)"', (folder / "out" / "index.html").read_text())
    assert len(named) in (2, 3) and all((folder / "out" / one).is_file() for one in named), named


def begin_edits(folder: Path) -> None:
    """A session on one material of the tray; its view has no transport yet."""
    tray = load_scene("builtin:teatray")
    nickel = {"nickel": tray.materials["nickel"]}
    Session.new("builtin:teatray", tray.cameras[0], nickel, size=VIEW_PX).save(folder / EDITS)


def edit_view(folder: Path) -> None:
    """What `lambent edit` bakes while its window is open: few lights, then more."""
    with redirect_stdout(StringIO()):  # progress, for the window
        worker.main(folder / EDITS, folder / "store", [2, 20])


def bake_tray(folder: Path) -> None:
    bake(load_scene("builtin:teatray"), folder / "store", quality=QUALITY, only=("geometry",)).close()


def relight_view(folder: Path) -> None:
    """What `lambent relight` bakes for a room with another material: a store of its own."""
    tray = load_scene("builtin:teatray")
    room = RoomState(materials={"nickel": tray.materials["nickel"].model_copy(update={"kd": (0.9, 0.6, 0.1)})})
    Relit(folder / "store", room, View(tray.cameras[0], *VIEW_PX)).bake()


def whole_relit(folder: Path) -> None:
    whole_arrays(folder)
    whole_arrays(folder, RELIT)


def nothing(folder: Path) -> None:
    folder.mkdir(exist_ok=True)


JOBS = {
    "bake": Job(nothing, bake_first, whole_arrays, arrays),
    "rebake": Job(bake_first, bake_changed, whole_arrays, arrays),
    "session": Job(nothing, save_sessions, whole_session, saved),
    "site": Job(partial(bake_box, former=export_site), export_site, whole_site, files),
    "edit": Job(begin_edits, edit_view, whole_arrays, arrays),
    "relight": Job(bake_tray, relight_view, whole_relit, partial(arrays, name=RELIT)),
    "stills": Job(partial(bake_box, former=export_page), export_page, whole_stills, files),
}


def copied(start: Path, folder: Path) -> Path:
    """A fresh copy of a prepared folder."""
    shutil.rmtree(folder, ignore_errors=True)
    return Path(shutil.copytree(start, folder))
