"""Written glTF, Mitsuba and MaterialX files: valid, and what they evaluate to costs what is stated.

glTF and MaterialX are evaluated by their specifications, apart from the code that wrote them; Mitsuba evaluates itself.
"""

from __future__ import annotations

import base64
import json
import math
import shutil
import struct
import subprocess
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.directions import Floats, normalize
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.export import gltf, materialx, mitsuba
from lambent.materials.export.resampling.resampled import CHECK_LOG2, pairs_of
from lambent.materials.measured.inspecting.metrics import errors_and_shares
from lambent.materials.measured.inspecting.synthetic import Setup, synthesise
from lambent.materials.measured.protocol import MeasuredSamples
from tests.materials.export.export_materials import ALL, BRUSHED, FOIL, GOLD, PAPER, PLASTIC, VARNISH
from tests.tools.in_mitsuba import f_cos


class Geometry:
    """wi, wo (N, 3) on the upper side, as wo is mirrored where it is below, and their half vector."""

    def __init__(self, samples: MeasuredSamples) -> None:
        self.far = samples.wo[:, 2] < 0
        self.wi, self.wo = samples.wi, samples.wo * np.where(self.far[:, None], (1, 1, -1), 1)
        self.h = normalize(self.wi + self.wo)
        self.cos_d = np.sum(self.wo * self.h, axis=1)

    def ggx(self, ax: float, ay: float, *, correlated: bool = True) -> Floats:
        """D G / (4 cos_i cos_o) of GGX (Heitz 2014, eqs 72, 85, 86, 98, 99)."""
        d = 1 / (np.pi * ax * ay * np.sum((self.h / (ax, ay, 1)) ** 2, axis=1) ** 2)
        one, other = (
            0.5 * (np.sqrt(1 + ((ax * w[:, 0]) ** 2 + (ay * w[:, 1]) ** 2) / w[:, 2] ** 2) - 1)
            for w in (self.wi, self.wo)
        )
        g = 1 / (1 + one + other) if correlated else 1 / ((1 + one) * (1 + other))
        return np.asarray(d * g / (4 * self.wi[:, 2] * self.wo[:, 2]))


def assert_costs(samples: MeasuredSamples, f: Floats, share: Mapping[str, float]) -> None:
    """The errors of f (N, 3), evaluated from the written file alone, are those that the writer states."""
    channels = samples.f.shape[1]
    if channels == 1:
        np.testing.assert_allclose(f, np.repeat(f[:, :1], 3, axis=1), rtol=1e-9)
    found = errors_and_shares(samples, f[:, :channels])[1]
    for name, value in share.items():
        assert found[name] == np.float64(value) or abs(found[name] - value) < 2e-3 * value + 1e-6, name


ROOT = Path(__file__).parents[3]
VALIDATOR = ROOT / ".venv" / "node" / "node_modules" / "gltf-validator"
ASK = """
const validator = require(process.argv[1]), fs = require("fs");
const all = process.argv.slice(2).map(f => validator.validateBytes(new Uint8Array(fs.readFileSync(f))));
Promise.all(all).then(reports => console.log(JSON.stringify(reports.map(r => r.issues))));
"""


@pytest.fixture(scope="module")
def gltf_files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("gltf")
    paths = {}
    for i, (name, material) in enumerate(ALL.items()):
        paths[name] = folder / f"{i}{('.gltf', '.glb')[i % 2]}"
        gltf.write(material, paths[name])
    return paths


# told before the files are written, which takes long
@pytest.mark.skipif(
    shutil.which("node") is None or not VALIDATOR.is_dir(),
    reason="gltf-validator is not installed: `python3 run.py test` does it where there is npm",
)
def test_the_validator_finds_nothing(gltf_files):
    command = ["node", "-e", ASK, str(VALIDATOR), *map(str, gltf_files.values())]
    answer = subprocess.run(command, capture_output=True, text=True, check=True)
    for name, issues in zip(gltf_files, json.loads(answer.stdout), strict=True):
        assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), (name, issues["messages"])


