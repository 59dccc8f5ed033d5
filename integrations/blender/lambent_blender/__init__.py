"""Lambent's extension of Blender: see README.md beside it."""
