"""The material that editing starts from where there is only a measurement."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lambent.materials.document import Lobe, Material
from lambent.materials.fitting.diffuse import diffuse_mode
from lambent.viewer.editor.measurement import Measurement

RGB = tuple[float, float, float]
NEAR = Lobe(mx=0.3, my=0.3)
FAR = Lobe(side="transmission", mx=0.3, my=0.3, r0=(0.0, 0.0, 0.0), k=(0.1, 0.1, 0.1))


def start_material(measurement: Measurement) -> Material:
    """A diffuse term read off the measurement, and one plain lobe per side, to be dragged or fitted from."""
    samples = measurement.few
    far = samples.transmitted
    lobes = tuple(lobe for lobe, here in ((NEAR, ~far), (FAR, far)) if here.any())
    name = Path(samples.info.file).stem
    return Material(name=name, kd=_diffuse(measurement, ~far), kt_d=_diffuse(measurement, far), lobes=lobes)


def _diffuse(measurement: Measurement, here: NDArray[np.bool_]) -> RGB:
    samples = measurement.few
    f, weight = samples.f[here], samples.weight[here] * np.abs(samples.wo[here, 2])
    values = [min(diffuse_mode(f[:, channel], weight), 1.0) for channel in range(f.shape[1])]
    red, green, blue = values if len(values) == 3 else values * 3
    return red, green, blue
