// Materials (group 1), objects and the light around them (group 2), and how a direction finds its light.

#include "lobes.wgsl"
#include "material.wgsl"

override SAMPLES: u32 = 7u; // n per lobe
override LOBES: u32 = 1u;
override PLANES: u32 = 0u;
override LOOKUP: u32 = 0u; // 0 plain, 1 bounding planes, 2 distance map

// Matches LOBE_DTYPE in frame_data.py.
struct PlacedLobe {
    lobe: LambentLobe,
    border: vec2f, // slopes along t and b outside which 1 % of the lobe lies
    level: f32,    // of the prefiltered cube that fits the roughness
    unused: f32,
}

struct Object {
    centre: vec4f, // of the probe; w: half the log2 of texels per unit area of the cube [-1, 1]^3
    emission: vec4f,
    irradiance: array<vec4f, 3>, // luminance that the probe alone would give, see probe_irradiance; 0 where it is not asked
}

@group(1) @binding(1) var<storage, read> lobes: array<PlacedLobe>;
@group(1) @binding(2) var<storage, read> samples: array<vec4f>; // see patterns.py

@group(2) @binding(0) var<uniform> object: Object;
@group(2) @binding(1) var<storage, read> planes: array<vec4f>; // n and n.c + d, about the probe's centre c
@group(2) @binding(2) var radiance_cube: texture_cube<f32>;
@group(2) @binding(3) var inverse_depth_cube: texture_cube<f32>; // 1/max(|x|, |y|, |z|) of what is seen, 1/m

// Shading frame and place of a pixel, and what the material's pictures say there; n is turned to the viewer, and
// painted.widening is along t and b.
struct Surface {
    t: vec3f,
    b: vec3f,
    n: vec3f,
    x: vec3f,      // position about the probe's centre
    pixel: vec2u,
    painted: Painted,
    open: f32,     // share of the probe's light that reaches the pixel
}

// A lobe where the pictures have changed its numbers: the samples, of slopes of the material's mx and my, grow by
// `growth` along t and b, and the solid angle they stand for by its product.
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

// Where to look in the probe (not unit), and the distance from the surface to what is seen there.
struct Lookup {
    direction: vec3f,
    t: f32,
}

fn max_norm(v: vec3f) -> f32 {
    let a = abs(v);
    return max(a.x, max(a.y, a.z));
}

const PLANE_ACTIVE_M = 1e-6; // planes that a point is nearer to, or behind, are left out

// Nearest hit with the bounding planes, as seen from the probe's centre (thesis 4.4.1). 1/t is the largest
// approach/height over the planes; the reciprocal height is the same for all samples of a pixel, so it is hoisted.
fn planes_lookup(x: vec3f, w: vec3f) -> Lookup {
    var nearness = 0.0;
    for (var i = 0u; i < PLANES; i++) {
        let plane = planes[i];
        let height = dot(plane.xyz, x) + plane.w;
        nearness = max(nearness, -dot(plane.xyz, w) * select(0.0, 1.0 / height, height > PLANE_ACTIVE_M));
    }
    if (nearness < 1e-6) { return Lookup(w, 1.0); }
    return Lookup(x + w / nearness, 1.0 / nearness);
}

// Depth of the point relative to what the probe sees behind it: < 1 in front, > 1 behind.
fn relative_depth(p: vec3f) -> f32 {
    return max_norm(p) * textureSampleLevel(inverse_depth_cube, linear_sampler, p, 0.0).r;
}

// Distance impostor (Szirmay-Kalos et al. 2005): steps that grow along the ray until it is behind what the probe sees,
// then the secant. 1/depth is linear over planes, so walls are met exactly.
fn distance_lookup(x: vec3f, w: vec3f) -> Lookup {
    const STEPS = 12u;
    var near = 0.0;
    var f_near = -1.0; // the surface itself lies in front of what the probe sees
    let reach = 1.0 / max(textureSampleLevel(inverse_depth_cube, linear_sampler, w, 0.0).r, 1e-4);
    var far = max(length(x), 0.05 * reach);
    var f_far = -1.0;
    for (var i = 0u; i < STEPS; i++) {
        f_far = relative_depth(x + far * w) - 1.0;
        if (f_far >= 0.0) { break; }
        near = far;
        f_near = f_far;
        far *= 1.6;
    }
    if (f_far < 0.0) { return Lookup(w, 1.0); }
    for (var i = 0u; i < 3u; i++) {
        let t = mix(near, far, clamp(f_near / min(f_near - f_far, -1e-9), 0.05, 0.95));
        let f = relative_depth(x + t * w) - 1.0;
        if (f < 0.0) { near = t; f_near = f; } else { far = t; f_far = f; }
    }
    let t = mix(near, far, clamp(f_near / min(f_near - f_far, -1e-9), 0.0, 1.0));
    return Lookup(x + t * w, max(t, 1e-4));
}

