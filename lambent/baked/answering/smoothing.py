"""Points whose gathered light is averaged: neighbours that see the same surfaces, equally lit.

Each point gathers along a few hundred rays. The noise of their ends is in the ratio of light after and before an edit,
and shows on walls as mottle. Means over neighbours remove most of it, but would blur contacts and edges. So neighbours
count less the more they differ in gathered light, and in the shares of it that come from different materials, which is
what edits change.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.baked.answering.answer import Neighbours, Points
from lambent.baked.answering.rays import BYTE, Rays, gathered
from lambent.core.arrays import Floats

SENDERS = 16  # sets of materials whose light is told apart
LIGHT_OFF = 0.2  # natural logarithm of a ratio of gathered light at which a neighbour counts by 1/e
LEAST = 0.05  # weight of a neighbour that counts
SHARES_OFF = 0.2  # likewise, sum of the shares that come from elsewhere; noise of 256 rays is about .1


def alike(points: Points, rays: Rays, reflected: Floats, near: Neighbours) -> Neighbours:
    """Points that each point is averaged with, by decreasing weight, from the point itself on.

    Parameters
    ----------
    rays : Rays
        Of K + F points, to the K `points`.
    reflected : (M, 3)
        Diffuse albedos of materials as baked.
    near : Neighbours
        The points near each point's own texel, (K + F, n).
    """
    by_sender = _light_by_sender(points, rays, reflected)
    total = by_sender.sum(axis=1)
    shares = by_sender / np.maximum(total, 1e-30)[:, None]
    log_light = np.log(np.maximum(total, 1e-6 * total.mean() + 1e-30))
    itself = np.arange(len(total))
    weights = np.zeros(near.points.shape)
    for column, other in enumerate(near.points.T):
        elsewhere = np.abs(shares[other] - shares).sum(axis=1) / 2
        away = ((log_light[other] - log_light) / LIGHT_OFF) ** 2 + (elsewhere / SHARES_OFF) ** 2
        weights[:, column] = np.exp(-away) * (near.shares[:, column] > 0)
    is_itself = near.points == itself[:, None]
    named, chosen = near.points.copy(), np.where(is_itself.any(axis=1), is_itself.argmax(axis=1), 0)
    named[itself, chosen], weights[itself, chosen] = itself, 1
    weights[weights < LEAST] = 0
    order = np.argsort(-weights, axis=1, kind="stable")
    bytes_of = np.rint(BYTE * np.take_along_axis(weights, order, axis=1)).astype(np.uint8)
    return Neighbours(np.take_along_axis(named, order, axis=1), bytes_of)


def _light_by_sender(points: Points, rays: Rays, reflected: Floats) -> NDArray[np.float32]:
    """Light (K + F, SENDERS) of baked materials, summed over groups and channels, by number of the material."""
    sent = (points.light.sum(axis=0) * reflected[points.material]).sum(axis=1)
    lanes = np.zeros((len(sent), SENDERS), np.float32)
    lanes[np.arange(len(sent)), np.asarray(points.material) % SENDERS] = sent
    return gathered(rays, lanes.reshape(-1, SENDERS // 4, 4)).reshape(-1, SENDERS)
