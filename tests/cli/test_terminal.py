"""What reaches a terminal: no control characters, no endless lines, no traceback of an interruption; and --force."""

from __future__ import annotations

import json
import logging
import os
import re
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from lambent.api import progress as bars
from lambent.cli.console import progress_bar, table
from lambent.core.errors import UserError
from lambent.core.pictures.images import write_shown
from lambent.core.plain import printable
from lambent.materials.document import Lobe, Material
from lambent.materials.measured.inspecting.synthetic import Setup, synthesise
from lambent.materials.measured.parts.gonio_text import write_gonio

ESCAPES = "\x1b]0;title\x07\x1b[31mred\u202e\r"
posix = pytest.mark.skipif(sys.platform == "win32", reason="signals and file names are of POSIX")


@pytest.fixture
def material(tmp_path: Path) -> Path:
    Material(name="brass", kd=0.1, lobes=(Lobe(k=3.0, mx=0.1, my=0.2, r0=0.9),)).save(tmp_path / "brass.json")
    return tmp_path / "brass.json"


def test_printable():
    assert printable("é 漢 \N{GRINNING FACE} a b") == "é 漢 \N{GRINNING FACE} a b"
    assert printable("\x1b[31m\r\n\t\x9b\u202e\u2028\udcff\0") == r"\x1b[31m\r\n\t\x9b\u202e\u2028\udcff\x00"


@posix
def test_names_do_not_command_the_terminal(lambent, refused, tmp_path, caplog):
    file = tmp_path / f"{ESCAPES}.json"
    Material(name=ESCAPES, kd=0.1).save(file)
    outcome = lambent("inspect", file)
    assert outcome.code == 0 and r"\x1b]0;title\x07" in outcome.out
    said = [outcome.out, *(refused(*words) for words in (("fit", file), ("inspect", f"{file}x"), (f"a{ESCAPES}",)))]
    said += [table([(ESCAPES,)]), lambent("inspect", file, "--json").out]
    assert json.loads(said[-1])["name"] == ESCAPES
    lambent("convert", file, tmp_path / "a.mtlx")
    logging.getLogger("lambent").warning("%s", ESCAPES)
    with progress_bar() as progress:
        progress(1, 2, "[/nothing] is markup")
    assert not any(set(text) & set("\x1b\x07\r\u202e") for text in said)


@pytest.mark.long
@posix
def test_file_names_that_are_no_text(lambent, material, tmp_path):
    file = os.fsdecode(os.fsencode(tmp_path) + b"/\xff\x1b.json")
    Path(file).write_bytes(material.read_bytes())
    for arguments in (["inspect", file], ["check", file], ["convert", file, f"{file}.mtlx"], ["inspect", f"{file}x"]):
        outcome = lambent(*arguments)
        assert outcome.code in (0, 1, 2) and "\x1b" not in outcome.out + outcome.err
    specimen = synthesise(Material(name="m", kd=0.3), Setup((0.0, 30.0), step_deg=30, fine_deg=30, noise=0, floor=0))
    write_gonio(Path(f"{file}.txt"), specimen)
    outcome = lambent("fit", f"{file}.txt", "-o", tmp_path / "fitted.json")
    assert outcome.code in (0, 2) and "Traceback" not in outcome.err


def test_steps_of_redirected_output_are_lines(capsys, monkeypatch):
    """A log has a line for each step that took a while, one a minute meanwhile, and the step that was interrupted."""
    now = [0.0]
    monkeypatch.setattr(bars.time, "monotonic", lambda: now[0])
    with pytest.raises(KeyboardInterrupt), progress_bar() as progress:
        for now[0], done, step in (0, 0, "light map"), (10, 1, "light map"), (70, 3, "light map"), (75, 0, "short"):
            progress(done, 4, step)
        now[0] += 0.1
        progress(0, 1, "probes")
        now[0] += 2.5
        raise KeyboardInterrupt
    lines = capsys.readouterr().err.splitlines()
    assert lines == ["light map: 75% after 70 s", "light map: 75.0 s", "probes: stopped after 2.5 s"]


def test_long_errors_are_cut_and_their_hints_are_not():
    long = "x" * 10**6
    error = UserError(long, file=long + "end.txt", field=long, got=long, expected=long, hint="h" * 2000)
    assert len(str(error)) < 6000 and str(error).endswith("h" * 2000)
    assert "end.txt: " in str(error)
    assert "more digits" in str(UserError("a", got=10**5000))


