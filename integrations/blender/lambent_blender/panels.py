"""Panels and menu entries."""

from __future__ import annotations

import bpy

from .operators import LAMBENT_OT_export, LAMBENT_OT_light_map, jobs


class LAMBENT_PT_sidebar(bpy.types.Panel):
    bl_label = bl_category = "Lambent"
    bl_space_type, bl_region_type = "VIEW_3D", "UI"

    def draw(self, context):
        layout = self.layout
        layout.prop(context.scene, "lambent_quality")
        layout.operator("lambent.bake_and_walk")
        layout.operator("lambent.stop")
        if jobs:
            layout.label(text=f"{jobs[-1].step}: {jobs[-1].state}")
            layout.label(text=jobs[-1].line, icon="ERROR" if jobs[-1].state == "failed" else "INFO")
        layout.operator("lambent.export", text="Export")
        layout.operator("lambent.light_map", text="Import light map")


def _panel(context_name, block, name, *extra):
    """A panel of the Properties editor with one property of a data block."""

    def draw(self, context):
        self.layout.prop(getattr(context, block), name)
        for operator in extra:
            self.layout.operator(operator)

    def poll(cls, context):
        return getattr(context, block, None) is not None

    members = {
        "bl_label": "Lambent", "bl_space_type": "PROPERTIES", "bl_region_type": "WINDOW", "bl_context": context_name,
        "bl_options": {"DEFAULT_CLOSED"}, "draw": draw, "poll": classmethod(poll),
    }  # fmt: skip
    return type(f"LAMBENT_PT_{block}", (bpy.types.Panel,), members)


def _export_entry(self, context):
    self.layout.operator(LAMBENT_OT_export.bl_idname)


def _import_entry(self, context):
    self.layout.operator(LAMBENT_OT_light_map.bl_idname)


CLASSES = (
    LAMBENT_PT_sidebar,
    _panel("material", "material", "lambent_material", "lambent.likeness"),
    _panel("data", "light", "lambent_luminaire"),
    _panel("object", "object", "lambent_light_field"),
    _panel("collection", "collection", "lambent_light_group"),
)


def register():
    bpy.types.TOPBAR_MT_file_export.append(_export_entry)
    bpy.types.TOPBAR_MT_file_import.append(_import_entry)


def unregister():
    bpy.types.TOPBAR_MT_file_import.remove(_import_entry)
    bpy.types.TOPBAR_MT_file_export.remove(_export_entry)
