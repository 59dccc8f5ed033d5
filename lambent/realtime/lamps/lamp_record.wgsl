// A lamp at a point (store/lamps.py).

struct PointLamp {
    place: vec4f,     // w: sin(reach/2), by which the disc of its shadow map and profile is scaled
    across: vec4f,    // unit axes, the third along the lamp's
    down: vec4f,
    along: vec4f,     // w: number of its profile
    intensity: vec4f, // the largest, W/sr
}
