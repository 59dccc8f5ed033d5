"""What a bake spends its time on: kernels are compiled once, and paths go to the texels that need them."""

from __future__ import annotations

from collections.abc import Callable

import drjit as dr
import numpy as np

from lambent.baking.light.sampling import Sampling, TexelJob, tile_samples
from lambent.baking.probes.planes import _packed
from lambent.baking.probes.probe import MOST, Surroundings, _blocks_needed, bake_probe
from lambent.baking.surfaces import atlas as atlases
from lambent.baking.surfaces.texels import Sides, texels_of
from lambent.baking.tracing.scene_builder import SceneBuilder
from tests.baking.small_scenes import coloured_room


def kernels(work: Callable[[], object]) -> set[str]:
    """Hashes of the path tracing kernels that this work starts."""
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        work()
        return {k["hash"] for k in dr.kernel_history() if k.get("operation_count", 0) > 500}


def test_probes_of_any_centre_share_their_kernels() -> None:
    whole = SceneBuilder(coloured_room()).build()
    around = Surroundings(whole, whole)
    one, two = (kernels(lambda c=c: bake_probe(around, np.array(c), 4, 4, 0)) for c in ((0, 0.9, 0), (0.3, 1.1, 0.2)))
    assert one and one == two


def test_tiles_of_any_number_of_texels_share_their_kernels() -> None:
    scene = coloured_room()
    atlas = atlases.unwrap(scene, 48)
    texels = texels_of(atlases.merged(atlas), atlas.width, atlas.height)
    sides, built = Sides(texels, 1.0, np.ones(texels.face.shape, bool)), SceneBuilder(scene).build()
    how = Sampling((4, 4), 0.0, 32, 2)

    def tile(size: int) -> Callable[[], object]:
        region = (slice(0, 2), slice(8, 8 + size), slice(8, 8 + size), slice(0, 4))
        return lambda: tile_samples(built, TexelJob.of(sides, region, 0), how)

    one, two = kernels(tile(9)), kernels(tile(14))
    assert one and one == two


def test_paths_go_where_the_noise_is() -> None:
    # Four paths each: all 1; 0, 0, 0, 4; black. Means 1, 1, 0, their median 1.
    total = np.array([4.0, 4.0, 0.0])[:, None] * np.ones(3)
    squares = np.array([4.0, 16.0, 0.0])[:, None] * np.ones(3)
    # The second's variance is 16/4 - 1 = 3, that of its mean 3/4: three quarters of what a noise of 1 allows.
    assert np.allclose(_blocks_needed(total, squares, 4, 1.0), [1, 1, 1])
    assert np.allclose(_blocks_needed(total, squares, 4, 0.5), [1, 3, 1])
    assert np.allclose(_blocks_needed(total, squares, 4, 0.01), [1, MOST, 1])


def test_a_black_probe_of_any_noise_needs_no_more_paths() -> None:
    assert (_blocks_needed(np.zeros((3, 3)), np.zeros((3, 3)), 4, np.inf) == 1).all()


def test_bins_as_one_number_are_the_bins() -> None:
    rng = np.random.default_rng(0)
    normals, steps = rng.integers(-6, 7, (2000, 3)), rng.integers(-40, 9, 2000)
    _, expected = np.unique(np.concatenate([normals, steps[:, None]], axis=1), axis=0, return_inverse=True)
    _, found = np.unique(_packed(normals, steps), return_inverse=True)
    assert (found == expected.reshape(-1)).all()
