"""Broken files of every format: a table, or one clear line; no traceback, no hang, no memory out of proportion."""

from __future__ import annotations

import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lambent.core.errors import UserError
from lambent.materials.measured import load
from lambent.materials.measured.registry import readers
from tests.materials.measured.measured_files import merl_bytes

KINDS = ("merl", "rgl", "cornell", "gonio")
WI, WO = np.array([[0.6, 0.0, 0.8]]), np.array([[-0.6, 0.0, 0.8]])


def _try(path: Path, content: bytes) -> None:
    """Reading `content` gives a usable table or a UserError of one line, in time and in proportion."""
    path.write_bytes(content)
    start = time.perf_counter()
    tracemalloc.start()
    try:
        table = load(path)
        assert np.isfinite(table.eval(WI, WO)).all()
        assert np.isfinite(table.samples(1000).f).all()
    except UserError as error:
        assert "\n" not in str(error) and path.name in str(error)
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert time.perf_counter() - start < 2
    assert peak < 10 * len(content) + (48 << 20)  # the fixed part: imports, the points of the Cornell weights


@pytest.fixture(scope="module")
def target(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where broken files are written; imports and caches are warm."""
    assert len(readers()) >= len(KINDS)
    import scipy.ndimage
    import scipy.spatial  # noqa: F401

    return tmp_path_factory.mktemp("broken") / "broken.bsdf"


QUICK = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.mark.parametrize("kind", KINDS)
@QUICK
@given(share=st.floats(0, 1))
def test_truncated(files: dict[str, Path], target: Path, kind: str, share: float) -> None:
    content = files[kind].read_bytes()
    _try(target, content[: int(share * len(content))])


@pytest.mark.parametrize("kind", KINDS)
@QUICK
@given(data=st.data())
def test_bytes_overwritten(files: dict[str, Path], target: Path, kind: str, data: st.DataObject) -> None:
    """Random bytes in random places, more often in the header."""
    content = bytearray(files[kind].read_bytes())
    for _ in range(data.draw(st.integers(1, 6))):
        limit = data.draw(st.sampled_from([16, 400, len(content)]))
        at = data.draw(st.integers(0, min(limit, len(content)) - 1))
        patch = data.draw(st.binary(min_size=1, max_size=8))
        content[at : at + len(patch)] = patch
    _try(target, bytes(content))


@pytest.mark.parametrize("kind", KINDS)
@QUICK
@given(tail=st.binary(max_size=400))
def test_sound_start_and_random_rest(files: dict[str, Path], target: Path, kind: str, tail: bytes) -> None:
    _try(target, files[kind].read_bytes()[:40] + tail)


@QUICK
@given(content=st.binary(max_size=600))
def test_random_bytes(target: Path, content: bytes) -> None:
    _try(target, content)


def test_headers_that_promise_too_much(files: dict[str, Path], target: Path) -> None:
    """Dimensions of 2^31 and 2^63 values must be refused by arithmetic, before anything is allocated."""
    _try(target, np.full(3, 2**31 - 1, "<i4").tobytes() + bytes(1000))
    rgl = bytearray(files["rgl"].read_bytes())
    for at in range(14, 400, 7):
        _try(target, bytes(rgl[:at] + b"\xff" * 8 + rgl[at + 8 :]))
    _try(target, b"1000000000\n400 500 600\n" + b"0 " * 100)
    _try(target, b"1e308 400 500 600 " + b"0 " * 100)
    _try(target, b"theta_i phi_i theta_o phi_o p\n" + b"0 " * 100000 + b"\n")


@pytest.mark.parametrize("kind", ["merl", "rgl"])
def test_wrong_endian(files: dict[str, Path], target: Path, kind: str) -> None:
    content = files[kind].read_bytes()
    _try(target, np.frombuffer(content[: len(content) // 4 * 4], "<u4").byteswap().tobytes())


@pytest.mark.parametrize("value", [np.nan, -np.inf, np.inf, -1.0])
def test_merl_without_a_value(files: dict[str, Path], target: Path, value: float) -> None:
    content = files["merl"].read_bytes()
    target.write_bytes(content[:12] + np.full((len(content) - 12) // 8, value, "<f8").tobytes())
    with pytest.raises(UserError, match="no measured value"):
        load(target)


def test_rgl_filled_with_nan(files: dict[str, Path], target: Path) -> None:
    content = files["rgl"].read_bytes()
    header = content.index(b"made up") + 7
    target.write_bytes(content[:header] + b"\xff" * (len(content) - header))
    with pytest.raises(UserError, match="not finite"):
        load(target)


@pytest.mark.parametrize("kind", ["cornell", "gonio"])
@pytest.mark.parametrize("ending", [b"\n", b"\r\n", b"\r"])
@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_line_ends_and_byte_order_marks_change_nothing(
    files: dict[str, Path], target: Path, kind: str, ending: bytes, mark: bytes
) -> None:
    plain = files[kind].read_bytes()
    target.write_bytes(mark + plain.replace(b"\n", ending))
    assert np.array_equal(load(target).eval(WI, WO), load(files[kind]).eval(WI, WO))


def test_values_no_surface_has_are_left_out(target: Path) -> None:
    target.write_bytes(merl_bytes(np.full((6, 6, 12, 3), 1e30)))
    with pytest.raises(UserError, match="not finite"):
        load(target).samples()
