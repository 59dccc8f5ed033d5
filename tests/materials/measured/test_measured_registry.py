"""Formats are recognised by content; unknown content is a UserError that lists them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.materials.measured import load
from lambent.materials.measured.registry import HEAD_BYTES, readers


def test_one_reader_claims_each_file(files: dict[str, Path]) -> None:
    formats = {"merl": "MERL", "rgl": "RGL", "cornell": "Cornell", "gonio": "gonio text"}
    for kind, path in files.items():
        content = path.read_bytes()
        claims = [r.NAME for r in readers() if r.recognise(content[:HEAD_BYTES], len(content))]
        assert len(claims) == 1 and claims[0].startswith(formats[kind])
        assert load(path).info.format.startswith(formats[kind])


def test_protocol_holds_for_every_format(files: dict[str, Path], hemisphere) -> None:
    wi, wo = hemisphere(50, 1).reshape(5, 10, 3), hemisphere(50, 2).reshape(5, 10, 3)
    for path in files.values():
        table = load(path)
        f = table.eval(wi, wo)
        assert f.shape == (5, 10, table.info.channels) and np.isfinite(f).all() and (f >= 0).all()
        assert table.albedo(wi[0, :2]).shape == (2, table.info.channels)
        samples = table.samples()
        assert samples.f.shape == (len(samples), table.info.channels) and len(samples.weight) == len(samples)
        assert (samples.weight >= 0).all() and (samples.f >= 0).all()
        np.testing.assert_allclose(np.linalg.norm(samples.wi, axis=1), 1, rtol=1e-9)
        np.testing.assert_allclose(np.linalg.norm(samples.wo, axis=1), 1, rtol=1e-9)
        few, again = table.samples(max_count=20), table.samples(max_count=20)
        assert len(few) == 20 and (few.wo == again.wo).all() and few.left_out == samples.left_out


@pytest.mark.parametrize("content", [b"", b"\0" * 100, b"hello world\n", b"\x89PNG\r\n\x1a\n" + b"\1" * 50, b"# x\n"])
def test_unknown_content(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "what.bsdf"
    path.write_bytes(content)
    with pytest.raises(UserError, match="empty" if not content else "known format.*MERL"):
        load(path)


def test_missing_file_and_folder(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="cannot be read"):
        load(tmp_path / "nothing.binary")
    with pytest.raises(UserError, match="cannot be read"):
        load(tmp_path)
