"""glTF files are valid, evaluate as claimed, and have the right brushing direction."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.materials.document import Lobe, Material
from lambent.materials.export.gltf import write
from lambent.materials.measured.inspecting.synthetic import Setup, synthesise
from tests.materials.export.export_materials import ALL, PLASTIC

ROOT = Path(__file__).parents[3]
VALIDATOR = ROOT / ".venv" / "node" / "node_modules" / "gltf-validator"
ASK = """
const validator = require(process.argv[1]), fs = require("fs");
const all = process.argv.slice(2).map(f => validator.validateBytes(new Uint8Array(fs.readFileSync(f))));
Promise.all(all).then(reports => console.log(JSON.stringify(reports.map(r => r.issues))));
"""


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("gltf")
    paths = {}
    for i, (name, material) in enumerate(ALL.items()):
        paths[name] = folder / f"{i}{('.gltf', '.glb')[i % 2]}"
        write(material, paths[name])
    return paths


# told before the files are written, which takes long
@pytest.mark.skipif(
    shutil.which("node") is None or not VALIDATOR.is_dir(),
    reason="gltf-validator is not installed: `python3 run.py test` does it where there is npm",
)
def test_the_validator_finds_nothing(files):
    command = ["node", "-e", ASK, str(VALIDATOR), *map(str, files.values())]
    answer = subprocess.run(command, capture_output=True, text=True, check=True)
    for name, issues in zip(files, json.loads(answer.stdout), strict=True):
        assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), (name, issues["messages"])


def test_trimesh_opens_them(files):
    trimesh = pytest.importorskip("trimesh")
    for path in files.values():
        mesh = trimesh.load(path, force="mesh")
        assert mesh.is_volume or trimesh.Trimesh(mesh.vertices, mesh.faces, process=True).volume > 0
        assert mesh.volume == pytest.approx(4 / 3 * np.pi * 0.1**3, rel=0.01)


@pytest.mark.parametrize(("mx", "my"), [(0.25, 0.05), (0.05, 0.25)])
def test_the_rough_axis_stays_where_it_is(mx, my, tmp_path):
    """Rotation 0 is rough along the tangent, which on the sphere is t; 90 degrees along n x t."""
    path = tmp_path / "x.gltf"
    write(Material(lobes=(Lobe(distribution="ggx", k=0.9, r0=0.9, mx=mx, my=my, alpha=0.4),)), path)
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
        write(table, tmp_path / "x.gltf", lambda *_: None)
