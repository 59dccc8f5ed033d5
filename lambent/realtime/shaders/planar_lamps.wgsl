// Lamps of a planar reflector in closed form (lamp_light.wgsl), for lobes wider than they are; narrow ones find them in
// the buffer, whose second layer has a channel for each emitting object. Lobes between have shares of both.

#include "planar_lamp_record.wgsl"
#include "lamp_light.wgsl"

@group(3) @binding(4) var<uniform> plane_lamps: PlaneLamps;
@group(3) @binding(5) var<storage, read> lamps_seen: array<vec2u>; // sr, four half floats, row by row

override LAMPS: u32 = 0u; // that the reflector has

const OUT_FROM = 0.5; // width of a lobe, in radii of a lamp, from which on the lamp begins to leave the buffer
const OUT_TO = 0.8;
const LARGE_FROM = 0.2; // rad: lamps seen as large as that begin to stay, as closed forms hold for small ones
const LARGE_TO = 0.35;

// How far a lamp has left the buffer for a lobe at a place, 0 to 1.
fn lamp_out(lobe: LambentLobe, k: u32, p_world: vec3f) -> f32 {
    let radius = plane_lamps.emissions[k].w / max(distance(plane_lamps.centres[k].xyz, p_world), 1e-6);
    let small = 1.0 - smoothstep(LARGE_FROM, LARGE_TO, radius);
    return small * smoothstep(OUT_FROM, OUT_TO, sqrt(lobe.mx * lobe.my) / max(radius, 1e-6));
}

// All lamps of an object leave together: the share of the last.
fn object_out(lobe: LambentLobe, k: u32, p_world: vec3f) -> f32 {
    var out = 1.0;
    for (var i = 0u; i < LAMPS; i++) {
        let same = dot(plane_lamps.channels[i], plane_lamps.channels[k]) > 0.5;
        out = min(out, select(1.0, lamp_out(lobe, i, p_world), same));
    }
    return out;
}

// What each channel of the buffer's second layer adds to its light for a lobe: columns of radiance.
fn lamps_kept(lobe: LambentLobe, p_world: vec3f) -> mat4x3f {
    var kept = mat4x3f();
    for (var k = 0u; k < LAMPS; k++) {
        let light = (1.0 - object_out(lobe, k, p_world)) * plane_lamps.emissions[k].rgb;
        for (var c = 0u; c < 4u; c++) {
            kept[c] = select(kept[c], light, plane_lamps.channels[k][c] > 0.5);
        }
    }
    return kept;
}

fn seen_texel(column: u32, row: u32) -> vec4f {
    let packed = lamps_seen[row * u32(plane_lamps.size.x) + column];
    return vec4f(unpack2x16float(packed.x), unpack2x16float(packed.y));
}

// Solid angles of the lamps that a place of the reflector sees, sr.
fn seen_from(p_world: vec3f) -> vec4f {
    let p = vec4f(p_world, 1.0);
    let last = plane_lamps.size.xy - 1.0;
    let at = clamp(vec2f(dot(plane_lamps.to_column, p), dot(plane_lamps.to_row, p)) - 0.5, vec2f(0.0), last);
    let low = vec2u(at);
    let high = min(low + 1u, vec2u(last));
    let share = at - vec2f(low);
    let above = mix(seen_texel(low.x, low.y), seen_texel(high.x, low.y), share.x);
    let below = mix(seen_texel(low.x, high.y), seen_texel(high.x, high.y), share.x);
    return mix(above, below, share.y);
}

fn lamps_light(lobe: LambentLobe, wo: vec3f, s: Surface, p_world: vec3f) -> vec3f {
    let seen = seen_from(p_world);
    let to_local = transpose(mat3x3f(s.t, s.b, s.n));
    var sum = vec3f(0.0);
    for (var k = 0u; k < LAMPS; k++) {
        let to = plane_lamps.centres[k].xyz - p_world;
        let per_t = inverseSqrt(max(dot(to, to), 1e-12));
        let w = to * per_t;
        let across = normalize(perpendicular(w));
        let beside = cross(w, across);
        let rows = 3u * k;
        let spread = mat3x3f(
            plane_lamps.spreads[rows].xyz, plane_lamps.spreads[rows + 1u].xyz, plane_lamps.spreads[rows + 2u].xyz,
        );
        // two vectors whose outer products add up to the spread across the view
        let first = spread * across;
        let width = sqrt(max(dot(across, first), 1e-12));
        let lean = dot(beside, first) / width;
        let rest = sqrt(max(dot(beside, spread * beside) - lean * lean, 0.0));
        let a = to_local * ((width * across + lean * beside) * per_t);
        let b = to_local * (rest * per_t * beside);
        let share = object_out(lobe, k, p_world) * plane_lamps.centres[k].w * seen[k];
        sum += share * plane_lamps.emissions[k].rgb * lambent_lamp_response(lobe, wo, to_local * w, a, b);
    }
    return sum;
}
