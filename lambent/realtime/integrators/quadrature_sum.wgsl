// Sum of w g L_i over fixed samples, for `rings` and `fis`, which differ in their tables.
//     g = F cos_i/((cos_i cos_o)^alpha h_z),  omega = c (wo.h) h_z^3
// Samples below the horizon count as 0, as in the integral.

fn quadrature_sum(here: LobeHere, first: u32, wo: vec3f, s: Surface) -> vec3f {
    let lobe = here.lobe;
    let tint = tints(lobe, wo);
    var sum = vec3f(0.0);
    for (var k = 0u; k < SAMPLES; k++) {
        let q = samples[first + k];
        let at = sample_about(wo, lambent_from_slopes(q.xy * here.growth));
        if (!at.seen) { continue; }
        let light = incident(s, on_side(lobe, at.wi), half_log2_omega(q, at, here));
        sum += q.w * sample_gain(tint, lobe, at, wo) * light;
    }
    return sum;
}
