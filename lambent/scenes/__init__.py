"""Scenes, their loaders, the built-in ones, and camera paths through them."""
