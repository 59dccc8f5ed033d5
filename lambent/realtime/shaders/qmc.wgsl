// Unbiased reference: importance samples of an additive sequence (Roberts 2018), rotated per pixel and lobe
// (Cranley & Patterson 1976), unfiltered. The sequence goes on from frame to frame, so the mean converges.

#include "surface.wgsl"

// Two well mixed words of a pixel (Jarzynski & Olano 2020, pcg3d).
fn pixel_hash(pixel: vec2u, lobe: u32) -> vec2u {
    var v = vec3u(pixel, lobe) * 1664525u + 1013904223u;
    v.x += v.y * v.z; v.y += v.z * v.x; v.z += v.x * v.y;
    v ^= v >> vec3u(16u);
    v.x += v.y * v.z; v.y += v.z * v.x; v.z += v.x * v.y;
    return v.xy;
}

fn integrate(index: u32, wo: vec3f, s: Surface) -> vec3f {
    let lobe = lobe_here(index, s).lobe;
    let offset = pixel_hash(s.pixel, index);
    var sum = vec3f(0.0);
    for (var k = 0u; k < SAMPLES; k++) {
        // whole numbers modulo 2^32: exact for any index, where floats would lose the sequence after some thousands
        let bits = offset + (frame.first_sample + k) * vec2u(3242174889u, 2447445413u);
        let u = (vec2f(bits >> vec2u(8u)) + 0.5) / 16777216.0;
        let h = lambent_sample_half_vector(u, lobe);
        let cos_d = dot(wo, h);
        let wi = 2.0 * cos_d * h - wo;
        if (cos_d <= LAMBENT_COS_MIN || wi.z <= LAMBENT_COS_MIN) { continue; }
        sum += gain(lobe, wi, wo, h) * incident_at_level(s, on_side(lobe, wi), 0.0);
    }
    return sum / f32(SAMPLES);
}
