"""Broken files made from sound ones, for every reader; runs alone for any length of time:

    python -m tests.materials.measured.measured_fuzz --seconds 600 --reader "Zemax" --seed 7

A file is a table that can be used, or a `UserError` of one line, within 2 s and 10 times the file's size (and some
32 MB).
"""

from __future__ import annotations

import argparse
import signal
import tempfile
import time
import traceback
import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from lambent.core.directions import angles, direction
from lambent.core.errors import UserError
from lambent.core.inputs import UNREADABLE
from lambent.materials.measured.gonio_text import write_gonio
from lambent.materials.measured.registry import load, readers
from lambent.materials.measured.synthetic import Setup, synthesise
from tests.materials.measured.lbnl_files import angle_basis, lbnl_xml, random_tree, words
from tests.materials.measured.measured_files import (
    GLOSSY,
    cornell_rows,
    cornell_text,
    fred_text,
    merl_bytes,
    rgl_fields,
    tensor_bytes,
    zemax_text,
)
from tests.materials.measured.vendor_files import alta_text, beam, ddr, lighttools

LONGEST_S = 2.0
LARGEST, FLOOR_BYTES = 10, 32 << 20  # scattered tables weigh their tuples with many points
WI, WO = direction(np.array([0.0, 0.6, 1.2]), 0.3), direction(np.array([0.3, 0.6, 1.4]), 3.4)
Random = np.random.Generator
ODD_WORDS = (
    b"nan inf -inf 1e308 -1e308 1e-320 -1 0 99999999999999999999 2147483647 90 180.00001 0,5 x 1_0 0x10 1e --1 360 "
    b"89.9999999 \xd9\xa3"
).split(b" ")


def seeds() -> dict[str, list[bytes]]:
    """Sound small files by the name of their reader."""
    coarse = Setup((0.0, 40.0), step_deg=30, fine_deg=15, fine_reach_deg=15)
    turned = Setup((0.0, 40.0), (0.0, 90.0), "quadrant", 30, 15, 15)
    grid = np.array([(t, p) for t in (0, 25, 50, 75) for p in (0, 60, 120, 180)], float)
    block = grid, 0.1 + grid[:, 0] / 100
    rows = [(a, 0, b, c, 0.2) for a in (0, 30) for b in (0, 20, 40) for c in (0, 90, 180, 270)]
    scan = b"theta_i theta_o brdf\n" + b"".join(b"30 %d .1\n" % theta for theta in range(-70, 71, 10))
    columns = "theta_in,phi_in,theta_out,phi_out,brdf\n" + "\n".join(",".join(map(str, row)) for row in rows) + "\n"
    random = np.random.default_rng(0)
    wi, wo = (direction(random.uniform(0, 1.3, 40), random.uniform(0, 6.2, 40)) for _ in range(2))
    tuples = np.column_stack([*angles(wi), *angles(wo), np.full((40, 3), 0.2)])
    astm = "SAMPLE_NAME x\nNUM_POINTS 40\nVARS theta_i,phi_i,theta_s,phi_s,R,G,B\n"
    basis = angle_basis("mine", [(0, 30, 1), (30, 60, 4), (60, 90, 4)])
    matrix = [("Visible", d, words(random.random((9, 9)) * 0.3)) for d in ("Reflection Back", "Transmission Front")]
    tree = "{" + " ".join(random_tree(random, 3, 1) for _ in range(8)) + "}"
    half = np.stack([np.radians(grid[:, 0]) / 2, np.radians(grid[:, 0]) / 2, np.radians(grid[:, 1])], axis=-1)
    return {
        "ALTA text": [
            alta_text("RUSIN_TH_TD_PD", half, np.full((len(half), 4), 0.2), "RGB_COLOR", vs="1").encode(),
            alta_text("COS_TH_TD", np.cos(half[:, :2]), np.full(len(half), 0.2)).encode(),
            alta_text("CARTESIAN", np.column_stack([wo, wi]), np.full(len(wi), 0.2)).encode(),
        ],
        "pab-opto text": [
            "".join(beam(t, p, step=(20, 40)) for t in (0, 30) for p in (0, 60, 120)).encode(),
            beam(150, 0, far=True, kind="BSDF", step=(20, 40)).encode(),
        ],
        "Integra DDR/DDT text": [
            ddr(phi=(0, 90, 180), model="RGB", tint=(1.0, 0.5, 0.2)).encode(),
            ddr(phi=(0, 90, 180, 270), kind="Intensity Relative", psi=(0, 90), sigmat=(0, 20, 40, 60)).encode(),
            ddr(phi=(0, 180), model="spectral 3", tint=(1.0, 0.5, 0.2)).encode(),
        ],
        "LightTools BSDF text": [
            lighttools(kinds=("BRDF", "BTDF")).encode(),
            lighttools(channels=((0, "TrisX"), (0, "TrisY"), (0, "TrisZ")), xyz=True).encode(),
        ],
        "MERL binary": [merl_bytes(np.full((6, 5, 4, 3), 0.25))],
        "RGL tensor file": [tensor_bytes(rgl_fields(p)) for p in (np.zeros(1), np.linspace(-np.pi, -np.pi / 2, 3))],
        "Cornell / pbrt-v2 text": [cornell_text(cornell_rows(count=20), np.linspace(400, 700, 5)).encode()],
        "gonio text": [_gonio(coarse), _gonio(turned), columns.encode(), scan],
        "Zemax BSDF text": [
            zemax_text(lambda wi, wo: 0.1 + 0 * wo[..., :1], "PlaneSymmetrical").encode(),
            zemax_text(lambda wi, wo: 0.1 + 0 * wo, "Asymmetrical", "BTDF").encode(),
        ],
        "FRED BSDF text": [fred_text({(10, 0): block, (40, 0): block}).encode()],
        "ASTM E1392": [(astm + "\n".join(",".join(f"{v:.6g}" for v in row) for row in tuples) + "\n").encode()],
        "LBNL BSDF XML": [
            lbnl_xml("Columns", matrix, basis, "mine").encode(),
            lbnl_xml("TensorTree3", [("Visible", "Transmission Back", tree)]).encode(),
        ],
    }


