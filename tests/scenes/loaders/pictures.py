"""Pictures that scenes show, written from their texels."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from PIL import Image


def png(path: Path, texels: ArrayLike) -> None:
    Image.fromarray(np.asarray(texels, np.uint8)).save(path)
