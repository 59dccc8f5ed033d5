// No specular light: the baseline of measurements.

#include "surface.wgsl"

fn integrate(index: u32, wo: vec3f, s: Surface) -> vec3f {
    return vec3f(0.0);
}
