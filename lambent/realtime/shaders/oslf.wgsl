// Monte Carlo evaluation of a BRDF over a light field (thesis R, 5.12): samples of the lobe, as in qmc.wgsl, and points
// near the pixel. With samples in the outer loop, the look-up serves each sample. With points in the outer loop, maps
// are read one at a time along the samples' directions, and blended by the points' weights for the mirror direction.

#include "frame.wgsl"
#include "surface.wgsl"
#include "sequence.wgsl"

override BY_POINTS: u32 = 0u;

const ALL = 4u; // number that stands for all points

fn of_samples(lobe: LambentLobe, offset: vec2u, point: u32, wo: vec3f, s: Surface) -> vec3f {
    var sum = vec3f(0.0);
    for (var k = 0u; k < SAMPLES; k++) {
        let at = sample_about(wo, lambent_sample_half_vector(sequence(offset, frame.first_sample + k), lobe));
        if (!at.seen) { continue; }
        let w = on_side(lobe, at.wi);
        var light = vec3f(0.0);
        if (point == ALL) { light = incident_ray(s, w); } else { light = ray_of_point(s, point, w); }
        sum += gain(lobe, at.wi, wo, at.h) * light;
    }
    return sum / f32(SAMPLES);
}

fn integrate(index: u32, wo: vec3f, s: Surface) -> vec3f {
    let lobe = lobe_here(index, s).lobe;
    let offset = pixel_hash(s.pixel, index).xy;
    if (BY_POINTS == 0u) { return of_samples(lobe, offset, ALL, wo, s); }
    let weights = point_weights(s, to_world(s, on_side(lobe, vec3f(-wo.xy, wo.z))));
    var sum = vec3f(0.0);
    for (var point = 0u; point < ALL; point++) {
        if (weights[point] > 0.0) { sum += weights[point] * of_samples(lobe, offset, point, wo, s); }
    }
    return sum;
}
