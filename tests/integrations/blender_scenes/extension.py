"""The extension as its user meets it: `extension.py TASK FOLDER COMMAND` does a task and says what came of it."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from types import SimpleNamespace

sys.path.insert(0, str(Path(__file__).parent))
import bpy
from building import box, empty_scene, look, put

ADDON = "lambent_blender"
FOLDER, COMMAND = Path(sys.argv[2]), sys.argv[3]


def enabled(file: Path | None = None):
    """Enable the extension in a file, with the command in its preferences; its operators and its module of jobs."""
    import addon_utils  # bpy makes it importable

    if file is not None:
        bpy.ops.wm.open_mainfile(filepath=str(file))
    assert addon_utils.enable(ADDON, default_set=True) is not None
    bpy.context.preferences.addons[ADDON].preferences.command = COMMAND
    from lambent_blender import operators

    return bpy.ops.lambent, operators


def refused(operator, **options) -> str:
    """What an operator reports instead of doing its work."""
    try:
        operator(**options)
    except RuntimeError as error:
        return str(error).strip()
    return ""


def followed(job) -> list[str]:
    """The states of a job at the ends of its commands."""
    states = []
    while job.poll():
        job.process.wait()
        states.append(job.step)
    return [*states, job.state, job.line]


def refusals() -> dict[str, str]:
    scene = empty_scene()
    act, _ = enabled()
    found = {"empty": refused(act.export, filepath=str(FOLDER / "empty" / "scene.toml"))}
    found["written"] = (FOLDER / "empty").exists()
    put(scene.collection, "box", box("box")).data.materials.append(look("paint"))
    found["unsaved"] = refused(act.bake_and_walk)
    bpy.data.materials["paint"].lambent_material = "//paint.json"
    (FOLDER / "mine").mkdir()
    (FOLDER / "mine" / "scene.toml").write_text('format = "lambent-scene"\n')
    found["foreign"] = refused(act.export, filepath=str(FOLDER / "mine" / "scene.toml"))
    act.export(filepath=str(FOLDER / "out" / "scene.toml"))
    act.export(filepath=str(FOLDER / "out" / "scene.toml"))
    found["notes"] = bpy.data.texts["Lambent export"].as_string()
    found["no store"] = refused(act.light_map, directory=str(FOLDER))
    return found


def jobs() -> dict:
    scene = empty_scene()
    put(scene.collection, "box", box("box"))
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "box.blend"))
    act, operators = enabled()
    scene.lambent_quality = "FINAL"
    act.bake_and_walk()
    found = {"done": followed(operators.jobs[-1]), "can start again": operators.LAMBENT_OT_bake_and_walk.poll(None)}
    (FOLDER / "fails").touch()
    act.bake_and_walk()
    found["failed"] = followed(operators.jobs[-1])
    (FOLDER / "fails").unlink()
    (FOLDER / "waits").touch()
    act.bake_and_walk()
    job = operators.jobs[-1]
    while job.line != "waiting":  # each line that it says is an event
        job.said.wait()
        job.said.clear()
    found["running"] = [job.poll(), operators.LAMBENT_OT_bake_and_walk.poll(None)]
    act.stop()
    job.process.wait()
    found["stopped"] = followed(job)
    bpy.context.preferences.addons[ADDON].preferences.command = str(FOLDER / "no such program")
    act.bake_and_walk()
    found["missing"] = followed(operators.jobs[-1])
    return found


def likeness() -> dict:
    scene = empty_scene()
    put(scene.collection, "box", box("box")).data.materials.append(look("paint"))
    act, _ = enabled()
    paint = bpy.data.materials["paint"]
    paint.lambent_material = str(FOLDER / "paint.json")
    with bpy.context.temp_override(material=paint):
        act.likeness()
    inputs = paint.node_tree.nodes["Principled BSDF"].inputs
    (FOLDER / "paint.json").unlink()
    with bpy.context.temp_override(material=paint):
        missing = refused(act.likeness)
    return {
        "colour": list(inputs["Base Color"].default_value)[:3], "metallic": inputs["Metallic"].default_value,
        "objects": [o.name for o in bpy.data.objects], "materials": [m.name for m in bpy.data.materials],
        "missing": missing,
    }  # fmt: skip


def walked() -> dict:
    """Bake the pool from Blender, and import its light map."""
    act, operators = enabled(FOLDER / "pool.blend")
    act.bake_and_walk()
    states = followed(operators.jobs[-1])
    act.light_map(directory=str(FOLDER / "pool.store"))
    objects = bpy.data.collections["pool light map"].objects
    floor = next(o for o in objects if o.name.startswith("white floor"))
    image = next(n.image for n in floor.active_material.node_tree.nodes if n.bl_idname == "ShaderNodeTexImage")
    return {"states": states, "points": _points(floor), "image": _pixels(image)}


def _points(o) -> list:
    """Place in the world, in units, and second texture coordinates, of each corner."""
    uv = o.data.uv_layers[1].data
    return [[list(o.matrix_world @ o.data.vertices[c.vertex_index].co), list(uv[c.index].uv)] for c in o.data.loops]


def _pixels(image) -> list:
    """(H, W, 3), the lowest row first."""
    width, height = image.size
    values = image.pixels[:]
    return [[values[4 * (r * width + c) : 4 * (r * width + c) + 3] for c in range(width)] for r in range(height)]


class Layout:
    """Notes what a panel shows; every property and operator must exist."""

    def __init__(self):
        self.shown = []

    def prop(self, block, name, **options):
        self.shown.append(f"{block.bl_rna.properties[name].name}")

    def operator(self, name, text=""):
        group, _, one = name.partition(".")
        self.shown.append(text or getattr(getattr(bpy.ops, group), one).get_rna_type().name)

    def label(self, text, icon=""):
        self.shown.append(text)


def panels() -> dict:
    scene = empty_scene()
    o = put(scene.collection, "box", box("box"))
    o.data.materials.append(look("paint"))
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "box.blend"))
    act, operators = enabled()
    from lambent_blender import panels

    act.bake_and_walk()
    operators.jobs[-1].process.wait()
    while operators.jobs[-1].poll():
        operators.jobs[-1].process.wait()
    context = SimpleNamespace(
        scene=scene, object=o, material=o.active_material, light=bpy.data.lights.new("l", "SPOT"),
        collection=scene.collection,
    )  # fmt: skip
    found = {}
    for panel in panels.CLASSES:
        layout = Layout()
        assert panel.poll(context) if hasattr(panel, "bl_context") else True
        panel.draw(SimpleNamespace(layout=layout), context)
        found[panel.__name__] = layout.shown
    import addon_utils

    addon_utils.disable(ADDON)
    return {"shown": found, "gone": not hasattr(bpy.types.Material, "lambent_material")}


if __name__ == "__main__":
    tasks = {"panels": panels, "refusals": refusals, "jobs": jobs, "likeness": likeness, "walked": walked}
    sys.stdout.write(f"\ntruth: {json.dumps(tasks[sys.argv[1]]())}\n")
