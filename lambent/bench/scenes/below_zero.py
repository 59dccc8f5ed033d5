"""RGL files of saturated materials, with variants that have readings below zero: a lowered channel, or noise.

They are written and read like user files. The fit of a variant is compared with that of the clean file.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from lambent.materials.document import Lobe, Material
from lambent.materials.export import rgl
from lambent.materials.measured.parts.tensor_file import read_tensors, tensor_bytes
from lambent.materials.measured.protocol import MeasuredTable
from lambent.materials.measured.registry import load

DARK = 2  # the channel near zero, blue
SIZE = 0.005  # deficit, and standard deviation of the noise, as stored: f cos theta_o in 1/sr
_FAINT = Lobe(k=(0.6, 0.5, 0.1), mx=0.15, my=0.15, r0=(0.04,) * 3, alpha=0.3)
_METAL = Lobe(k=(0.9, 0.7, 0.1), mx=0.2, my=0.2, r0=(0.6,) * 3)
_MATERIALS = (
    Material(name="yellow", kd=(0.8, 0.55, 0.0), lobes=(_FAINT,)),
    Material(name="gold", kd=(0.02, 0.01, 0.0), lobes=(_METAL,)),
)


@dataclass(frozen=True)
class Spoilt:
    """A clean table, and its variants with readings below zero, by kind of change."""

    name: str
    clean: MeasuredTable
    changed: dict[str, MeasuredTable]


def spoilt_tables() -> Iterator[Spoilt]:
    """The tables of each material."""
    with TemporaryDirectory() as folder:
        for material in _MATERIALS:
            path = Path(folder) / f"{material.name}.bsdf"
            rgl.write(material, path)
            clean, tensors = load(path), dict(read_tensors(path))
            stored = tensors["rgb"].astype(np.float32)
            lowered = stored.copy()
            lowered[:, :, DARK] -= SIZE
            noise = np.random.default_rng(0).normal(0, SIZE, stored.shape).astype(np.float32)
            changed = {}
            for what, values in (("blue lowered", lowered), ("noise", stored + noise)):
                path.write_bytes(tensor_bytes(tensors | {"rgb": values}))
                changed[what] = load(path)
            yield Spoilt(material.name, clean, changed)
