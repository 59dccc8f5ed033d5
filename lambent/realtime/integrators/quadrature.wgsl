// Quadrature at fixed samples: L = (1/n) sum w g L_i.

#include "surface.wgsl"
#include "quadrature_sum.wgsl"

fn integrate(index: u32, wo: vec3f, s: Surface) -> vec3f {
    return quadrature_sum(lobe_here(index, s), index * SAMPLES, wo, s) / f32(SAMPLES);
}
