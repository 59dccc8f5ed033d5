"""Operators: export, bake and walk, stop, likeness of a material, import of a light map."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import StringProperty
from bpy_extras.io_utils import ExportHelper

from .brought_in import import_light_map, show_likeness
from .export import export_scene, folder_of
from .properties import setting
from .running import Job, command_of

REPORT = "Lambent export"
INTERVAL_S = 0.3
jobs = []  # the running one, or the last


class LambentPreferences(bpy.types.AddonPreferences):
    bl_idname = __package__
    command: StringProperty(name="Command", description="Program lambent, or a command that runs it", default="lambent")

    def draw(self, context):
        self.layout.prop(self, "command")


class _Action:
    """An operator that does `run`, and reports what the user can mend as one line."""

    def execute(self, context):
        try:
            self.run(context, command_of(context.preferences.addons[__package__].preferences.command))
        except (RuntimeError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}

    def export(self, context, folder):
        """Export; what is not carried goes to the report, and to a text of the .blend."""
        exported = export_scene(folder, Path(bpy.data.filepath or "untitled").stem, context)
        text = bpy.data.texts.get(REPORT) or bpy.data.texts.new(REPORT)
        text.from_string("\n".join([f"Exported {exported.scene}", *(exported.notes or ["Everything is carried."])]))
        for note in exported.notes:
            self.report({"WARNING"}, note)
        self.report({"INFO"}, f"Exported {exported.scene}: {len(exported.notes)} notes in the text {REPORT}")
        return exported


class LAMBENT_OT_export(_Action, bpy.types.Operator, ExportHelper):
    """Export the scene with its materials, lamps and cameras for Lambent"""

    bl_idname, bl_label = "lambent.export", "Lambent (.toml)"
    filename_ext = ".toml"
    filter_glob: StringProperty(default="*.toml", options={"HIDDEN"})

    def invoke(self, context, event):
        place = folder_of(bpy.data.filepath) if bpy.data.filepath else Path.home() / "untitled.lambent"
        self.filepath = str(place / "scene.toml")
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def run(self, context, command):
        self.export(context, Path(bpy.path.abspath(self.filepath)).parent)


class LAMBENT_OT_bake_and_walk(_Action, bpy.types.Operator):
    """Export, bake in the background, then open the window to walk"""

    bl_idname, bl_label = "lambent.bake_and_walk", "Bake and walk"

    @classmethod
    def poll(cls, context):
        return not (jobs and jobs[-1].state == "running")

    def run(self, context, command):
        if not bpy.data.filepath:
            raise RuntimeError("Save the .blend first: the store goes beside it")
        file, quality = Path(bpy.data.filepath), context.scene.lambent_quality.lower()
        scene, store = self.export(context, folder_of(file)).scene, str(file.with_suffix(".store"))
        bake = [*command, "bake", str(scene), "-o", store, "--quality", quality]
        jobs[:] = [Job([("bake", bake), ("walk", [*command, "walk", store])])]
        bpy.app.timers.register(_follow, first_interval=INTERVAL_S)


class LAMBENT_OT_stop(bpy.types.Operator):
    """Stop; finished work stays"""

    bl_idname, bl_label = "lambent.stop", "Stop"

    @classmethod
    def poll(cls, context):
        return bool(jobs) and jobs[-1].state == "running"

    def execute(self, context):
        jobs[-1].cancel()
        return {"FINISHED"}


class LAMBENT_OT_likeness(_Action, bpy.types.Operator):
    """Show the nearest likeness of the document in this material's Principled BSDF"""

    bl_idname, bl_label = "lambent.likeness", "Preview"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 - read by Blender

    @classmethod
    def poll(cls, context):
        return getattr(context, "material", None) is not None and bool(setting(context.material, "lambent_material"))

    def run(self, context, command):
        file = setting(context.material, "lambent_material")
        show_likeness(context.material, bpy.path.abspath(file, library=context.material.library), command)


class LAMBENT_OT_light_map(_Action, bpy.types.Operator):
    """Import the objects of a store in their baked light"""

    bl_idname, bl_label = "lambent.light_map", "Lambent light map (store)"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 - read by Blender
    directory: StringProperty(subtype="DIR_PATH")

    def invoke(self, context, event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def run(self, context, command):
        import_light_map(Path(bpy.path.abspath(self.directory)), command, context.scene)


def _follow():
    """Follow the job; the seconds until the next look, None at its end."""
    running = jobs[-1].poll()
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            area.tag_redraw()
    return INTERVAL_S if running else None


CLASSES = (
    LambentPreferences, LAMBENT_OT_export, LAMBENT_OT_bake_and_walk, LAMBENT_OT_stop, LAMBENT_OT_likeness,
    LAMBENT_OT_light_map,
)  # fmt: skip
