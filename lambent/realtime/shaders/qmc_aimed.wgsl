// qmc.wgsl for probes with prominent lamps: a share of the samples aims at the lamps, the others follow the lobe; both
// are weighted by the balance heuristic (Veach & Guibas 1995).

#include "frame.wgsl"
#include "surface.wgsl"
#include "sequence.wgsl"
#include "aim.wgsl"

const SIXTEENTHS = 16u;

// Sixteenths of a lobe's samples that aim, an even number, known before any sample is taken.
fn aimed_share(lobe: LambentLobe, s: Surface) -> u32 {
    if (!aim_maps(s.x)) { return 0u; }
    return 2u * u32(round(0.5 * wanted_sixteenths(aim[0].y, lobe.mx * lobe.my)));
}

// f cos_i times the light over the density of all samples in a direction; the share `aim_share` aims with density
// `aimed`.
fn counted(lobe: LambentLobe, at: Sample, wo: vec3f, light: vec3f, aimed: f32, aim_share: f32) -> vec3f {
    let pdf = lambent_distribution(at.h, lobe) * at.h.z / (4.0 * at.cos_d);
    return gain(lobe, at.wi, wo, at.h) * light * (pdf / max(mix(pdf, aimed, aim_share), 1e-30));
}

fn probe_light(s: Surface, w: vec3f, direction: vec3f) -> vec3f {
    return s.niche + arriving(s, to_world(s, w)) * textureSampleLevel(radiance_cube, linear_sampler, direction, 0.0).rgb;
}

fn of_lobe(u: vec2f, lobe: LambentLobe, wo: vec3f, s: Surface, aim_share: f32) -> vec3f {
    let at = sample_about(wo, lambent_sample_half_vector(u, lobe));
    if (!at.seen) { return vec3f(0.0); }
    let w = on_side(lobe, at.wi);
    let found = aimed_look_up(s.x, to_world(s, w));
    let aimed = aim_probability(found.direction) * found.density;
    return counted(lobe, at, wo, probe_light(s, w, found.direction), aimed, aim_share);
}

fn of_lamps(u: vec2f, lobe: LambentLobe, wo: vec3f, s: Surface, aim_share: f32) -> vec3f {
    let drawn = aim_draw(u);
    let to = aim_towards(s.x, drawn.xyz);
    let w = vec3f(dot(to.w, s.t), dot(to.w, s.b), dot(to.w, s.n));
    let wi = on_side(lobe, w);
    let h = lambent_half_vector(wi, wo);
    let cos_d = dot(wo, h);
    if (cos_d <= LAMBENT_COS_MIN || wi.z <= LAMBENT_COS_MIN) { return vec3f(0.0); }
    let at = Sample(h, cos_d, wi, true);
    return counted(lobe, at, wo, probe_light(s, w, drawn.xyz), drawn.w * to.density, aim_share);
}

// A frame's samples of both sequences: first and past the last, for lobe samples and for aimed samples.
struct Turn {
    lobe: vec2u,
    aimed: vec2u,
}

// If a frame's samples divide evenly, each kind continues its own sequence. Otherwise, as with one sample per frame, a
// separate sequence chooses the kind by frame; it must not correlate with the frame's jitter.
fn turn_of(share: u32, phase: u32) -> Turn {
    let first = frame.first_sample;
    let index = first / SAMPLES;
    if (share * SAMPLES % SIXTEENTHS == 0u) {
        let aimed = share * SAMPLES / SIXTEENTHS;
        return Turn((SAMPLES - aimed) * vec2u(index, index + 1u), aimed * vec2u(index, index + 1u));
    }
    let aimed = (share * SAMPLES + ((phase + index * 2654435769u) >> 28u)) / SIXTEENTHS;
    return Turn(vec2u(first + aimed, first + SAMPLES), vec2u(first, first + aimed));
}

fn integrate(index: u32, wo: vec3f, s: Surface) -> vec3f {
    let lobe = lobe_here(index, s).lobe;
    let share = aimed_share(lobe, s);
    let offset = pixel_hash(s.pixel, index);
    let turn = turn_of(share, offset.z);
    let aim_share = f32(share) / f32(SIXTEENTHS);
    var sum = vec3f(0.0);
    for (var k = turn.lobe.x; k < turn.lobe.y; k++) {
        sum += of_lobe(sequence(offset.xy, k), lobe, wo, s, aim_share);
    }
    let other = pixel_hash(s.pixel, index + 16u).xy;
    for (var k = turn.aimed.x; k < turn.aimed.y; k++) {
        sum += of_lamps(sequence(other, k), lobe, wo, s, aim_share);
    }
    return sum / f32(SAMPLES);
}
