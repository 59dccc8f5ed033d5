"""Pictures of a BSDF in the plane of incidence, for looking at measurements and fits."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lambent.core.files import atomic_path
from lambent.core.frames import direction

Floats = NDArray[np.floating]
Eval = Callable[[Floats, Floats], Floats]

THETA_I_DEG = (0, 20, 40, 60, 75)
STEPS = 721  # every quarter of a degree
FLOOR = 1e-5  # 1/sr, the lowest value shown


def plot_plane_of_incidence(path: Path, evals: Mapping[str, Eval], *, title: str, transmits: bool) -> None:
    """Draw f in 1/sr, mean over channels, against theta_o in the plane of incidence, one panel per theta_i.

    Parameters
    ----------
    path : Path
        Picture to write: .png, .pdf or .svg.
    evals : mapping of name -> eval(wi, wo)
        What to draw: the first as a thick pale line, the next ones as thin lines over it.
    transmits : bool
        Whether to show the far side as well; theta_o then runs from -180 to 180 degrees.
    """
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    limit = 180 if transmits else 90
    theta_o = np.linspace(-limit, limit, STEPS)[1:-1]
    # Positive theta_o lies opposite the light, where a mirror sends it.
    wo = direction(np.radians(np.abs(theta_o)), np.where(theta_o >= 0, np.pi, 0.0))
    figure, axes = pyplot.subplots(
        1, len(THETA_I_DEG), figsize=(3 * len(THETA_I_DEG), 3.2), sharey=True, layout="constrained"
    )
    for axis, theta_i in zip(axes, THETA_I_DEG, strict=True):
        wi = np.broadcast_to(direction(np.radians(theta_i), 0.0), wo.shape)
        for index, (name, evaluate) in enumerate(evals.items()):
            style = {"lw": 4, "color": "0.75"} if index == 0 and len(evals) > 1 else {"lw": 1.2}
            axis.semilogy(theta_o, np.maximum(evaluate(wi, wo).mean(axis=-1), FLOOR), label=name, **style)
        axis.axvline(theta_i, color="0.5", lw=0.5, ls=":")
        axis.set_title(f"light at {theta_i} deg", fontsize=9)
        axis.set_xlabel("theta_o (deg)", fontsize=8)
        axis.tick_params(labelsize=8)
    axes[0].set_ylabel("f (1/sr)", fontsize=8)
    axes[-1].legend(fontsize=8)
    figure.suptitle(title, fontsize=10)
    with atomic_path(path) as beside:
        figure.savefig(beside, dpi=120)
    pyplot.close(figure)
