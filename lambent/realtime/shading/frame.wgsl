// Data of all passes of a frame (group 0).

struct Frame {
    clip_from_world: mat4x4f,
    eye: vec4f,      // w: this frame's turn, of 64, of interleaved samples; the frames of a still take all turns
    across: vec4f,   // the ray of clip position (x, y) is forward + x across + y up
    up: vec4f,
    forward: vec4f,
    show: vec4f,     // weights of: diffuse, specular, sky, irradiance instead of light
    first_sample: u32, // index of this frame's first sample of a progressive series
    view_transform: u32,
    exposure: f32,   // factor on radiance, 2^EV
    fading: f32,     // share of the fading difference in an edited picture
    scale: vec4f,      // of false colour: low, high, logarithmic, lm/W
}

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var linear_sampler: sampler;

// The ray from the eye, of depth 1, through a clip position.
fn camera_ray(clip: vec2f) -> vec3f {
    return frame.forward.xyz + clip.x * frame.across.xyz + clip.y * frame.up.xyz;
}
