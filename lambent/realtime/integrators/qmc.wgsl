// Unbiased reference: samples of an additive sequence (Roberts 2018), rotated per pixel and lobe (Cranley & Patterson
// 1976), unfiltered. The sequence continues from frame to frame, so the mean converges.

#include "frame.wgsl"
#include "surface.wgsl"
#include "sequence.wgsl"

fn integrate(index: u32, wo: vec3f, s: Surface) -> vec3f {
    let lobe = lobe_here(index, s).lobe;
    let offset = pixel_hash(s.pixel, index).xy;
    var sum = vec3f(0.0);
    for (var k = 0u; k < SAMPLES; k++) {
        let at = sample_about(wo, lambent_sample_half_vector(sequence(offset, frame.first_sample + k), lobe));
        if (!at.seen) { continue; }
        sum += gain(lobe, at.wi, wo, at.h) * incident_ray(s, on_side(lobe, at.wi));
    }
    return sum / f32(SAMPLES);
}
