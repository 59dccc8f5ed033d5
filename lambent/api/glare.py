"""Discomfort glare of views."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from lambent.api.progress import Wanted, progress_of
from lambent.api.stores import Note, Store
from lambent.core.errors import UserError
from lambent.core.extras import needing_extras
from lambent.core.light.glare import THRESHOLD_CD_M2, Glare
from lambent.core.light.glare import glare as rated

if TYPE_CHECKING:
    from lambent.core.arrays import Floats
    from lambent.core.views.projections import View

SIDE_PX = 800


def glare(
    what: Store | str | Path,
    camera: str | None = None,
    *,
    threshold_cd_m2: float = THRESHOLD_CD_M2,
    note: Note | None = None,
    progress: Wanted = None,
    **settings: Any,
) -> Glare:
    """Rate the glare of a view: daylight glare probability (DGP), unified glare rating (UGR), and every source.

    Parameters
    ----------
    what : Store, str or Path
        A store or its folder, of which a fisheye of 180 degrees is traced, or a Radiance fisheye picture (.hdr).
    camera : str, optional
        Of a store: camera or saved view by name; by default the first.
    threshold_cd_m2 : float
        Least luminance of a glare source.
    note, progress
        As of `Store.render`.
    **settings
        Of a store: integrator, samples, variant, ... as of `Store.render`.

    Returns
    -------
    Glare
        Figures, `sources` in descending order of brightness, and `marked()`, a picture of them.

    Raises
    ------
    UserError
        If the picture or store cannot be read, or the picture shows less than the half space ahead.
    """
    if isinstance(what, Store) or Path(what).is_dir():
        store = what if isinstance(what, Store) else Store(what)
        radiance, view = _fisheye(store, camera, note, progress, settings)
    elif camera is not None or settings:
        option = "camera" if camera is not None else next(iter(settings))
        raise UserError("applies to stores only", field=option, hint="a picture has its own view")
    else:
        from lambent.core.light.radiance_views import read_view
        from lambent.core.pictures.images import read_image

        view, radiance = read_view(Path(what)), read_image(Path(what))
    return rated(radiance, view, threshold_cd_m2)


def _fisheye(
    store: Store, camera: str | None, note: Note | None, progress: Wanted, settings: dict[str, Any]
) -> tuple[Floats, View]:
    from lambent.core.views.projections import Projection
    from lambent.render.output import drawn_view

    given = {"light": None, "variant": "", **settings}
    wanted = store._settings((SIDE_PX, SIDE_PX), projection=Projection.fisheye, **given)
    with needing_extras(), progress_of(progress) as bar:
        radiance, seen = drawn_view(store.arrays, camera, wanted, note=note or (lambda text: None), progress=bar)
    return radiance, wanted.view_of(seen)
