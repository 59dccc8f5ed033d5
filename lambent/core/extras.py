"""Parts of Lambent that are installed on request: `pip install "lambent[walk]"`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from lambent.core.errors import UserError

EXTRAS = {
    "drjit": "bake", "mitsuba": "bake", "pyoidn": "bake", "xatlas": "bake", "distributed": "cluster",
    "glfw": "walk", "imageio_ffmpeg": "walk", "imgui_bundle": "walk", "rendercanvas": "walk", "wgpu": "walk",
    "ipywidgets": "notebook", "jupyter_rfb": "notebook",
}  # fmt: skip


def missing(error: ImportError) -> UserError | None:
    """What to install, if the error is about a package of an extra."""
    package = (error.name or "").partition(".")[0]
    if package not in EXTRAS:
        return None
    hint = f"run `pip install 'lambent[{EXTRAS[package]}]'`"
    return UserError("is not installed", field=package, hint=hint)


@contextmanager
def needing_extras() -> Iterator[None]:
    """Context in which a missing package of an extra is a `UserError`."""
    try:
        yield
    except ModuleNotFoundError as error:
        if (said := missing(error)) is None:
            raise
        raise said from error
