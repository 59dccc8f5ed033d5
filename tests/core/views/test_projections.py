"""Fisheyes and cylinders: where directions lie, solid angles that add up, Radiance's VIEW line there and back."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lambent.core.errors import UserError
from lambent.core.light.radiance_views import read_view, view_of
from lambent.core.pictures import rgbe
from lambent.core.views.camera import Camera, pixel_rays
from lambent.core.views.projections import Projection, View

CAMERA = Camera("eye", (1.0, 2.0, 3.0), (1.0, 2.0, 2.0), fov_y_deg=50.0)


def of(projection: Projection, field_deg: float | None = None, size: tuple[int, int] = (64, 64)) -> View:
    return View.of(CAMERA, projection, *size, field_deg)


@pytest.mark.parametrize(
    ("projection", "size", "exact"),
    [
        (Projection.fisheye, (400, 400), 2 * math.pi),
        (Projection.cylinder, (400, 100), 4 * math.pi * math.sin(math.atan(math.pi / 4))),
    ],
)
def test_solid_angles_add_up(projection, size, exact):
    rays, solid_angle = of(projection, size=size).directions(*size)
    assert solid_angle.sum() == pytest.approx(exact, rel=2e-3)
    assert np.allclose(np.linalg.norm(rays[solid_angle > 0], axis=-1), 1)


def test_area_of_a_hemispherical_view_is_projected_solid_angle():
    rays, solid_angle = of(Projection.hemispherical).directions(400, 400)
    cosine = -rays[..., 2]
    inside = cosine > 0.05
    weights = (solid_angle * cosine)[inside]
    assert np.allclose(weights, weights[0]) and (solid_angle * cosine).sum() == pytest.approx(math.pi, rel=5e-3)


def test_a_perspective_view_is_the_camera_s():
    view = View.of(CAMERA, Projection.perspective, 60, 40)
    rays, solid_angle = view.directions(60, 40)
    assert np.allclose(rays, pixel_rays(CAMERA, 60, 40)) and view.height_deg == 50
    assert solid_angle.sum() == pytest.approx(
        4 * math.asin(math.prod(math.sin(math.radians(a) / 2) for a in (view.width_deg, 50))), rel=0.01
    )


@pytest.mark.parametrize(("projection", "angle"), [(Projection.fisheye, 45.0), (Projection.hemispherical, 30.0)])
def test_halfway_to_the_right(projection, angle):
    rays, _ = of(projection).directions(401, 401)
    found = rays[200, 300]
    assert np.degrees(np.arctan2(found[0], -found[2])) == pytest.approx(angle, abs=0.15)
    assert rays[100, 200][1] > 0.4


@given(
    st.sampled_from(list(Projection)), st.floats(20, 170), st.tuples(*[st.floats(-9, 9)] * 3),
    st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda d: np.hypot(d[0], d[2]) > 0.1),
)  # fmt: skip
def test_view_lines_come_back(projection, field_deg, eye, ahead):
    camera = Camera("view", eye, tuple(np.add(eye, ahead).tolist()))
    view = View.of(camera, projection, 32, 32, field_deg)
    back = view_of(view.radiance_options(), Path("picture.hdr"))
    assert np.allclose(view.directions(8, 8)[0], back.directions(8, 8)[0], atol=1e-5)
    assert np.allclose(view.directions(8, 8)[1], back.directions(8, 8)[1], rtol=1e-4)


def test_the_last_view_of_a_header_counts(tmp_path):
    file = tmp_path / "a.hdr"
    data = rgbe.encode(np.ones((4, 4, 3), np.float32), of(Projection.fisheye).radiance_options())
    older = b"\tVIEW= -vtv -vh 10\nrpict -vtv -vp 9 9 9 -vh 20 scene.oct\n"
    file.write_bytes(data.replace(b"SOFTWARE", older + b"SOFTWARE", 1))
    assert read_view(file).projection is Projection.fisheye
    file.write_bytes(data.replace(b"VIEW= ", b"OTHER= ", 1).replace(b"SOFTWARE", older + b"SOFTWARE", 1))
    assert read_view(file).camera.position == (9.0, 9.0, 9.0) and read_view(file).width_deg == 20
    assert np.allclose(rgbe.decode(data, file), 1)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("-vts -vh 180", "unknown view type"),
        ("-vta -vh 180 -vs .5", "shifted"),
        ("-vta -vh 720 -vv 180", "out of range"),
        ("-vta -vp 1 2", "damaged"),
        ("-vta -vd 0 0 0 -vh 90 -vv 90", "no direction"),
    ],
)
def test_views_that_cannot_be(line, said):
    with pytest.raises(UserError, match=said):
        view_of(line, Path("picture.hdr"))


def test_pictures_without_a_view(tmp_path):
    (tmp_path / "a.hdr").write_bytes(rgbe.encode(np.ones((4, 4, 3), np.float32)))
    (tmp_path / "b.hdr").write_bytes(b"#?RADIANCE\nVIEW= -vta")
    for name in "ab":
        with pytest.raises(UserError, match="picture has no view"):
            read_view(tmp_path / f"{name}.hdr")
