"""Lambent's extension of Blender: see README.md beside it."""

from __future__ import annotations


def register():
    """Called by Blender when the extension is enabled."""
    import bpy

    from . import operators, panels, properties

    properties.register()
    for one in (*operators.CLASSES, *panels.CLASSES):
        bpy.utils.register_class(one)
    panels.register()


def unregister():
    """Called by Blender when the extension is disabled."""
    import bpy

    from . import operators, panels, properties

    panels.unregister()
    for one in reversed((*operators.CLASSES, *panels.CLASSES)):
        bpy.utils.unregister_class(one)
    properties.unregister()
