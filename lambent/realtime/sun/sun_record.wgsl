// The sun that the light map leaves out, and where its shadow map lies (realtime/sun/sun.py).

struct Sun {
    towards: vec4f,    // unit; w: tangent of its angular radius
    irradiance: vec4f, // W/m^2 on a surface that faces it; w: number of squares, 0 where there is no sun
    parts: u32,        // into which the disc is cut; each has squares of its own
    part_towards: array<vec4f, 4>, // unit; w: tangent of a part's angular radius
    across: array<vec4f, 4>,       // unit, along rows of the map; w: depth of 0, m
    down: array<vec4f, 4>,         // unit, along columns; w: metres that depths of 0 to 1 span
    squares: array<vec4f, 16>,     // 4 a part: corner (across, down), m; texels per metre; metres per texel
}
