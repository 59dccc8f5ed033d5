"""What the scripts share that build scenes in Blender, and what Blender says of them."""

from __future__ import annotations

import math

import bpy

CM = 0.01


def empty_scene(scale_length: float = 1.0):
    """Blender's scene without anything in it, in a metric system."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.unit_settings.system, scene.unit_settings.scale_length = "METRIC", scale_length
    scene.render.resolution_x, scene.render.resolution_y = 800, 600
    return scene


def put(collection, name, data, at=(0, 0, 0), turn_deg=(0, 0, 0), scale=(1, 1, 1)):
    """A new object in a collection."""
    o = bpy.data.objects.new(name, data)
    o.location, o.rotation_euler, o.scale = at, [math.radians(a) for a in turn_deg], scale
    collection.objects.link(o)
    return o


def box(name, size=(1, 1, 1)):
    """A mesh: a box about the origin."""
    corners = [(x * size[0] / 2, y * size[1] / 2, z * size[2] / 2) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return _mesh(name, corners, faces)


def plane(name, width, depth, uv=False):
    """A mesh: a rectangle that faces up."""
    w, d = width / 2, depth / 2
    mesh = _mesh(name, [(-w, -d, 0), (w, -d, 0), (w, d, 0), (-w, d, 0)], [(0, 1, 2, 3)])
    if uv:
        layer = mesh.uv_layers.new()
        for corner, place in zip(layer.data, ((0, 0), (1, 0), (1, 1), (0, 1)), strict=True):
            corner.uv = place
    return mesh


def _mesh(name, corners, faces):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], faces)
    return mesh


def look(name, colour=(0.8, 0.8, 0.8), roughness=0.5, emission=0.0):
    """A material: a Principled BSDF."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    inputs = material.node_tree.nodes["Principled BSDF"].inputs
    inputs["Base Color"].default_value, inputs["Roughness"].default_value = (*colour, 1), roughness
    inputs["Emission Color"].default_value, inputs["Emission Strength"].default_value = (1, 1, 1, 1), emission
    return material


def lamp(collection, name, kind, watts, at=(0, 0, 0), turn_deg=(0, 0, 0), scale=(1, 1, 1), **settings):
    """A lamp; `watts` is Blender's number."""
    light = bpy.data.lights.new(name, kind)
    light.energy = watts
    for key, value in settings.items():
        setattr(light, key, value)
    return put(collection, name, light, at, turn_deg, scale)


def camera(scene, name, at, turn_deg, **settings):
    data = bpy.data.cameras.new(name)
    for key, value in settings.items():
        setattr(data, key, value)
    return put(scene.collection, name, data, at, turn_deg)


def ies_node(light, file, strength=1.0):
    """Make an IES texture the strength of a light."""
    light.use_nodes = True
    nodes = light.node_tree.nodes
    texture = nodes.new("ShaderNodeTexIES")
    texture.mode, texture.filepath, texture.inputs["Strength"].default_value = "EXTERNAL", file, strength
    light.node_tree.links.new(texture.outputs[0], nodes["Emission"].inputs["Strength"])


def truth(scene):
    """Boxes of evaluated meshes in world space, instances included, and cameras' projections, in Blender's space."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    boxes = {}
    for one in depsgraph.object_instances:
        if one.object.type != "MESH" or not one.object.data.polygons:
            continue
        points = [one.matrix_world @ v.co for v in one.object.data.vertices]
        low, high = ([f(p[i] for p in points) for i in range(3)] for f in (min, max))
        boxes.setdefault(one.object.name, []).append([low, high])
    return {
        "boxes": boxes,
        "cameras": {o.name: _projection(o, scene, depsgraph) for o in scene.objects if o.type == "CAMERA"},
    }


def _projection(o, scene, depsgraph):
    """Rows of the matrix from world to clip space."""
    o = o.evaluated_get(depsgraph)
    projection = o.calc_matrix_camera(depsgraph, x=scene.render.resolution_x, y=scene.render.resolution_y)
    return [list(row) for row in projection @ o.matrix_world.inverted()]
