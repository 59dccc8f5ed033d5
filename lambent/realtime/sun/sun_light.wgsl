// Specular light of the sun's disc: probes and mirrored views do not hold it (realtime/sun/sun_disc.py).

#include "sun_record.wgsl"
#include "sequence.wgsl"
#include "lamp_light.wgsl"

@group(3) @binding(1) var<uniform> sun: Sun;
@group(3) @binding(2) var sun_seen: texture_2d<f32>; // share of its light by pixel, of sun.wgsl

override SUN_SAMPLED: bool = false; // unbiased, by SAMPLES samples of the lobe and as many of the disc
const SUN_SEQUENCE = 32u;           // added to a lobe's number, for samples of the disc
const SUN_LEAST = 1e-4;             // tangent of the radius: of a point, no sample of a lobe would meet anything

fn sun_share(s: Surface) -> vec3f {
    return textureLoad(sun_seen, vec2i(s.pixel), 0).rgb;
}

// A loop for a branch: adapters in software skip loops of no turns alone.
fn sun_light(index: u32, wo: vec3f, s: Surface) -> vec3f {
    let share = sun_share(s);
    let lobe = lobe_here(index, s).lobe;
    var sum = vec3f(0.0);
    for (var i = 0u; i < select(0u, 1u, max_norm(share) > 0.0); i++) {
        let towards = on_side(lobe, vec3f(dot(sun.towards.xyz, s.t), dot(sun.towards.xyz, s.b), dot(sun.towards.xyz, s.n)));
        let across = normalize(perpendicular(towards));
        let axes = array<vec3f, 2>(across, cross(towards, across));
        if (SUN_SAMPLED) {
            sum = sun_sampled(index, lobe, wo, s, towards, axes);
        } else {
            let deviation = 0.5 * sun.towards.w; // of a disc, along any axis
            sum = lambent_lamp_response(lobe, wo, towards, deviation * axes[0], deviation * axes[1]);
        }
    }
    return share * sun.irradiance.rgb * sum;
}

// Mean of f cos_i over the disc: samples of the lobe and of the disc, by the balance heuristic (Veach & Guibas 1995).
fn sun_sampled(index: u32, lobe: LambentLobe, wo: vec3f, s: Surface, towards: vec3f, axes: array<vec3f, 2>) -> vec3f {
    let radius = max(sun.towards.w, SUN_LEAST);
    let offset = pixel_hash(s.pixel, index).xy;
    let other = pixel_hash(s.pixel, index + SUN_SEQUENCE).xy;
    let density = 1.0 / (LAMBENT_PI * radius * radius);
    var sum = vec3f(0.0);
    for (var k = frame.first_sample; k < frame.first_sample + SAMPLES; k++) {
        let of_lobe = sample_about(wo, lambent_sample_half_vector(sequence(offset, k), lobe));
        let away = rejection(of_lobe.wi, towards);
        let meets = of_lobe.seen && dot(of_lobe.wi, towards) > 0.0 && dot(away, away) < radius * radius;
        sum += select(vec3f(0.0), sun_counted(lobe, of_lobe, wo, density), meets);

        let u = sequence(other, k);
        let place = radius * sqrt(u.x) * vec2f(cos(2.0 * LAMBENT_PI * u.y), sin(2.0 * LAMBENT_PI * u.y));
        let wi = normalize(towards + place.x * axes[0] + place.y * axes[1]);
        let h = lambent_half_vector(wi, wo);
        let of_disc = Sample(h, dot(wo, h), wi, dot(wo, h) > LAMBENT_COS_MIN && wi.z > LAMBENT_COS_MIN);
        sum += select(vec3f(0.0), sun_counted(lobe, of_disc, wo, density), of_disc.seen);
    }
    return sum / f32(SAMPLES);
}

// f cos_i over the disc's solid angle and over the density of both kinds of samples.
fn sun_counted(lobe: LambentLobe, at: Sample, wo: vec3f, density: f32) -> vec3f {
    let pdf = lambent_distribution(at.h, lobe) * at.h.z / (4.0 * at.cos_d);
    return gain(lobe, at.wi, wo, at.h) * (density * pdf / (density + pdf));
}
