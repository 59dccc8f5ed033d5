// The estimate on planes as published (thesis M, 4.24, 4.25, 4.5.3): several rings within the lobe, one filter size per
// pixel: the ellipse through the lobe's two extreme directions, projected into the buffer, divided by n.

#include "planar.wgsl"

override FORMULA: u32 = 25u;

// Samples that the buffer does not hold, for one look-up in the probe in their mean direction.
struct Beyond {
    gain: vec3f,
    w: vec3f,
    omega: f32, // sr
}

fn from_probe(s: Surface, beyond: Beyond) -> vec3f {
    if (beyond.omega <= 0.0) { return vec3f(0.0); }
    return beyond.gain * incident(s, normalize(beyond.w), 0.5 * log2(beyond.omega));
}

fn reflected(wo: vec3f, slope: vec2f) -> vec3f {
    return lambent_mirrored(wo, lambent_from_slopes(slope));
}

fn integrate_planar(index: u32, wo: vec3f, s: Surface, place: Place) -> vec4f {
    let here = lobe_here(index, s);
    let lobe = here.lobe;
    let border = lobes[index].border * here.growth;
    let centre = project(place.q + place.t * to_world(s, vec3f(-wo.xy, wo.z))).xy;
    let a = length(find_hit(place, to_world(s, reflected(wo, vec2f(border.x, 0.0)))).texel - centre);
    let b = length(find_hit(place, to_world(s, reflected(wo, vec2f(0.0, border.y)))).texel - centre);
    let level = 0.5 * log2(clamp(LAMBENT_PI * a * b / f32(SAMPLES), 1e-6, 1e12));
    let omega = 4.0 * LAMBENT_PI * lobe.mx * lobe.my * wo.z / f32(SAMPLES);
    var beyond = Beyond(vec3f(0.0), vec3f(0.0), 0.0);
    var sum = vec3f(0.0);
    var weights = vec3f(0.0);
    for (var k = 0u; k < SAMPLES; k++) {
        let sample = samples[index * SAMPLES + k];
        let at = sample_about(wo, lambent_from_slopes(sample.xy * here.growth));
        if (!at.seen) { continue; }
        let p = sample.w / (at.h.z * at.h.z * at.h.z * at.cos_d);
        let q = gain(lobe, at.wi, wo, at.h) / at.wi.z;
        let hit = find_hit(place, to_world(s, at.wi));
        let inside = hit.inside;
        let norm = select(q, vec3f(1.0), FORMULA == 24u) * (at.wi.z * p);
        let weight = norm * q * at.wi.z;
        sum += buffer_sample(hit.texel, level) * inside * weight;
        let share = 1.0 - inside;
        beyond = Beyond(beyond.gain + share * weight, beyond.w + share * at.wi, beyond.omega + share * omega);
        weights += norm;
    }
    sum += from_probe(s, beyond);
    return vec4f(select(vec3f(0.0), sum / max(weights, vec3f(1e-30)), weights > vec3f(1e-30)), 0.0);
}
