"""How a site loads: stand-ins and shorter vertices come out of JavaScript as Python means them."""

from __future__ import annotations

import base64
import gzip

import numpy as np
import pytest

from lambent.baked.light_fields.blocks.bc6h import decoded
from lambent.realtime.light.baked import read_baked
from lambent.realtime.planar.planar_view import whole_window
from lambent.site.memory import graphics_bytes, needs_of, script_bytes
from lambent.site.standins import COARSE_LEVEL, DROPPED_BITS, standin
from lambent.site.vertices import UNITS, vertices_of, words_of
from lambent.store.store import Store
from tests.site.test_export import manifest_of, packed_bytes, unpacked


def encoded(data: bytes) -> str:
    return base64.b64encode(data).decode()


ENLARGED = """import {enlarged} from './loading.js';
const data = new Uint8Array(Buffer.from(given.data, 'base64')).buffer;
say(Buffer.from(enlarged(data, given.size, given.levels, given.finest, given.bytes)).toString('base64'));"""


@pytest.fixture
def vertices():
    """Vertices with normals in all octants, on axes and edges of the octahedron."""
    rng = np.random.default_rng(3)
    found = rng.normal(size=(4000, 13)).astype(np.float32)
    found[:, 0] *= 5e4  # m
    found[:27, 3:6] = found[:27, 6:9] = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3), -1).reshape(-1, 3)
    found[13, 3:9] = 0, 0, 1, 0, 0, -1
    for first in UNITS:
        found[:, first : first + 3] /= np.linalg.norm(found[:, first : first + 3], axis=1, keepdims=True)
    return found


def test_vertices_are_those_of_python_to_the_bit(javascript, vertices):
    words = words_of(vertices)
    code = """import {vertices} from './loading.js';
    const data = new Uint8Array(Buffer.from(given.data, 'base64')).buffer;
    say(Buffer.from(vertices(data, 11, given.units)).toString('base64'));"""
    found = base64.b64decode(javascript(code, {"data": encoded(words.tobytes()), "units": UNITS}))
    assert found == vertices_of(words).tobytes()


def test_vertices_keep_all_but_directions(vertices):
    found = vertices_of(words_of(vertices))
    others = np.r_[:3, 9:13]
    assert np.array_equal(found[:, others], vertices[:, others])
    for first in UNITS:
        there, before = found[:, first : first + 3], vertices[:, first : first + 3]
        assert np.abs(there - before).max() < 6e-5
        on_axis = (before == 0).sum(axis=1) == 2
        assert on_axis.any() and np.array_equal(there[on_axis], before[on_axis])


def test_vertices_with_other_vectors_stay_as_they_are(vertices):
    vertices[7, 6:9] = 0
    assert words_of(vertices) is None


