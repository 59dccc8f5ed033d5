"""Rendered image against a reference that knows its own variance.

assert_same_image(image, image_variance, reference, reference_variance)
"""

from __future__ import annotations

import numpy as np

LEVEL = 0.01  # of the whole image


def mean_and_variance(passes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean image of independent passes (n, ...) and the variance of that mean."""
    assert len(passes) >= 4, "a variance from fewer than four passes says nothing"
    return passes.mean(axis=0), passes.var(axis=0, ddof=1) / len(passes)


def image_p_values(
    image: np.ndarray,
    variance: np.ndarray,
    reference: np.ndarray,
    reference_variance: np.ndarray,
    *,
    floor: float = 1e-8,
) -> np.ndarray:
    """Two-sided p-value of every value under the hypothesis that both estimate the same image.

    The z-test wants a normal distribution: use a hundred samples per pixel or more. `floor` is added to the variance,
    so that pixels without noise must agree to its square root.
    """
    from scipy.stats import norm

    assert image.shape == reference.shape == variance.shape == reference_variance.shape
    z = (image - reference) / np.sqrt(variance + reference_variance + floor)
    return np.asarray(2 * norm.sf(np.abs(z)))


def assert_same_image(
    image: np.ndarray,
    variance: np.ndarray,
    reference: np.ndarray,
    reference_variance: np.ndarray,
    *,
    level: float = LEVEL,
) -> None:
    """Fail where any value differs significantly, corrected for the number of values (Sidak)."""
    assert np.isfinite(image).all() and np.isfinite(reference).all(), "an image is not finite"
    p = image_p_values(image, variance, reference, reference_variance)
    least = 1 - (1 - level) ** (1 / p.size)
    worst = np.unravel_index(int(np.argmin(p)), p.shape)
    assert p[worst] >= least, (
        f"{np.count_nonzero(p < least)} of {p.size} values differ; worst at {tuple(map(int, worst))}: "
        f"{image[worst]:.5g} against {reference[worst]:.5g}, p {p[worst]:.2g} < {least:.2g}"
    )
