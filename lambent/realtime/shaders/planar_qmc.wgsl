// The progressive mode on planes: importance samples as in qmc.wgsl, unfiltered, each marched to its hit, so that the mean
// converges to what the buffer knows: only surfaces hidden from the mirrored eye are missing.

#include "planar_march.wgsl"
#include "sequence.wgsl"

fn integrate_planar(index: u32, wo: vec3f, s: Surface, place: Place) -> vec4f {
    let lobe = lobe_here(index, s).lobe;
    let offset = pixel_hash(s.pixel, index).xy;
    var sum = vec3f(0.0);
    var beyond = Beyond(vec3f(0.0), vec3f(0.0), 0.0);
    for (var k = 0u; k < SAMPLES; k++) {
        let at = sample_about(wo, lambent_sample_half_vector(sequence(offset, frame.first_sample + k), lobe));
        if (!at.seen) { continue; }
        let g = gain(lobe, at.wi, wo, at.h);
        let jitter = f32(((frame.first_sample + k) * 2654435769u + offset.x) >> 8u) / 16777216.0;
        let hit = march(place, to_world(s, at.wi), jitter);
        let inside = hit.inside;
        sum += g * inside * buffer_sample(hit.texel, 0.0, mat4x3f());
        let share = 1.0 - inside;
        beyond = Beyond(beyond.gain + share * g, beyond.w + share * at.wi, beyond.omega + share * 1e-6);
    }
    return vec4f((sum + from_probe(s, beyond)) / f32(SAMPLES), 0.0);
}