@pytest.mark.long
def test_what_exists_is_replaced_by_force_alone(lambent, refused, material, tmp_path):
    before = material.read_bytes()
    (tmp_path / "mine").write_text("mine")
    write_shown(tmp_path / "a.png", np.zeros((8, 8, 3), np.uint8))
    write_gonio(tmp_path / "m.txt", synthesise(Material(name="m", kd=0.3), Setup((0.0,), step_deg=30, fine_deg=30)))
    for ending in ("mtlx", "json", "png", "html"):
        (tmp_path / f"mine.{ending}").write_text("mine")
    (tmp_path / "mine_albedo.png").write_text("mine")
    for arguments in (
        ["convert", material, tmp_path / "mine.mtlx"],
        ["check", material, "--normalise", "-o", tmp_path / "mine.json"],
        ["inspect", material, "--plot", tmp_path / "mine.png"],
        ["compare", tmp_path / "a.png", tmp_path / "a.png", "-o", tmp_path / "mine.png"],
        ["fit", tmp_path / "m.txt", "-o", tmp_path / "mine.json"],
        ["fit", tmp_path / "m.txt", "--report", tmp_path / "mine.html"],
        ["fit", tmp_path / "m.txt", "--plot", tmp_path / "mine.png"],
        ["render", tmp_path / "a.store", "-o", tmp_path / "mine.png"],
    ):
        assert "exists already; write to another file, or add --force" in refused(*arguments)
    assert all(path.read_text() == "mine" for path in tmp_path.glob("mine*"))
    assert "output is the input" in refused("check", material, "--normalise", "-o", material)
    assert "output is the input" in refused("compare", tmp_path / "a.png", tmp_path / "a.png", "-o", tmp_path / "a.png")
    assert material.read_bytes() == before
    assert lambent("check", material, "--normalise", "-o", material, "--force").code == 0
    assert material.read_bytes() != before
    assert [lambent("inspect", material, "--plot", tmp_path / "plot.png").code for _ in "12"] == [0, 0]


INTERRUPTED_IMPORT = """
import signal, sys
class Interrupt:
    def find_spec(self, name, path=None, target=None):
        if name == {name!r} and not done:
            done.append(name)
            signal.raise_signal(signal.SIGINT)
done = []
sys.meta_path.insert(0, Interrupt())
{before}
from lambent.cli.main import main
sys.argv = ["lambent", "check", "lambert"]
main()
"""
AT_THE_END_OF_AN_OBJECT = """
class Late:
    def __del__(self):
        raise KeyboardInterrupt
import time
import lambent.materials.checking.check as module
was = module.check
def check(*arguments, **options):
    Late()
    time.sleep(1)
    return was(*arguments, **options)
module.check = check
"""


@posix
@pytest.mark.parametrize("name", ["typer", "lambent.materials.checking.check", ""])
def test_ctrl_c_is_clean_while_libraries_are_imported(name):
    """Among the modules: those of the command line itself, and those of a command that has begun."""
    program = INTERRUPTED_IMPORT.format(name=name, before="" if name else AT_THE_END_OF_AN_OBJECT)
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    # A slow machine has been at the step long enough for its line.
    said = r"(\w+: stopped after [\d.]+ s\n)?lambent: interrupted; finished work is kept\n"
    assert (done.returncode, done.stdout) == (130, "") and re.fullmatch(said, done.stderr), done.stderr


AFTER_CTRL_C = """
import signal, sys
from lambent.cli.console import progress_bar
from lambent.core.errors import UserError
from lambent.core.inputs import foreign_bytes
import lambent.materials.checking.check as module
def dropped():
    try:
        signal.raise_signal(signal.SIGINT)
    except KeyboardInterrupt:
        pass
def check(*_, **__):
    {body}
module.check = check
from lambent.cli.main import main
sys.argv = ["lambent", "check", "lambert"]
main()
"""
READER = "with foreign_bytes('reader', 'a.txt'): raise RuntimeError('no compiled object yet')"
STEPS = "with progress_bar() as progress: progress(0, 1, 'step')\n    raise SystemExit('went on')"
BEFORE = "raise RuntimeError('a bug')"
FULL = "dropped()\n    raise OSError(28, 'no space', 'a.png')"


@pytest.mark.long
@posix
@pytest.mark.parametrize(
    ("body", "code", "said"),
    [("dropped()\n    raise RuntimeError('no compiled object yet')", 130, "lambent: interrupted"),
     (f"dropped()\n    {STEPS}", 130, "lambent: interrupted"),
     (FULL, 2, "lambent: error: a.png: cannot be written"),
     (READER, 2, "lambent: error: a.txt: "), (BEFORE, 1, "Traceback")],
)  # fmt: skip
def test_errors_after_ctrl_c_are_the_interruption(body, code, said):
    """Where a library drops the `KeyboardInterrupt`; errors before Ctrl-C, and of the disk after it, are told."""
    program = AFTER_CTRL_C.format(body=body)
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout) == (code, "") and done.stderr.startswith(said), done.stderr
    assert code == 1 or done.stderr.count("\n") == 1


@pytest.mark.parametrize("error", [MemoryError(), ImportError("a.so: failed to map segment from shared object")])
def test_an_error_of_memory_is_one_line(refused, monkeypatch, tmp_path: Path, error: Exception) -> None:
    def fails(*_: object) -> None:
        raise error

    Image.new("L", (8, 8)).save(tmp_path / "a.png")
    monkeypatch.setattr("lambent.api.pictures.read_image", fails)
    assert "out of memory" in refused("inspect", tmp_path / "a.png")


@pytest.mark.long
def test_a_picture_larger_than_the_memory(tmp_path: Path) -> None:
    """800 MB of pixels in a process that may have 900 MB."""
    Image.new("L", (8192, 8192)).save(tmp_path / "a.png")
    done = subprocess.run(
        [sys.executable, "-m", "lambent.cli.main", "inspect", str(tmp_path / "a.png")],
        capture_output=True, text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (900 << 20, 900 << 20)),
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (2, ""), done
    assert done.stderr.splitlines()[-1].startswith("lambent: error: out of memory"), done.stderr
    assert "Traceback" not in done.stderr
