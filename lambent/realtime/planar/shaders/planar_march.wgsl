// The first surface along a ray that the planar reflection buffer shows, searched for step by step across the image.

#include "planar.wgsl"

const MARCH_STEPS = 12u;

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

// The hit of a ray that passes a wall, or behind something, before anything is found: the surface that the buffer shows
// where the ray was last before all, as the sky beside the frame of a window.
fn hit_behind(place: Place, w: vec3f, free: f32) -> Hit {
    let projected = project(place.q + free * w);
    let plane = plane_at(projected.xy);
    let t = meet(plane, place.q, w, max(free, 1e-3));
    let inside = select(0.0, inside_image(projected), is_shown(plane));
    return Hit(place.q + t * w, t, plane, projected.xy, inside);
}

// Steps are even in the image but for being denser near the pixel, and moved by `jitter` in [0, 1). A step has found a
// hit where the ray meets the plane seen at its end within the step. No branch: see planar_quadrature.
fn march(place: Place, w: vec3f, jitter: f32) -> Hit {
    let guess = find_hit(place, w);
    let again = meet(plane_at(guess.texel), place.q, w, guess.t);
    let settled = is_shown(guess.plane) && abs(again - guess.t) < 0.03 * guess.t; // only what is nearer can be the hit
    let t_exit = min(exit_distance(place.q, w), select(FARTHEST, guess.t, settled));
    var found = -1.0;
    var before = 0.0;
    var walled = false; // a step has passed the foot of a wall
    var free = 0.0; // the last step before all that the buffer shows
    for (var i = 0u; i < MARCH_STEPS; i++) {
        let step = min((f32(i) + 1.0 - 0.999 * jitter) / (f32(MARCH_STEPS) - 1.0), 1.0);
        let share = step * sqrt(step);
        let t = distance_at(place, w, t_exit, share);
        let q = place.q + t * w;
        let plane = plane_at(project(q).xy);
        let met = meet(plane, place.q, w, -1.0);
        let last = share >= 1.0 && !settled;
        walled = walled || !is_shown(plane);
        let hit = found < 0.0 && !walled && met > 0.97 * before && (met < 1.03 * t || last);
        found = select(found, met, hit);
        free = select(free, t, found < 0.0 && !walled && seen_depth(q, plane) > 1.0);
        before = t;
    }
    if (found < 0.0 && !settled) { return hit_behind(place, w, free); }
    let t_found = select(guess.t, found, found > 0.0);
    let plane = plane_along(place, w, t_found);
    let refined = meet(plane, place.q, w, t_found);
    let t = select(t_found, refined, abs(refined - t_found) < 0.05 * t_found);
    return hit_within(place, w, t, plane);
}
