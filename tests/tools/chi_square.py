"""Chi-square test of a direction sampler that explains its own failure with a picture.

assert_sampler(bsdf, theta_deg=50, phi_deg=20, folder=tmp_path)
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lambent.core.geometry.directions import direction
from lambent.materials.checking.check import Scatters
from lambent.materials.checking.chi_square import ChiSquare, chi_square

LEVEL = 1e-4  # per test: a suite of a hundred fails by chance once in a hundred seeds, and the seeds are fixed


def sampler_test(bsdf: Scatters, theta_deg: float, phi_deg: float, *, samples: int = 1_000_000, seed: int = 0):
    """`ChiSquare` of the sampler of `bsdf` for one wo."""
    wo = direction(np.radians(theta_deg), np.radians(phi_deg))
    return chi_square(
        lambda u: bsdf.sample(np.broadcast_to(wo, u.shape), u),
        lambda w: bsdf.pdf(w, np.broadcast_to(wo, w.shape)),
        samples=samples,
        seed=seed,
    )


def assert_sampler(
    bsdf: Scatters, theta_deg: float, phi_deg: float, folder: Path, *, samples: int = 1_000_000, seed: int = 0
) -> None:
    """Fail where samples do not follow the density; the picture of both lies in `folder`."""
    test = sampler_test(bsdf, theta_deg, phi_deg, samples=samples, seed=seed)
    if test.p_value < LEVEL:
        raise AssertionError(explain(test, folder / "chi_square.png"))


def explain(test: ChiSquare, picture: Path) -> str:
    """Write observed, expected and their difference over (phi, cos theta), and say where they differ most."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import PatchCollection
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

    observed, expected = test.observed[:-1], test.expected[:-1]
    sigma = (observed - expected) / np.sqrt(np.maximum(expected, 1))
    solid_angle = (test.cells[:, 1] - test.cells[:, 0]) * (test.cells[:, 3] - test.cells[:, 2])
    panels = {
        "observed, log10 of density": np.log10(np.maximum(observed / solid_angle / test.samples, 1e-6)),
        "expected, log10 of density": np.log10(np.maximum(expected / solid_angle / test.samples, 1e-6)),
        "(observed - expected) / sigma": sigma,
    }
    figure = Figure(figsize=(18, 6))
    FigureCanvasAgg(figure)
    for axes, (title, value) in zip(figure.subplots(1, 3), panels.items(), strict=True):
        patches = [Rectangle((p0, z0), p1 - p0, z1 - z0) for z0, z1, p0, p1 in test.cells]
        collection = PatchCollection(patches, cmap="RdBu_r" if "sigma" in title else "viridis")
        collection.set_array(value)
        if "sigma" in title:
            collection.set_clim(-8, 8)
        axes.add_collection(collection)
        axes.set(xlim=(0, 2 * np.pi), ylim=(-1, 1), xlabel="phi", ylabel="cos theta", title=title)
        figure.colorbar(collection, ax=axes)
    figure.savefig(picture)
    worst = int(np.argmax(np.abs(sigma)))
    z0, z1, p0, p1 = test.cells[worst]
    return (
        f"samples do not follow the density: chi-square {test.statistic:.0f} at {test.degrees} degrees of freedom, "
        f"p {test.p_value:.2g}; pdf integrates to {test.pdf_integral:.4f}, which leaves {1 - test.pdf_integral:.4f} to "
        f"reject, and {test.rejected_share:.4f} were; worst cell cos theta {z0:.4f}..{z1:.4f}, "
        f"phi {p0:.4f}..{p1:.4f}: {observed[worst]:.0f} observed, {expected[worst]:.1f} expected; see {picture}"
    )
