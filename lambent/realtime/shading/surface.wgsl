// Materials (group 1), objects and the light around them (group 2), and the light from a direction; look_up.wgsl is the
// shader of the look-up in use (lambent/realtime/incident), which may replace incident_light.wgsl.

#include "lobes.wgsl"
#include "scattering.wgsl"
#include "colour.wgsl"
#include "incident.wgsl"
#include "look_up.wgsl"
#include "incident_light.wgsl"
#include "material.wgsl"

override SAMPLES: u32 = 7u; // n per lobe
override LOBES: u32 = 1u;
override STRAIGHT: bool = false; // transmitted light passes straight through and is already drawn (glazing.wgsl)

struct PlacedLobe {
    lobe: LambentLobe,
    border: vec2f, // slopes along t and b outside which 1 % of the lobe lies
    level: f32,    // of the prefiltered cube map for the roughness
    unused: f32,
}

struct Object {
    centre: vec4f, // of the probe; w: half the log2 of texels per unit area of the cube [-1, 1]^3
    emission: vec4f,
    irradiance: array<vec4f, 3>, // nine: luminance from the probe alone (probe_irradiance), 0 if unused; then even niches
    borders: array<vec4f, 2>, // of a part, see ObjectRecord of store/contract.py
    sky_change: vec4f, // ratio of the sky to the baked sky; w: 1 if the light map has shares
}

@group(1) @binding(1) var<storage, read> lobes: array<PlacedLobe>;
@group(1) @binding(2) var<storage, read> samples: array<vec4f>; // see patterns.py; then rows of curves

@group(2) @binding(0) var<uniform> object: Object;
@group(2) @binding(1) var radiance_cube: texture_cube<f32>;

fn lambent_row(i: u32) -> vec4f {
    return samples[i];
}

// A place on the light map: its coordinates, and their gradients, 1/m, along the surface.
struct OnMap {
    uv2: vec2f,
    u: vec3f,
    v: vec3f,
}

// Shading frame and position of a pixel, and its values of the material's textures; n faces the viewer, and
// painted.widening is along t and b.
struct Surface {
    t: vec3f,
    b: vec3f,
    n: vec3f,
    x: vec3f,      // position about the probe's centre
    pixel: vec2u,
    painted: Painted,
    shares: vec4f, // (b, a): the share a + b.w of the probe's light along w arrives at the pixel
    niche: vec3f,  // additional light of near walls, the same from all directions
    points: vec4u,  // points of a light field near the pixel
    exit: vec4f,    // glass with a light field: the face behind
}

// A lobe with its numbers changed by textures: the samples' slopes, made for the material's mx and my, grow by `growth`
// along t and b, and their solid angles by growth.x growth.y.
struct LobeHere {
    lobe: LambentLobe,
    growth: vec2f,
    half_log2_growth: f32, // log2(growth.x growth.y)/2
}

fn lobe_here(index: u32, s: Surface) -> LobeHere {
    var lobe = lobes[index].lobe;
    if ((TEXTURES & 14u) == 0u) { return LobeHere(lobe, vec2f(1.0), 0.0); }
    lobe.k *= s.painted.specular;
    let m = vec2f(lobe.mx, lobe.my);
    let factor = clamp(s.painted.roughness, 0.001 / min(m.x, m.y), 4.0 / max(m.x, m.y)); // bounds of a document
    let here = sqrt(factor * factor * m * m + s.painted.widening);
    lobe.mx = here.x;
    lobe.my = here.y;
    let growth = here / m;
    return LobeHere(lobe, growth, 0.5 * log2(growth.x * growth.y));
}

fn to_world(s: Surface, w: vec3f) -> vec3f {
    return w.x * s.t + w.y * s.b + w.z * s.n;
}

// Near surfaces occlude most of a probe's light in a niche. The light map's irradiance e, relative to the irradiance
// from the probe alone, gives the share that arrives; the latter is known to the second band of harmonics.
fn specular_occlusion(n: vec3f, e: vec3f) -> f32 {
    let i = object.irradiance;
    let whole = dot(i[0], vec4f(1.0, n)) + dot(i[1], vec4f(n.xy * n.yz, 3.0 * n.z * n.z - 1.0, n.x * n.z))
        + i[2].x * (n.x * n.x - n.y * n.y);
    return select(1.0, clamp(luminance(e) / max(whole, 1e-6), 0.0, 1.0), whole > 0.0);
}

const MOST_SHARE = 2.0; // as in store/occlusion.py

// Share of the probe's light along world direction w that arrives.
fn arriving(s: Surface, w: vec3f) -> f32 {
    return clamp(dot(s.shares, vec4f(w, 1.0)), 0.0, MOST_SHARE);
}

// Share of the probe's light, the same for all directions, and light of the niche that occludes the rest (Scaling of
// baking/probes/selection.py), for the light map's irradiance e.
fn in_niche(found: Surface, e: vec3f) -> Surface {
    var s = found;
    let share = specular_occlusion(s.n, e);
    let even = object.irradiance[2].y;
    s.shares = vec4f(0.0, 0.0, 0.0, mix(share, share * share, even));
    s.niche = even * (1.0 - share) / LAMBENT_PI * e;
    return s;
}

