"""Scenes, their loaders, the built-in ones, and camera paths through them."""

from lambent.scenes.camera_paths import sample_path
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.validation import validate

__all__ = ["load_scene", "sample_path", "validate"]
