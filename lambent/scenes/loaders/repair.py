"""From whatever a file holds to a mesh that can be baked: what is missing is made, what is broken goes, all said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lambent.core.directions import Floats, basis, normalize
from lambent.core.errors import UserError
from lambent.scenes.geometry import areas, tangents_along
from lambent.scenes.geometry.grid import FLAT
from lambent.scenes.scene import Mesh

Faces = NDArray[np.integer]
ABSURD = 1e15


def mesh_of(
    positions: Floats,
    faces: Faces,
    normals: Floats | None,
    uv: Floats | None,
    tangents: Floats | None,
    *,
    name: str,
    file: Path,
) -> tuple[Mesh | None, list[str]]:
    """Mesh of arrays read from a file, and what was repaired; None where no triangle is left.

    Parameters
    ----------
    positions, normals, uv, tangents : (V, 3), (V, 3), (V, 2), (V, 3); all but positions may be None
        Missing normals become flat ones, missing uv box-mapped metres, missing tangents the direction of u.
    faces : (T, 3) integer
        Counter-clockwise from outside.

    Raises
    ------
    UserError
        Where a face names a vertex that is not there.
    """
    said: list[str] = []
    positions, normals, uv, tangents = (None if a is None else _tame(a) for a in (positions, normals, uv, tangents))
    assert positions is not None
    count = len(positions)
    if faces.size and int(faces.max()) >= count:
        got, expected = int(faces.max()), f"below {count}"
        raise UserError("face index out of range", file=file, field=name, got=got, expected=expected)
    faces = _usable(positions, faces, said)
    if not len(faces):
        return None, [f"{name}: left out, it has no triangle with an area ({'; '.join(said) or 'empty'})"]
    if normals is None:
        positions, uv, tangents, faces = _split(positions, uv, tangents, faces)
        normals = _flat_normals(positions, faces)
        said.append("no normals: faces are flat")
    else:
        normals = _unit_normals(positions, faces, normals, said)
    if uv is None:
        uv = _box_mapped(positions, normals)
        said.append("no uv: box-mapped, one unit a metre")
    elif not np.isfinite(uv).all():
        uv = np.nan_to_num(uv, nan=0.0, posinf=0.0, neginf=0.0)
        said.append("uv not finite: set to 0")
    direction = _along_u(positions, faces, uv) if tangents is None else np.nan_to_num(tangents)
    used, index = np.unique(faces, return_inverse=True)
    mesh = Mesh(
        positions[used].astype(np.float32),
        normals[used].astype(np.float32),
        tangents_along(normals, direction)[used].astype(np.float32),
        uv[used].astype(np.float32),
        index.reshape(-1, 3).astype(np.uint32),
    )
    return mesh, [f"{name}: {what}" for what in said]


def _tame(values: Floats) -> Floats:
    """`values` with NaN for what is too far to be meant: its square would overflow in single precision."""
    with np.errstate(invalid="ignore"):
        return np.where(np.abs(values) < ABSURD, values, np.nan)


def _usable(positions: Floats, faces: Faces, said: list[str]) -> Faces:
    """Faces with finite corners and an area, in float32, as they will be stored."""
    finite = np.isfinite(positions).all(axis=-1)[faces].all(axis=-1)
    if not finite.all():
        said.append(f"{int((~finite).sum())} triangles dropped: a corner is not finite")
    faces = faces[finite]
    if not len(faces):
        return faces
    stored = positions.astype(np.float32)
    extent = float(np.ptp(positions[np.unique(faces)], axis=0).max())
    wide = areas(stored, faces) > FLAT * extent**2
    if not wide.all():
        said.append(f"{int((~wide).sum())} triangles dropped: no area")
    return faces[wide]


def _split(
    positions: Floats, uv: Floats | None, tangents: Floats | None, faces: Faces
) -> tuple[Floats, Floats | None, Floats | None, Faces]:
    """Every triangle with vertices of its own."""
    corners = faces.reshape(-1)
    own = np.arange(len(corners)).reshape(-1, 3)
    return (
        positions[corners],
        None if uv is None else uv[corners],
        None if tangents is None else tangents[corners],
        own,
    )


def _cross(positions: Floats, faces: Faces) -> Floats:
    a, b, c = (positions[faces[:, i]] for i in range(3))
    cross: Floats = np.cross(b - a, c - a)
    return cross


def _flat_normals(positions: Floats, faces: Faces) -> Floats:
    normals = np.zeros_like(positions)
    normals[faces] = normalize(_cross(positions, faces))[:, None]
    return normals


def _unit_normals(positions: Floats, faces: Faces, normals: Floats, said: list[str]) -> Floats:
    """Unit normals; those that are no direction become the mean of their faces'."""
    length = np.linalg.norm(np.nan_to_num(normals), axis=-1)
    broken = ~np.isfinite(normals).all(axis=-1) | (length < 1e-6)
    unit = normalize(np.nan_to_num(normals))
    broken &= np.isin(np.arange(len(normals)), faces)
    if broken.any():
        mean = np.zeros_like(positions)
        cross = _cross(positions, faces)
        for corner in range(3):
            np.add.at(mean, faces[:, corner], cross)
        unit[broken] = normalize(mean)[broken]
        still = np.linalg.norm(unit, axis=-1) < 0.5
        unit[still] = (0.0, 1.0, 0.0)
        said.append(f"{int(broken.sum())} normals were no direction: taken from the faces")
    unit[np.linalg.norm(unit, axis=-1) < 0.5] = (0.0, 1.0, 0.0)  # of vertices that nothing uses
    return unit


def _box_mapped(positions: Floats, normals: Floats) -> Floats:
    axis = np.argmax(np.abs(normals), axis=-1)
    kept = np.array([(2, 1), (0, 2), (0, 1)])[axis]
    finite = np.nan_to_num(positions)
    return np.take_along_axis(finite, kept, axis=-1)


def _along_u(positions: Floats, faces: Faces, uv: Floats) -> Floats:
    """Direction (V, 3) in which u grows, area-weighted over the faces of each vertex; any where uv says nothing."""
    finite = np.nan_to_num(positions)
    a, b, c = (finite[faces[:, i]] for i in range(3))
    ua, ub, uc = (uv[faces[:, i]] for i in range(3))
    e1, e2, d1, d2 = b - a, c - a, ub - ua, uc - ua
    turn = np.sign(d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0])[:, None]
    along = turn * (e1 * d2[:, 1:] - e2 * d1[:, 1:])
    total = np.zeros_like(finite)
    for corner in range(3):
        np.add.at(total, faces[:, corner], normalize(along))
    lost = np.linalg.norm(total, axis=-1) < 1e-6
    total[lost] = basis(np.tile([0.0, 1.0, 0.0], (int(lost.sum()), 1)))[0]
    return total
