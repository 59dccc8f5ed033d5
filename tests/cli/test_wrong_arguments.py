"""Wrong arguments of every command: one line that names what was wrong, exit code 2, and nothing written."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from lambent.editing.session.session import Session
from lambent.materials.document import Lobe, Material
from lambent.materials.measured.inspecting.synthetic import Setup, synthesise
from lambent.materials.measured.parts.gonio_text import write_gonio
from lambent.scenes.loaders.load import load_scene
from tests.cli.edited_floor import saved, write_floor
from tests.viewer.small_store import write_small_store

VIEW = "bake scene.toml -o s --only transport --view"
BOUNCED = "--view above:12x8 --series 4,1 --samples 4"
PROPOSED = f"bake scene.toml {BOUNCED} --propose"
EDITED = "render none --edit paint.edits.json -o x.png"
FIXED = "fixes camera, size and light"
SMALL = "render small.store -o"

WRONG = {
    "fitt": "Did you mean 'fit'? (see `lambent --help`)",
    "bake absent.toml -o s": "absent.toml: cannot be read (",
    "bake absent.glb -o s": "absent.glb: cannot be read (",
    "bake absent -o s": "absent: cannot be read (",
    "bake builtin:rom -o s": "did you mean 'room'?",
    "bake builtin:box": "-o: no output folder",
    "bake builtin:box -o s --quality great": "--quality': 'great' is not one of",
    "bake builtin:box -o s --only walls": "--only",
    "bake builtin:box -o s --seed -1": "--seed",
    "bake builtin:box -o s --merge": "--merge: applies to interreflections only",
    "bake builtin:box -o s --crease-angle 181": "--crease-angle",
    "bake builtin:box -o s --light-fields ''": "--light-fields: matches no object",
    "bake builtin:box -o s --light-fields sphre": "found sphre; expected names of objects, auto",
    "bake folder -o s": "folder: unknown scene format",
    "bake scene.toml -o s --only transport": "name them with --view",
    f"{VIEW} abov:9x9": "--view: unknown camera; found abov; expected above",
    f"{VIEW} above:0x9": "found above:0x9; expected WIDTHxHEIGHT",
    f"{VIEW} above:9x99999": "expected WIDTHxHEIGHT",
    f"{VIEW} above:9x99999999999": "expected WIDTHxHEIGHT",
    f"{VIEW} above --fixed paint": "--fixed: applies to interreflections only",
    "bake scene.toml -o s --only geometry --view above": "--only: no kind uses the given view; found geometry",
    "bake scene.toml -o s --only transport --edit wool.edits.json": "unknown material; found wool",
    "bake scene.toml -o s --only transport --edit bad.edits.json": "bad.edits.json: JSON cannot be read",
    "bake scene.toml -o s --only transport --edit half.edits.json": "half.edits.json: scene: is missing",
    "bake scene.toml -o s --only interreflection": "--view: is missing",
    "bake scene.toml -o s --editable paint": "--editable: applies to interreflections only",
    "bake builtin:box -o s --on 0": "--on: no workers; found 0; expected at least 1",
    "bake builtin:box --propose": "--view",
    f"{PROPOSED} --series 64": "expected 2 to 6 numbers",
    f"{PROPOSED} --series 63,1": "expected powers of two",
    f"{PROPOSED} --fixed gold": "--fixed: unknown material",
    f"{PROPOSED} --editable carpet": "--editable: unknown material",
    f"{PROPOSED} --fixed paint --editable paint": "--fixed and --editable; found paint",
    "bench nothing": "unknown bench",
    "bench flicker --input nothing": "nothing: input does not exist",
    "check absent.json": "is neither a file nor a model",
    "check folder": "folder: cannot be used; found a folder",
    "check half.json": "no scattering term",
    "check half.json --set kd=1": "only a model",
    "check wart": "did you mean 'ward'",
    "check ward --seed -1": "--seed",
    "check ward --set kss=1": "did you mean",
    "check ward --set mx=wide": "NAME=VALUE",
    "check ward --set mx": "NAME=VALUE",
    "check ward --set mx=0.1,0.2,0.3": "a number from",
    "check ward --set mx=7": "from 0.003 to 1",
    "check ward --normalise": "-o: is missing",
    "check ward -o x.json": "--normalise: is missing",
    "check ward --normalise -o x.png": "expected .json",
    "check ward --normalise -o x.json": "cannot be read",
    "check table.txt --normalise -o x.json": "fit it first",
    "check brass.json --normalise -o brass.json": "output is the input",
    "compare absent.png other.png": "absent.png: cannot be read (",
    "compare bad.edits.json bad.edits.json": "unknown picture format",
    "convert half.edits.json thing.nope": "thing.nope: unknown ending",
    "convert half.edits.json thing.glb": "half.edits.json",
    "convert table.txt thing.glb": "is a table, which glTF",
    "convert table.txt table.txt": "output is the input",
    "convert table.txt link.txt": "output is the input",
    "convert table.txt folder --as gonio_text": "is a folder",
    "convert table.txt x.bin --as merk": "did you mean 'merl'",
    "convert absent x.txt": "absent: cannot be read (",
    "convert hello x.txt": "known format",
    "demo further": "further",
    "demo --headless --out folder/..": "is neither a demo folder nor empty",
    "demo --headless --out hello": "is neither a demo folder nor empty",
    "doctor further": "further",
    "edit builtin:box --picture 9x": "--picture: cannot be read as a picture size; found 9x",
    "edit builtin:box other.json": "a scene takes no material document",
    "edit half.json --crease-angle 40": "--crease-angle: applies to scenes",
    "fit absent.bsdf": "absent.bsdf: cannot be read (",
    "fit folder -o a.json": "folder: cannot be read",
    "fit table.txt --fix q=1": "unknown parameter",
    "fit table.txt --fix mx": "name=value",
    "fit table.txt --range mx=2:1": "empty range",
    "fit table.txt --lobes many": "--lobes",
    "fit table.txt --lobes 9": "1 to 4",
    "fit table.txt --metric l2": "unknown metric",
    "glare half.edits.json": "picture has no view",
    "glare folder": "folder: not a store",
    "inspect absent.bsdf": "absent.bsdf: cannot be read (",
    "inspect folder": "folder: not a store",
    "inspect infinite.txt": "columns with names that are not known (inf 400 500 600)",
    "inspect lamp.gldf": "ask its maker for an .ies or .ldt file",
    "relight folder": "folder: not a store",
    "relight folder --exposure 1": "--exposure: is for a picture; name it with -o",
    "relight folder --size 5": "--size: cannot be read",
    "relight folder --turn inf": "--turn: is no angle",
    "relight folder --turn nan -o x.png": "--turn: is no angle",
    "render absent.store -o x.png": "absent.store: not a store",
    "render folder -o x.gif": "x.gif: unknown kind of file",
    "render folder -o x.png --ev100 500": "--ev100: is out of range; found 500.0; expected -57 to 71",
    "render folder -o x.png --ev100 9 --exposure 1": "--ev100: excludes --exposure",
    "render folder -o x.png --exposure 1e9": "--exposure: is out of range",
    "render folder -o x.png --range 5:1": "is not a luminance range; found 5:1",
    "render folder -o x.png --range a:b": "--range: cannot be read as a range",
    "render folder -o x.png --range 5": "expected LOW:HIGH",
    "render folder -o x.png --size 5": "--size: cannot be read as a picture size",
    "render folder -o x.png --size 0x5": "expected WIDTHxHEIGHT",
    "render folder -o x.png --samples 0": "--samples': it has to be greater than or equal to 1",
    "render folder -o x.png --view falsecolour": "--view: unknown view transform",
    "render folder -o x.png --show luminance --view neutral": "leave out --view",
    "render folder -o x.png --surfaces 2": "--surfaces",
    "render folder -o x.png --field 500": "--field",
    "render folder -o x.png --projection fisheye --size 9x9 --field 0": "field of view is out of range",
    "render folder -o x.png --projection cylinder --field 0": "field of view is out of range",
    "render folder -o x.png --fps 24": "--fps: applies to films only",
    "render folder -o x.png --light sun=off@3": "--light: keyframes apply to films only; found sun at 3 s",
    "render folder -o x.png --light sun=off --light sun=on@3": "films only; found sun at 3 s",
    "render folder -o x.png --light lamp=2700": "--light: intensity is out of range; found lamp=2700; ",
    "render folder -o x.png --range 1:5": "--range: applies to false colours only",
    "render folder -o x.png --linear": "--linear: applies to false colours only",
    "render folder -o x.png --integrator ray": "expected traced, path, lamps",
    f"{SMALL} x.png --integrator lamps --planar of": "did you mean 'off'?",
    "render folder -o x.png --integrator path --planar off": "--planar: applies to drawn pictures only",
    "render folder -o x.hdr --path tour": "--path: applies to films only",
    "render folder -o x.mp4 --camera side": "a film follows a path",
    "render folder -o x.png --variant blue --variants": "--variant: excludes --variants; leave out one",
    "render folder -o x.png --variants --path rest": "--path: excludes --variants",
    "render folder -o x.exr --variants": "expected .png",
    "render folder -o /proc/x.png": "cannot be written",
    f"{SMALL} x.png --camera sied": "did you mean 'side'?",
    f"{SMALL} x.png --integrator path": "name it with --scene",
    f"{SMALL} x.png --variants": "the store has no variants",
    f"{EDITED} --size 9x9": f"--size: excludes --edit; paint.edits.json {FIXED}",
    **{f"{EDITED} {option}": f"error: {option.split()[0]}: excludes --edit" for option in (
        "--camera above", "--path tour", "--integrator path", "--samples 4", "--show diffuse", "--planar off",
        "--scene x", "--fps 25")},
    "view folder --camera front": "No such option: --camera",
    "view absent.store": "not a store",
    "walk absent.store": "not a store",
    "walk folder --size 0x0": "--size: cannot be read as a picture size",
}  # fmt: skip


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of sound and unsound files."""
    folder = tmp_path_factory.mktemp("place")
    (folder / "folder").mkdir()
    for name, text in {
        "bad.edits.json": "not JSON", "half.edits.json": '{"format": "lambent-edit-session"}', "half.json": "{}",
        "hello": "hello", "infinite.txt": "inf 400 500 600\n1 2 3 4 5\n", "lamp.gldf": "PK\x03\x04",
    }.items():  # fmt: skip
        (folder / name).write_text(text)
    steep = Material(name="brass", kd=0.1, lobes=(Lobe(mx=0.4, my=0.4, k=0.8, r0=1, alpha=1),))
    steep.save(folder / "brass.json")
    setup = Setup((0.0, 30.0, 60.0), step_deg=20, fine_deg=10, noise=0.0, floor=0.0)
    write_gonio(folder / "table.txt", synthesise(steep, setup))
    (folder / "link.txt").symlink_to("table.txt")
    scene = write_floor(folder)
    saved(scene, "paint.edits.json")
    stranger = {"wool": Material(kd=0.5)}
    Session.new("s", load_scene(str(scene)).cameras[0], stranger).save(folder / "wool.edits.json")
    write_small_store(folder / "small.store")
    return folder


@pytest.mark.parametrize("line", WRONG)
def test_one_line_says_what_is_wrong(refused, place, monkeypatch, line):
    monkeypatch.chdir(place)
    before = {one: one.lstat().st_mtime_ns for one in place.iterdir()}
    said = refused(*shlex.split(line))
    assert WRONG[line] in said and len(said) < 400
    assert {one: one.lstat().st_mtime_ns for one in place.iterdir()} == before
