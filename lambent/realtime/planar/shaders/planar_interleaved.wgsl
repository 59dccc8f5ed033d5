// Quadrature on planes, interleaved: each pixel of an 8 x 8 tile takes n other samples of the lobe, the light of which is
// found in the planar reflection buffer, and the light is cleaned afterwards (planar_clean.wgsl, planar_shown.wgsl). Lobes
// that cover few pixels need and stand no cleaning: theirs are the same samples at every pixel. The table of a lobe has
// SAMPLES rows of these, then 64 times SAMPLES rows.

#include "planar_march.wgsl"
#include "lobe_width.wgsl"

const LEAST_PX = 4.0; // mean width of a lobe

const SHARE_STEPS = 15.0; // of how far a sample lies outside the buffer: 4 bits, for up to 64 samples

// Lobe `index` by the rows of the table from `first` on.
// No branch about the look-up: software Vulkan (Mesa 22.3) crashes on textures that are sampled within branches of a loop.
fn planar_quadrature(index: u32, first: u32, wo: vec3f, s: Surface, place: Place) -> vec3f {
    let first_jitter = fract(0.754878 * f32(s.pixel.x & 3u) + 0.569840 * f32(s.pixel.y & 3u));
    let here = lobe_here(index, s);
    let tint = tints(here.lobe, wo);
    var sum = vec3f(0.0);
    var shares = array<u32, 8>();
    var beyond = 0u;
    for (var k = 0u; k < SAMPLES; k++) {
        let q = samples[first + k];
        let at = sample_about(wo, lambent_from_slopes(q.xy * here.growth));
        if (!at.seen) { continue; }
        let g = q.w * sample_gain(tint, here.lobe, at, wo);
        let w = to_world(s, at.wi);
        let hit = march(place, w, fract(first_jitter + 0.618034 * f32(k)));
        let outside = u32(round(SHARE_STEPS * (1.0 - hit.inside)));
        shares[k >> 3u] |= outside << ((k & 7u) << 2u);
        beyond |= outside;
        let inside = 1.0 - f32(outside) / SHARE_STEPS;
        sum += g * inside * buffer_sample(hit.texel, level_of(hit, w, half_log2_omega(q, at, here)));
    }
    // One by one: their mean direction leaps from pixel to pixel, past a sun. No look-up where there are none.
    let count = select(0u, SAMPLES, beyond > 0u);
    var others = vec3f(0.0);
    for (var k = 0u; k < count; k++) {
        let q = samples[first + k];
        let at = sample_about(wo, lambent_from_slopes(q.xy * here.growth));
        let share = f32((shares[k >> 3u] >> ((k & 7u) << 2u)) & 15u) / SHARE_STEPS;
        let g = share * q.w * sample_gain(tint, here.lobe, at, wo);
        let light = incident(s, at.wi, half_log2_omega(q, at, here));
        others += select(vec3f(0.0), g * light, share > 0.0);
    }
    return (sum + others) / f32(SAMPLES);
}

fn bayer(pixel: vec2u) -> u32 {
    let d = pixel.x ^ pixel.y;
    let y = pixel.y;
    let index = ((d & 1u) << 5u) | ((y & 1u) << 4u) | ((d & 2u) << 2u) | ((y & 2u) << 1u) | ((d & 4u) >> 1u) | ((y >> 2u) & 1u);
    return (index + u32(frame.eye.w)) & 63u;
}

fn integrate_planar(index: u32, wo: vec3f, s: Surface, place: Place) -> vec4f {
    let widths = lobe_half_widths(lobe_here(index, s).lobe, wo);
    let px = pixels_of(sqrt(widths.x * widths.y), mirrored.focal_px, place.t, length(place.q));
    let block = select(0u, 1u + bayer(s.pixel), px >= LEAST_PX);
    let light = planar_quadrature(index, (index * 65u + block) * SAMPLES, wo, s, place);
    return vec4f(light, f32(min(block, 1u)));
}
