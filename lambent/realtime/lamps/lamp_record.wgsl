// A lamp (store/lamps.py).

struct PointLamp {
    place: vec4f,     // w: sin(reach/2), by which the disc of its shadow map and profile is scaled
    across: vec4f,    // unit axes, the third along the lamp's; w: half axes of its opening across and down, 0 for a point
    down: vec4f,
    along: vec4f,     // w: number of its profile
    intensity: vec4f, // the largest, W/sr; w: number of its opening among the shares of texels, -1 if none
    faces: vec4f,     // m2, silhouettes of its opening along the axes; w: 1 for a box, along others their sum
}
