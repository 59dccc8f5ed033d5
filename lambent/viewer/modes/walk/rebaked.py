"""What the window shows of light that is baked anew beside it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class Rebaking:
    """What the panel shows: whether light is baked anew, and how far that is.

    Attributes
    ----------
    on : bool
        Whether edits are baked in the background.
    possible : bool
        Whether there is a store to bake beside.
    line : str
        What the bake does, in a line; empty where it does nothing.
    share : float or None
        How far the step under way is, 0 to 1; None where there is none.
    exact : bool
        Whether the picture has the light of a bake for the materials as they are.
    said : bool
        Whether the line says so.
    """

    on: bool = True
    possible: bool = True
    line: str = ""
    share: float | None = None
    exact: bool = False
    said: bool = False
