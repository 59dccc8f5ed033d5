// One MIP level of a planar reflection buffer from the one above it: means of 2 x 2 texels. Light is multiplied by its coverage.

#include "screen.wgsl"

@group(0) @binding(0) var finer: texture_2d<f32>;
@group(0) @binding(1) var linear_sampler: sampler;

@fragment fn planar_buffer_mips_main(screen: Screen) -> @location(0) vec4f {
    let size = max(textureDimensions(finer) / 2u, vec2u(1u));
    return textureSampleLevel(finer, linear_sampler, screen.position.xy / vec2f(size), 0.0);
}
