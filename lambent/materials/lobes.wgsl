// Parts of the Kurt lobe for shaders. lobes.py is the reference; tests compare the two.
//
// Conventions (those of lobes.py): local shading frame (t, b, n), n = +z; unit directions away from the surface;
// wi to the light, wo to the viewer, both on the upper side: for transmission wi is mirrored at the surface, for a retro
// lobe about n. f is in 1/sr and without the cosine.
// No bindings, no entry points: a pure include. Every name begins with lambent_ / Lambent / LAMBENT_.
//
// Sources: Kurt, Szirmay-Kalos & Krivanek 2010; thesis M, equations in parentheses; GGX: Walter et al. 2007, eq. 33.
//
// Hazards in float32: 1 - (n.h)^2 and tan^2(theta_h) cancel at low roughness, so everything is built from hx^2, hy^2,
// hz^2. The half vector itself carries an absolute error of 6e-8, so f of a lobe of slope m carries a relative error
// of about 1e-7 tan(theta_h) / m^2: harmless at m = .05, a few per cent at the foot of a lobe of m = .001.

const LAMBENT_PI: f32 = 3.14159265358979;
const LAMBENT_COS_MIN: f32 = 1e-4;
const LAMBENT_REFLECTION: u32 = 0u;
const LAMBENT_TRANSMISSION: u32 = 1u;
const LAMBENT_BECKMANN: u32 = 0u;
const LAMBENT_GGX: u32 = 1u;
const LAMBENT_CURVE: u32 = 2u;

// Written from LOBE_DTYPE of lambent.materials.shader_layout.
struct LambentLobe {
    k: vec3f,           // RGB coefficient
    mx: f32,            // slope roughness along t
    r0: vec3f,          // Fresnel reflectance at normal incidence, RGB
    my: f32,            // slope roughness along b
    alpha: f32,         // exponent of the cosine product, 0..1
    side: u32,          // LAMBENT_REFLECTION or LAMBENT_TRANSMISSION
    distribution: u32,  // LAMBENT_BECKMANN, LAMBENT_GGX or LAMBENT_CURVE
    retro: u32,         // 1: centred on the direction to the light
    shape_row: u32,     // of a curve, first row of its shape in the table of lambent_row (scattering.wgsl)
    fresnel_row: u32,   // likewise of its Fresnel reflectances; 0: Schlick's approximation
    widening: f32,      // factor on a lamp's extent that widens the lobe as much (lamp_light.wgsl)
    spread: f32,        // width over that of a Beckmann lobe of mx and my
}

// normalize(wi + wo); finite but meaningless for opposite directions.
fn lambent_half_vector(wi: vec3f, wo: vec3f) -> vec3f {
    let sum = wi + wo;
    return sum * inverseSqrt(max(dot(sum, sum), 1e-20));
}

// Schlick's approximation (2.9); cos_d in [0, 1].
fn lambent_fresnel(cos_d: f32, r0: vec3f) -> vec3f {
    let m = max(1.0 - cos_d, 0.0);
    let m2 = m * m;
    return r0 + (1.0 - r0) * (m2 * m2 * m);
}

// 1 - (1 - cos)^5, without cancellation at grazing: Schlick transmittance relative to that at cos = 1.
fn lambent_under_fresnel(cosine: f32) -> f32 {
    let c = min(cosine, 1.0);
    let m = 1.0 - c;
    return c * (1.0 + m * (1.0 + m * (1.0 + m * (1.0 + m))));
}

// The unit half vector of slopes along t and b.
fn lambent_from_slopes(slope: vec2f) -> vec3f {
    return vec3f(slope, 1.0) * inverseSqrt(dot(slope, slope) + 1.0);
}

// w mirrored about the unit vector `about`: 2 (w.a) a - w (4.8).
fn lambent_mirrored(w: vec3f, about: vec3f) -> vec3f {
    return 2.0 * dot(w, about) * about - w;
}

fn lambent_cosine_power(wi: vec3f, wo: vec3f, lobe: LambentLobe) -> f32 {
    return pow(max(abs(wi.z * wo.z), 1e-12), lobe.alpha);
}
