"""Meshes laid flat by xatlas, in a process of its own.

Threads of xatlas 0.0.11 race in two places. One may read a task while the next mesh moves the queue of tasks, which
ends the process. One may sleep through its dismissal, for which the destructor then waits forever. So the process ends
without a destructor, and one that failed is started again.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Sequence
from typing import NoReturn

import numpy as np
import xatlas

from lambent.core.arrays import Floats, Indices
from lambent.core.machine import python_environment

ATTEMPTS = 3  # at the same meshes: races are rare, and what fails that often always will

Triangles = tuple[Floats, Indices, Floats]  # positions (V, 3), faces (F, 3) and normals (V, 3)
Laid = tuple[Indices, Indices, Floats]  # mesh vertex of each vertex (W,), faces (F, 3), and coordinates (W, 2)


def laid_flat(meshes: Sequence[Triangles]) -> list[Laid]:
    """Charts of each mesh, whose triangles keep their order; charts share no vertices, and their scale is arbitrary.

    A mesh on which xatlas fails has NaN coordinates.
    """
    if not meshes:
        return []
    given, environment = pickle.dumps(meshes), python_environment()
    for _ in range(ATTEMPTS):
        done = subprocess.run([sys.executable, "-m", __name__], input=given, capture_output=True, env=environment)
        if done.returncode == 0:
            found: list[Laid] = pickle.loads(done.stdout)
            return found
    if len(meshes) > 1:
        half = len(meshes) // 2
        return laid_flat(meshes[:half]) + laid_flat(meshes[half:])
    (_, faces, _), count = meshes[0], meshes[0][1].size
    return [(faces.reshape(-1), np.arange(count).reshape(-1, 3), np.full((count, 2), np.nan, np.float32))]


def _by_xatlas(meshes: Sequence[Triangles]) -> NoReturn:
    """Write what `laid_flat` returns to stdout, and end this process, which is its other one."""
    atlas = xatlas.Atlas()
    for mesh in meshes:
        atlas.add_mesh(*mesh)
    packing = xatlas.PackOptions()
    packing.resolution, packing.padding, packing.bilinear = 16 * int(np.ceil(np.sqrt(len(meshes)))), 0, False
    atlas.generate(xatlas.ChartOptions(), packing, False)
    pickle.dump([atlas[i] for i in range(len(meshes))], sys.stdout.buffer)
    sys.stdout.buffer.flush()
    os._exit(0)


if __name__ == "__main__":
    _by_xatlas(pickle.load(sys.stdin.buffer))
