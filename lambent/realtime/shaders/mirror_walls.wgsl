// Depth of a mirror picture before anything is drawn: nothing passes where the mirror eye looks past the foot of a wall.

#include "frame.wgsl"
#include "screen.wgsl"

struct Plan { // PLAN_DTYPE in mirror.py
    to_u: vec4f, // what leads from the mirror eye to a point of the reflector's plane, to its place in the plan
    to_v: vec4f,
    below: f32,  // m: the mirror eye under the plane
}

@group(1) @binding(0) var<uniform> plan: Plan;
@group(1) @binding(1) var distances: texture_2d<f32>;

@fragment fn mirror_walls_main(screen: Screen) -> @builtin(frag_depth) f32 {
    let w = frame.forward.xyz + screen.clip.x * frame.across.xyz + screen.clip.y * frame.up.xyz;
    let rising = dot(w, vec3f(frame.across.w, frame.up.w, frame.forward.w));
    let q = w * (plan.below / max(rising, 1e-9));
    let uv = vec2f(dot(plan.to_u, vec4f(q, 1.0)), dot(plan.to_v, vec4f(q, 1.0)));
    // held in bounds here: samplers lose the fraction of what is far away
    let distance = textureSampleLevel(distances, linear_sampler, clamp(uv, vec2f(0.0), vec2f(1.0)), 0.0).r;
    if (distance >= 0.0 || rising <= 1e-9) { discard; }
    return 1.0; // the nearest depth there is
}
