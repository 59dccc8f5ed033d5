// Discs that face the eye, each with a rim; realtime/overlays/discs.py describes the vertices.

#include "frame.wgsl"

struct Corner {
    @builtin(position) position: vec4f,
    @location(0) colour: vec3f,
    @location(1) corner: vec2f,
    @location(2) rim: f32, // grey
}

@vertex fn vertex_main(
    @location(0) place: vec3f, @location(1) colour: vec3f, @location(2) corner: vec3f, @location(3) half_size: vec2f,
    @location(4) none: vec2f,
) -> Corner {
    let clip = frame.clip_from_world * vec4f(place, 1.0);
    return Corner(clip + vec4f(corner.xy * half_size * clip.w, 0.0, 0.0), colour, corner.xy, corner.z);
}

@fragment fn discs_main(v: Corner) -> @location(0) vec4f {
    let r = length(v.corner);
    if (r > 1.0) { discard; }
    return vec4f(select(v.colour, vec3f(v.rim), r > 0.75), 1.0);
}
