"""A baked view under an environment that rotates or is replaced, with fixed materials (store.contract, relighting).

picture = sum over wavelets of light of  coefficient * row        (Ben-Artzi 2007, section 7.3)

Rows are sparse, by blocks of pixels. The entries of a block are contiguous, wavelet after wavelet: one core draws
each block.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats, Image
from lambent.core.errors import UserError
from lambent.core.kernels import parallel
from lambent.core.views.camera import Camera, pixel_rays
from lambent.editing.products import Halves, Pixels, float_of_half
from lambent.scenes.geometry import turn
from lambent.scenes.scene import Environment, ImageEnvironment
from lambent.scenes.sky.environment_images import environment_picture, orientation, seen_at
from lambent.scenes.sky.triangle_wavelets import CHILDREN, FACES, TriangleTree, TurningLight
from lambent.store.contract import ViewRecord, baked_views, view_artefact_name
from lambent.store.store import Store


class RelitView:
    """The picture of a stored view under a changing environment; it starts with that of the bake.

    Parameters
    ----------
    camera, width, height
        Of a view baked with `bake(..., only={"relighting"}, views=[...])`.

    Attributes
    ----------
    error : float
        Omitted and rounded part of the stored transport, relative to its norm (root mean square).

    Raises
    ------
    UserError
        If the store has no relighting of the view.
    """

    def __init__(self, store: Store, camera: Camera, width: int, height: int) -> None:
        def name(part: str, kind: str = "relighting") -> str:
            return view_artefact_name(camera, width, height, kind, part)

        if not all(name(part) in store for part in ("spans", "points", "values", "errors", "lamps", "light")):
            what = f"no relighting for camera {camera.name}, {width} x {height}"
            raise UserError(what, file=store.folder, field="view", hint="bake the view for relighting first")
        self._pixel = store.read(name("pixel", "view_points")).astype(np.int64)
        self._backdrop = store.read(name("backdrop", "view_points")).astype(np.float32).reshape(-1, 3)
        self._lamps, fine = store.read(name("lamps")), store.read(name("light")).astype(float)
        spans = store.read(name("spans")).astype(np.int64)
        left_out, whole = store.read(name("errors")).astype(float).sum(axis=0)
        self.error = float(np.sqrt(left_out / max(whole, 1e-300)))
        self._tree = TriangleTree(_depth(spans.shape[1] - 1))
        self._rows = SparseRows(
            spans, store.read(name("points"))[:, 0], store.read(name("values")),
            int(store.artefact(name("spans")).meta["block"]), len(self._pixel),
        )  # fmt: skip
        self._rays, self._shape = pixel_rays(camera, width, height).reshape(-1, 3), (height, width, 3)
        self._baked = TurningLight(self._tree, fine)
        self.light(None)
        self.draw()

    def turn(self, rotation_deg: float) -> None:
        """Light the next `draw` by the environment rotated about +y, relative to the bake or to the last `light`."""
        self._turn = turn("y", rotation_deg % 360) @ self._laid

    def light(self, environment: Environment | None) -> None:
        """Light the next `draw` by another environment, or by that of the bake (None).

        Raises
        ------
        UserError
            If it is daylight, which only a bake can compute, or its file cannot be read.
        """
        self._environment = None if environment is None else environment_picture(environment)
        self._light = (
            self._baked if self._environment is None else TurningLight.of_picture(self._tree, self._environment)
        )
        self._laid = orientation(environment) if isinstance(environment, ImageEnvironment) else np.eye(3)
        self.turn(0.0)

    def draw(self) -> None:
        """Sum the picture under the light as set."""
        radiance = self._light.radiance(None if self._is_upright else self._turn)
        self._picture = self._rows.summed(self._tree.of_radiance(radiance))

    def image(self) -> Image:
        """(H, W, 3) float32, linear radiance."""
        image = self._backdrop.copy()
        is_background = np.ones(len(image), bool)
        is_background[self._pixel] = False
        w = self._rays[is_background] @ self._turn
        if self._environment is not None:
            image[is_background] = seen_at(self._environment, w)
        elif not self._is_upright:
            image[is_background] = self._light.seen(w)
        image[self._pixel] += self._picture.T + self._lamps
        return image.reshape(self._shape)

    @property
    def _is_upright(self) -> bool:
        return np.array_equal(self._turn, np.eye(3))


def _depth(triangles: int) -> int:
    depth = round(float(np.log(triangles / FACES) / np.log(CHILDREN)))
    assert FACES * CHILDREN**depth == triangles, f"not a tree of triangles: {triangles}"
    return depth


def views_for_relighting(store: Store) -> dict[str, ViewRecord]:
    """The views that a store can relight, by camera name; of several sizes, the one with the most pixels."""
    found = [
        view for view in baked_views(store).values()
        if view_artefact_name(view.camera, view.width, view.height, "relighting", "spans") in store
    ]  # fmt: skip
    return {view.camera.name: view for view in sorted(found, key=lambda view: view.width * view.height)}


@dataclass(frozen=True)
class SparseRows:
    """Rows (J, 3, P).

    Attributes
    ----------
    spans : (B, J + 1) int64
        First entry of each row in each block, and one past the last.
    points : (E,) uint16
        Pixel of each entry within its block, ascending in each row.
    values : (E, 3) float16
    block : int
        Pixels per block; the last block may have fewer.
    pixels : int
        P.
    """

    spans: NDArray[np.int64]
    points: NDArray[np.uint16]
    values: Halves
    block: int
    pixels: int

    def summed(self, weights: Floats) -> Pixels:
        """(3, P) sum of the rows, each times its weights (J, 3)."""
        picture, rows = np.zeros((3, self.pixels), np.float32), np.flatnonzero(weights.any(axis=1))
        values = self.values.view(np.uint16)
        _add(picture, self.spans, self.points, values, self.block, rows, np.asarray(weights[rows], np.float32))
        return picture


@parallel()
def _add(picture, spans, points, values, block, rows, weights):  # type: ignore[no-untyped-def]
    for b in numba.prange(len(spans)):
        start = b * block
        for k in range(len(rows)):
            red, green, blue = weights[k, 0], weights[k, 1], weights[k, 2]
            for e in range(spans[b, rows[k]], spans[b, rows[k] + 1]):
                p = start + points[e]
                picture[0, p] += red * float_of_half(values[e, 0])  # type: ignore[call-arg]
                picture[1, p] += green * float_of_half(values[e, 1])
                picture[2, p] += blue * float_of_half(values[e, 2])
