"""Files that mean harm, or came to it: one clear line, soon, and nothing read outside the scene's folder."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.loaders.mitsuba import load as read_mitsuba
from lambent.scenes.loaders.mitsuba import serialized
from lambent.scenes.loaders.ply import UV_NAMES
from lambent.scenes.loaders.ply import read as read_ply

BALL = '<shape type="sphere"/>'
DEEP = "<scene version='3.0.0'>" + "<bsdf type='twosided'>" * 5000 + "</bsdf>" * 5000 + "</scene>"
DOUBLING = "".join(
    f'<bsdf type="blendbsdf" id="b{i}"><ref id="b{i + 1}"/><ref id="b{i + 1}"/></bsdf>' for i in range(25)
)
LAUGHS = '<!DOCTYPE scene [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>'
HOSTILE = {
    "not XML": ("<scene", r"not XML"),
    "another root": ("<bsdf/>", r"not a Mitsuba scene; found <bsdf>"),
    "entities": (LAUGHS + f"<scene version='3.0.0'>{BALL}</scene>", "declarations are not supported"),
    "a file of the system": (
        '<!DOCTYPE s [<!ENTITY x SYSTEM "file:///etc/passwd">]><scene>&x;</scene>', "declarations are not supported"),
    "too deep": (DEEP, r"too many levels"),
    "itself": ('<bsdf type="twosided" id="a"><ref id="a"/></bsdf><shape type="sphere"><ref id="a"/></shape>',
               r"contains itself; found a"),
    "doubling": (DOUBLING + '<bsdf type="plastic" id="b25"/><shape type="sphere"><ref id="b0"/></shape>',
                 r"too many lobes"),
    "a group within itself": (
        '<shape type="shapegroup" id="g"><shape type="instance"><ref id="g"/></shape></shape>'
        '<shape type="instance"><ref id="g"/></shape>', r"nested groups are ignored"),
    "unknown id": ('<bsdf type="diffuse" id="wood"/><shape type="sphere"><ref id="wod"/></shape>',
                   r"unknown id; found wod; did you mean 'wood'\?"),
    "one id twice": ('<bsdf type="diffuse" id="a"/><bsdf type="diffuse" id="a"/>' + BALL, r"id is used twice; found a"),
    "unset parameter": ('<default name="size" value="1"/><shape type="$siez"/>',
                        r"parameter is not set; found \$siez; did you mean 'size'\?"),
    "parameters that grow": (
        f'<default name="a" value="{"x" * 4096}"/><bsdf type="{"$a" * 4096}"/>' + BALL, r"too long after its"),
    "out of the folder": ('<shape type="obj"><string name="filename" value="../a.obj"/></shape>', r"leaves its folder"),
    "out by an absolute name": ('<shape type="ply"><string name="filename" value="/etc/passwd"/></shape>', r"leaves"),
    "out by a drive": ('<shape type="ply"><string name="filename" value="C:\\a.ply"/></shape>', r"leaves its folder"),
    "includes out": ('<include filename="../other.xml"/>', r"leaves its folder"),
    "includes itself": ('<include filename="scene.xml"/>', r"includes itself"),
    "a picture out": ('<shape type="sphere"><bsdf type="diffuse"><texture type="bitmap" name="reflectance"><string '
                      'name="filename" value="../../p.png"/></texture></bsdf></shape>', r"leaves its folder"),
    "not there": ('<shape type="obj"><string name="filename" value="a.obj"/></shape>',
                  r"holds no triangles; a: left out, its file a\.obj is missing"),
    "not a number": ('<shape type="sphere"><float name="radius" value="big"/></shape>',
                     r"line 1 <float> radius: not a number; found big"),
    "not finite": ('<shape type="sphere"><float name="radius" value="nan"/></shape>', r"not a finite number"),
    "a transform that is not finite": (
        '<shape type="cube"><transform name="to_world"><scale value="1e8"/><scale x="1e8"/></transform></shape>',
        r"transform is not finite"),
    "a matrix cut short": (
        '<shape type="sphere"><transform name="to_world"><matrix value="1 0 0"/></transform></shape>', r"wrong count"),
    "no axis": ('<shape type="sphere"><transform name="to_world"><rotate angle="3"/></transform></shape>',
                r"axis is zero"),
    "an empty film": (
        '<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="0"/></film></sensor>' + BALL,
        r"film has no size"),
    "an impossible view": (
        '<sensor type="perspective"><float name="fov" value="180"/></sensor>' + BALL, r"is out of range"),
    "nothing": ("", r"holds no triangles"),
    "flat": ('<shape type="sphere"><transform name="to_world"><scale x="1" y="0" z="1"/></transform></shape>',
             r"holds no triangles; sphere: left out, its transform is singular"),
}  # fmt: skip


WHOLE = {"not XML", "another root", "entities", "a file of the system", "too deep"}  # files without a scene around them


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_xml_is_one_line(tmp_path: Path, name: str) -> None:
    body, said = HOSTILE[name]
    (tmp_path / "inner").mkdir()
    path = tmp_path / "inner" / "scene.xml"
    path.write_text(body if name in WHOLE else f'<scene version="3.0.0">{body}</scene>')
    with pytest.raises(UserError, match=said) as caught:
        read_mitsuba(path)
    assert "\n" not in str(caught.value)


def test_pictures_that_are_missing_damaged_or_absurd(tmp_path: Path) -> None:
    """A missing picture is said, a damaged or an absurd one is an error."""
    body = """<scene version="3.0.0"><shape type="sphere"><bsdf type="diffuse" id="m"><texture type="bitmap"
        name="reflectance"><string name="filename" value="p.png"/></texture></bsdf></shape></scene>"""
    path = tmp_path / "scene.xml"
    path.write_text(body)
    scene = load_scene(path)
    assert scene.materials["m"].kd == (0.5,) * 3 and "p.png is missing" in " ".join(scene.warnings)
    (tmp_path / "p.png").write_bytes(_png_of(60000, 60000))
    with pytest.raises(UserError, match=r"p.png: picture"):
        load_scene(path)
    (tmp_path / "p.png").write_bytes(_png_of(4, 4)[:45])
    with pytest.raises(UserError, match=r"p.png: picture cannot be read"):
        load_scene(path)
    (tmp_path / "p.png").write_bytes(b"hello")
    with pytest.raises(UserError, match=r"p.png: picture cannot be read \(unknown picture format\)"):
        load_scene(path)


def _png_of(width: int, height: int) -> bytes:
    """A small file that says it is large: grey rows of zeros, packed."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    rows = zlib.compress(b"\0" * min((width + 1) * height, 1 << 22))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