def _gonio(setup: Setup) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a"
        write_gonio(path, synthesise(GLOSSY, setup))
        return path.read_bytes()


def mutate(content: bytes, others: list[bytes], random: Random) -> bytes:
    """`content` with one to three mutations."""
    for _ in range(int(random.integers(1, 4))):
        way = WAYS[int(random.integers(len(WAYS)))]
        content = way(content, others, random)[:200_000]
    return content


def _cut(content: bytes, others: list[bytes], random: Random) -> bytes:
    return content[: int(random.integers(len(content) + 1))]


def _flip(content: bytes, others: list[bytes], random: Random) -> bytes:
    broken = bytearray(content)
    for at in random.integers(0, max(len(broken), 1), int(random.integers(1, 8))):
        if at < len(broken):
            broken[at] ^= 1 << int(random.integers(8))
    return bytes(broken)


def _overwrite(content: bytes, others: list[bytes], random: Random) -> bytes:
    at = _place(content, random)
    patch = random.bytes(int(random.integers(1, 9)))
    return content[:at] + patch + content[at + len(patch) :]


def _huge(content: bytes, others: list[bytes], random: Random) -> bytes:
    """A binary number replaced by an extreme or odd value."""
    values = (b"\xff" * 8, b"\xff\xff\xff\x7f", b"\0\0\0\x80", b"\0" * 8, b"\xff" * 7 + b"\x7f", b"\0\0\xc0\x7f" * 2,
              b"\0\0\x80\x7f" * 2, b"\0" * 6 + b"\xf0\x7f", b"\1")  # fmt: skip
    value = values[int(random.integers(len(values)))]
    at = _place(content, random)
    return content[:at] + value + content[at + len(value) :]


def _number(content: bytes, others: list[bytes], random: Random) -> bytes:
    """A word of text replaced by an impossible number, or removed."""
    value = ODD_WORDS[int(random.integers(len(ODD_WORDS)))]
    found = [m for m in range(len(content)) if content[m : m + 1].isdigit()]
    if not found:
        return content
    at = found[min(int(random.exponential(len(found) / 4)), len(found) - 1)]
    begin = end = at
    while begin > 0 and content[begin - 1 : begin] not in (b" ", b"\t", b"\n", b",", b";", b">", b"{"):
        begin -= 1
    while end < len(content) and content[end : end + 1] not in (b" ", b"\t", b"\n", b",", b";", b"<", b"}"):
        end += 1
    return content[:begin] + value + content[end:]


def _splice(content: bytes, others: list[bytes], random: Random) -> bytes:
    other = others[int(random.integers(len(others)))]
    return content[: int(random.integers(len(content) + 1))] + other[int(random.integers(len(other) + 1)) :]


def _repeat(content: bytes, others: list[bytes], random: Random) -> bytes:
    a, b = sorted(random.integers(0, len(content) + 1, 2))
    return content[:b] + content[a:b] * int(random.integers(1, 20)) + content[b:]


def _remove(content: bytes, others: list[bytes], random: Random) -> bytes:
    a = int(random.integers(len(content) + 1))
    return content[:a] + content[a + int(random.integers(1, 200)) :]


def _lines(content: bytes, others: list[bytes], random: Random) -> bytes:
    """Lines dropped, doubled or in another order."""
    lines = content.split(b"\n")
    at, to = random.integers(0, len(lines), 2)
    way = int(random.integers(3))
    if way == 0:
        del lines[at]
    elif way == 1:
        lines.insert(int(to), lines[at])
    else:
        lines[at], lines[to] = lines[to], lines[at]
    return b"\n".join(lines)


