"""Wavefront OBJ with its MTL libraries."""

from lambent.scenes.loaders.obj.objects import load

NAME, ENDINGS = "Wavefront OBJ", (".obj",)

__all__ = ["ENDINGS", "NAME", "load"]
