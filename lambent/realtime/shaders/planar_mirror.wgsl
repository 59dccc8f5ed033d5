// A mirror picture, as its readers know it.

const NEAR_PX = 4; // side of the finest cells of planar_near.wgsl, FIRST_PX of passes/near.py

struct Mirror { // MIRROR_DTYPE in mirror.py
    eye: vec4f,
    row_x: vec4f, // q to clip x, y and w
    row_y: vec4f,
    row_w: vec4f,
    plane: vec4f, // of the reflector, n towards the viewer
    across: vec4f, // the ray of clip position (x, y) is forward + x across + y up
    up: vec4f,
    forward: vec4f,
    size: vec2f,
    offset: vec2f,  // of the frame in the mirror picture
    tolerance: f32, // m: how far the reflector's pixels may lie from its plane
    focal_px: f32,
    levels: f32,
    number: f32, // of the reflector in this frame
}