def serialized_of(version: int = 4, **more: Any) -> bytes:
    """A file of two meshes, the second a triangle; `more` changes what its head says."""
    said = {"flags": 0x1003, "vertices": 3, "triangles": 1} | more

    def mesh(flags: int, vertices: int, triangles: int) -> bytes:
        name = b"name\0" if version == 4 else b""
        arrays = (
            np.float32([(0, 0, 0), (1, 0, 0), (0, 1, 0)]).tobytes() + np.tile(np.float32([0, 0.6, 0.8]), 3).tobytes()
        )
        arrays += np.float32([(0, 0), (1, 0), (0, 1)]).tobytes() + np.uint32([0, 1, 2]).tobytes()
        body = struct.pack("<I", flags) + name + struct.pack("<QQ", vertices, triangles) + arrays
        return struct.pack("<HH", 0x041C, version) + zlib.compress(body)

    first, second = mesh(0x1003, 3, 1), mesh(**said)
    places = struct.pack("<QQ" if version == 4 else "<II", 0, len(first))
    return first + second + places + struct.pack("<I", 2)


@pytest.mark.parametrize("version", [3, 4])
def test_serialized_meshes(tmp_path: Path, version: int) -> None:
    (tmp_path / "two.serialized").write_bytes(serialized_of(version))
    path = tmp_path / "scene.xml"
    path.write_text("""<scene version="0.6.0"><shape type="serialized"><string name="filename" value="two.serialized"/>
        <integer name="shapeIndex" value="1"/></shape></scene>""")
    (o,) = load_scene(path).objects
    assert np.array_equal(o.mesh.positions, [(0, 0, 0), (1, 0, 0), (0, 1, 0)]) and np.allclose(
        o.mesh.normals, (0, 0.6, 0.8)
    )
    assert np.array_equal(o.mesh.uv, [(0, 1), (1, 1), (0, 0)])  # Mitsuba's v points down


BOMBS = {
    "more than it holds": ({"vertices": 1_000_000}, 1, r"mesh is truncated"),
    "more than there is": ({"vertices": 1 << 60}, 1, r"mesh is too large"),
    "more triangles than there are": ({"triangles": 1 << 40}, 1, r"is too large"),
    "mesh index out of range": ({}, 2, r"mesh index out of range; found 2; expected below 2"),
    "a negative one": ({}, -1, r"mesh index out of range"),
}


@pytest.mark.parametrize("name", BOMBS)
def test_serialized_files_that_promise_too_much(tmp_path: Path, name: str) -> None:
    more, index, said = BOMBS[name]
    path = tmp_path / "a.serialized"
    path.write_bytes(serialized_of(**more))
    with pytest.raises(UserError, match=said):
        serialized.read(path, index)


