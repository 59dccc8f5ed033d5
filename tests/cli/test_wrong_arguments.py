"""Wrong arguments of every command: one line that names what was wrong, exit code 2, and nothing written."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

WRONG = {
    "bake builtin:box": "-o: no output folder",
    "bake builtin:box -o s --quality great": "--quality': 'great' is not one of",
    "bake builtin:box -o s --only walls": "--only",
    "bake builtin:box -o s --only transport": "--view",
    "bake builtin:box -o s --only transport --view none": "--view: unknown camera",
    "bake builtin:box -o s --only transport --view front:0x0": "front:0x0",
    "bake builtin:box -o s --seed -1": "--seed",
    "bake builtin:box -o s --merge": "--merge: applies to interreflections only",
    "bake builtin:box -o s --crease-angle 181": "--crease-angle",
    "bake builtin:box --propose": "--view",
    "bake builtin:box --propose --view front --series 3,1": "3,1",
    "bake builtin:box --propose --view front --fixed gold": "--fixed: unknown material",
    "bake builtin:box -o s --only transport --edit bad.edits.json": "bad.edits.json: not a JSON document",
    "bake builtin:box -o s --only transport --edit half.edits.json": "half.edits.json: scene: is missing",
    "bake folder -o s": "folder: unknown scene format",
    "bench nothing": "unknown bench",
    "bench flicker --input nothing": "nothing: input does not exist",
    "check folder": "folder: cannot be read",
    "check ward --seed -1": "--seed",
    "compare bad.edits.json bad.edits.json": "unknown picture format",
    "convert half.edits.json thing.nope": "thing.nope: unknown ending",
    "convert half.edits.json thing.glb": "half.edits.json",
    "demo further": "further",
    "doctor further": "further",
    "edit builtin:box --picture 9x": "--picture: cannot be read as a picture size; found 9x",
    "edit builtin:box other.json": "a scene takes no material document",
    "edit half.json --crease-angle 40": "--crease-angle: applies to scenes",
    "fit half.edits.json -o a.json --lobes many": "--lobes",
    "fit folder -o a.json": "folder: cannot be read",
    "glare half.edits.json": "picture has no view",
    "glare folder": "folder: not a store",
    "inspect folder": "folder: not a store",
    "relight folder": "-o",
    "render folder -o x.gif": "x.gif: unknown kind of file",
    "render folder -o x.png --ev100 500": "--ev100: is out of range",
    "render folder -o x.png --exposure 1e9": "--exposure: is out of range",
    "render folder -o x.png --range 5:1": "is not a luminance range; found 5:1",
    "render folder -o x.png --range a:b": "--range: cannot be read as a range",
    "render folder -o x.png --size 5": "--size: cannot be read as a picture size",
    "render folder -o x.png --samples 0": "--samples': it has to be greater than or equal to 1",
    "render folder -o x.png --view pretty": "--view: unknown view transform",
    "render folder -o x.png --surfaces 2": "--surfaces",
    "render folder -o x.png --field 500": "--field",
    "render folder -o x.png --projection fisheye --size 9x9 --field 0": "field of view is out of range",
    "render folder -o x.png --projection cylinder --field 0": "field of view is out of range",
    "render folder -o x.png --fps 24": "--fps: applies to films only",
    "render folder -o x.png --light sun=off@3": "--light: keyframes apply to films only; found sun at 3 s",
    "render folder -o x.png --light sun=off --light sun=on@3": "films only; found sun at 3 s",
    "render folder -o x.png --range 1:5": "--range: applies to false colours only",
    "render folder -o x.png --linear": "--linear: applies to false colours only",
    "render folder -o x.png --integrator ray": "expected traced, path, lamps",
    "bake builtin:box -o s --light-fields ''": "--light-fields: matches no object",
    "walk folder --size 0x0": "--size: cannot be read as a picture size",
    "view folder --camera front": "No such option: --camera",
}


@pytest.mark.parametrize("line", WRONG)
def test_one_line_says_what_is_wrong(refused, tmp_path, monkeypatch, line):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "bad.edits.json").write_text("not JSON")
    (tmp_path / "half.edits.json").write_text('{"format": "lambent-edit-session"}')
    (tmp_path / "half.json").write_text("{}")
    said = refused(*shlex.split(line))
    assert WRONG[line] in said and len(said) < 400
    assert {one.name for one in tmp_path.iterdir()} == {"folder", "bad.edits.json", "half.edits.json", "half.json"}


def test_a_name_that_fits_nothing_is_one_line(lambent, tmp_path: Path):
    outcome = lambent("bake", "builtin:box", "-o", tmp_path / "s", "--light-fields", "sphre")
    assert outcome.code == 2
    assert "--light-fields: matches no object; found sphre" in outcome.err and "did you mean 'sphere'?" in outcome.err
    assert not (tmp_path / "s").exists(), "nothing is begun"
