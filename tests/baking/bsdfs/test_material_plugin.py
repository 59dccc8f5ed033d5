"""The plugin scatters like the numpy model, and a renderer that uses it finds the answers known by hand."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.baking.bsdfs.material_plugin import material_dict
from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from tests.materials.test_curve_lobes import KD_CURVE, curve_lobe
from tests.tools.checks import assert_sampler
from tests.tools.in_mitsuba import InMitsuba, furnace_box, interaction, random_directions, square, vectors

BRUSHED = Lobe(mx=0.3, my=0.07, k=(0.5, 0.6, 0.7), r0=(0.5, 0.6, 0.7), alpha=0.43)
MATERIALS = {
    "diffuse": Material(kd=(0.2, 0.1, 0.3), kt_d=0.4),
    "coupled": Material(kd=(0.2, 0.4, 0.6), kd_coupled=True, kt_d=0.1, lobes=(BRUSHED,)),
    "beckmann": Material(lobes=(BRUSHED,)),
    "ggx": Material(lobes=(BRUSHED.model_copy(update={"distribution": "ggx"}),)),
    "transmission": Material(lobes=(BRUSHED.model_copy(update={"side": "transmission"}),)),
    "retro": Material(kd=0.1, lobes=(BRUSHED.model_copy(update={"retro": True, "alpha": -1.5}),)),
    "curves": Material(
        kd=(0.3, 0.2, 0.1),
        kd_curve=KD_CURVE,
        lobes=(curve_lobe(mx=0.2, my=0.1, alpha=0.2), curve_lobe(mx=0.3, my=0.3, side="transmission")),
    ),
    "mixture": Material(
        kd=(0.1, 0.2, 0.3),
        kt_d=0.1,
        lobes=(BRUSHED, Lobe(side="transmission", distribution="ggx", mx=0.2, my=0.4, k=0.5, r0=0.1, alpha=0.2)),
    ),
}


@pytest.mark.parametrize("name", MATERIALS)
def test_values_densities_and_samples_equal_numpy(mi, name):
    material = MATERIALS[name]
    plugin, model = mi.load_dict(material_dict(material)), MaterialBSDF(material)
    wi, wo = (random_directions(20_000, seed, 0.02) for seed in (1, 2))
    value, density = (np.array(v).T for v in plugin.eval_pdf(mi.BSDFContext(), interaction(wo), vectors(wi)))
    expected = model.eval(wi, wo) * np.abs(wi[:, 2:])
    assert expected.max() > 0.01
    np.testing.assert_allclose(value, expected, rtol=1e-4, atol=1e-12)
    np.testing.assert_allclose(density, model.pdf(wi, wo), rtol=1e-4, atol=1e-12)
    u = np.random.default_rng(4).random((20_000, 3)).astype(np.float32)
    bs, weight = plugin.sample(mi.BSDFContext(), interaction(wo), mi.Float(u[:, 0]), mi.Point2f(u[:, 1:].T))
    value, density = (np.array(v).T for v in plugin.eval_pdf(mi.BSDFContext(), interaction(wo), bs.wo))
    good, weight = np.array(bs.pdf) > 1e-3, np.array(weight).T
    assert good.mean() > 0.5
    np.testing.assert_allclose(np.array(bs.pdf)[good], density[good], rtol=1e-3)
    np.testing.assert_allclose(weight[good] * density[good, None], value[good], rtol=2e-3, atol=1e-6)
    same = np.linalg.norm(np.array(bs.wo).T - model.sample(wo, u), axis=-1) < 1e-4
    assert same.mean() > 0.998  # float32 may choose another component where u_select lies on the border


@pytest.mark.parametrize("name", ["retro", "curves", "mixture"])
def test_samples_follow_the_density(mi, name):
    plugin = mi.load_dict(material_dict(MATERIALS[name]))
    assert_sampler(InMitsuba(plugin), 50.0, 23.0, samples=400_000)


def test_closed_box_of_albedo_and_emission_one_half_has_radiance_one(mi):
    image = np.array(mi.render(furnace_box(material_dict(Material(kd=0.5))), spp=256))
    assert image.mean() == pytest.approx(1.0, abs=0.003)


def test_furnace_of_a_mirror_like_sphere_shows_the_models_albedo(mi):
    """A sphere in uniform light of radiance 1 shows the directional albedo at its centre and is black nowhere."""
    material = Material(kd=0.2, lobes=(Lobe(mx=0.2, my=0.2, k=0.9, r0=0.6, alpha=0.3),))
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 2},
            "sensor": {
                "type": "perspective",
                "fov": 1.0,
                "to_world": mi.ScalarTransform4f().look_at([0, 0, 20], [0, 0, 0], [0, 1, 0]),
                "film": {"type": "hdrfilm", "width": 4, "height": 4, "rfilter": {"type": "box"}},
            },
            "light": {"type": "constant", "radiance": 1.0},
            "ball": {"type": "sphere", "bsdf": material_dict(material)},
        }
    )
    seen = np.array(mi.render(scene, spp=4_000)).mean()
    half_width = 19 * np.tan(np.radians(0.5))  # of the square that is seen, on a sphere of radius 1
    cosine = 1 - half_width**2 / 3  # its mean
    expected = MaterialBSDF(material).albedo(direction(np.arccos(cosine), 0.0), samples=200_000).mean()
    assert seen == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("apart_deg", [0.0, 4.0])
def test_a_plane_of_retro_tape_shines_back_at_the_lamp(mi, apart_deg):
    """Lit by a small lamp so many degrees from the camera, a plane shows f cos_i I/d^2."""
    tape = Material(kd=0.1, lobes=(Lobe(retro=True, mx=0.02, my=0.02, k=0.4, r0=1.0, alpha=-1.0),))
    tilted, d = np.radians(35), 10.0
    eye, lamp = direction(tilted, 0.0), direction(tilted - np.radians(apart_deg), 0.0)
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 2},
            "sensor": {
                "type": "perspective",
                "fov": 0.02,
                "to_world": mi.ScalarTransform4f().look_at((d * eye).tolist(), [0, 0, 0], [0, 1, 0]),
                "film": {"type": "hdrfilm", "width": 2, "height": 2, "rfilter": {"type": "box"}},
            },
            "lamp": {"type": "point", "position": (d * lamp).tolist(), "intensity": 3.0},
            "plane": {"type": "rectangle", "bsdf": material_dict(tape)},
        }
    )
    seen = np.array(mi.render(scene, spp=64)).mean()
    expected = MaterialBSDF(tape).eval(lamp, eye).mean() * lamp[2] * 3.0 / d**2
    assert seen == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("degrees", [None, 30.0, -120.0])
def test_vertex_tangent_is_the_brushing_direction(mi, tmp_path, degrees):
    """Evaluated on a mesh with that tangent, the plugin equals numpy in the frame (t, n x t, n).

    Without tangents the frame is that of the surface.
    """
    model, bsdf = MaterialBSDF(MATERIALS["mixture"]), material_dict(MATERIALS["mixture"])
    wo, wi = direction(0.5, 1.0), direction(0.4, 3.9)
    if degrees is None:
        scene = mi.load_dict({"type": "scene", "square": {"type": "rectangle", "bsdf": bsdf}})
    else:
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        scene, frame = square(tmp_path, bsdf, np.eye(3)[:2], (c, s, 0)), np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    si = scene.ray_intersect(mi.Ray3f(mi.Point3f(wo * 2 + [0.1, 0.2, 0]), mi.Vector3f(-wo)))
    if degrees is None:
        frame = np.stack([np.array(v).ravel() for v in (si.sh_frame.s, si.sh_frame.t, si.sh_frame.n)])
    value = si.bsdf().eval(mi.BSDFContext(), si, si.to_local(mi.Vector3f(wi)))
    np.testing.assert_allclose(np.array(value).ravel(), model.eval(frame @ wi, frame @ wo) * wi[2], rtol=1e-4)
    bs, _ = si.bsdf().sample(mi.BSDFContext(), si, mi.Float(0.9), mi.Point2f(0.3, 0.4))
    sampled = frame @ np.array(si.to_world(bs.wo)).ravel()
    np.testing.assert_allclose(sampled, model.sample(frame @ wo, np.array([0.9, 0.3, 0.4])), atol=1e-5)


def test_flags_components_and_switches(mi):
    flags = mi.BSDFFlags
    plugin = mi.load_dict(material_dict(MATERIALS["mixture"]))
    assert plugin.component_count() == 4
    for flag in (flags.DiffuseReflection, flags.DiffuseTransmission, flags.GlossyReflection, flags.GlossyTransmission):
        assert mi.has_flag(plugin.flags(), flag)
    wo, wi = random_directions(1000, 5), random_directions(1000, 6)
    si, whole = interaction(wo), mi.BSDFContext()

    def value(bsdf, context=whole):
        return np.array(bsdf.eval(context, si, mi.Vector3f(wi.T)))

    only_diffuse = mi.load_dict(material_dict(MATERIALS["mixture"].model_copy(update={"lobes": ()})))
    only_lobes = mi.load_dict(material_dict(MATERIALS["mixture"], diffuse=False))
    np.testing.assert_allclose(value(only_diffuse) + value(only_lobes), value(plugin), rtol=1e-4, atol=1e-9)
    parts = []
    for i in range(4):
        context = mi.BSDFContext()
        context.component = i
        parts.append(value(plugin, context))
    np.testing.assert_allclose(sum(parts), value(plugin), rtol=1e-4, atol=1e-9)
    np.testing.assert_allclose(parts[0] + parts[1], value(only_diffuse), rtol=1e-4, atol=1e-9)


def test_sampled_type_names_the_component(mi):
    plugin = mi.load_dict(material_dict(MATERIALS["mixture"]))
    n = 1000
    wo = np.tile(direction(0.3, 0.2), (n, 1))
    u = (np.arange(n) + 0.5) / n
    bs, _ = plugin.sample(mi.BSDFContext(), interaction(wo), mi.Float(u), mi.Point2f(0.3, 0.7))
    index, kind = np.array(bs.sampled_component), np.array(bs.sampled_type)
    assert set(index) == {0, 1, 2, 3} and (np.diff(index.astype(int)) >= 0).all()
    below = np.array(bs.wo).T[:, 2] < 0
    assert (below == ((kind & int(mi.BSDFFlags.Transmission)) != 0)).all()