def test_trimesh_opens_them(gltf_files):
    trimesh = pytest.importorskip("trimesh")
    for path in gltf_files.values():
        mesh = trimesh.load(path, force="mesh")
        assert mesh.is_volume or trimesh.Trimesh(mesh.vertices, mesh.faces, process=True).volume > 0
        assert mesh.volume == pytest.approx(4 / 3 * np.pi * 0.1**3, rel=0.01)


@pytest.mark.parametrize(("mx", "my"), [(0.25, 0.05), (0.05, 0.25)])
def test_the_rough_axis_stays_where_it_is(mx, my, tmp_path):
    """Rotation 0 is rough along the tangent, which on the sphere is t; 90 degrees along n x t."""
    path = tmp_path / "x.gltf"
    gltf.write(Material(lobes=(Lobe(distribution="ggx", k=0.9, r0=0.9, mx=mx, my=my, alpha=0.4),)), path)
    document = json.loads(path.read_text())
    anisotropy = document["materials"][0]["extensions"]["KHR_materials_anisotropy"]
    assert anisotropy.get("anisotropyRotation", 0) == pytest.approx(0 if mx > my else np.pi / 2)
    narrow = document["materials"][0]["pbrMetallicRoughness"]["roughnessFactor"] ** 2
    wide = narrow + (1 - narrow) * anisotropy["anisotropyStrength"] ** 2
    assert narrow == pytest.approx(0.05, rel=0.3) and wide == pytest.approx(0.25, rel=0.3)
    buffer = base64.b64decode(document["buffers"][0]["uri"].partition(",")[2])

    def floats(index, width):
        view = document["bufferViews"][index]
        data = np.frombuffer(buffer, "<f4", view["byteLength"] // 4, view["byteOffset"])
        return data.reshape(-1, width)

    normals, tangents = floats(2, 3), floats(3, 4)
    assert (tangents[:, 3] == 1).all()
    np.testing.assert_allclose(np.sum(normals * tangents[:, :3], axis=1), 0, atol=1e-6)
    bitangents = np.cross(normals, tangents[:, :3])
    assert (bitangents[np.abs(normals[:, 1]) < 0.99, 1] > 0).all()  # t runs round the axis, n x t up


def test_a_table_is_refused(tmp_path):
    table = synthesise(PLASTIC, Setup((0, 40), step_deg=15, fine_deg=15))
    with pytest.raises(UserError, match="lambent fit"):
        gltf.write(table, tmp_path / "x.gltf", lambda *_: None)


@pytest.fixture(scope="module")
def library():
    mx = pytest.importorskip("MaterialX")
    loaded = mx.createDocument()
    assert mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), loaded)
    return loaded


@pytest.mark.parametrize("name", ALL)
def test_materialx_is_valid_and_resolves(name, library, tmp_path):
    mx = pytest.importorskip("MaterialX")
    path = tmp_path / "material.mtlx"
    materialx.write(ALL[name], path)
    read = mx.createDocument()
    mx.readFromXmlFile(read, str(path))
    read.setDataLibrary(library)
    assert read.validate() == (True, "")
    nodes = [element for element in read.traverseTree() if element.isA(mx.Node)]
    assert all(node.getNodeDef() is not None for node in nodes)
    assert len(read.getMaterialNodes()) == 1
    assert 'name="4' not in path.read_text()


def test_a_shader_can_be_generated(library):
    import MaterialX as mx
    from MaterialX import PyMaterialXGenGlsl as glsl
    from MaterialX import PyMaterialXGenShader as generate

    read = mx.createDocument()
    mx.readFromXmlString(read, materialx.document("foil", materialx.likeness(FOIL)[0]))
    read.setDataLibrary(library)
    generator = glsl.GlslShaderGenerator.create()
    context = generate.GenContext(generator)
    context.registerSourceCodeSearchPath(mx.getDefaultDataSearchPath())
    shader = generator.generate("foil", read.getMaterialNodes()[0], context)
    source = shader.getSourceCode("pixel")
    assert "mx_generalized_schlick_bsdf" in source and "mx_dielectric_bsdf" in source


