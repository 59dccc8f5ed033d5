// `lamps`: like rings.wgsl, but the probe's small lamps are taken out of the cube map, and each is evaluated under the
// lobe in closed form (lamp_light.wgsl). probe_lamps.py describes the table.

#include "surface.wgsl"
#include "albedo_factor.wgsl"
#include "lamp_light.wgsl"

@group(2) @binding(1) var cleaned_cubes: texture_cube_array<f32>; // without 0, 1, ... groups of lamps
@group(2) @binding(2) var<uniform> lamps: array<vec4f, 130>;

override LAYERS: u32 = 2u; // 1 if no lobe mixes two cube maps, which shortens the loop

const LAMP_HEAD = 2u;
const LAMP_ROWS = 4u;
const FIRST_OUT = 0.47;
const LAST_OUT = 0.54;

// Number of groups taken out of the cube map for a lobe; a fraction is the share of the last group (probe_lamps.py).
fn groups_out(lobe: LambentLobe) -> f32 {
    let share = smoothstep(vec4f(FIRST_OUT), vec4f(LAST_OUT), lobe.spread * sqrt(lobe.mx * lobe.my) / lamps[0]);
    return dot(share, vec4f(1.0));
}

fn lamps_light(lobe: LambentLobe, wo: vec3f, s: Surface, out: f32) -> vec3f {
    let count = select(0u, u32(lamps[1][u32(max(ceil(out), 1.0)) - 1u]), out > 0.0);
    let sides = on_side(lobe, vec3f(1.0));
    let to_local = transpose(mat3x3f(sides.x * s.t, sides.y * s.b, sides.z * s.n));
    var sum = vec3f(0.0);
    for (var k = 0u; k < count; k++) {
        let row = LAMP_HEAD + k * LAMP_ROWS;
        let place = lamps[row];
        let flux = lamps[row + 1u];
        let first = lamps[row + 2u];
        let second = lamps[row + 3u];
        let to = place.xyz - place.w * s.x;
        let per_t = inverseSqrt(dot(to, to) + second.w); // slightly short, like the mean direction of a near lamp
        let wi = (to_local * to) * per_t;
        let facing = first.w * abs(dot(cross(first.xyz, second.xyz), to)) * per_t * per_t * per_t;
        let a = rejection((to_local * first.xyz) * per_t, wi);
        let b = rejection((to_local * second.xyz) * per_t, wi);
        let light = lambent_lamp_response(lobe, wo, wi, a, b);
        let share = clamp(out - flux.w, 0.0, 1.0) * select(1.0, facing, place.w > 0.0);
        sum += share * arriving(s, to * per_t) * flux.rgb * light;
    }
    return sum;
}

fn cleaned_light(s: Surface, w: vec3f, half_log2_omega: f32, layer: u32) -> vec3f {
    let along = to_world(s, w);
    let found = incident_look_up(s.x, along);
    let level = level_of_look_up(found, half_log2_omega);
    return s.niche + arriving(s, along) * textureSampleLevel(cleaned_cubes, linear_sampler, found.direction, layer, level).rgb;
}

fn integrate(index: u32, wo: vec3f, s: Surface) -> vec3f {
    let here = lobe_here(index, s);
    let lobe = here.lobe;
    let first = index * (SAMPLES + FACTOR_ROWS);
    let out = groups_out(lobe);
    let layer = u32(out);
    let mixed = fract(out);
    let tint = tints(lobe, wo);
    var sum = vec3f(0.0);
    for (var i = 0u; i < LAYERS; i++) {
        let share = select(select(1.0 - mixed, mixed, i == 1u), 1.0, LAYERS == 1u);
        for (var k = 0u; k < SAMPLES; k++) {
            let q = samples[first + k];
            let at = sample_about(wo, lambent_from_slopes(q.xy * here.growth));
            if (!at.seen) { continue; }
            let light = cleaned_light(s, on_side(lobe, at.wi), half_log2_omega(q, at, here), min(layer + i, textureNumLayers(cleaned_cubes) - 1u));
            sum += share * q.w * sample_gain(tint, lobe, at, wo) * light;
        }
    }
    return sum * (albedo_factor(first + SAMPLES, wo.z) / f32(SAMPLES)) + lamps_light(lobe, wo, s, out);
}
