// The share of the sun's disc that each pixel sees, by a shadow map of the scene, made once (realtime/sun.py): depth along the sun's direction in nested
// squares, the smallest first, and the least and greatest depths of blocks of texels.
//
// Penumbras are as wide as the sun's disc makes them behind the mean of the blockers (Fernando 2005, "Percentage-closer
// soft shadows"). The plane of the surface is followed from texel to texel, so that it does not shadow itself.

#include "vertex.wgsl"
#include "sun_record.wgsl"

@group(1) @binding(0) var<uniform> sun: Sun;
@group(1) @binding(1) var sun_depths: texture_depth_2d_array;
@group(1) @binding(2) var sun_blocks: texture_2d_array<f32>; // (least, greatest) depth

override TRANSMITS: bool = false; // surfaces show light from behind them

const SUN_BLOCK = 8.0;       // texels along the side of the smallest block: BLOCK of realtime/sun.py
const SUN_SEARCH = 8u;       // taps that look for blockers
const SUN_TAPS = 16u;        // taps that are compared
const SUN_LEAST_PX = 1.5;    // texels: least radius of either
const SUN_STEEPEST = 20.0;   // slope, depth over width, beyond which a surface is not followed
const SUN_BIAS_PX = 0.7;     // texels, by which what is nearer to the sun casts no shadow
const SUN_ROUNDING = 4e-7;   // of the depths' span

var<private> sun_turn: vec2f; // of the pattern at this pixel: share of a ring, share of a turn

// Sixteen patterns in turn over 4 x 4 pixels; others in every frame of a progressive series or of a still.
fn turn_sun_pattern(pixel: vec2u) {
    let mixed = pixel.x ^ pixel.y;
    let place = ((mixed & 1u) << 3u) | ((pixel.y & 1u) << 2u) | (mixed & 2u) | ((pixel.y & 2u) >> 1u);
    let frames = f32(frame.first_sample & 0xffffu);
    let order = f32(place) + 0.5;
    sun_turn = fract(vec2f(order / 16.0 + 0.7548776662 * frames, 0.6180339887 * (order + frame.eye.w) + 0.5698402910 * frames));
}

// Where a surface lies in the map: place in texels of a square, depth in metres towards the sun, and its slope, metres of
// depth per metre along rows and columns.
struct SunPlace {
    texel: vec2f,
    square: u32,
    depth_m: f32,
    slope: vec2f,
    texel_m: f32,
}

fn sun_depth_m(stored: f32) -> f32 {
    return sun.across.w + sun.down.w * stored;
}

// Least and greatest depth (m) within `radius` texels.
fn sun_range(at: SunPlace, radius: f32) -> vec2f {
    let reach = radius + 1.0;
    let across = i32(textureDimensions(sun_blocks).y); // blocks of the first level
    let level = u32(clamp(ceil(log2(2.0 * reach / SUN_BLOCK)), 0.0, log2(f32(across))));
    let size = SUN_BLOCK * exp2(f32(level));
    let most = vec2i((across >> level) - 1);
    let corner = select(vec2i(across, across - (across >> (level - 1u))), vec2i(0), level == 0u);
    let low = clamp(vec2i(floor((at.texel - reach) / size)), vec2i(0), most);
    let high = clamp(vec2i(floor((at.texel + reach) / size)), vec2i(0), most);
    var found = vec2f(1.0, 0.0);
    for (var i = 0u; i < 4u; i++) {
        let block = vec2i(select(low.x, high.x, (i & 1u) == 1u), select(low.y, high.y, i > 1u));
        let range = textureLoad(sun_blocks, corner + block, at.square, 0).xy;
        found = vec2f(min(found.x, range.x), max(found.y, range.y));
    }
    return vec2f(sun_depth_m(found.x), sun_depth_m(found.y));
}

// How far (m) the map is nearer to the sun than the surface, in the texel at `offset` from its own.
fn sun_rise(at: SunPlace, offset: vec2f) -> f32 {
    let most = vec2f(textureDimensions(sun_depths)) - 1.0;
    let texel = clamp(floor(at.texel + offset), vec2f(0.0), most);
    let here = at.depth_m + dot(at.slope, (texel + 0.5 - at.texel) * at.texel_m);
    return sun_depth_m(textureLoad(sun_depths, vec2i(texel), at.square, 0)) - here;
}

// A point of a disc of radius 1, and the next: n of them are spread evenly over it (Vogel 1979).
struct SunTap {
    across: vec2f, // unit
    order: f32,
}

fn first_sun_tap() -> SunTap {
    let phi = 6.283185307 * sun_turn.y;
    return SunTap(vec2f(cos(phi), sin(phi)), sun_turn.x);
}

