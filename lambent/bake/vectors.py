"""Arrays of vectors on the way to Dr.Jit and back, such that kernels are shared by all of them.

As a whole, an (n, 3) array is taken apart, or put together, by a kernel that holds n as a constant. And Dr.Jit reads
numpy's memory where it lies: an address that happens to be no multiple of the vector's length makes for another
kernel. Either way what is computed with the array is compiled anew, for seconds where that is paths.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

ALIGNED_BYTES = 64  # the longest vectors that LLVM has


def vectors(kind: Any, array: NDArray[np.floating]) -> Any:
    """An array (..., 3) as `kind`: mi.Vector3f, mi.Point3f or mi.Normal3f, one after another."""
    return kind(*(mi.Float(_aligned(component)) for component in array.reshape(-1, 3).T))


def rays_from(origins: NDArray[np.floating], directions: NDArray[np.floating]) -> Any:
    """mi.Ray3f from origins (n, 3), or one (3,), along directions (n, 3)."""
    return mi.Ray3f(vectors(mi.Point3f, np.broadcast_to(origins, directions.shape)), vectors(mi.Vector3f, directions))


def array_of(vector: Any) -> NDArray[np.float32]:
    """A vector or colour of Dr.Jit as an array (n, 3)."""
    components = [vector[0], vector[1], vector[2]]
    dr.eval(components)
    return np.stack([np.array(c) for c in components], axis=-1)


def _aligned(values: NDArray[np.floating]) -> NDArray[np.float32]:
    """A copy (n,) that begins at a multiple of ALIGNED_BYTES."""
    memory = np.empty(4 * len(values) + ALIGNED_BYTES, np.uint8)
    start = -memory.ctypes.data % ALIGNED_BYTES
    result = memory[start : start + 4 * len(values)].view(np.float32)
    result[:] = values
    return result
