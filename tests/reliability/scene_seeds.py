"""Small sound scenes of every format, rich in what their readers know; each is the content of a folder."""

from __future__ import annotations

import base64
import io
import json
import struct
import zlib
from typing import Any

import numpy as np
from PIL import Image

Files = dict[str, bytes]
_RANDOM = np.random.default_rng(0)
TEXELS = _RANDOM.integers(0, 255, (6, 8, 4), np.uint8)
SQUARE = np.float32([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
_PICTURE_MODES = {
    "PNG": "RGBA", "JPEG": "RGB", "BMP": "RGB", "TGA": "RGBA", "TIFF": "RGB", "WEBP": "RGB", "GIF": "P",
}  # fmt: skip


def encoded(kind: str, mode: str | None = None) -> bytes:
    """The picture `TEXELS` in a format of Pillow."""
    stream = io.BytesIO()
    picture = Image.fromarray(TEXELS, "RGBA")
    if mode == "I;16":
        picture = Image.fromarray(TEXELS[..., 0].astype(np.uint16) * 257)
    else:
        picture = picture.convert(mode or _PICTURE_MODES[kind])
    picture.save(stream, kind, **({"lossless": True} if kind == "WEBP" else {}))
    return stream.getvalue()


def pictures() -> dict[str, bytes]:
    """A picture in every encoding that textures may have, but EXR and HDR."""
    found = {f"{kind} texture": encoded(kind) for kind in _PICTURE_MODES}
    return found | {
        "16-bit PNG": encoded("PNG", "I;16"),
        "palette PNG": encoded("PNG", "P"),
        "LA PNG": encoded("PNG", "LA"),
    }


OBJ = b"""# a square, a hollow pentagon and a wedge
mtllib a.mtl
o square
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
vn 0 0 1
usemtl wood
f 1/1/1 2/2/1 3/3/1 4/4/1
o star
v 2 0 0
v 3 0 0
v 2.5 .3 0
v 3 1 0
v 2 1 0
s 1
usemtl paint
f -5 -4 -3 -2 -1
g wedge
usemtl glass
f 1//1 2//1 \\
 3//1
l 1 2
"""
MTL = b"""newmtl wood
Kd .5 .4 .3
Ks .2 .2 .2
Ns 100
illum 2
map_Kd -s 2 2 -o .5 0 p.png
norm p.png
newmtl paint
Kd .8 .1 .1
Pr .3
Pm .2
Pc .5
Pcr .1
aniso .4
map_Pr p.png
Ke 1 1 .5
newmtl glass
Kd .9 .9 .9
d .3
Ni 1.5
Tf .9 .8 .7
illum 4
map_d p.png
"""


def obj() -> Files:
    return {"scene.obj": OBJ, "a.mtl": MTL, "p.png": encoded("PNG")}


def bpt(numbered: bool) -> Files:
    """A curved patch, in the layout of degrees or in the older one of `numbered` points."""
    points = "\n".join(f"{x} {y} {(x * (3 - x) + y * y) / 4}" for y in range(4) for x in range(4))
    text = f"1\n{','.join(map(str, range(1, 17)))}\n16\n{points}\n" if numbered else f"1\n3 3\n{points}\n"
    return {"scene.bpt": text.encode()}


def ply(form: str) -> Files:
    """A square of a triangle pair with normals and uv."""
    names = ("x", "y", "z", "nx", "ny", "nz", "u", "v")
    table = np.hstack([SQUARE, np.tile(np.float32([0, 0, 1]), (4, 1)), SQUARE[:, :2]])
    head = f"ply\nformat {form} 1.0\ncomment made up\nelement vertex 4\n"
    head += "".join(f"property float {name}\n" for name in names)
    head += "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    faces = [(0, 1, 2), (0, 2, 3, 1)[:3]] if form == "ascii" else [(0, 1, 2, 3), (0, 2, 3)]
    if form == "ascii":
        rows = [" ".join(map(str, row)) for row in table.tolist()] + [f"3 {a} {b} {c}" for a, b, c in faces]
        return {"scene.ply": (head + "\n".join(rows) + "\n").encode()}
    order = ">" if "big" in form else "<"
    body = table.astype(f"{order}f4").tobytes()
    return {"scene.ply": head.encode() + body + b"".join(struct.pack(f"{order}B{len(f)}i", len(f), *f) for f in faces)}


def gltf_parts() -> tuple[dict[str, Any], bytes]:
    """A document that uses what is read, and its buffer."""
    image = encoded("PNG")
    pieces = [
        SQUARE.tobytes(), np.tile(np.float32([0, 0, 1]), (4, 1)).tobytes(), SQUARE[:, :2].tobytes(),
        np.tile(np.float32([1, 0, 0, 1]), (4, 1)).tobytes(), np.uint16([0, 1, 2, 0, 2, 3]).tobytes(),
        np.uint8([2, 0, 0, 0]).tobytes(), np.float32([1.1, 1, 0]).tobytes(), image,
    ]  # fmt: skip
    offsets = np.cumsum([0, *map(len, pieces)]).tolist()
    texture = {
        "index": 0,
        "extensions": {"KHR_texture_transform": {"offset": [0.1, 0], "rotation": 0.3, "scale": [2, 2]}},
    }
    sparse = {
        "count": 1,
        "indices": {"bufferView": 5, "componentType": 5121},
        "values": {"bufferView": 6},
    }
    kinds = [
        (0, 5126, 4, "VEC3"),
        (1, 5126, 4, "VEC3"),
        (2, 5126, 4, "VEC2"),
        (3, 5126, 4, "VEC4"),
        (4, 5123, 6, "SCALAR"),
    ]
    attributes = {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "TANGENT": 3}
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 3, 4]}],
        "nodes": [
            {"mesh": 0, "name": "a", "children": [1, 2], "rotation": [0, 0.1, 0, 1], "scale": [1, 2, 1]},
            {"mesh": 1, "name": "a", "translation": [1, 2, 3]},
            {"mesh": 1, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 3, 0, 0, 1]},
            {"camera": 0, "translation": [0, 0, 5]},
            {"extensions": {"KHR_lights_punctual": {"light": 0}}},
        ],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8}}],
        "meshes": [
            {
                "primitives": [
                    {
                        "attributes": attributes,
                        "indices": 4,
                        "material": 0,
                        "extensions": {"KHR_materials_variants": {"mappings": [{"material": 1, "variants": [0]}]}},
                    }
                ]
            },
            {
                "name": "b",
                "primitives": [
                    {"attributes": {"POSITION": 5}, "mode": 5, "material": 1},
                    {"attributes": {"POSITION": 0, "TEXCOORD_0": 2}, "mode": 6, "material": 2},
                ],
            },
        ],
        "accessors": [
            *({"bufferView": v, "componentType": c, "count": n, "type": t} for v, c, n, t in kinds),
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "sparse": sparse},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": len(piece)}
            for start, piece in zip(offsets, pieces, strict=False)
        ],
        "images": [{"bufferView": 7, "mimeType": "image/png"}, {"uri": "p.png"}],
        "samplers": [{"wrapS": 33071}],
        "textures": [{"source": 0}, {"source": 1, "sampler": 0}],
        "materials": [
            {
                "name": "wood",
                "pbrMetallicRoughness": {"baseColorTexture": texture, "metallicRoughnessTexture": {"index": 1}},
                "normalTexture": {"index": 1, "scale": 0.5},
                "emissiveTexture": {"index": 0},
                "emissiveFactor": [1, 1, 0],
                "alphaMode": "MASK",
                "extensions": {
                    "KHR_materials_anisotropy": {"anisotropyStrength": 0.5, "anisotropyTexture": {"index": 1}},
                    "KHR_materials_clearcoat": {"clearcoatFactor": 0.5, "clearcoatRoughnessFactor": 0.1},
                    "KHR_materials_emissive_strength": {"emissiveStrength": 3},
                },
            },
            {
                "name": "sheet",
                "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.6, 0.7, 0.4], "roughnessFactor": 0.4},
                "alphaMode": "BLEND",
                "extensions": {
                    "KHR_materials_transmission": {"transmissionFactor": 0.5},
                    "KHR_materials_volume": {
                        "thicknessFactor": 1, "attenuationDistance": 2, "attenuationColor": [1, 0.5, 1],
                    },
                    "KHR_materials_ior": {"ior": 1.4},
                    "KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [1, 0.9, 0.8]},
                    "KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": 0.3},
                },
            },
            {
                "extensions": {
                    "KHR_materials_pbrSpecularGlossiness": {
                        "diffuseTexture": {"index": 0}, "specularFactor": [0.2, 0.3, 0.4], "glossinessFactor": 0.6,
                    }
                }
            },
        ],
        "extensions": {
            "KHR_lights_punctual": {
                "lights": [{"type": "spot", "intensity": 40, "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.5}}]
            },
            "KHR_materials_variants": {"variants": [{"name": "night"}]},
        },
    }  # fmt: skip
    return document, b"".join(pieces)


def gltf(kind: str) -> Files:
    """The document in a .glb, in a .gltf with its buffer inside, or with its buffer beside it."""
    document, data = gltf_parts()
    more = {"p.png": encoded("PNG")}
    if kind == "glb":
        text = json.dumps(document | {"buffers": [{"byteLength": len(data)}]}).encode()
        text, data = text + b" " * (-len(text) % 4), data + b"\0" * (-len(data) % 4)
        body = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
        return {"scene.glb": struct.pack("<III", 0x46546C67, 2, 12 + len(body)) + body} | more
    uri = "a.bin" if kind == "beside" else "data:;base64," + base64.b64encode(data).decode()
    document["buffers"] = [{"byteLength": len(data), "uri": uri}]
    return {"scene.gltf": json.dumps(document).encode(), "a.bin": data} | more


def serialized() -> bytes:
    """Mitsuba 0.6's binary mesh: two of them."""

    def mesh(name: bytes) -> bytes:
        normals = np.tile(np.float32([0, 0, 1]), (4, 1))
        body = struct.pack("<I", 0x1003) + name + struct.pack("<QQ", 4, 2)
        body += SQUARE.tobytes() + normals.tobytes() + SQUARE[:, :2].tobytes() + np.uint32([0, 1, 2, 0, 2, 3]).tobytes()
        return struct.pack("<HH", 0x041C, 4) + zlib.compress(body)

    first, second = mesh(b"a\0"), mesh(b"b\0")
    return first + second + struct.pack("<QQI", 0, len(first), 2)


MITSUBA = b"""<?xml version="1.0" encoding="utf-8"?>
<scene version="3.0.0"><default name="size" value="2"/><include filename="inner.xml"/>
<bsdf type="twosided" id="metal"><bsdf type="roughconductor"><string name="material" value="Cu"/>
<string name="distribution" value="ggx"/><float name="alpha_u" value=".1"/>
<float name="alpha_v" value=".3"/></bsdf></bsdf>
<bsdf type="principled" id="paint"><rgb name="base_color" value=".4 .5 .6"/><float name="roughness" value=".4"/>
<float name="clearcoat" value=".5"/></bsdf>
<bsdf type="blendbsdf" id="blend"><float name="weight" value=".3"/><ref id="metal"/><bsdf type="roughplastic">
<spectrum name="diffuse_reflectance" value="400:.1, 500:.2, 600:.5"/><float name="alpha" value=".2"/></bsdf></bsdf>
<bsdf type="mask" id="veil"><texture type="checkerboard" name="opacity"><rgb name="color0" value=".2"/></texture>
<bsdf type="diffuse"><texture type="bitmap" name="reflectance"><string name="filename" value="p.png"/>
<transform name="to_uv"><scale x="2" y="3"/></transform></texture></bsdf></bsdf>
<shape type="ply"><string name="filename" value="a.ply"/><ref id="paint"/></shape>
<shape type="serialized"><string name="filename" value="a.serialized"/><integer name="shape_index" value="1"/>
<bsdf type="diffuse"><spectrum name="reflectance" filename="a.spd"/></bsdf></shape>
<shape type="rectangle"><transform name="to_world"><scale value="$size"/><rotate x="1" angle="-90"/>
<translate x="1"/></transform><ref id="blend"/></shape>
<shape type="shapegroup" id="g"><shape type="disk"><ref id="veil"/></shape></shape>
<shape type="instance"><ref id="g"/>
<transform name="to_world"><lookat origin="0,1,2" target="0 0 0" up="0,1,0"/></transform></shape>
<shape type="rectangle"><emitter type="area"><spectrum name="radiance" value="3"/></emitter></shape>
<emitter type="point"><point name="position" x="1" y="2" z="3"/>
<blackbody name="intensity" temperature="3000K"/></emitter>
<emitter type="envmap"><string name="filename" value="sky.hdr"/>
<transform name="to_world"><rotate y="1" angle="30"/></transform></emitter>
<sensor type="perspective"><float name="fov" value="45"/>
<transform name="to_world"><lookat origin="0,1,5" target="0,0,0" up="0,1,0"/>
</transform><film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="48"/></film></sensor>
</scene>"""
INNER = (
    b'<scene version="3.0.0"><bsdf type="thindielectric" id="pane"/><shape type="cube"><ref id="pane"/></shape></scene>'
)
PLAIN_MITSUBA = b"""<scene version="3.0.0"><include filename="inner.xml"/>
<shape type="serialized"><string name="filename" value="a.serialized"/><integer name="shape_index" value="1"/>
<bsdf type="diffuse"><spectrum name="reflectance" filename="a.spd"/></bsdf></shape>
<emitter type="envmap"><string name="filename" value="sky.hdr"/></emitter></scene>"""
SPECTRUM = b"# nm, reflectance\n400 .1\n450 .2\n500, .4\n600 .5\n700 .4\n"
HDR = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\n\n-Y 4 +X 8\n" + bytes(range(100, 228))


def mitsuba() -> Files:
    return {
        "scene.xml": MITSUBA, "inner.xml": INNER, "a.ply": ply("binary_little_endian")["scene.ply"],
        "a.serialized": serialized(), "a.spd": SPECTRUM, "p.png": encoded("PNG"), "sky.hdr": HDR,
    }  # fmt: skip


TOML = b"""format = "lambent-scene"
version = 1
name = "house"
geometry = ["scene.glb", { file = "scene.ply", scale = 0.01 }]
exposure_ev = 2.0
variant = "night"

[environment]
kind = "image"
file = "sky.hdr"
scale = 2.0
rotation_deg = 30.0

[materials.copper]
file = "copper.json"

[materials.oak]
kd = [0.4, 0.27, 0.15]
lobes = [{ mx = 0.1, my = 0.1, r0 = 0.04, alpha = 0.5 }]

[measured]
oak = "oak.txt"

[assign]
"w*" = "oak"

[objects."a*"]
material = "copper"
probe_centre = [0.0, 1.5, 0.0]
probe_planes = [[1.0, 0.0, 0.0, 2.6]]
light_map_scale = 0.5
light_field = { points = 64, texels = 48, offset_m = 0.01, error = 0.05 }

[objects.scene]
emission = [0.4, 0.3, 0.2]

[[variants]]
name = "dark"
materials.oak = { kd = 0.05 }
materials.copper = { use = "oak" }
objects."a*" = "oak"
light = { sky = "0.2,2700K" }

[[reflectors]]
objects = "a*"
use = true
plane = [0.0, 0.0, 1.0, 0.0]

[[lights]]
kind = "spot"
position = [0.0, 2.5, 0.0]
intensity = [20.0, 18.0, 15.0]
direction = [0.0, -1.0, 0.0]
outer_deg = 40.0

[[lights]]
kind = "ies"
file = "lamp.ies"
position = [0.0, 2.5, 0.0]
lumens = 800.0

[[lights]]
kind = "ies"
file = "lamp.ldt"
lamp_set = 1
position = [0.0, 2.5, 0.0]

[[lights]]
kind = "ies"
file = "flood.ies"
position = [0.0, 2.5, 0.0]

[[cameras]]
name = "entrance"
position = [0.0, 1.6, 3.0]
target = [0.0, 1.2, 0.0]
fov_y_deg = 50.0

[[paths]]
name = "walk"
seconds = 20.0
keys = [
  { position = [0.0, 1.6, 3.0], target = [0.0, 1.2, 0.0] },
  { position = [1.0, 1.6, 1.0], target = [0.0, 1.0, -2.0] },
]
"""


IES = b"""IESNA:LM-63-2002
[TEST] by hand
TILT=INCLUDE
1
3
0 45 90
1 .9 .8
1 800 1 5 3 1 2 .6 .6 0
.95 1 40
0 22.5 45 67.5 90
0 45 90
300 280 200 90 0
300 270 180 80 0
300 260 160 70 0
"""
FLOOD = b"""IESNA:LM-63-1995
TILT=flood.tlt
1 -1 1 5 3 2 1 -.6 0 0
1 1 40
-90 -45 0 45 90
0 45 90
0 100 300 200 0
0 80 150 90 0
0 0 0 0 0
"""
TILT = b"1\n3\n0 45 90\n1 .9 .8\n"


def ldt() -> bytes:
    """Symmetric to both planes, two lamp sets, a round opening."""
    head = ["ACME", 1, 4, 8, 45, 3, 45, "R 1", "Dummy", "N 1", "lamp.ldt", "2024", 200, 0, 90, 150, 0, 10, 10, 10, 10]
    sets = [1, "LED", 500, 3000, 80, 15, 2, "LED", "1200,0", 3000, 80, 30]
    angles, values = [*range(0, 360, 45), 0, 45, 90], [300, 200, 5, 300, 180, 5, 300, 150, 5]
    return "\r\n".join(map(str, [*head, 100, 100, 1, 0, 2, *sets, *[0.5] * 10, *angles, *values])).encode()


def toml(material: bytes, table: bytes) -> Files:
    """A scene.toml with a file of every kind that it may name."""
    return {
        "scene.toml": TOML, **gltf("glb"), **ply("ascii"), "sky.hdr": HDR, "copper.json": material, "oak.txt": table,
        "lamp.ies": IES, "lamp.ldt": ldt(), "flood.ies": FLOOD, "flood.tlt": TILT,
    }  # fmt: skip
