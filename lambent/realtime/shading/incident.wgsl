// Results of look-ups of incident light (lambent/realtime/incident).

#include "directions.wgsl"

// Direction in the probe (not unit), and distance from the surface to the point seen there; 1 for distant light.
struct LookUp {
    direction: vec3f,
    t: f32,
}
