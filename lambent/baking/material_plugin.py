"""Registers the exact material with Mitsuba; exported Mitsuba scenes tell their users to import this module."""

from lambent.baking.bsdfs.material_plugin import material_dict, register_material_plugin

__all__ = ["material_dict", "register_material_plugin"]
