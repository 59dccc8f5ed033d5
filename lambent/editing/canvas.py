"""Canvases of an edited picture: terms are added, pixel by pixel, to the unedited part.

`HostCanvas` is in memory and the reference. `lambent.viewer.edits.edited` implements the same on a GPU.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numba
import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats, Image, Indices
from lambent.core.kernels import parallel
from lambent.editing.products import Halves, HostProducts, Pixels, Products
from lambent.editing.rows import PairTransport
from lambent.materials.factored.curve import END_RAD, KNOTS, Curve

ONE = np.ones((3, 1), np.float32)  # multiplier of all pixels


class Layer(Protocol):
    """One term of one material: products of its transport, and their factors."""

    def hold(self, transport: Halves) -> Products:
        """Take transport (J, 3, P) float16; the layer shows its products from then on."""

    def fold(self, pairs: PairTransport, idle: int, means: Floats) -> tuple[Products, float]:
        """Take transport with curve `idle` folded in (`PairTransport.fold`); products, and radiance of value 1."""

    def view(self, curve: Curve | None) -> None:
        """Multiply by the curve of the viewer's angle."""


class Canvas(Protocol):
    """The picture (H, W) of all layers."""

    def layer(self, pixel: Indices, theta_o: Floats) -> Layer:
        """A new layer over pixels (P,), with the viewer's angles (P,)."""

    def compose(self, shown: Sequence[tuple[Layer, NDArray[np.float32]]]) -> None:
        """Draw the sum of layers, each with its scale (3,)."""

    def image(self) -> Image:
        """(H, W, 3) float32, linear radiance, as of the last `compose`."""


class HostLayer:
    """`Layer` in memory."""

    products: HostProducts

    def __init__(self, pixel: Indices, theta_o: Floats) -> None:
        self.pixel, self._theta_o, self.multiplier = pixel, np.asarray(theta_o, np.float32), ONE

    def hold(self, transport: Halves) -> Products:
        self.products = HostProducts(transport)
        return self.products

    def fold(self, pairs: PairTransport, idle: int, means: Floats) -> tuple[Products, float]:
        rows = pairs.fold(idle, means)
        return self.hold(rows.values), rows.unit

    def view(self, curve: Curve | None) -> None:
        self.multiplier = ONE if curve is None else viewed(self._theta_o, curve)


class HostCanvas:
    """`Canvas` in memory; `background` (H, W, 3) is the unedited part."""

    def __init__(self, background: Image) -> None:
        self._background = np.array(background, np.float32)
        self._image = self._background.copy()

    def layer(self, pixel: Indices, theta_o: Floats) -> HostLayer:
        return HostLayer(pixel, theta_o)

    def compose(self, shown: Sequence[tuple[Layer, NDArray[np.float32]]]) -> None:
        self._image = self._background.copy()
        for layer, scale in shown:
            assert isinstance(layer, HostLayer)
            _compose(self._image.reshape(-1, 3), layer.pixel, layer.products.picture, scale, layer.multiplier)

    def image(self) -> Image:
        return self._image


def viewed(theta_o: NDArray[np.float32], viewer: Curve) -> Pixels:
    """(3, P) values f_o(theta_o) of the viewer's curve."""
    return np.asarray(_looked_up(theta_o * np.float32(KNOTS / END_RAD), viewer.values.astype(np.float32)))


@parallel()
def _looked_up(step, values):  # type: ignore[no-untyped-def]
    out, last = np.empty((3, len(step)), np.float32), len(values) - 2
    for p in numba.prange(len(step)):
        k = min(max(int(step[p]), 0), last)
        share = min(max(step[p] - k, np.float32(0)), np.float32(1))
        for c in range(3):
            out[c, p] = values[k, c] + share * (values[k + 1, c] - values[k, c])
    return out


@parallel(fastmath=True)
def _compose(image, pixel, picture, scale, multiplier):  # type: ignore[no-untyped-def]
    step = 0 if multiplier.shape[1] == 1 else 1
    for p in numba.prange(len(pixel)):
        for c in range(3):
            image[pixel[p], c] += scale[c] * multiplier[c, p * step] * picture[c, p]