fn next_sun_tap(tap: SunTap) -> SunTap {
    let golden = vec2f(-0.73736888, 0.67549029); // cosine and sine of the golden angle
    let turned = vec2f(dot(tap.across, vec2f(golden.x, -golden.y)), dot(tap.across, golden.yx));
    return SunTap(turned, tap.order + 1.0);
}

fn sun_place(p_world: vec3f, n_world: vec3f) -> SunPlace {
    let axes = vec2f(dot(sun.across.xyz, p_world), dot(sun.down.xyz, p_world));
    let side = f32(textureDimensions(sun_depths).x);
    var at = SunPlace();
    at.square = u32(sun.irradiance.w);
    for (var k = 0u; k < u32(sun.irradiance.w); k++) {
        at.texel = (axes - sun.squares[k].xy) * sun.squares[k].z;
        at.texel_m = sun.squares[k].w;
        if (all(at.texel > vec2f(2.0)) && all(at.texel < vec2f(side - 2.0))) {
            at.square = k;
            break;
        }
    }
    at.depth_m = dot(sun.towards.xyz, p_world);
    let facing = dot(sun.towards.xyz, n_world);
    let falls = -vec2f(dot(sun.across.xyz, n_world), dot(sun.down.xyz, n_world)) * select(-1.0, 1.0, facing > 0.0);
    at.slope = falls / max(abs(facing), length(falls) / SUN_STEEPEST);
    return at;
}

// The share of the sun's disc that a point sees; n is the normal of the flat surface there, on either side.
//
// Adapters in software skip loops of no turns, but neither branches nor what follows a return.
fn sun_visibility(p_world: vec3f, n_world: vec3f) -> f32 {
    let at = sun_place(p_world, n_world);
    let bias_m = SUN_BIAS_PX * at.texel_m + SUN_ROUNDING * sun.down.w;
    let px_per_m = sun.towards.w / at.texel_m;
    var highest_m = sun.across.w + sun.down.w - at.depth_m;
    var radius = 0.0;
    var range = vec2f(0.0);
    let inside = at.square < u32(sun.irradiance.w);
    var turns = select(0u, 1u, inside);
    for (var i = 0u; i < turns; i++) {
        radius = max(px_per_m * highest_m, SUN_LEAST_PX);
        range = sun_range(at, radius) - at.depth_m;
        highest_m = max(range.y, 0.0);
        turns = select(1u, 2u, radius > SUN_BLOCK);
    }
    radius = max(px_per_m * highest_m, SUN_LEAST_PX);
    let tilt_m = length(at.slope) * (radius + 1.0) * at.texel_m + bias_m;
    let is_shaded = inside && range.x > tilt_m;
    let is_lit = !inside || range.y <= 2.0 * bias_m - tilt_m;

    var blockers = 0.0;
    var rise_m = 0.0;
    var tap = first_sun_tap();
    let looks = select(SUN_SEARCH, 0u, is_shaded || is_lit);
    for (var k = 0u; k < looks; k++) {
        let rise = sun_rise(at, radius * sqrt(tap.order / f32(SUN_SEARCH)) * tap.across);
        let blocks = select(0.0, 1.0, rise > bias_m);
        blockers += blocks;
        rise_m += blocks * rise;
        tap = next_sun_tap(tap);
    }
    radius = max(px_per_m * rise_m / max(blockers, 1.0), SUN_LEAST_PX);
    tap = first_sun_tap();
    var open = 0.0;
    let taps = select(0u, SUN_TAPS, blockers > 0.0);
    for (var k = 0u; k < taps; k++) {
        open += select(0.0, 1.0, sun_rise(at, radius * sqrt(tap.order / f32(SUN_TAPS)) * tap.across) <= bias_m);
        tap = next_sun_tap(tap);
    }
    return select(select(open / f32(SUN_TAPS), 1.0, blockers == 0.0), 0.0, is_shaded);
}

@fragment fn sun_main(v: Varyings, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let flat_normal = cross(dpdx(v.p_world), dpdy(v.p_world));
    let n = select(v.n_world, normalize(flat_normal), dot(flat_normal, flat_normal) > 0.0);
    let facing = dot(v.n_world, sun.towards.xyz) * select(-1.0, 1.0, front);
    turn_sun_pattern(vec2u(v.position.xy));
    var seen = 0.0;
    for (var i = 0u; i < select(0u, 1u, TRANSMITS | (facing > 0.0)); i++) { seen = sun_visibility(v.p_world, n); }
    return vec4f(seen);
}
