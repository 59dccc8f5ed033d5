// Enlarges the radiance of a smaller frame, as the base of a frame of full size.

#include "screen.wgsl"

@group(0) @binding(0) var small: texture_2d<f32>;
@group(0) @binding(1) var linear_sampler: sampler;

@fragment fn enlarge_main(screen: Screen) -> @location(0) vec4f {
    return textureSampleLevel(small, linear_sampler, vec2f(0.5 + 0.5 * screen.clip.x, 0.5 - 0.5 * screen.clip.y), 0.0);
}
