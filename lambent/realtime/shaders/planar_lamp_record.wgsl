// The lamps of a planar reflector that its mirrored view leaves out (realtime/reflector_lamps.py).

const LAMPS_MOST = 4;

struct PlaneLamp {
    centre: vec4f,           // w: share of it that the mirrored view would show if nothing hid it
    spread: array<vec4f, 3>, // rows of M of plane_lamps.py, m^2
    emission: vec4f,         // W/(sr m^2); w: rms radius, m
    channel: vec4f,          // 1 at the number of its object
}

struct PlaneLamps {
    to_column: vec4f, // a place (x, y, z, 1) to its column and row in the map
    to_row: vec4f,
    size: vec4f, // columns and rows
    lamps: array<PlaneLamp, 4>,
}
