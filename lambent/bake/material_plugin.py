"""The import that exported Mitsuba scenes name: it makes their exact material known to Mitsuba."""

from lambent.bake.bsdfs.material_plugin import material_dict, register_material_plugin

__all__ = ["material_dict", "register_material_plugin"]