@pytest.mark.parametrize("size", [(64, 32, 6), (64, 64, 18), (40, 17, 1)])
def test_coarse_levels_are_enlarged(javascript, size):
    """Each texel is that of the finest level sent; coarser levels are rounded alone."""
    rng = np.random.default_rng(4)
    columns, rows, layers = size
    count = int(np.log2(max(size[:2]))) + 1
    shapes = [(layers, max(1, rows >> k), max(1, columns >> k), 4) for k in range(count)]
    levels = [rng.uniform(0, 9, shape).astype(np.float16) for shape in shapes]
    finest, coarse = standin("rgba16float", size, [level.tobytes() for level in levels])
    given = {"data": encoded(b"".join(coarse)), "size": size, "levels": count, "finest": finest, "bytes": 8}
    found = np.frombuffer(base64.b64decode(javascript(ENLARGED, given)), np.float16)
    at = 0
    for k, shape in enumerate(shapes):
        level = found[at : at + np.prod(shape)].reshape(shape)
        at += level.size
        source, step = levels[max(k, COARSE_LEVEL)], 1 << max(COARSE_LEVEL - k, 0)
        row, column = (
            np.minimum(np.arange(n) // step, m - 1) for n, m in zip(shape[1:3], source.shape[1:3], strict=True)
        )
        wanted = source[:, row][:, :, column]
        np.testing.assert_allclose(level, wanted, rtol=2.0**-7)
    assert at == found.size


@pytest.mark.long
def test_stand_ins_of_blocks_have_their_colour(javascript):
    """As the decoder of light fields reads them: each block has the colour of the texel in its corner."""
    levels = [np.random.default_rng(6).uniform(0, 9, (6, 32 >> k, 32 >> k, 4)).astype(np.float16) for k in range(6)]
    finest, coarse = standin("rgba16float", (32, 32, 6), [level.tobytes() for level in levels])
    code = """import {enlarged, inBlocks} from './loading.js';
    const bytes = new Uint8Array(Buffer.from(given.data, 'base64')).buffer;
    say(Buffer.from(inBlocks(enlarged(bytes, given.size, given.levels, given.finest, 8, 4))).toString('base64'));"""
    given = {"data": encoded(b"".join(coarse)), "size": (32, 32, 6), "levels": 6, "finest": finest}
    words, at = np.frombuffer(base64.b64decode(javascript(code, given)), np.uint32), 0
    for k, level in enumerate(levels):
        n = max(1, len(level[0]) // 4)
        light = decoded(words[at : at + 24 * n * n].reshape(6, n, n, 4))[:, ::4, ::4]
        at += 24 * n * n
        source = levels[max(k, finest)]
        corners = np.minimum(np.arange(n) * 4 // (1 << max(finest - k, 0)), len(source[0]) - 1)
        np.testing.assert_allclose(light, source[:, corners][:, :, corners, :3], rtol=0.05)
    assert at == len(words)


def test_blocks_of_a_light_map_are_means_of_its_charts(javascript):
    """The dark beside a chart is no part of them; without a whole block at the end, the last one serves."""
    texels = np.zeros((2, 5, 7, 4), np.float16)
    texels[..., 3] = 1
    texels[0, :, :3, :3] = 8.0
    finest, coarse = standin("rgba16float", (7, 5, 2), [texels.tobytes()])
    given = {"data": encoded(b"".join(coarse)), "size": (7, 5, 2), "levels": 1, "finest": finest, "bytes": 8}
    found = np.frombuffer(base64.b64decode(javascript(ENLARGED, given)), np.float16).reshape(texels.shape)
    assert np.array_equal(found[0, :, :4, 0], np.full((5, 4), 8)) and not found[0, :, 4:, :3].any()
    assert not found[1, ..., :3].any() and (found[..., 3] == 1).all()


def test_depths_are_the_farthest_from_the_sun_in_their_blocks(javascript):
    depths = np.random.default_rng(5).uniform(0, 1, (2, 16, 16)).astype(np.float32)
    finest, coarse = standin("depth32float", (16, 16, 2), [depths.tobytes()])
    given = {"data": encoded(b"".join(coarse)), "size": (16, 16, 2), "levels": 1, "finest": finest, "bytes": 4}
    found = np.frombuffer(base64.b64decode(javascript(ENLARGED, given)), np.float32).reshape(depths.shape)
    farthest = depths.reshape(2, 4, 4, 4, 4).min(axis=(2, 4))
    assert np.array_equal(found, farthest.repeat(4, axis=1).repeat(4, axis=2))


def test_rounded_half_floats_stay_finite():
    values = np.array([65504, 65000, 1, 1.015, 0, 6e-8, -2.03, 0.1] * 64, np.float16).reshape(1, 16, 32, 1)
    levels = [np.zeros(0, np.float16).tobytes()] * COARSE_LEVEL + [values.tobytes()]
    _, (coarse,) = standin("r16float", (256, 128, 1), levels)
    found = np.frombuffer(coarse, np.float16)
    assert np.isfinite(found).all() and not (found.view(np.uint16) & ((1 << DROPPED_BITS) - 1)).any()
    np.testing.assert_allclose(found, values.ravel(), rtol=2.0**-6, atol=1e-6)


def test_a_site_has_stand_ins_for_what_is_large(streamed_site, blue_box):
    manifest = manifest_of(streamed_site)
    textures, buffers = manifest["tables"]["texture"], manifest["tables"]["buffer"]
    first = [piece for one in textures + buffers if (piece := one.get("data"))]
    large = [at for at, one in enumerate(textures) if "standin" in one.get("data", {})]
    for state in manifest["states"]:
        assert sorted(state["finer"]) == [at for at in large if at < state["counts"]["texture"]] != []
    files = {(piece.get("standin") or piece)["file"]: (piece.get("standin") or piece)["packed"] for piece in first}
    assert sum(files.values()) < 0.5 * sum({piece["file"]: piece["packed"] for piece in first}.values())
    for at in large:
        piece = textures[at]["data"]["standin"]
        assert len(gzip.decompress(packed_bytes(streamed_site, piece))) == piece["bytes"]
    (piece,) = [one["data"] for one in buffers if one["usage"] & 0x20]
    words = np.frombuffer(unpacked(streamed_site, piece), np.uint32).reshape(-1, 11)
    positions = read_baked(Store.open(blue_box)).positions
    assert np.array_equal(np.unique(vertices_of(words)[:, :3], axis=0), np.unique(positions, axis=0))


@pytest.mark.parametrize(
    ("table", "one", "words"),
    [
        ("texture", {"size": [300, 9000, 1]}, "allows 8192 texels a side of a texture, the room has 9000: bake it at"),
        ("texture", {"size": [8, 8, 300]}, "allows 256 layers of a texture, the room has 300"),
        ("buffer", {"size": 300_000_000}, "allows 250000000 bytes of a buffer, the room has 300000000"),
        ("texture", {"size": ["canvas", "canvas", 1]}, None),
    ],
)
def test_what_an_adapter_does_not_allow_is_said(javascript, table, one, words):
    tables = {"texture": [{"size": [64, 64]}], "buffer": [{"size": 80}]}
    tables[table].append(one)
    limits = {"maxTextureDimension2D": 8192, "maxTextureArrayLayers": 256, "maxBufferSize": 250_000_000}
    found = javascript("import {beyond} from './device.js'; say(beyond(...given));", [needs_of(tables), limits])
    assert found is None if words is None else words in found


def test_memory_is_that_of_the_objects(streamed_site):
    """Against sizes of the contents, which are those of the tables; drawn textures follow the window."""
    manifest = manifest_of(streamed_site)
    tables = manifest["tables"]
    sizes = [len(_content(streamed_site, one)) for one in tables["texture"] if "data" in one]
    drawn = [one for one in tables["texture"] if "data" not in one]
    wide, high = whole_window((1920, 1080))
    texels = {"canvas": 1920 * 1080, "mirror": wide * high}
    bytes_of = {
        "depth32float": 4,
        "rgb10a2unorm": 4,
        "rgba8unorm": 4,
        "rgba16float": 8,
        "r32uint": 4,
        "rgba32float": 16,
        "r32float": 4,
    }
    wanted = sum(sizes) + sum(one["size"] for one in tables["buffer"])
    for one in drawn:
        levels = [texels[one["size"][0]]] if one["mipLevelCount"] == 1 else _level_texels(wide, high, one)
        wanted += bytes_of[one["format"]] * sum(levels)
    assert graphics_bytes(tables) == wanted
    (blue,) = manifest["states"][1:]
    changed = [piece for places in blue["changes"].values() for piece in places.values()]
    changed += [tables[kind][int(at)]["data"] for kind, places in blue["changes"].items() for at in places]
    changed = {one["file"]: one["bytes"] for one in (piece.get("blocks", piece) for piece in changed)}
    by_number = {kind: {int(at): piece for at, piece in places.items()} for kind, places in blue["changes"].items()}
    document = {"tables": tables, "states": [{"changes": {}}, {"changes": by_number}]}
    assert script_bytes(document, 10) == 360 + sum(changed.values())


def _level_texels(width: int, height: int, one: dict) -> list[int]:
    return [max(1, width >> level) * max(1, height >> level) for level in range(one["mipLevelCount"])]


def _content(site, one):
    """A texture's content, pictures as texels."""
    if not one["data"].get("picture"):
        return unpacked(site, one["data"].get("blocks", one["data"]))
    levels = [(one["size"][0] >> k or 1) * (one["size"][1] >> k or 1) * 4 for k in range(one["mipLevelCount"])]
    return bytes(sum(levels))


def test_damaged_files_are_named(javascript):
    """A turned bit, an end cut off, something after the end, and the file of other data."""
    whole = gzip.compress(bytes(range(256)) * 9, mtime=0)
    turned = bytearray(whole)
    turned[len(whole) // 2] ^= 4
    files = [whole, bytes(turned), whole[:-9], whole + b"more", gzip.compress(b"other")]
    code = """import {Data} from './loading.js';
    const found = [];
    for (const text of given) {
      globalThis.fetch = async () => new Response(Buffer.from(text, 'base64'));
      const read = new Data(() => {}).read({file: 'data/a.gz', bytes: 2304, packed: 1});
      found.push(await read.then((one) => one.byteLength, (error) => error.message));
    }
    say(found);"""
    found = javascript(code, [encoded(file) for file in files])
    assert found == [2304, *["data/a.gz is damaged; export the site again"] * 4]


def test_blocks_are_taken_where_all_states_have_them(javascript):
    plain, blocks = {"file": "a"}, {"file": "b", "blocks": {"file": "c"}, "standin": {"file": "d"}}
    textures = [{"format": "rgba16float", "data": one} for one in (plain, blocks, blocks)] + [{"format": "rgba16float"}]
    changes = {"texture": {"1": {"file": "e", "blocks": {"file": "f"}}, "2": {"file": "g"}}}
    manifest = {"tables": {"texture": textures}, "states": [{"changes": {}}, {"changes": changes}]}
    code = "import {takeBlocks} from './loading.js'; takeBlocks(given); say(given);"
    found = javascript(code, manifest)
    taken = {"format": "bc6h-rgb-ufloat", "data": {"file": "c", "standin": {"file": "d"}}}
    assert found["tables"]["texture"] == [textures[0], taken, *textures[2:]]
    assert found["states"][1]["changes"]["texture"] == {"1": {"file": "f"}, "2": {"file": "g"}}
