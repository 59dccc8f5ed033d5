// The environment in a planar reflection buffer: a plane far away that faces the mirrored eye.

#include "frame.wgsl"
#include "screen.wgsl"

@group(1) @binding(0) var environment: texture_cube<f32>;

const FAR = 1e4; // metres, as in store/contract.py

struct BufferTexel {
    @location(0) light: vec4f,
    @location(1) plane: vec4f,
}

@fragment fn planar_buffer_sky_main(screen: Screen) -> BufferTexel {
    let w = camera_ray(screen.clip);
    let n = vec3f(frame.across.w, frame.up.w, frame.forward.w);
    let faced = dot(w, n) > 0.0; // other rays never leave the reflector: nothing lies there
    let light = vec4f(textureSampleLevel(environment, linear_sampler, w, 0.0).rgb, 1.0);
    return BufferTexel(select(vec4f(0.0), light, faced), vec4f(-normalize(w), -FAR));
}
