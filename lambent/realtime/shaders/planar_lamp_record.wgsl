// The lamps of a planar reflector that its mirrored view leaves out (realtime/reflector_lamps.py), at most four.

struct PlaneLamps {
    to_column: vec4f, // a place (x, y, z, 1) to its column and row in the map
    to_row: vec4f,
    size: vec4f,                 // columns and rows
    centres: array<vec4f, 4>,    // w: share of a lamp that the mirrored view would show if nothing hid it
    spreads: array<vec4f, 12>,   // three rows for each, of M of plane_lamps.py, m^2
    emissions: array<vec4f, 4>,  // W/(sr m^2); w: rms radius, m
    channels: array<vec4f, 4>,   // 1 at the number of a lamp's object
}
