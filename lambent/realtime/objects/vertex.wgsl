// The vertex stage of shade passes and, with depth.wgsl, of depth; @invariant makes them agree to the bit.

#include "frame.wgsl"

struct Varyings {
    @invariant @builtin(position) position: vec4f,
    @location(0) p_world: vec3f,
    @location(1) n_world: vec3f,
    @location(2) t_world: vec3f,
    @location(3) uv2: vec2f,
    @location(4) uv: vec2f,
}

@vertex fn vertex_main(
    @location(0) position: vec3f, @location(1) normal: vec3f, @location(2) tangent: vec3f, @location(3) uv2: vec2f,
    @location(4) uv: vec2f,
) -> Varyings {
    return Varyings(frame.clip_from_world * vec4f(position, 1.0), position, normal, tangent, uv2, uv);
}
