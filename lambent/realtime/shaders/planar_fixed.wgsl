// Quadrature on planes: as quadrature.wgsl, the light from the planar reflection buffer, one filter size per sample.

#include "planar_march.wgsl"

// Filters in the probe against those in the buffer, half the log2. Of the 64 pixels that sample in turns few look
// at a sun that the buffer does not hold: with narrow filters their tiles show as blocks.
override BEYOND_WIDER: f32 = 0.0;

const SHARE_STEPS = 15.0; // of how far a sample lies outside the buffer: 4 bits, for up to 64 samples

// Lobe `index` by the rows of the table from `first` on.
// No branch about the look-up: software Vulkan (Mesa 22.3) crashes on textures that are sampled within branches of a loop.
fn planar_quadrature(index: u32, first: u32, wo: vec3f, s: Surface, place: Place) -> vec3f {
    let first_jitter = fract(0.754878 * f32(s.pixel.x & 3u) + 0.569840 * f32(s.pixel.y & 3u));
    let here = lobe_here(index, s);
    var sum = vec3f(0.0);
    var held = vec3f(0.0); // gains of all samples that the buffer holds
    var kept = vec3f(1e-9);    // of those not dropped
    var shares = array<u32, 8>();
    var beyond = 0u;
    for (var k = 0u; k < SAMPLES; k++) {
        let q = samples[first + k];
        let at = sample_about(wo, lambent_from_slopes(q.xy * here.growth));
        if (!at.seen) { continue; }
        let g = q.w * gain(here.lobe, at.wi, wo, at.h);
        let w = to_world(s, at.wi);
        let hit = first_hit(place, w, fract(first_jitter + 0.618034 * f32(k)));
        let outside = u32(round(SHARE_STEPS * (1.0 - hit.inside)));
        shares[k >> 3u] |= outside << ((k & 7u) << 2u);
        beyond |= outside;
        let inside = 1.0 - f32(outside) / SHARE_STEPS;
        let counted = g * inside * seen_share(hit);
        sum += counted * buffer_sample(hit.texel, level_of(hit, w, half_log2_omega(q, at, here)));
        held += g * inside;
        kept += counted;
    }
    // One by one: their mean direction leaps from pixel to pixel, past a sun. No look-up where there are none.
    let count = select(0u, SAMPLES, beyond > 0u);
    var others = vec3f(0.0);
    for (var k = 0u; k < count; k++) {
        let q = samples[first + k];
        let at = sample_about(wo, lambent_from_slopes(q.xy * here.growth));
        let share = f32((shares[k >> 3u] >> ((k & 7u) << 2u)) & 15u) / SHARE_STEPS;
        let g = share * q.w * gain(here.lobe, at.wi, wo, at.h);
        let light = incident(s, at.wi, half_log2_omega(q, at, here) + BEYOND_WIDER);
        others += select(vec3f(0.0), g * light, share > 0.0);
    }
    return (sum * held / kept + others) / f32(SAMPLES);
}

fn first_hit(place: Place, w: vec3f, jitter: f32) -> Hit {
    if (MARCH_STEPS > 0u) { return march(place, w, jitter); }
    return find_hit(place, w);
}
