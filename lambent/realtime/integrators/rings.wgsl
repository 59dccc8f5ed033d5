// `rings`: quadrature at fixed samples, and a factor by cos_o that makes it exact under uniform light (albedo.py).
//     L = c(cos_o)/n sum w g L_i

#include "surface.wgsl"
#include "quadrature_sum.wgsl"
#include "albedo_factor.wgsl"

fn integrate(index: u32, wo: vec3f, s: Surface) -> vec3f {
    let first = index * (SAMPLES + FACTOR_ROWS);
    let sum = quadrature_sum(lobe_here(index, s), first, wo, s);
    return sum * (albedo_factor(first + SAMPLES, wo.z) / f32(SAMPLES));
}
