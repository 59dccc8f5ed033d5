// `lamps`: as rings.wgsl, with the probe's small lamps outside of the cube map, each under the lobe in closed form
// (lamp_light.wgsl). The table is that of lamps.py.

#include "surface.wgsl"
#include "albedo_factor.wgsl"
#include "lamp_light.wgsl"

@group(2) @binding(1) var cleaned_cubes: texture_cube_array<f32>; // without 0, 1, ... groups of lamps
@group(2) @binding(2) var<storage, read> lamps: array<vec4f>;

const LAMP_HEAD = 2u;
const LAMP_ROWS = 4u;
const FIRST_OUT = 1.0;
const LAST_OUT = 1.6;

// How many groups have left the cube map for a lobe; fractions are shares of the last.
fn groups_out(lobe: LambentLobe) -> f32 {
    let share = smoothstep(vec4f(FIRST_OUT), vec4f(LAST_OUT), min(lobe.mx, lobe.my) / lamps[0]);
    return dot(share, vec4f(1.0));
}

// Share of a lamp that reaches the pixel.
fn lamp_visibility(s: Surface, to_lamp: vec3f) -> f32 {
    return s.occlusion;
}

fn to_local(s: Surface, w: vec3f) -> vec3f {
    return vec3f(dot(w, s.t), dot(w, s.b), dot(w, s.n));
}

fn lamps_light(lobe: LambentLobe, wo: vec3f, s: Surface, out: f32) -> vec3f {
    if (out <= 0.0) { return vec3f(0.0); }
    let count = u32(lamps[1][u32(ceil(out)) - 1u]);
    var sum = vec3f(0.0);
    for (var k = 0u; k < count; k++) {
        let row = LAMP_HEAD + k * LAMP_ROWS;
        let place = lamps[row];
        let flux = lamps[row + 1u];
        let first = lamps[row + 2u];
        let second = lamps[row + 3u].xyz;
        let to = place.xyz - place.w * s.x;
        let extent2 = place.w * (dot(first.xyz, first.xyz) + dot(second, second)); // bounds a lamp that is touched
        let per_t = inverseSqrt(dot(to, to) + extent2);
        let w = normalize(to);
        let normal = cross(first.xyz, second);
        let facing = abs(dot(normal, to)) * inverseSqrt(max(dot(normal, normal), 1e-30));
        let nearer = select(1.0, first.w * facing * per_t * per_t * per_t, place.w > 0.0);
        let a = on_side(lobe, to_local(s, rejection(first.xyz, w) * per_t));
        let b = on_side(lobe, to_local(s, rejection(second, w) * per_t));
        let light = lambent_lamp_response(lobe, wo, on_side(lobe, to_local(s, w)), a, b);
        sum += clamp(out - flux.w, 0.0, 1.0) * nearer * lamp_visibility(s, w) * flux.rgb * light;
    }
    return sum;
}

fn cleaned_light(s: Surface, w: vec3f, half_log2_omega: f32, layer: u32) -> vec3f {
    let found = incident_look_up(s.x, to_world(s, w));
    let level = level_of_look_up(found, half_log2_omega);
    return s.occlusion * textureSampleLevel(cleaned_cubes, linear_sampler, found.direction, layer, level).rgb;
}

fn integrate(index: u32, wo: vec3f, s: Surface) -> vec3f {
    let here = lobe_here(index, s);
    let lobe = here.lobe;
    let first = index * (SAMPLES + FACTOR_ROWS);
    let out = groups_out(lobe);
    let layer = floor(out);
    let mixed = fract(out);
    let layers = select(1u, 2u, mixed > 0.0);
    var sum = vec3f(0.0);
    for (var i = 0u; i < layers; i++) {
        let share = select(1.0 - mixed, mixed, i == 1u);
        for (var k = 0u; k < SAMPLES; k++) {
            let q = samples[first + k];
            let at = sample_about(wo, lambent_from_slopes(q.xy * here.growth));
            if (!at.seen) { continue; }
            let light = cleaned_light(s, on_side(lobe, at.wi), half_log2_omega(q, at, here), u32(layer) + i);
            sum += share * q.w * gain(lobe, at.wi, wo, at.h) * light;
        }
    }
    return sum * (albedo_factor(first + SAMPLES, wo.z) / f32(SAMPLES)) + lamps_light(lobe, wo, s, out);
}
