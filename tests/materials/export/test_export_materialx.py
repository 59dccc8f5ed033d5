"""MaterialX documents are valid, every node is known, and shaders can be generated from them."""

from __future__ import annotations

import pytest

from lambent.materials.export.materialx import document, likeness, write
from tests.materials.export.export_materials import ALL, FOIL

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
