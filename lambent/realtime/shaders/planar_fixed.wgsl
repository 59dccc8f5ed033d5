// Quadrature on planes: as quadrature.wgsl, the light from the mirror picture, one filter size per sample.

#include "planar.wgsl"

// Lobe `index` by the rows of the table from `first` on.
fn planar_quadrature(index: u32, first: u32, wo: vec3f, s: Surface, place: Place) -> vec3f {
    let here = lobe_here(index, s);
    let lobe = here.lobe;
    let through = lobe.side == LAMBENT_TRANSMISSION; // light from beyond the plane: the mirror picture does not know it
    var sum = vec3f(0.0);
    var beyond = Beyond(vec3f(0.0), vec3f(0.0), 0.0);
    for (var k = 0u; k < SAMPLES; k++) {
        let q = samples[first + k];
        let slope = q.xy * here.growth;
        let h = vec3f(slope, 1.0) * inverseSqrt(1.0 + dot(slope, slope));
        let cos_d = dot(wo, h);
        let wi = 2.0 * cos_d * h - wo;
        if (cos_d <= LAMBENT_COS_MIN || wi.z <= LAMBENT_COS_MIN) { continue; }
        let half_log2_omega = q.z + here.half_log2_growth + 0.5 * log2(cos_d * h.z * h.z * h.z);
        let g = q.w * planar_gain(lobe, wi, wo, h);
        let found = planar_incident(place, to_world(s, wi), half_log2_omega);
        let inside = select(found.a, 0.0, through);
        sum += g * inside * found.rgb;
        let share = 1.0 - inside;
        beyond = Beyond(beyond.gain + share * g, beyond.w + share * on_side(lobe, wi), beyond.omega + share * exp2(2.0 * half_log2_omega));
    }
    return (sum + from_probe(s, beyond)) / f32(SAMPLES);
}
