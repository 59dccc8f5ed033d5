// A ray from a pixel of a reflector, as its planar reflection buffer shows it; for both searches.

#include "planar.wgsl"

// Distance at which a ray leaves the image.
fn exit_distance(q: vec3f, w: vec3f) -> f32 {
    let at = vec3f(dot(mirrored.row_x.xyz, q), dot(mirrored.row_y.xyz, q), dot(mirrored.row_w.xyz, q));
    let along = vec3f(dot(mirrored.row_x.xyz, w), dot(mirrored.row_y.xyz, w), dot(mirrored.row_w.xyz, w));
    let sides = vec4f(at.z - at.x, at.z + at.x, at.z - at.y, at.z + at.y);
    let closing = -vec4f(along.z - along.x, along.z + along.x, along.z - along.y, along.z + along.y);
    let t = select(vec4f(FARTHEST), sides / max(closing, vec4f(1e-9)), closing > vec4f(1e-9));
    return clamp(0.999 * min(min(t.x, t.y), min(t.z, t.w)), 1e-3, FARTHEST);
}

// Distance at a share of the ray's way across the image, from the pixel to t_last: there 1/depth is linear.
fn distance_at(place: Place, w: vec3f, t_last: f32, share: f32) -> f32 {
    let z = dot(mirrored.row_w.xyz, place.q);
    let z_last = max(z + t_last * dot(mirrored.row_w.xyz, w), 1e-6);
    return t_last * share * z / mix(z_last, z, share);
}
