// Depth of a mirrored view before anything is drawn: nothing passes where its eye looks past the foot of a wall.

#include "frame.wgsl"
#include "screen.wgsl"

struct Plan {
    to_u: vec4f, // offset of a point of the reflector's plane from the mirrored eye -> its place in the plan
    to_v: vec4f,
    below: f32,  // m: the mirrored eye under the plane
}

@group(1) @binding(0) var<uniform> plan: Plan;
@group(1) @binding(1) var distances: texture_2d<f32>;

@fragment fn planar_walls_main(screen: Screen) -> @builtin(frag_depth) f32 {
    let w = camera_ray(screen.clip);
    let rising = dot(w, vec3f(frame.across.w, frame.up.w, frame.forward.w));
    let q = w * (plan.below / max(rising, 1e-9));
    let uv = vec2f(dot(plan.to_u, vec4f(q, 1.0)), dot(plan.to_v, vec4f(q, 1.0)));
    // held in bounds here: samplers lose the fraction of what is far away
    let distance = textureSampleLevel(distances, linear_sampler, clamp(uv, vec2f(0.0), vec2f(1.0)), 0.0).r;
    if (distance >= 0.0 || rising <= 1e-9) { discard; }
    return 1.0; // the nearest depth there is
}
