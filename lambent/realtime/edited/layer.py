"""One term of one material on a GPU: its transport, and the factors on its sums."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats, Indices
from lambent.materials.factored.curve import END_RAD, KNOTS, Curve
from lambent.realtime.edited.commands import GROUP, Commands
from lambent.realtime.edited.products import GpuProducts, Halves, Piece, new_piece, words_of

POINTS_AT_ONCE = 2 * 65535  # points of one fold: two per workgroup
PAIR_BYTES = 4  # bytes of a pair's value; its step is one byte in another buffer
MOST_BANDS = 256  # limit of the shader


class GpuLayer:
    """`lambent.editing.canvas.Layer` on a GPU; transport of two curves comes as plain arrays.

    Parameters
    ----------
    places : (P,) uint32
        Texels of `image`, each once.
    theta_o : (P,)
        Angle of the viewer, rad.
    image
        Buffer of texels; layers are added to it.
    """

    products: GpuProducts

    def __init__(self, commands: Commands, places: NDArray[np.uint32], theta_o: Floats, image: Any) -> None:
        self._commands, self._image = commands, image
        steps = np.asarray(theta_o, np.float32) * np.float32(KNOTS / END_RAD)
        self._places = np.stack([places, steps.view(np.uint32)], axis=1)
        self._curve = commands.empty((KNOTS + 1) * 16)
        self._viewed = False
        self._composed: list[tuple[Any, int]] = []  # bind group and pixels, by piece
        self._folds: list[tuple[Any, int]] = []
        self._pieces: list[Piece] = []
        self._pairs: Any = None

    def hold(self, transport: Halves) -> GpuProducts:
        """Upload transport (J, 3, P) float16; the layer shows its products from now on."""
        bands, _, pixels = transport.shape
        most = self._most(bands)
        self._divide([(k, min(most, pixels - k)) for k in range(0, pixels, most)], bands)
        self._pairs = None
        for piece in self._pieces:
            mine = transport[:, :, piece.first : piece.first + piece.pixels]
            self._commands.write(piece.transport, np.pad(mine, ((0, 0), (0, 0), (0, piece.pixels % 2))))
        return self._show(transport.shape)

    def fold_pairs(
        self,
        spans: NDArray[np.uint32],
        steps: NDArray[np.uint8],
        values: NDArray[np.uint32],
        idle: Floats,
        edited: int,
        bands: int,
    ) -> tuple[GpuProducts, float]:
        """Fold on the GPU; parameters and returned scale as in `lambent.editing.folding.folded`.

        The pairs are uploaded once and kept.
        """
        assert max(bands, len(idle)) <= MOST_BANDS
        if self._pairs is not values:
            self._send(spans, steps, values, max(bands, len(idle)))
            self._pairs = values
        scale = float(np.abs(idle).max()) or 1.0
        means = np.zeros((len(idle), 4), np.float32)
        means[:, :3] = idle / scale
        head = np.array([edited, bands, bands if edited else len(idle), 0], np.uint32)
        work = [(group, words_of(points), 1) for group, points in self._folds]
        self._commands.dispatch("fold", head.tobytes() + means.tobytes(), work)
        return self._show((bands, 3, len(spans))), scale

    def view(self, curve: Curve | None) -> None:
        """Multiply by the curve of the viewer's angle."""
        self._viewed = curve is not None
        if curve is not None:
            table = np.zeros((KNOTS + 1, 4), np.float32)
            table[:, :3] = curve.values
            self._commands.write(self._curve, table)

    def compose(self, scale: NDArray[np.float32]) -> None:
        """Record the addition of the products, times `scale` (3,), to the image."""
        parameters = np.asarray(scale, np.float32).tobytes() + np.uint32(self._viewed).tobytes()
        self._commands.dispatch("compose", parameters, [(g, -(-pixels // GROUP), 1) for g, pixels in self._composed])

    def _show(self, shape: tuple[int, int, int]) -> GpuProducts:
        """Products of the pieces' current transport, with a zero picture."""
        self.products = GpuProducts(self._commands, self._pieces, shape)
        self.products.add_rows(np.zeros(0, int), np.zeros((0, 3)), anew=True)
        return self.products

    def _most(self, rows: int) -> int:
        """Most pixels whose `rows` rows of transport (half floats) and whose sums (floats) fit a binding."""
        return 2 * (self._commands.largest // (3 * max(4 * rows, 8)))

    def _divide(self, parts: list[tuple[int, int]], rows: int) -> None:
        """Replace the pieces by new ones from (first, pixels), with room for `rows` rows."""
        commands = self._commands
        self._pieces, self._composed, self._folds = [], [], []
        for first, pixels in parts:
            piece, part = new_piece(commands, first, pixels, rows), slice(first, first + pixels)
            buffers = piece.about, piece.picture, commands.buffer(self._places[part])
            self._pieces.append(piece)
            self._composed.append((commands.group("compose", *buffers, self._curve, self._image), pixels))

    def _send(self, spans: NDArray[np.uint32], steps: NDArray[np.uint8], values: NDArray[np.uint32], rows: int) -> None:
        """Upload pairs of points, divided into pieces whose pairs and rows fit a binding."""
        commands = self._commands
        begins, ends = _bounds(spans)
        self._divide(list(self._parts(begins, ends, rows)), rows)
        for piece in self._pieces:
            mine = slice(piece.first, piece.first + piece.pixels)
            begin = int(begins[mine].min())
            part = slice(begin, max(begin, int(ends[mine].max())))
            moved = np.where(begins[mine] < ends[mine], spans[mine].T - np.uint32(begin), 0).T.astype(np.uint32)
            buffers = [commands.buffer(array) for array in (moved, steps[part], values[part])]
            self._folds.append((commands.group("fold", piece.about, *buffers, piece.transport), piece.pixels))

    def _parts(self, begins: Indices, ends: Indices, rows: int) -> Iterator[tuple[int, int]]:
        """(first, pixels) of pieces."""
        most, pairs = min(self._most(rows), POINTS_AT_ONCE), self._commands.largest // PAIR_BYTES
        first = 0
        while first < len(begins):
            few = slice(first, first + most)
            taken = np.maximum.accumulate(ends[few]) - np.minimum.accumulate(begins[few])
            count = max(1, int(np.searchsorted(taken, pairs, side="right")))
            yield first, count
            first += count


def _bounds(spans: NDArray[np.uint32]) -> tuple[Indices, Indices]:
    """First and past-the-last entry of each point; points without entries do not bound anything."""
    begins, ends = spans.astype(np.int64).T
    empty = begins >= ends
    return np.where(empty, ends.max(initial=0), begins), np.where(empty, 0, ends)


def texels(pixel: Indices, width: int, stride: int) -> NDArray[np.uint32]:
    """Texel numbers, in an image with rows of `stride` texels, of pixels given as row * width + column."""
    return np.asarray(pixel // width * stride + pixel % width, np.uint32)
