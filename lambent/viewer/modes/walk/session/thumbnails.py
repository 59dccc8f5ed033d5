"""Thumbnails of textures, and of materials on a sphere: made one by one in the background, when first shown."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from functools import cache

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from lambent.core.arrays import Floats
from lambent.core.geometry.cubemap import face_directions, sample, texel_solid_angles
from lambent.core.geometry.directions import normalize
from lambent.core.light.colour import filmic, srgb_encode
from lambent.core.pictures.images import to_bytes
from lambent.materials.bsdf import MaterialBSDF, cos_over_pdf, specular_only
from lambent.materials.document import Material
from lambent.scenes.sky.environments import studio
from lambent.viewer.background.work import Work, pending

SIDE, BALL_SIDE = 18, 96  # pixels of a texture's, about the height of a line, and of a material's
ENOUGH = 8 * SIDE  # texels a side that a texture's is made from
RADIUS = 0.94  # of the sphere, as a share of half a side
SAMPLES = 48  # directions of reflected light for each pixel of a sphere
R3 = 0.8191725134 ** np.arange(1, 4)  # low-discrepancy steps in three dimensions (Roberts 2018)
BRIGHTEST, LEAST_COS = 8.0, 0.05
OVERLAP = 4.0  # of the parts of the studio that the directions stand for
LEVELS = (64, 32, 16, 8, 4)  # texels along a face of the studio
Thumbnail = NDArray[np.uint8]  # (side, side, 4), as displayed


class Thumbnails:
    """Makes thumbnails into `images`, by name; `busy` while one is being made, `failed` names those that cannot be."""

    def __init__(self, images: dict[str, Thumbnail]) -> None:
        self._images, self.failed = images, set[str]()
        self._work: Work | None = None

    @property
    def busy(self) -> bool:
        return self._work is not None

    def get(self, key: Hashable, make: Callable[[], Thumbnail]) -> str:
        """The name of a thumbnail in `images`, where it lies once it is made.

        `make` is called in the background and may raise `UserError`: then there is none.
        """
        name = name_of(key)
        self._work = pending(self._work)
        if name not in self._images and name not in self.failed and self._work is None:

            def keep(made: Thumbnail) -> None:
                self._images[name] = made

            self._work = Work(lambda _: make(), keep, lambda _: self.failed.add(name))
        return name


def name_of(key: Hashable) -> str:
    """The name of the thumbnail of a key."""
    return f"thumbnail {key}"


def texture_thumbnail(reflectance: Floats) -> Thumbnail:
    """Linear values (H, W, 3) as a displayed picture (SIDE, SIDE, 4); large textures are sampled."""
    height, width = reflectance.shape[:2]
    few = reflectance[:: max(1, height // ENOUGH), :: max(1, width // ENOUGH)].astype(np.float32)
    picture = Image.fromarray(to_bytes(srgb_encode(few)))
    return np.asarray(picture.resize((SIDE, SIDE), Image.Resampling.BOX).convert("RGBA"))


def ball(material: Material, side: int = BALL_SIDE) -> Thumbnail:
    """A sphere of a material in the studio's light, clear around it: (side, side, 4)."""
    across = ((np.arange(side) + 0.5) / side * 2 - 1) / RADIUS
    x, y = np.meshgrid(across, -across)
    z = np.sqrt(np.maximum(1 - x**2 - y**2, 0))
    inside = z > 0
    n = np.stack([x, y, z], axis=-1)[inside]
    t = normalize(np.stack([n[:, 2], np.zeros(len(n)), -n[:, 0]], axis=-1))
    frame = np.stack([t, np.cross(n, t), n], axis=1)  # (pixels, 3, 3), rows t, b, n
    shown = np.zeros((side, side, 4), np.uint8)
    shown[inside, :3] = to_bytes(srgb_encode(filmic(_reflected(material, frame))))
    edge = (1 - np.sqrt(x**2 + y**2)) * RADIUS * side / 2 + 0.5
    shown[..., 3] = to_bytes(np.clip(edge, 0, 1))
    return shown


def _reflected(material: Material, frame: Floats) -> Floats:
    """Radiance (n, 3) towards the viewer at +z of surfaces with these frames (n, 3, 3), by importance sampling.

    The diffuse light is the mean over all of the studio, in which few samples would leave grain.
    """
    shiny, wo = MaterialBSDF(specular_only(material)), normalize(np.maximum(frame[:, :, 2], [-1, -1, LEAST_COS]))
    total = np.asarray(material.kd) * _diffuse_light(len(frame), frame[:, 2].tobytes())
    if any(material.kt_d):
        total = total + np.asarray(material.kt_d) * _diffuse_light(len(frame), (-frame[:, 2]).tobytes())
    if not material.lobes:
        return total
    for u in (np.arange(SAMPLES)[:, None] + 0.5) * R3 % 1:
        wi = shiny.sample(wo, np.broadcast_to(u, wo.shape))
        pdf = shiny.pdf(wi, wo)
        weight = cos_over_pdf(wi, pdf)[:, None] * shiny.eval(wi, wo) / SAMPLES
        total = total + weight * _seen(np.einsum("pk,pkx->px", wi, frame), pdf)
    return total


def _seen(towards: Floats, pdf: Floats) -> Floats:
    """The studio in directions (n, 3), averaged over what each stands for (Krivanek & Colbert 2008)."""
    texel_sr, stands_for_sr = 4 * np.pi / (6 * LEVELS[0] ** 2), OVERLAP / (SAMPLES * np.maximum(pdf, 1e-9))
    level = np.clip(np.round(0.5 * np.log2(stands_for_sr / texel_sr)), 0, len(LEVELS) - 1)
    found = np.zeros_like(towards)
    for number, n in enumerate(LEVELS):
        found[level == number] = sample(_studio(n), towards[level == number])
    return found


@cache
def _studio(n: int) -> Floats:
    """Light (6, n, n, 3) of the studio, its small lamp dimmed, averaged from LEVELS[0] texels."""
    whole, step = np.minimum(studio(LEVELS[0]), BRIGHTEST), LEVELS[0] // n
    return np.asarray(whole.reshape(6, n, step, n, step, 3).mean(axis=(2, 4)))


@cache
def _diffuse_light(count: int, normals: bytes) -> Floats:
    """Mean light (n, 3) on the hemispheres of normals (n, 3), by cosine; one array for all thumbnails of a size."""
    towards, cube = normalize(face_directions(16)).reshape(-1, 3), _studio(16)
    weights = np.maximum(np.frombuffer(normals).reshape(count, 3) @ towards.T, 0)
    light = cube.reshape(-1, 3) * np.tile(texel_solid_angles(16).ravel(), 6)[:, None]
    return np.asarray(weights @ light / np.pi)
