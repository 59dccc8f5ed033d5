"""State of a background rebake, for the panel."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class Rebaking:
    """Whether edits are rebaked, and the progress.

    Attributes
    ----------
    on : bool
        Whether edits are baked in the background.
    possible : bool
        Whether a store and a scene file exist to bake from.
    line : str
        Line on the bake; empty without one.
    share : float or None
        Progress of the present step, 0 to 1; None without one.
    exact : bool
        Whether the picture has the light of a bake for the present materials.
    said : bool
        Whether the bake is done and the line says how exact the picture is.
    copied : bool
        Whether the picture at rest has the light of the copy beside the store.
    """

    on: bool = True
    possible: bool = True
    line: str = ""
    share: float | None = None
    exact: bool = False
    said: bool = False
    copied: bool = False