def test_a_deflated_desert_is_not_unpacked(tmp_path: Path) -> None:
    """A gigabyte of zeros in a megabyte: a head of zeros is a mesh of nothing, read without unpacking the rest."""
    packer = zlib.compressobj(9)
    desert = b"".join(packer.compress(b"\0" * (1 << 20)) for _ in range(64)) + packer.flush()
    path = tmp_path / "a.serialized"
    path.write_bytes(struct.pack("<HH", 0x041C, 3) + desert + struct.pack("<II", 0, 1))
    assert len(serialized.read(path, 0).positions) == 0


POINTS = np.array([(0, 0, 0, 0.6, 0, 0.8, 0.1, 0.2), (1, 0, 0, 0, 0.6, 0.8, 0.3, 0.4),
                   (1, 1, 0, 0, 0, 1, 0.5, 0.9), (0, 1, 0, 0.8, 0, 0.6, 0.7, 0.6)])  # fmt: skip


def ply_of(form: str, sizes: tuple[int, ...] = (3, 3), uv: tuple[str, str] | None = None) -> bytes:
    """A square of faces with the given numbers of corners; with `uv`, its properties stand in an order of their own."""
    columns = ("x", "y", "z") if uv is None else ("nz", uv[1], "x", "ny", "y", uv[0], "z", "nx")
    of = dict(zip(("x", "y", "z", "nx", "ny", "nz", *(uv or "uv")), POINTS.T, strict=True))
    table, faces = np.stack([of[name] for name in columns], axis=-1), [(0, 1, 2, 3)[:n] for n in sizes]
    head = f"ply\nformat {form} 1.0\ncomment made up\nelement vertex 4\n"
    head += "".join(f"property float {name}\n" for name in columns)
    head += f"element face {len(faces)}\nproperty uchar flag\nproperty list uchar int vertex_indices\nend_header\n"
    if form == "ascii":
        rows = [" ".join(f"{value:g}" for value in row) for row in (*table, *((7, len(f), *f) for f in faces))]
        return (head + "\n".join(rows) + "\n").encode()
    order = ">" if "big" in form else "<"
    body = table.astype(f"{order}f4").tobytes()
    return head.encode() + body + b"".join(struct.pack(f"{order}BB{len(f)}i", 7, len(f), *f) for f in faces)


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("sizes", [(3, 3), (4,), (3, 4, 2)])
@pytest.mark.parametrize("uv", [None, *UV_NAMES])
def test_ply_in_every_form(tmp_path: Path, form: str, sizes: tuple[int, ...], uv: tuple[str, str] | None) -> None:
    path = tmp_path / "a.ply"
    path.write_bytes(ply_of(form, sizes, uv))
    arrays = read_ply(path, notes := [])
    assert len(arrays.triangles) == sum(max(0, n - 2) for n in sizes) and not notes
    assert arrays.triangles[0].tolist() == [0, 1, 2]
    assert (arrays.normals is None) == (arrays.uv is None) == (uv is None)
    found = [part for part in (arrays.positions, arrays.normals, arrays.uv) if part is not None]
    np.testing.assert_allclose(np.column_stack(found), POINTS[:, : 3 if uv is None else 8], atol=1e-6)


def test_ply_that_is_broken(tmp_path: Path) -> None:
    path = tmp_path / "a.ply"
    sound = {form: ply_of(form) for form in ("ascii", "binary_little_endian")}
    broken = [
        (b"plx", r"not a PLY"),
        (sound["ascii"].replace(b"vertex 4", b"vertex 400000000000"), r"truncated"),
        (sound["binary_little_endian"].replace(b"vertex 4", b"vertex 4000000000000"), r"truncated"),
        (sound["ascii"].replace(b"face 2", b"face 200000000"), r"truncated"),
        (sound["binary_little_endian"].replace(b"face 2", b"face 200000000"), r"truncated"),
        (sound["ascii"].replace(b"3 0 1 2", b"3 0 1 9"), r"face index out of range; found 9"),
        (sound["ascii"].replace(b"3 0 1 2", b"3 0 1 x"), r"not a number"),
        (sound["ascii"].replace(b"float x", b"floot x"), r"header cannot be read"),
        (sound["ascii"].replace(b"format ascii 1.0\n", b""), r"header cannot be read"),
        (sound["ascii"].replace(b"property float y\n", b""), r"."),
        (b"ply\nformat ascii 1.0\nelement vertex " + b"9" * 30 + b"\nend_header\n", r"has no vertices"),
    ]
    for data, said in broken:
        path.write_bytes(data)
        with pytest.raises(UserError, match=said):
            read_ply(path)
    for data in sound.values():
        for length in range(0, len(data) - 2, 5):
            path.write_bytes(data[:length])
            with pytest.raises(UserError):
                read_ply(path)