// Level at which a texel has the solid angle omega, seen from the surface; half_log2_omega = log2(omega)/2.
// On the cube that is omega t^2/d^2 (seen from the probe, d away) / cos b^3 texels (4.16, 4.17), cos b = max|w|/|w|.
fn level_of_look_up(found: LookUp, half_log2_omega: f32) -> f32 {
    let major = max_norm(found.direction);
    let stretch = found.t * found.t * length(found.direction) / (major * major * major);
    return max(half_log2_omega + 0.5 * log2(max(stretch, 1e-20)) + object.centre.w, 0.0);
}

// A sample of a lobe: wi is wo mirrored about the half vector h; not `seen` below the horizon.
struct Sample {
    h: vec3f,
    cos_d: f32,
    wi: vec3f,
    seen: bool,
}

fn sample_about(wo: vec3f, h: vec3f) -> Sample {
    let cos_d = dot(wo, h);
    let wi = lambent_mirrored(wo, h);
    return Sample(h, cos_d, wi, cos_d > LAMBENT_COS_MIN && wi.z > LAMBENT_COS_MIN);
}

// Half the log2 of the solid angle c (wo.h) h_z^3 sr of a row (slopes, half the log2 of the filter constant c, weight)
// of a table of samples.
fn half_log2_omega(row: vec4f, at: Sample, here: LobeHere) -> f32 {
    return row.z + here.half_log2_growth + 0.5 * log2(at.cos_d * at.h.z * at.h.z * at.h.z);
}

// f cos_i / pdf for wi, wo on the upper side; the distribution D cancels and is never computed.
fn gain(lobe: LambentLobe, wi: vec3f, wo: vec3f, h: vec3f) -> vec3f {
    return lambent_tint(dot(wo, h), lobe) * (wi.z / (lambent_cosine_power(wi, wo, lobe) * h.z));
}

// The tints of the fixed samples of a lobe, linear in cos_d: through the tints of half vectors one standard deviation
// of the lobe before and behind the normal (Gauss's nodes). Curves are looked up twice a lobe, not twice a sample.
struct Tints {
    middle: vec3f,
    rise: vec3f,
}

fn tints(lobe: LambentLobe, wo: vec3f) -> Tints {
    if !LAMBENT_CURVES { return Tints(); }
    let reach = max(lobe.spread * sqrt(0.5 * lobe.mx * lobe.my * (1.0 - min(wo.z * wo.z, 1.0))), 0.01);
    let ends = clamp(wo.z + vec2f(-reach, reach), vec2f(0.0), vec2f(1.0));
    let low = lambent_tint(ends.x, lobe);
    let rise = (lambent_tint(ends.y, lobe) - low) / (ends.y - ends.x);
    return Tints(low + (wo.z - ends.x) * rise, rise);
}

// `gain` of a fixed sample.
fn sample_gain(along: Tints, lobe: LambentLobe, at: Sample, wo: vec3f) -> vec3f {
    if !LAMBENT_CURVES { return gain(lobe, at.wi, wo, at.h); }
    let tint = max(along.middle + (at.cos_d - wo.z) * along.rise, vec3f(0.0));
    return tint * (at.wi.z / (lambent_cosine_power(at.wi, wo, lobe) * at.h.z));
}

// Diffuse light towards cos_o from the irradiance on this side and on the other (4.1). A kd that depends on both
// directions is kd t(cos_o) times a mean over the light, which is 1 under uniform light, and is assumed 1 for all light.
fn diffuse_light(cos_o: f32, e_here: vec3f, e_beyond: vec3f, painted: Painted) -> vec3f {
    var seen = select(1.0, lambent_under_fresnel(cos_o), material.kd.w > 0.5);
    if LAMBENT_CURVES && material.kt_d.w > 0.0 {
        seen = lambent_at_cosine(u32(material.kt_d.w), cos_o).x;
    }
    return painted.diffuse * (material.kd.rgb * seen * e_here + material.kt_d.rgb * e_beyond) / LAMBENT_PI;
}

// Maps a direction between reflection and the lobe's side, an involution: transmission is reflection mirrored at the
// surface, retro-reflection is reflection mirrored about n.
fn on_side(lobe: LambentLobe, w: vec3f) -> vec3f {
    return vec3f(select(w.xy, -w.xy, lobe.retro == 1u), select(w.z, -w.z, lobe.side == LAMBENT_TRANSMISSION));
}

// Whether a lobe contributes light.
fn lobe_adds(lobe: LambentLobe) -> bool {
    return !STRAIGHT || lobe.side == LAMBENT_REFLECTION;
}

// Whether a planar reflector's view serves the lobe; other lobes use the probe's light.
fn lobe_mirrors(lobe: LambentLobe) -> bool {
    return lobe.side == LAMBENT_REFLECTION && lobe.retro == 0u;
}