@pytest.mark.parametrize("material", [PLASTIC, FOIL], ids=lambda m: m.name)
def test_weights_integrate_to_the_albedo(material):
    """Mean over theta_i of the albedo, by the pairs and by importance sampling."""
    samples = pairs_of(material, 14, seed=1).samples
    theta = np.radians(np.linspace(0, 84, 43)[:-1] + 1)
    phi = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    wo = np.stack(
        np.broadcast_arrays(
            np.sin(theta)[:, None] * np.cos(phi),
            np.sin(theta)[:, None] * np.sin(phi),
            np.cos(theta)[:, None] + 0 * phi,
        ),
        axis=-1,
    )
    albedo = MaterialBSDF(material).albedo(wo, samples=1024).mean(axis=(0, 1))[: samples.f.shape[1]]
    total = (samples.weight * np.abs(samples.wo[:, 2])) @ samples.f / 2**14
    np.testing.assert_allclose(total, albedo, rtol=0.05)  # the pairs leave out what is beyond 84 degrees
    assert (total < 1.02 * albedo).all()


MATERIALS = [PLASTIC, BRUSHED, GOLD, PAPER, VARNISH]


def named(material: Material) -> str:
    return material.name


def gltf_material(path: Path) -> dict[str, Any]:
    content = path.read_bytes()
    if path.suffix == ".glb":
        assert content[:4] == b"glTF" and struct.unpack_from("<2I", content, 4) == (2, len(content))
        (length,) = struct.unpack_from("<I", content, 12)
        content = content[20 : 20 + length]
    (material,) = json.loads(content)["materials"]
    return dict(material)


def gltf_f(written: dict[str, Any], geometry: Geometry) -> Floats:
    """f (N, 3) by appendix B of glTF 2.0 and the extensions' own texts."""
    pbr = written["pbrMetallicRoughness"]
    base, metallic, alpha = np.array(pbr["baseColorFactor"][:3]), pbr["metallicFactor"], pbr["roughnessFactor"] ** 2
    extensions = {k.removeprefix("KHR_materials_"): v for k, v in written.get("extensions", {}).items()}
    anisotropy = extensions.get("anisotropy", {})
    along, across = alpha + (1 - alpha) * anisotropy.get("anisotropyStrength", 0) ** 2, alpha
    rotation = anisotropy.get("anisotropyRotation", 0.0)
    assert rotation == 0 or math.isclose(rotation, math.pi / 2)
    axes = (across, along) if rotation else (along, across)
    ior, specular = extensions.get("ior", {}).get("ior", 1.5), extensions.get("specular", {})
    weight, tint = specular.get("specularFactor", 1), np.array(specular.get("specularColorFactor", [1, 1, 1]))
    transmission = extensions.get("transmission", {}).get("transmissionFactor", 0)
    through = extensions.get("diffuse_transmission", {})
    share = through.get("diffuseTransmissionFactor", 0)
    colour = np.array(through.get("diffuseTransmissionColorFactor", [1, 1, 1]))

    grazing = ((1 - geometry.cos_d) ** 5)[:, None]
    f0 = np.minimum(((ior - 1) / (ior + 1)) ** 2 * tint, 1)
    fresnel = f0 + (1 - f0) * grazing
    under = 1 - weight * fresnel.max(axis=1, keepdims=True)
    layer = geometry.ggx(*axes)[:, None]
    diffuse = (1 - transmission) * (1 - share) * base / np.pi
    near = (1 - metallic) * (under * diffuse + weight * fresnel * layer)
    near = near + metallic * (base + (1 - base) * grazing) * layer
    sheet = transmission * base * geometry.ggx(*axes, correlated=False)[:, None]
    far = (1 - metallic) * under * (sheet + (1 - transmission) * share * colour / np.pi)
    return np.asarray(np.where(geometry.far[:, None], far, near))


@pytest.mark.long
@pytest.mark.parametrize("material", [*MATERIALS, FOIL], ids=named)
def test_gltf(tmp_path: Path, material: Material) -> None:
    ending = ".glb" if material in (PAPER, FOIL) else ".gltf"
    path = tmp_path / f"a{ending}"
    cost = gltf.write(material, path)
    samples = pairs_of(material, CHECK_LOG2, seed=1).samples
    assert_costs(samples, gltf_f(gltf_material(path), Geometry(samples)), cost.share)


