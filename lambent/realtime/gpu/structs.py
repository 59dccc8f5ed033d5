"""Structs shared with the shaders, as numpy dtypes read from the WGSL that declares them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.materials.shader_layout import wgsl_dtype
from lambent.realtime.gpu.shader_source import assemble

Record = NDArray[np.void]


def offsets_of(record: np.dtype[Any]) -> dict[str, int]:
    """Bytes before each field of a record."""
    return {name: int(field[1]) for name, field in (record.fields or {}).items()}


_DECLARED = {
    "LambentLobe": "lobes", "PlacedLobe": "surface", "Frame": "frame", "Material": "material", "Object": "surface",
    "Sun": "sun_record", "MirroredView": "planar_view", "Plan": "planar_walls", "Prefilter": "prefilter",
    "LightFieldRecord": "light_field_record", "PointLamp": "lamp_record",
}  # fmt: skip
STRUCTS = {
    name: wgsl_dtype(name, assemble(f"{file}.wgsl", given={"look_up.wgsl": ""}))[0] for name, file in _DECLARED.items()
}
FRAME_DTYPE, MATERIAL_DTYPE, OBJECT_DTYPE = STRUCTS["Frame"], STRUCTS["Material"], STRUCTS["Object"]
PLACED_LOBE_DTYPE, PREFILTER_DTYPE = STRUCTS["PlacedLobe"], STRUCTS["Prefilter"]
SUN_DTYPE, LAMP_DTYPE = STRUCTS["Sun"], STRUCTS["PointLamp"]
LIGHT_FIELD_DTYPE = STRUCTS["LightFieldRecord"]
MIRRORED_VIEW_DTYPE, PLAN_DTYPE = STRUCTS["MirroredView"], STRUCTS["Plan"]