fn find(x: vec3f, w: vec3f) -> Lookup {
    if (LOOKUP == 1u) { return planes_lookup(x, w); }
    if (LOOKUP == 2u) { return distance_lookup(x, w); }
    return Lookup(w, 1.0);
}

fn to_world(s: Surface, w: vec3f) -> vec3f {
    return w.x * s.t + w.y * s.b + w.z * s.n;
}

// Near things hide from a niche most of what the probe sees. The irradiance of the light map, e, knows how much; the
// probe's own is known to the second band of harmonics (bake/probe_modes.py).
fn open_share(n: vec3f, e: vec3f) -> f32 {
    let i = object.irradiance;
    let whole = dot(i[0], vec4f(1.0, n)) + dot(i[1], vec4f(n.xy * n.yz, 3.0 * n.z * n.z - 1.0, n.x * n.z))
        + i[2].x * (n.x * n.x - n.y * n.y);
    return select(1.0, clamp(dot(e, vec3f(0.2126, 0.7152, 0.0722)) / max(whole, 1e-6), 0.0, 1.0), whole > 0.0);
}

// Light from local direction w, averaged over the solid angle omega sr; half_log2_omega = log2(omega)/2.
// On the cube that is omega t^2/d^2 (seen from the probe, d away) / cos b^3 texels (4.16, 4.17), cos b = max|w|/|w|.
fn incident(s: Surface, w: vec3f, half_log2_omega: f32) -> vec3f {
    let found = find(s.x, to_world(s, w));
    let major = max_norm(found.direction);
    let stretch = found.t * found.t * length(found.direction) / (major * major * major);
    let level = half_log2_omega + 0.5 * log2(max(stretch, 1e-20)) + object.centre.w;
    return s.open * textureSampleLevel(radiance_cube, linear_sampler, found.direction, max(level, 0.0)).rgb;
}

fn incident_at_level(s: Surface, w: vec3f, level: f32) -> vec3f {
    let found = find(s.x, to_world(s, w));
    return s.open * textureSampleLevel(radiance_cube, linear_sampler, found.direction, level).rgb;
}

// A sample of a lobe: wi is wo mirrored about the half vector h; not `seen` where the lobe does not go.
struct Sample {
    h: vec3f,
    cos_d: f32,
    wi: vec3f,
    seen: bool,
}

fn sample_about(wo: vec3f, h: vec3f) -> Sample {
    let cos_d = dot(wo, h);
    let wi = 2.0 * cos_d * h - wo;
    return Sample(h, cos_d, wi, cos_d > LAMBENT_COS_MIN && wi.z > LAMBENT_COS_MIN);
}

fn half_vector_of(slope: vec2f) -> vec3f {
    return vec3f(slope, 1.0) * inverseSqrt(1.0 + dot(slope, slope));
}

// f cos_i / pdf for wi, wo on the upper side; the distribution D cancels and is never computed.
fn gain(lobe: LambentLobe, wi: vec3f, wo: vec3f, h: vec3f) -> vec3f {
    return lambent_tint(dot(wo, h), lobe) * (wi.z / (lambent_cosine_power(wi, wo, lobe) * h.z));
}

// Diffuse light towards cos_o from the irradiance on this side and on the other (4.1). A coupled kd is kd t(cos_o) times
// the mean of (21/20) t(cos_i) over the light, which is 1 under uniform light and taken as 1 under any.
fn diffuse_light(cos_o: f32, e_here: vec3f, e_beyond: vec3f, painted: Painted) -> vec3f {
    let seen = select(1.0, lambent_under_fresnel(cos_o), material.kd.w > 0.5);
    return painted.diffuse * (material.kd.rgb * seen * e_here + material.kt_d.rgb * e_beyond) / LAMBENT_PI;
}

// A direction of the upper side on the lobe's side: transmission is reflection mirrored at the surface.
fn on_side(lobe: LambentLobe, w: vec3f) -> vec3f {
    return vec3f(w.xy, select(w.z, -w.z, lobe.side == LAMBENT_TRANSMISSION));
}
