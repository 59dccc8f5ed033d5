"""Smooth normals across hard edges: where one turns from a viewer whom its face sees, it is bent back to him.

The path tracer (baking/bsdfs) bends as the renderer does (`shading_frame` of realtime/shading/shade.wgsl).
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import lambent.realtime
from lambent.core.geometry.directions import normalize
from lambent.core.views.camera import Camera
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.scenes.scene import ConstantEnvironment, Mesh, Scene, SceneObject

pytestmark = pytest.mark.usefixtures("mi")
GLOSSY = Material(kd=(0.2, 0.3, 0.4), lobes=(Lobe(mx=0.4, my=0.4, k=0.5, r0=0.3),))


def interactions(mi, flat, shading, wi):
    """Surface interactions at triangles of normals `flat`, with shading normals, seen from wi: (n, 3) in the world."""
    si = mi.SurfaceInteraction3f()
    si.n = mi.Normal3f(*flat.T)
    si.sh_frame = mi.Frame3f(mi.Normal3f(*shading.T))
    si.wi = si.to_local(mi.Vector3f(*wi.T))
    return si


def test_the_bsdf_sees_a_normal_bent_as_the_shader_bends_it(mi):
    """n = normalize(n + max(.1 - n.v, 0) v) on the side that the viewer sees, and the numpy model about it."""
    from lambent.baking.bsdfs.material_plugin import material_dict
    from lambent.baking.bsdfs.textured import GRAZING

    rng = np.random.default_rng(0)
    count = 4000
    flat = np.repeat([[0.0, 0.0, 1.0]], count, axis=0)
    shading = normalize(rng.normal(size=(count, 3)) * (1, 1, 0.3) + (0, 0, 0.8))
    view = normalize(rng.normal(size=(count, 3)))
    light = normalize(rng.normal(size=(count, 3)))
    kept = (np.abs(view[:, 2]) > GRAZING) & (shading[:, 2] > 0.05) & (np.abs((shading * view).sum(axis=1)) > 0.01)
    flat, shading, view, light = (a[kept].astype(np.float32) for a in (flat, shading, view, light))
    side = np.sign(view[:, 2:])
    given = shading * side
    cosine = (given * view).sum(axis=1, keepdims=True)
    bent = normalize(given + np.maximum(GRAZING - cosine, 0) * view) * side
    assert ((cosine < 0).mean() > 0.1) and ((cosine > GRAZING).mean() > 0.3)
    t = normalize(np.cross(bent, np.array([0.31, 0.52, 0.8])))
    frame = np.stack([t, np.cross(bent, t), bent], axis=1)
    wo, wi = (np.einsum("nij,nj->ni", frame, w) for w in (view, light))
    expected = MaterialBSDF(GLOSSY).eval(wi, wo) * np.abs(wi[:, 2:])
    si = interactions(mi, flat, shading, view)
    found = mi.load_dict(material_dict(GLOSSY)).eval(mi.BSDFContext(), si, si.to_local(mi.Vector3f(*light.T)))
    np.testing.assert_allclose(np.array(found).T, expected, rtol=2e-3, atol=1e-5)


def test_both_bend_to_the_same_cosine():
    from lambent.baking.bsdfs.textured import GRAZING

    shader = (Path(lambent.realtime.__file__).parent / "shading" / "shade.wgsl").read_text()
    assert float(re.search(r"const GRAZING = ([\d.]+);", shader)[1]) == GRAZING
    assert "normalize(given + max(GRAZING - dot(given, view), 0.0) * view)" in shader


def test_a_box_with_smooth_normals_has_no_dark_sides():
    """In an even environment of radiance 1, every face returns about kd; without bending a third of them is black."""
    from lambent.baking.reference.path_traced import render_reference

    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float32)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([half for a, b, c, d in quads for half in ((a, b, c), (a, c, d))], np.uint32)
    normals = normalize(corners).astype(np.float32)
    tangents = normalize(np.cross(normals, (0.3, 0.5, 0.8))).astype(np.float32)
    box = Mesh(corners, normals, tangents, corners[:, :2].copy(), faces)
    scene = Scene(
        "box", (SceneObject("box", box, "m"),), {"m": Material(kd=0.5)}, environment=ConstantEnvironment((1.0,) * 3)
    )
    close = Camera("close", (1.6, 1.3, 1.5), (1.0, 0.0, 0.0), fov_y_deg=60.0)
    image, _ = render_reference(scene, close, 48, 48, 256)
    on_box = image[..., 1] < 0.9
    assert on_box.mean() > 0.3
    assert np.quantile(image[on_box][:, 1], 0.02) > 0.25
