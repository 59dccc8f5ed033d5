"""Mitsuba's scene files, versions 0.6 and 3."""

from lambent.scenes.loaders.mitsuba.document import is_scene as recognise
from lambent.scenes.loaders.mitsuba.scene import load

NAME, ENDINGS = "Mitsuba", (".xml",)

__all__ = ["ENDINGS", "NAME", "load", "recognise"]
