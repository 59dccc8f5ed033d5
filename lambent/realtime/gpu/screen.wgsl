// One triangle over the whole target.

struct Screen {
    @invariant @builtin(position) position: vec4f,
    @location(0) clip: vec2f,
}

@vertex fn screen_main(@builtin(vertex_index) index: u32) -> Screen {
    let clip = vec2f(f32((index << 1u) & 2u), f32(index & 2u)) * 2.0 - 1.0;
    return Screen(vec4f(clip, 0.0, 1.0), clip);
}
