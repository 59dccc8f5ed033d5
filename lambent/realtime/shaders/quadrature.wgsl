// Quadrature at fixed samples: `rings` and `fis`, which differ in the table alone.
//     L = (1/n) sum w g L_i,  g = F cos_i/((cos_i cos_o)^alpha h_z),  omega = c (wo.h) h_z^3
// Samples below the horizon count as 0, as the integral has it.

#include "surface.wgsl"

fn integrate(index: u32, wo: vec3f, s: Surface) -> vec3f {
    let here = lobe_here(index, s);
    let lobe = here.lobe;
    var sum = vec3f(0.0);
    for (var k = 0u; k < SAMPLES; k++) {
        let q = samples[index * SAMPLES + k];
        let slope = q.xy * here.growth;
        let h = vec3f(slope, 1.0) * inverseSqrt(1.0 + dot(slope, slope));
        let cos_d = dot(wo, h);
        let wi = 2.0 * cos_d * h - wo;
        if (cos_d <= LAMBENT_COS_MIN || wi.z <= LAMBENT_COS_MIN) { continue; }
        let half_log2_omega = q.z + here.half_log2_growth + 0.5 * log2(cos_d * h.z * h.z * h.z);
        sum += q.w * gain(lobe, wi, wo, h) * incident(s, on_side(lobe, wi), half_log2_omega);
    }
    return sum / f32(SAMPLES);
}
