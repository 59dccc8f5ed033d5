"""What Lambent needs to know of Blender's data, as properties: registered ones, or custom ones of the same names."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty

LIGHT_FIELDS = {
    "NONE": ("None", "Reflections of a probe"),
    "SURFACE": ("On its surface", "Nearby things are reflected"),
    "GLASS": ("Of its glass", "Light that it transmits is refracted"),
    "VOLUME": ("In its box", "Another mesh can take its place"),
}
WISHES = {"SURFACE": True, "GLASS": {"refracts": True}, "VOLUME": {"volume": True}}
DECLARED = (
    (
        "Material", "lambent_material",
        StringProperty(name="File", description="Material document (.json) or measured table", subtype="FILE_PATH"),
    ),
    (
        "Light", "lambent_luminaire",
        StringProperty(name="Luminaire", description="IES or EULUMDAT file, with its own flux", subtype="FILE_PATH"),
    ),
    (
        "Object", "lambent_light_field",
        EnumProperty(name="Light field", items=[(key, *words) for key, words in LIGHT_FIELDS.items()], default="NONE"),
    ),
    (
        "Collection", "lambent_light_group",
        BoolProperty(name="Light group", description="Its lights are dimmed together", default=False),
    ),
    (
        "Scene", "lambent_quality",
        EnumProperty(name="Quality", items=[(key, key.title(), "") for key in ("PREVIEW", "NORMAL", "FINAL")]),
    ),
)  # fmt: skip


def register():
    for kind, name, declared in DECLARED:
        setattr(getattr(bpy.types, kind), name, declared)


def unregister():
    for kind, name, _ in DECLARED:
        delattr(getattr(bpy.types, kind), name)


def setting(block, name):
    """The property of a data block, or else its custom property; None or empty without both."""
    custom = block.get(
        name
    )  # first: Blender 4 drops a custom property of another type when it reads the registered one
    registered = getattr(block, name, None)
    return custom if registered in (None, "", "NONE", False) else registered
