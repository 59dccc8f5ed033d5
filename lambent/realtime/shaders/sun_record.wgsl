// The sun that the light map leaves out, and where its shadow map lies (realtime/sun.py).

struct Sun {
    towards: vec4f,    // unit; w: tangent of its angular radius
    across: vec4f,     // unit, along rows of the map; w: depth of 0, m
    down: vec4f,       // unit, along columns; w: metres that depths of 0 to 1 span
    irradiance: vec4f, // W/m^2 on a surface that faces it; w: number of squares, 0 where there is no sun
    squares: array<vec4f, 4>, // corner (across, down), m; texels per metre; metres per texel
}
