// The mirrored view of a planar reflector, and how places in the scene find theirs in its planar reflection buffer.

struct MirroredView {
    eye: vec4f,
    row_x: vec4f, // q to clip x, y and w
    row_y: vec4f,
    row_w: vec4f,
    plane: vec4f, // of the reflector, n towards the viewer
    size: vec2f,
    offset: vec2f,  // of the frame in the buffer
    tolerance: f32, // m: how far the reflector's pixels may lie from its plane
    focal_px: f32,
    levels: f32,
    number: f32, // of the reflector in this frame
}

