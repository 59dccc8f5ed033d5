// The first surface along a ray, searched for in few steps: each looks into a large cell of planar_cells.wgsl, for a plane
// that the ray meets within the step. The buffer itself has the last word.

#include "planar_ray.wgsl"
#include "directions.wgsl"

override CELL_STEPS: u32 = 0u;

const CELLS = 10.0; // along the rows of the buffer, up to twice as many: one holds a lamp, but little else

// The plane of what is nearest in the cell about a texel of the buffer.
fn cell_plane(texel: vec2f, level: u32) -> vec4f {
    let last = vec2i(textureDimensions(buffer_cells, level)) - 1;
    let cell = vec2i(floor(texel / f32(CELL_PX))) >> vec2u(level);
    let found = textureLoad(buffer_cells, clamp(cell, vec2i(0), last), level);
    return vec4f(from_octahedral(found.xy), found.z);
}

// Where a ray goes if nothing stands in its way: the guess, where the buffer shows what was guessed. Else the ray passes
// behind something: the farther of what the buffer shows there and where the ray leaves it.
fn unhindered(place: Place, w: vec3f, t_out: f32) -> Met {
    let guess = guessed(place, w);
    let shown = plane_along(place, w, guess.t);
    let t_shown = meet(shown, place.q, w, FARTHEST);
    let outermost = plane_along(place, w, t_out);
    let t_outermost = meet(outermost, place.q, w, t_out);
    if (!is_shown(shown) && is_shown(place.seen)) { return first_guess(place, w); } // past the foot of a wall
    let passes = is_shown(outermost) && abs(t_shown - guess.t) >= 0.03 * guess.t;
    let farther = max(min(meet(shown, place.q, w, t_out), t_out), t_outermost);
    var found = guess.plane;
    if (passes) { found = outermost; }
    return Met(select(guess.t, farther, passes), found);
}

fn search(place: Place, w: vec3f, jitter: f32) -> Hit {
    let t_out = exit_distance(place.q, w);
    let behind = unhindered(place, w, t_out);
    let t_last = min(t_out, behind.t);
    let from_px = project(place.q).xy;
    let way_px = project(place.q + t_last * w).xy - from_px;
    let step_px = max(abs(way_px.x), abs(way_px.y)) / f32(CELL_STEPS);
    let cell_px = clamp(8.0 * step_px, f32(CELL_PX), max(mirrored.size.x / CELLS, f32(CELL_PX)));
    let level = min(u32(log2(cell_px / f32(CELL_PX))), textureNumLevels(buffer_cells) - 1u);
    let moved = 0.999 * jitter;
    var before = 0.0;
    var nearest = -1.0;
    for (var i = 0u; i < CELL_STEPS; i++) {
        let share = min((f32(i) + 1.0 - moved) / (f32(CELL_STEPS) - moved), 1.0);
        let middle = max((f32(i) + 0.5 - moved) / (f32(CELL_STEPS) - moved), 0.0);
        let t_end = distance_at(place, w, t_last, share);
        let t = meet(cell_plane(from_px + middle * way_px, level), place.q, w, -1.0);
        let before_all = nearest < 0.0 && t > 0.9 * before && t < min(1.1 * t_end, 0.97 * behind.t);
        nearest = select(nearest, t, before_all);
        before = t_end;
    }
    let plane = plane_along(place, w, max(nearest, 0.0));
    let t = meet(plane, place.q, w, -1.0);
    let seen = nearest > 0.0 && abs(t - nearest) < 0.1 * nearest;
    var found = behind.plane;
    if (seen) { found = plane; }
    return hit_within(place, w, select(behind.t, t, seen), found);
}
