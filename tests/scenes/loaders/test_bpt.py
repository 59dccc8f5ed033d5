"""Files of Bezier patches: both layouts, lower degrees, repairs, and one line for everything that is broken."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.scenes.geometry import signed_volume, teapot
from lambent.scenes.loaders import bpt
from lambent.scenes.loaders.load import load_scene
from tests.scenes.geometry.test_geometry import TEAPOT, sheet


def text_of(*patches: np.ndarray, count: int | None = None) -> str:
    """In the layout of PatchOff; patches (p, q, 3) of degrees q - 1 and p - 1."""
    lines = [str(len(patches) if count is None else count)]
    for points in patches:
        lines.append(f"{points.shape[1] - 1} {points.shape[0] - 1}")
        lines += [" ".join(map(repr, point)) for point in points.reshape(-1, 3).tolist()]
    return "\n".join(lines) + "\n"


def written(path: Path, text: str | bytes) -> Path:
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def test_the_teapot_is_the_built_in_one(tmp_path: Path) -> None:
    """z up becomes y up; normals point outwards, and the volume is that of the finer of both meshes."""
    scene = load_scene(written(tmp_path / "pot.bpt", text_of(*TEAPOT)))
    mesh, built_in = scene.objects[0].mesh, teapot(6.525, 24)
    assert scene.objects[0].name == "pot"
    assert signed_volume(mesh) == pytest.approx(signed_volume(built_in), rel=2e-3)
    assert np.allclose(mesh.bounds, built_in.bounds, atol=1e-2)
    assert not scene.warnings


def test_points_by_number(tmp_path: Path, shared_data: Path) -> None:
    """The published teapot, in the layout of its first distributions."""
    found = bpt.read(shared_data / "geometry" / "newell_teapot.bpt.txt")
    assert found.shape == (32, 4, 4, 3)

    def key(points: np.ndarray) -> tuple[tuple[float, ...], ...]:
        return tuple(sorted(tuple(p) for p in (points.reshape(-1, 3).round(5) + 0.0).tolist()))

    assert {key(points) for points in found} == {key(points) for points in TEAPOT}
    points = np.unique(sheet().reshape(-1, 3), axis=0)
    numbers = [1 + int(np.flatnonzero((points == p).all(axis=1))[0]) for p in sheet().reshape(-1, 3)]
    lines = ["1", ",".join(map(str, numbers)), str(len(points)), *(",".join(map(repr, p)) for p in points.tolist())]
    assert np.array_equal(bpt.read(written(tmp_path / "a.bpt", "\r\n".join(lines))), sheet()[None])


def test_u_runs_first_and_degrees_are_elevated(tmp_path: Path) -> None:
    """A "1 2" patch: the first two points are the first edge, the last two the far one (Holmes)."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 1], [1, 1, 1], [0, 2, 0], [1, 2, 0]], float).reshape(3, 2, 3)
    found = bpt.read(written(tmp_path / "a.bpt", text_of(points)))[0]
    assert np.allclose(found[0, :, 0], [0, 1 / 3, 2 / 3, 1]) and np.allclose(found[0, :, 1], 0)
    assert np.allclose(found[:, 0, 1], [0, 2 / 3, 4 / 3, 2]) and np.allclose(found[:, 0, 2], [0, 2 / 3, 2 / 3, 0])


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r", "\n\n \t\n"])
def test_line_ends_and_blank_lines(tmp_path: Path, end: str) -> None:
    text = "\ufeff" + end + text_of(sheet(), sheet() + 1.0).replace("\n", end)
    assert np.array_equal(bpt.read(written(tmp_path / "a.bpt", text)), [sheet(), sheet() + 1.0])


def test_broken_patches_are_left_out_and_keep_their_numbers(tmp_path: Path) -> None:
    broken = sheet()
    broken[0, 0, 1] = np.nan
    far = sheet() * 1e30
    scene = load_scene(written(tmp_path / "a.bpt", text_of(broken, sheet() + 1, np.zeros((4, 4, 3)), sheet(), far)))
    mesh = scene.objects[0].mesh
    assert len(mesh.faces) == 4 and np.array_equal(mesh.bounds, [(0, 0, -2), (2, 1, 0)])
    assert scene.warnings[:2] == (
        "a: patches 1, 5 left out: a control point is not finite",
        "a: patch 3 left out: no area",
    )


SOUND = text_of(sheet(), sheet() + 1.0)
BROKEN = {
    "empty": ("", r"number of patches: file is truncated; found 0 numbers"),
    "no number": ("patches\n" + SOUND, r"line 1: has a word that is not a number; found 'patches'"),
    "two points in a number": (SOUND.replace("3 3\n0.0", "3 3\n0.0.0", 1), r"line 3: .* found '0.0.0'"),
    "no patches": ("0\n", r"line 1: number of patches cannot be read; found 0; expected a whole number from 1"),
    "too many": (
        text_of(sheet(), count=900_000_000_000),
        r"a.bpt: patches: file is truncated; found 50 numbers; expected at least 12600000000000",
    ),
    "one too many": (text_of(sheet(), sheet(), count=1), r"line 19: has numbers after its last patch; found 3"),
    "degree 4": (text_of(sheet()).replace("3 3", "4 3"), r"line 2: degree in u of patch 1 .* found 4; .* from 1 to 3"),
    "a short last patch": (SOUND[: SOUND.rindex("\n", 0, -2)], r"control points of patch 2: file is truncated"),
    "nothing finite": (
        text_of(sheet() * np.nan),
        r"holds no patch with an area; patch 1 left out: a control point is not finite",
    ),
    "no area": (text_of(sheet() * (1, 0, 0)), r"holds no patch with an area"),
    "point 0": (
        "1\n" + "0 " * 16 + "\n1\n1 2 3\n",
        r"line 2: point of patch 1 does not exist; found 0; .* from 1 to 1",
    ),
    "points of points": ("1\n" + "1 " * 16 + "\n9999999999999\n1 2 3\n", r"points: file is truncated"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_files_are_one_line(tmp_path: Path, name: str) -> None:
    text, said = BROKEN[name]
    with pytest.raises(UserError, match=said) as error:
        load_scene(written(tmp_path / "a.bpt", text))
    assert "\n" not in str(error.value) and "a.bpt" in str(error.value)