@pytest.mark.parametrize("material", [*MATERIALS, FOIL], ids=named)
def test_mitsuba(tmp_path: Path, mi: Any, material: Material) -> None:
    """As Mitsuba itself evaluates the ball's BSDF."""
    cost = mitsuba.write(material, tmp_path / "a.xml")
    (bsdf,) = ET.parse(tmp_path / "a.xml").getroot().findall("bsdf")
    assert bsdf.get("id") == "material"
    (ball,) = (shape for shape in mi.load_file(str(tmp_path / "a.xml")).shapes() if not shape.is_emitter())
    samples = pairs_of(material, CHECK_LOG2, seed=1).samples
    assert_costs(samples, f_cos(ball.bsdf(), samples.wi, samples.wo) / samples.wi[:, 2:], cost.share)


@pytest.mark.parametrize("material", [PLASTIC, PAPER], ids=named)
def test_mitsuba_lights_the_side_that_is_looked_at(tmp_path: Path, material: Material) -> None:
    """Above all from before the ball, or from behind what transmits; the ball's pole, +z of a sphere, is up."""
    mitsuba.write(material, tmp_path / "a.xml")
    ball, lamp, *_ = ET.parse(tmp_path / "a.xml").getroot().findall("shape")
    eye = ET.parse(tmp_path / "a.xml").getroot().find("sensor/transform/lookat").get("origin")
    lamp_z, eye_z = (float(text.split(",")[2]) for text in (lamp.find("point").get("value"), eye))
    assert np.sign(lamp_z * eye_z) == (-1 if material.transmits else 1)
    turn = ball.find("transform/rotate")
    angle = np.radians(float(turn.get("angle")))
    np.testing.assert_allclose([float(turn.get("x")), -np.sin(angle)], [1, 1])  # about x, z becomes y


def inputs_of(node: ET.Element) -> dict[str, Floats]:
    """The numbers of a MaterialX node's inputs, by name."""
    numeric = (one for one in node if one.get("type") in ("float", "vector2", "color3"))
    return {one.get("name", ""): np.array([float(v) for v in one.get("value", "").split(",")]) for one in numeric}


def materialx_f(root: ET.Element, geometry: Geometry) -> Floats:
    """f (N, 3) of the document's nodes by their own definitions, added up."""
    near, far = np.zeros((2, len(geometry.cos_d), 3))
    grazing = ((1 - geometry.cos_d) ** 5)[:, None]
    for node in root:
        numbers = inputs_of(node)
        scatter = [one.get("value") for one in node if one.get("name") == "scatter_mode"]
        if node.tag == "oren_nayar_diffuse_bsdf":
            assert numbers["roughness"] == 0
            near += numbers["color"] / np.pi
        elif node.tag == "translucent_bsdf":
            far += numbers["color"] / np.pi
        elif node.tag == "generalized_schlick_bsdf":
            assert scatter == ["R"] and numbers["exponent"] == 5
            fresnel = numbers["color0"] + (numbers["color90"] - numbers["color0"]) * grazing
            near += fresnel * geometry.ggx(*numbers["roughness"])[:, None]
        elif node.tag == "dielectric_bsdf":
            assert scatter == ["T"]
            f0 = ((numbers["ior"] - 1) / (numbers["ior"] + 1)) ** 2
            far += numbers["tint"] * (1 - f0 - (1 - f0) * grazing) * geometry.ggx(*numbers["roughness"])[:, None]
    return np.asarray(np.where(geometry.far[:, None], far, near))


@pytest.mark.parametrize("material", [PLASTIC, BRUSHED, GOLD, FOIL, PAPER], ids=named)
def test_materialx(tmp_path: Path, material: Material) -> None:
    cost = materialx.write(material, tmp_path / "a.mtlx")
    samples = pairs_of(material, CHECK_LOG2, seed=1).samples
    assert_costs(samples, materialx_f(ET.parse(tmp_path / "a.mtlx").getroot(), Geometry(samples)), cost.share)
