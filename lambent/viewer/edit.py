"""`lambent edit`: opens the editing mode for the kind of a path."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lambent.core.errors import UserError
from lambent.viewer import app


def run(
    path: Path,
    material: Path | None = None,
    environments: Sequence[Path] = (),
    *,
    camera: str | None = None,
    picture: tuple[int, int] | None = None,
    store: Path | None = None,
    crease_deg: float | None = None,
    **window: Any,
) -> None:
    """Show the editor of a material, or of the materials of a scene; returns when its window is closed.

    Parameters
    ----------
    path : Path
        A measured table in any known format or a material document; or a scene, a store or a session, whose materials
        are edited in place.
    material : Path, optional
        A document: the material to start from, or, if `path` is also a document, the material B to compare with.
    environments : sequence of Path
        Lat-long pictures to light the preview with; the .hdr files beside `path` are offered too. In place, at most
        one, which replaces the scene's environment.
    camera, picture, store, crease_deg : str, (width, height), Path, float, optional
        In place: the name of the camera, the size of the picture in pixels, the folder for the transport, and the
        crease angle in degrees, above which edges with leaning normals are hard.
    **window
        `size`, `frames`, `folder` as in `app.run`, with the same errors.
    """
    mode = editing_mode(path)
    if mode == "material":
        _refuse(path, camera=camera, picture=picture, output=store, crease_angle=crease_deg)
        app.run(path, mode, material=material, environments=environments, **window)
        return
    if material is not None:
        raise UserError(
            "a scene takes no material document",
            file=path,
            got=material,
            hint="open the scene, then drop the document onto the window",
        )
    if len(environments) > 1:
        raise UserError(
            "more than one environment for a scene", field="--environment", got=f"{len(environments)} files"
        )
    light = environments[0] if environments else None
    app.run(
        path, mode, camera=camera, picture=picture, store=store, environment=light, crease_deg=crease_deg, **window
    )  # fmt: skip


def _refuse(path: Path, **options: object) -> None:
    for name, value in options.items():
        if value is not None:
            option = f"--{name.replace('_', '-')}"
            raise UserError("applies to scenes and stores only", file=path, field=option, hint="leave it out")


def editing_mode(path: Path) -> str:
    """Name of the mode that edits this kind of file; by default the material editor, which reports unreadable files."""
    found = app.starts().items()
    return next((name for name, mode in found if hasattr(mode, "edits") and mode.edits(path)), "material")
