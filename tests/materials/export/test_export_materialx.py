"""MaterialX documents are valid, every node is known, and shaders can be generated from them."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.materials.document import Material
from lambent.materials.export.materialx import document, likeness, write
from tests.materials.export.export_materials import ALL, BRUSHED, FOIL, GOLD

mx = pytest.importorskip("MaterialX")


@pytest.fixture(scope="module")
def library():
    loaded = mx.createDocument()
    assert mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), loaded)
    return loaded


@pytest.mark.parametrize("name", ALL)
def test_documents_are_valid_and_resolve(name, library, tmp_path):
    path = tmp_path / "material.mtlx"
    write(ALL[name], path)
    read = mx.createDocument()
    mx.readFromXmlFile(read, str(path))
    read.setDataLibrary(library)
    assert read.validate() == (True, "")
    nodes = [element for element in read.traverseTree() if element.isA(mx.Node)]
    assert all(node.getNodeDef() is not None for node in nodes)
    assert len(read.getMaterialNodes()) == 1
    assert 'name="4' not in path.read_text()


def test_a_shader_can_be_generated(library, tmp_path):
    from MaterialX import PyMaterialXGenGlsl as glsl
    from MaterialX import PyMaterialXGenShader as generate

    read = mx.createDocument()
    mx.readFromXmlString(read, document("foil", likeness(FOIL)[0]))
    read.setDataLibrary(library)
    generator = glsl.GlslShaderGenerator.create()
    context = generate.GenContext(generator)
    context.registerSourceCodeSearchPath(mx.getDefaultDataSearchPath())
    shader = generator.generate("foil", read.getMaterialNodes()[0], context)
    source = shader.getSourceCode("pixel")
    assert "mx_generalized_schlick_bsdf" in source and "mx_dielectric_bsdf" in source


def test_numbers_stay_near_the_material():
    found, cost = likeness(BRUSHED)
    first, second = found.parts
    assert first.mx > first.my and second.mx > second.my  # t is the tangent in both
    assert cost.share["cuberoot"] < 0.3
    found, cost = likeness(GOLD)
    (gold,) = found.parts
    assert gold.mx == pytest.approx(0.2, rel=0.15) and gold.mx == gold.my
    np.testing.assert_allclose(gold.colour, (1, 0.8, 0.4), atol=0.15)
    assert cost.share["cuberoot"] < 0.1
    assert likeness(Material(kd=0.3, kt_d=0.1))[1].errors == {"l1": 0, "l2_ngan": 0, "cuberoot": 0, "log": 0}
