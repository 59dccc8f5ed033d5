// Quadrature on planes: as quadrature.wgsl, the light from the mirror picture, one filter size per sample.

#include "planar.wgsl"
#include "planar_march.wgsl"

// Lobe `index` by the rows of the table from `first` on.
// No branch about the look-up: software Vulkan (Mesa 22.3) crashes on textures that are sampled within branches of a loop.
fn planar_quadrature(index: u32, first: u32, wo: vec3f, s: Surface, place: Place) -> vec3f {
    let first_jitter = fract(0.754878 * f32(s.pixel.x & 3u) + 0.569840 * f32(s.pixel.y & 3u));
    let here = lobe_here(index, s);
    let lobe = here.lobe;
    var sum = vec3f(0.0);
    var mirrored = vec3f(0.0); // gains of all samples that the mirror picture has
    var kept = vec3f(1e-9);    // of those not dropped
    var beyond = Beyond(vec3f(0.0), vec3f(0.0), 0.0);
    for (var k = 0u; k < SAMPLES; k++) {
        let q = samples[first + k];
        let at = sample_about(wo, half_vector_of(q.xy * here.growth));
        if (!at.seen) { continue; }
        let half_log2_omega = q.z + here.half_log2_growth + 0.5 * log2(at.cos_d * at.h.z * at.h.z * at.h.z);
        let g = q.w * planar_gain(lobe, at.wi, wo, at.h);
        let w = to_world(s, at.wi);
        let hit = march(place, w, fract(first_jitter + 0.618034 * f32(k)));
        let inside = hit.inside;
        let counted = g * inside * seen_share(hit);
        sum += counted * mirror_sample(hit.texel, level_of(hit, w, half_log2_omega));
        mirrored += g * inside;
        kept += counted;
        let share = 1.0 - inside;
        beyond = Beyond(beyond.gain + share * g, beyond.w + share * at.wi, beyond.omega + share * exp2(2.0 * half_log2_omega));
    }
    return (sum * mirrored / kept + from_probe(s, beyond)) / f32(SAMPLES);
}