def _swap(content: bytes, others: list[bytes], random: Random) -> bytes:
    """The byte order of the rest swapped."""
    size, at = int(random.choice([2, 4, 8])), int(random.choice([0, 12, _place(content, random)]))
    body = content[at : at + (len(content) - at) // size * size]
    return content[:at] + np.frombuffer(body, f"<u{size}").byteswap().tobytes() + content[at + len(body) :]


def _nest(content: bytes, others: list[bytes], random: Random) -> bytes:
    """Brackets and elements nested very deeply."""
    at, depth = _place(content, random), int(random.choice([10, 1000, 20000]))
    opening = (b"{", b"<a>", b"<Layer>", b"(", b"<!--", b"<![CDATA[", b"&amp;")[int(random.integers(7))]
    return content[:at] + opening * depth + content[at:]


def _encoding(content: bytes, others: list[bytes], random: Random) -> bytes:
    way = int(random.integers(5))
    if way == 0:
        return b"\xef\xbb\xbf" + content
    if way == 1:
        return content.replace(b"\n", b"\r")
    if way == 2:
        return content.replace(b".", b",")
    if way == 3:
        return content.decode("latin-1").encode("utf-16")
    return content.replace(b"\n", b"\0\n", 3)


WAYS: tuple[Callable[[bytes, list[bytes], Random], bytes], ...] = (
    _cut, _flip, _overwrite, _huge, _number, _number, _number, _splice, _repeat, _remove, _lines, _lines, _swap, _nest,
    _encoding,
)  # fmt: skip


def _place(content: bytes, random: Random) -> int:
    """A place in `content`, more often near its beginning."""
    limit = (16, 200, len(content))[int(random.integers(3))]
    return int(random.integers(0, max(min(limit, len(content)), 1)))


class Hang(Exception):
    """A file took too long to read."""


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    def stop(*_: object) -> None:
        raise Hang(f"longer than {seconds} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def attempt(path: Path, content: bytes) -> str:
    """The text of the `UserError` for `content`, or "" for a usable table; fails otherwise."""
    path.write_bytes(content)
    said = ""
    tracemalloc.start()
    try:
        with limited(5 * LONGEST_S):  # tracemalloc takes its time, so the limit is checked without it where it counts
            start = time.perf_counter()
            table = load(path)
            f = table.eval(WI, WO)
            assert np.isfinite(f).all() and (f >= 0).all(), "eval is not finite or negative"
            assert np.isfinite(table.reflectivity(WI[:1])).all(), "reflectivity is not finite"
            samples = table.samples(1000)
            assert np.isfinite(samples.f).all() and np.isfinite(samples.weight).all() and (samples.weight >= 0).all()
            taken = time.perf_counter() - start
    except UserError as error:
        said, taken = str(error), time.perf_counter() - start
        assert "\n" not in said and path.name in said, said
        assert UNREADABLE not in said, said  # the registry caught an error that the reader should have foreseen
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert peak < LARGEST * len(content) + FLOOR_BYTES, f"{peak / 2**20:.0f} MB for {len(content)} bytes"
    if taken > LONGEST_S:
        with limited(LONGEST_S):
            try_again(path)
    return said


def try_again(path: Path) -> None:
    try:
        table = load(path)
        table.eval(WI, WO), table.reflectivity(WI[:1]), table.samples(1000)
    except UserError:
        pass


def warm() -> None:
    """Warm imports and caches, so that no file is charged for them."""
    import colour
    import scipy.interpolate
    import scipy.ndimage
    import scipy.spatial  # noqa: F401

    assert colour.MSDS_CMFS and readers()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "sound"
        for name, contents in seeds().items():
            for content in contents:
                path.write_bytes(content)
                table = load(path)
                assert table.info.format == name, f"{name} was taken for {table.info.format}"
                table.eval(WI, WO), table.reflectivity(WI[:1]), table.samples(1000)


def main() -> None:
    options = argparse.ArgumentParser()
    options.add_argument("--seconds", type=float, default=60)
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--reader", default="")
    options.add_argument("--keep", type=Path, help="folder for the files that fail")
    given = options.parse_args()
    warm()
    sound = seeds()
    kinds = [name for name in sound if given.reader.lower() in name.lower()]
    everything = [content for contents in sound.values() for content in contents]
    folder = given.keep or Path(tempfile.mkdtemp())
    folder.mkdir(parents=True, exist_ok=True)
    end, count, failed, refused = time.perf_counter() + given.seconds, 0, {}, 0
    while time.perf_counter() < end:
        kind = kinds[count % len(kinds)]
        random = np.random.default_rng([given.seed, count])
        content = mutate(sound[kind][int(random.integers(len(sound[kind])))], everything, random)
        count += 1
        try:
            refused += bool(attempt(folder / "broken", content))
        except Exception as error:  # noqa: BLE001 - every kind of failure is what this looks for
            frames = [f for f in traceback.extract_tb(error.__traceback__) if "lambent/" in f.filename]
            where = f"{Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else "here"
            key = f"{kind}: {type(error).__name__} at {where}: {str(error)[:90]}"
            if key not in failed:
                (folder / f"failed-{len(failed)}").write_bytes(content)
                print(f"failed-{len(failed)}: {key}", flush=True)  # noqa: T201
            failed[key] = failed.get(key, 0) + 1
    print(f"{count} files, {refused} refused, {sum(failed.values())} failed in {len(failed)} ways; {folder}")  # noqa: T201


if __name__ == "__main__":
    main()
