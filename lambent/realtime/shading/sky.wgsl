// The environment in the background.

#include "frame.wgsl"
#include "screen.wgsl"

@group(1) @binding(0) var environment: texture_cube<f32>;

@fragment fn sky_main(screen: Screen) -> @location(0) vec4f {
    let w = camera_ray(screen.clip);
    return vec4f(frame.show.z * textureSampleLevel(environment, linear_sampler, w, 0.0).rgb, 1.0);
}
