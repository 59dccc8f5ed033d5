"""Views around the eye are put together from pinhole pictures without seams."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.progress import silent
from lambent.core.views.camera import Camera, pixel_rays
from lambent.core.views.projections import Projection, View
from lambent.render.images import Images, Settings
from lambent.render.projected import Projected, faces_settings

EYE = Camera("eye", (0.3, 1.0, -2.0), (1.3, 0.7, -4.0))


class Directions(Images):
    """A world whose light is its direction: red and green and blue grow along x, y and z."""

    def radiance(self, camera, progress=silent):
        progress(1, 1, "drawn")
        return (pixel_rays(camera, self.settings.width, self.settings.height) * 0.5 + 0.5).astype(np.float32)


@pytest.mark.parametrize(
    ("projection", "size", "field_deg"),
    [(Projection.fisheye, (96, 96), None), (Projection.fisheye, (96, 96), 360), (Projection.fisheye, (96, 96), 40),
     (Projection.hemispherical, (96, 96), None), (Projection.cylinder, (160, 60), None)],
)  # fmt: skip
def test_every_pixel_shows_its_direction(projection, size, field_deg):
    settings = Settings(*size, projection=projection, field_deg=field_deg)
    told = []
    image = Projected(Directions(faces_settings(settings)), settings).radiance(EYE, lambda *done: told.append(done))
    assert [done / total for done, total, _ in told] == pytest.approx((np.arange(len(told)) + 1) / len(told))
    rays, _ = View.of(EYE, projection, *size, field_deg).directions(*size)
    fine, _ = View.of(EYE, projection, *size, field_deg).directions(2 * size[0], 2 * size[1])
    whole = fine.any(axis=-1).reshape(size[1], 2, size[0], 2).all(axis=(1, 3))  # no part outside of the circle
    assert np.abs(image[whole] - (rays[whole] * 0.5 + 0.5)).max() < 0.02
    assert not image[~rays.any(axis=-1) & ~fine.any(axis=-1).reshape(size[1], 2, size[0], 2).any(axis=(1, 3))].any()


def test_faces_are_as_fine_as_the_picture():
    settings = Settings(1000, 1000, projection=Projection.fisheye)
    assert faces_settings(settings).width == pytest.approx(2 * 1000 / np.pi, abs=6)
    assert faces_settings(Settings(100, 50)) == Settings(100, 50)


@pytest.mark.parametrize(
    "settings",
    [Settings(100, 50, projection=Projection.fisheye), Settings(100, 50, field_deg=90.0),
     Settings(100, 100, projection=Projection.hemispherical, field_deg=200.0)],
)  # fmt: skip
def test_views_that_cannot_be_are_refused(settings):
    with pytest.raises(UserError):
        settings.check()
