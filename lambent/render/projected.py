"""Images in fisheye and cylindrical projections, resampled from cube faces that another renderer draws."""

from __future__ import annotations

from dataclasses import replace

from lambent.core.arrays import Floats
from lambent.core.progress import Progress, part_of, silent
from lambent.core.views.camera import Camera
from lambent.core.views.panorama import Panorama, face_px
from lambent.core.views.projections import Projection
from lambent.render.images import ANYWHERE, Images, Settings
from lambent.scenes.scene import Variant


def faces_settings(settings: Settings) -> Settings:
    """Settings of the renderer that draws the faces."""
    if settings.projection is Projection.perspective:
        return settings
    side = face_px(settings.view_of(ANYWHERE), settings.width)
    return replace(settings, width=side, height=side, projection=Projection.perspective, field_deg=None)


class Projected(Images):
    """Images resampled from cube faces; `faces` is a renderer with the settings `faces_settings`."""

    def __init__(self, faces: Images, settings: Settings) -> None:
        super().__init__(settings)
        self.quantity, self._faces = faces.quantity, faces

    def apply_variant(self, variant: Variant) -> None:
        self._faces.apply_variant(variant)

    def radiance(self, camera: Camera, progress: Progress = silent) -> Floats:
        around = Panorama(self.settings.view_of(camera), self.settings.width, self.settings.height)
        count, self._faces.time_s = len(around.cameras), self.time_s
        for index, face in enumerate(around.cameras):
            part = part_of(progress, index / count, (index + 1) / count, "faces around the eye")
            around.fill(index, self._faces.radiance(face, part))
        return around.image()
