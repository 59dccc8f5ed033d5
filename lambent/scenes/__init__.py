"""What is there: scenes, their loaders, the built-in ones."""

from lambent.scenes.loaders.load import load_scene

__all__ = ["load_scene"]
