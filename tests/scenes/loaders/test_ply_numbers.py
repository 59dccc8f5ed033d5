"""PLY: every name of texture coordinates, normals by their names, and both byte orders."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.scenes.loaders import ply
from lambent.scenes.loaders.ply import UV_NAMES

ROWS = np.array([(0, 0, 0, 0.6, 0, 0.8, 0.1, 0.2), (1, 0, 0, 0, 0.6, 0.8, 0.3, 0.4), (0, 1, 0, 0, 0, 1, 0.5, 0.9)])


def written(path: Path, order: str, names: tuple[str, str]) -> Path:
    """A triangle whose properties stand in an order of their own."""
    columns = ("nz", names[1], "x", "ny", "y", names[0], "z", "nx")
    of = dict(zip(("x", "y", "z", "nx", "ny", "nz", *names), ROWS.T, strict=True))
    head = f"ply\nformat {order} 1.0\nelement vertex 3\n" + "".join(f"property float {c}\n" for c in columns)
    head += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    table = np.stack([of[c] for c in columns], axis=-1)
    if order == "ascii":
        body = "\n".join(" ".join(map(str, row)) for row in table) + "\n3 0 1 2\n"
        path.write_bytes(head.encode() + body.encode())
    else:
        end = "<" if order == "binary_little_endian" else ">"
        face = np.array([0, 1, 2], f"{end}i4").tobytes()
        path.write_bytes(head.encode() + table.astype(f"{end}f4").tobytes() + b"\x03" + face)
    return path


@pytest.mark.parametrize("names", UV_NAMES)
@pytest.mark.parametrize("order", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_columns_are_known_by_their_names(tmp_path: Path, order: str, names: tuple[str, str]) -> None:
    arrays = ply.read(written(tmp_path / "a.ply", order, names))
    assert arrays.normals is not None and arrays.uv is not None
    found = np.column_stack([arrays.positions, arrays.normals, arrays.uv])
    np.testing.assert_allclose(found, ROWS, atol=1e-6)
    assert np.asarray(arrays.triangles).tolist() == [[0, 1, 2]]
