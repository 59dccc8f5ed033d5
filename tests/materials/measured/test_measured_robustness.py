"""Broken files whose answer is known: one clear line, no memory out of proportion. Others are in tests/reliability."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.inputs import UNREADABLE
from lambent.materials.measured import load
from tests.materials.measured.measured_files import merl_bytes
from tests.materials.measured.sound_files import seeds

SOUND = seeds()
LARGEST = 10  # times the size of a file: memory that may be used
WI, WO = np.array([[0.6, 0.0, 0.8]]), np.array([[-0.6, 0.0, 0.8]])


@pytest.fixture(scope="module")
def target(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where broken files are written."""
    return tmp_path_factory.mktemp("broken") / "broken.bsdf"


def attempt(path: Path, content: bytes) -> None:
    """Load and use a broken file; it is a table or a `UserError` of one line, which its reader raises itself."""
    path.write_bytes(content)
    try:
        table = load(path)
        assert np.isfinite(table.eval(WI, WO)).all() and np.isfinite(table.samples(1000).f).all()
    except UserError as error:
        assert "\n" not in str(error) and UNREADABLE not in str(error), str(error)


_LOAD = """
import json, resource, sys
from pathlib import Path
from lambent.core.errors import UserError
from lambent.core.inputs import UNREADABLE
from lambent.materials.measured import load
from tests.materials.measured.sound_files import seeds
for contents in seeds().values():  # imports and caches are warm
    for content in contents:
        Path(sys.argv[1]).with_name("sound").write_bytes(content)
        load(Path(sys.argv[1]).with_name("sound")).samples()
peak = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
grown = {}
for path in map(Path, sys.argv[1:]):
    before = peak()
    try:
        load(path).samples()
    except UserError:
        pass
    grown[path.name] = [peak() - before, path.stat().st_size]
print(json.dumps(grown))
"""


def test_memory_of_the_whole_process(tmp_path: Path) -> None:
    """Memory outside tracemalloc counts too: headers that promise gigabytes, and a large sound file."""
    huge = {
        "merl": np.full(3, 2**31 - 1, "<i4").tobytes() + bytes(1000),
        "rgl": SOUND["RGL tensor file"][0][:60] + b"\xff" * 4000,
        "cornell": b"1000000000\n400 500 600\n" + b"0 " * 1000,
        "zemax": SOUND["Zemax BSDF text"][0].replace(b"ScatterRadial\t7", b"ScatterRadial\t999999999"),
        "large": merl_bytes(np.full((45, 45, 90, 3), 0.2)),
    }
    for name, content in huge.items():
        (tmp_path / name).write_bytes(content)
    done = subprocess.run(
        [sys.executable, "-c", _LOAD, *(str(tmp_path / name) for name in huge)], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    for name, (grown, size) in json.loads(done.stdout).items():
        assert grown < LARGEST * size + (8 << 20), f"{name}: {grown / 2**20:.0f} MB for {size} bytes"


def test_headers_that_promise_too_much(files: dict[str, Path], target: Path) -> None:
    """Dimensions of 2^31 and 2^63 values must be refused by arithmetic, before anything is allocated."""
    attempt(target, np.full(3, 2**31 - 1, "<i4").tobytes() + bytes(1000))
    rgl = bytearray(files["rgl"].read_bytes())
    for at in range(14, 400, 7):
        attempt(target, bytes(rgl[:at] + b"\xff" * 8 + rgl[at + 8 :]))
    at = rgl.index(b"ndf") + 3 + 11
    attempt(target, bytes(rgl[:at] + b"\0" * 8 + b"\xff" * 7 + b"\x7f" + rgl[at + 16 :]))  # nothing, times very much
    attempt(target, b"1000000000\n400 500 600\n" + b"0 " * 100)
    attempt(target, b"1e308 400 500 600 " + b"0 " * 100)
    attempt(target, b"theta_i phi_i theta_o phi_o p\n" + b"0 " * 100000 + b"\n")


@pytest.mark.parametrize("kind", ["cornell", "gonio"])
@pytest.mark.parametrize("ending", [b"\n", b"\r\n", b"\r"])
@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_line_ends_and_byte_order_marks_change_nothing(
    files: dict[str, Path], target: Path, kind: str, ending: bytes, mark: bytes
) -> None:
    plain = files[kind].read_bytes()
    target.write_bytes(mark + plain.replace(b"\n", ending))
    assert np.array_equal(load(target).eval(WI, WO), load(files[kind]).eval(WI, WO))


def test_impossibly_bright_values_are_left_out(target: Path) -> None:
    target.write_bytes(merl_bytes(np.full((6, 6, 12, 3), 1e30)))
    with pytest.raises(UserError, match=r"no measured value.*beyond 1e"):
        load(target)
