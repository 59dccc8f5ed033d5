// The share of the sun's light that each pixel gets, by a shadow map of the scene, made once (realtime/sun/sun.py): depth along the sun's direction in nested
// squares, the smallest first, and the least and greatest depths of blocks of texels. Layers of clear glass beside it
// (realtime/sun/panes.py) tint what they let through.
//
// A wide sun's disc is cut into parts, each with a map of its own: in one map blockers hide others behind them. Penumbras
// are as wide as a part's disc makes them behind the mean of the blockers (Fernando 2005, "Percentage-closer soft
// shadows"). The plane of the surface is followed from texel to texel, so that it does not shadow itself. Under the edge of
// a sheet that touches the surface, texels beyond that edge do not count: what they show is farther from the sun.

#include "frame.wgsl"
#include "sun_record.wgsl"

@group(1) @binding(0) var<uniform> sun: Sun;
@group(1) @binding(1) var sun_depths: texture_depth_2d_array;
@group(1) @binding(2) var sun_blocks: texture_2d_array<f32>; // (least, greatest) depth

@group(1) @binding(3) var pane_depths: texture_depth_2d_array; // layer x squares + square
@group(1) @binding(4) var pane_colours: texture_2d_array<f32>;
@group(1) @binding(5) var sun_reaches: texture_2d<f32>; // by texel of the light map: 0 where the sun does not get

// Conditions of uniforms alone, of loops or in `&&`, make Mesa's software adapter copy the shader for every render pass, and
// keep the copies: use constants and `&`.
override PARTS: u32 = 4u;        // of the disc, each with a map of its own
override SQUARES: u32 = 4u;      // of each part of the disc
override PANES: u32 = 0u;        // layers of clear glass
override TRANSMITS: bool = false; // surfaces show light from behind them

const SUN_BLOCK = 8.0;       // texels along the side of the smallest block: BLOCK of realtime/sun/sun.py
const SUN_SEARCH = 8u;       // taps that look for blockers
const SUN_TAPS = 16u;        // taps that are compared
const SUN_LEAST_PX = 1.5;    // texels: least radius of either
const SUN_STEEPEST = 20.0;   // slope, depth over width, beyond which a surface is not followed
const SUN_BIAS_PX = 0.3;     // texels, by which what is nearer to the sun casts no shadow
const SUN_BEYOND_PX = 2.0;   // texels, by which what is farther from the sun is no part of the surface
const SUN_LEAST_BEND = 0.85; // cosine between a facet and the smooth surface that it stands for
const SUN_ROUNDING = 4e-7;   // of the depths' span
const PANE_LOOKS = 8u;       // taps that look for panes
const PANE_TAPS = 6u;        // that are averaged
const PANE_SEARCH_PX = 4.0;  // texels of theirs, within which panes are looked for beside the one above
const HARDLY = 1e-3;         // weight of taps that meet what blocks the sun, where no other tells
const PANE_LEAST_PX = 0.6;   // likewise: least radius

var<private> sun_turn: vec2f; // of the pattern at this pixel: share of a ring, share of a turn
var<private> sun_part: u32;   // of the disc, that this pixel asks for in this frame

// Sixteen patterns in turn over 4 x 4 pixels; others in every frame of a progressive series or of a still. Four pixels
// and four frames ask for all parts of the disc.
fn turn_sun_pattern(pixel: vec2u) {
    let mixed = pixel.x ^ pixel.y;
    let place = ((mixed & 1u) << 3u) | ((pixel.y & 1u) << 2u) | (mixed & 2u) | ((pixel.y & 2u) >> 1u);
    let frames = f32(frame.first_sample & 0xffffu);
    let order = f32(place) + 0.5;
    sun_part = ((pixel.x & 1u) + 2u * (pixel.y & 1u) + (u32(frame.eye.w) >> 4u)) % PARTS;
    let turn = f32(u32(frame.eye.w) >> 2u); // sixteen in a still: for each part they show all of a ring
    sun_turn = fract(vec2f((order + 5.0 * turn) / 16.0 + 0.7548776662 * frames, 0.6180339887 * (order + turn) + 0.5698402910 * frames));
}

// Where a surface lies in the map: place in texels of a square, depth in metres towards the sun, and its slope, metres of
// depth per metre along rows and columns.
struct SunPlace {
    texel: vec2f,
    square: u32, // of the part, its number of squares where there is none
    depth_m: f32,
    slope: vec2f,
    texel_m: f32,
    layer: u32,   // of the map
    last: vec2f,  // texel of a square
    low_m: f32,   // depth where the map has 0
    span_m: f32,  // metres that its depths of 0 to 1 span
    tangent: f32, // of the part's angular radius
}

// Layers of the map: all squares of one part after those of another.
fn sun_layers() -> u32 {
    return PARTS * u32(sun.irradiance.w);
}

fn sun_depth_m(at: SunPlace, stored: f32) -> f32 {
    return at.low_m + at.span_m * stored;
}

// Least and greatest depth (m) within `radius` texels, and somewhat beyond: a block's range is that of its neighbours, too.
fn sun_range(at: SunPlace, radius: f32) -> vec2f {
    let across = i32(textureDimensions(sun_blocks).y); // blocks of the first level
    let level = u32(clamp(ceil(log2((radius + 1.0) / SUN_BLOCK)), 0.0, log2(f32(across))));
    let corner = select(vec2i(across, across - (across >> (level - 1u))), vec2i(0), level == 0u);
    let block = vec2i(at.texel / (SUN_BLOCK * exp2(f32(level))));
    let range = textureLoad(sun_blocks, corner + block, at.layer, 0).xy;
    return vec2f(sun_depth_m(at, range.x), sun_depth_m(at, range.y));
}

// How far (m) the map is nearer to the sun than the surface, in the texel at `offset` from its own.
fn sun_rise(at: SunPlace, offset: vec2f) -> f32 {
    let texel = clamp(floor(at.texel + offset), vec2f(0.0), at.last);
    let here = at.depth_m + dot(at.slope, (texel + 0.5 - at.texel) * at.texel_m);
    return sun_depth_m(at, textureLoad(sun_depths, vec2i(texel), at.layer, 0)) - here;
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
    // read once, not at each tap: adapters in software read what depends on the pixel lane by lane
    let across = sun.across[sun_part];
    let down = sun.down[sun_part];
    let towards = sun.part_towards[sun_part];
    let axes = vec2f(dot(across.xyz, p_world), dot(down.xyz, p_world));
    let side = f32(textureDimensions(sun_depths).x);
    var at = SunPlace();
    at.last = vec2f(side - 1.0);
    at.low_m = across.w;
    at.span_m = down.w;
    at.tangent = towards.w;
    at.square = u32(sun.irradiance.w);
    for (var k = 0u; k < SQUARES; k++) {
        at.texel = (axes - sun.squares[4u * sun_part + k].xy) * sun.squares[4u * sun_part + k].z;
        at.texel_m = sun.squares[4u * sun_part + k].w;
        if (all(at.texel > vec2f(2.0)) && all(at.texel < vec2f(side - 2.0))) {
            at.square = k;
            break;
        }
    }
    at.layer = sun_part * u32(sun.irradiance.w) + at.square;
    at.depth_m = dot(towards.xyz, p_world);
    let facing = dot(towards.xyz, n_world);
    let falls = -vec2f(dot(across.xyz, n_world), dot(down.xyz, n_world)) * select(-1.0, 1.0, facing > 0.0);
    at.slope = falls / max(abs(facing), length(falls) / SUN_STEEPEST);
    return at;
}

// The share of the sun's disc that a point sees; n is the normal of the flat surface there, on either side.
//
// Adapters in software skip loops of no turns, but neither branches nor what follows a return, and a loop within another
// costs them more than it saves: one loop looks for blockers and then compares.
fn sun_visibility(p_world: vec3f, n_world: vec3f) -> f32 {
    let at = sun_place(p_world, n_world);
    let bias_m = SUN_BIAS_PX * at.texel_m + SUN_ROUNDING * at.span_m;
    let px_per_m = at.tangent / at.texel_m;
    var highest_m = at.low_m + at.span_m - at.depth_m;
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
    var sum_m = 0.0; // of their distances towards the sun
    var nearest_m = 1e30;
    var touches = false;
    var open = 0.0;
    var open_here = 0.0;
    var here = 0.0;
    var spread = radius * inverseSqrt(f32(SUN_SEARCH));
    let first = first_sun_tap();
    var tap = first;
    turns = select(SUN_SEARCH, 0u, is_shaded || is_lit);
    for (var k = 0u; k < turns; k++) {
        let is_search = k < SUN_SEARCH;
        let reach = select(spread, min(spread, SUN_LEAST_PX), k == 0u); // the first finds what touches the surface
        let rise = sun_rise(at, reach * sqrt(tap.order) * tap.across);
        let blocks = rise > bias_m;
        if (is_search) {
            blockers += select(0.0, 1.0, blocks);
            sum_m += select(0.0, rise, blocks);
            nearest_m = select(nearest_m, min(nearest_m, rise), blocks);
            touches |= k == 0u && blocks && px_per_m * rise < SUN_LEAST_PX;
        } else {
            let on_surface = select(0.0, 1.0, rise > -SUN_BEYOND_PX * at.texel_m);
            open += select(1.0, 0.0, blocks);
            open_here += select(on_surface, 0.0, blocks);
            here += on_surface;
        }
        tap = next_sun_tap(tap);
        if (k == SUN_SEARCH - 1u) {
            let behind_m = select(sum_m / max(blockers, 1.0), 0.0, touches);
            spread = max(px_per_m * behind_m, SUN_LEAST_PX) * inverseSqrt(f32(SUN_TAPS));
            tap = first;
            turns = select(SUN_SEARCH, SUN_SEARCH + SUN_TAPS, blockers > 0.0);
        }
    }
    let share = select(open / f32(SUN_TAPS), open_here / max(here, 1.0), px_per_m * nearest_m < SUN_LEAST_PX && here > 0.0);
    return select(select(share, 1.0, turns <= SUN_SEARCH), 0.0, is_shaded);
}

// The texel of panes `offset` of them away from a point's own.
fn pane_texel(at: SunPlace, offset: vec2f) -> vec2i {
    let side = vec2f(textureDimensions(pane_depths));
    let to_pane = side / vec2f(textureDimensions(sun_depths));
    return vec2i(clamp(floor(at.texel * to_pane + offset), vec2f(0.0), side - 1.0));
}

// How far (m) a layer of panes is nearer to the sun than the surface.
fn pane_rise(at: SunPlace, texel: vec2i, layer: u32) -> f32 {
    let to_sun = vec2f(textureDimensions(sun_depths)) / vec2f(textureDimensions(pane_depths));
    let here = at.depth_m + dot(at.slope, ((vec2f(texel) + 0.5) * to_sun - at.texel) * at.texel_m);
    return sun_depth_m(at, textureLoad(pane_depths, texel, layer * sun_layers() + at.layer, 0)) - here;
}

// What the clear glass between a point and the part of the sun that it sees lets through; edges are as wide as the sun's
// disc makes them behind the nearest pane.
fn sun_through_panes(p_world: vec3f, n_world: vec3f) -> vec3f {
    let at = sun_place(p_world, n_world);
    let to_sun = f32(textureDimensions(sun_depths).x) / f32(textureDimensions(pane_depths).x);
    let texel_m = at.texel_m * to_sun;
    let bias_m = SUN_BIAS_PX * texel_m + SUN_ROUNDING * at.span_m;
    let inside = at.square < u32(sun.irradiance.w);
    var tap = first_sun_tap();
    var rise_m = 0.0;
    for (var k = 0u; k < select(0u, PANE_LOOKS, inside); k++) {
        let reach = select(PANE_SEARCH_PX * tap.order / f32(PANE_LOOKS), 0.0, k == 0u);
        rise_m = max(rise_m, pane_rise(at, pane_texel(at, reach * tap.across), 0u));
        tap = next_sun_tap(tap);
    }
    let radius = max(at.tangent * rise_m / texel_m, PANE_LEAST_PX);
    var sum = vec4f(0.0);
    tap = first_sun_tap();
    let taps = select(0u, PANE_TAPS, rise_m > bias_m);
    for (var k = 0u; k < taps; k++) {
        let offset = radius * sqrt(tap.order / f32(PANE_TAPS)) * tap.across;
        let texel = pane_texel(at, offset);
        var passed = vec3f(1.0);
        for (var layer = 0u; layer < PANES; layer++) {
            let colour = textureLoad(pane_colours, texel, layer * sun_layers() + at.layer, 0).rgb;
            passed *= select(vec3f(1.0), colour, pane_rise(at, texel, layer) > bias_m);
        }
        sum += select(HARDLY, 1.0, sun_rise(at, offset * to_sun) <= bias_m) * vec4f(passed, 1.0);
        tap = next_sun_tap(tap);
    }
    return select(vec3f(1.0), sum.rgb / sum.a, taps > 0u);
}

// Mean over four pixels of one triangle, which ask for the four parts. Adapters shade 2 x 2 pixels at once, and those of
// them that the triangle does not cover as well.
fn mean_of_parts(seen: vec3f, pixel: vec2u) -> vec3f {
    let is_odd = vec2f(pixel & vec2u(1u));
    let row = seen + (0.5 - is_odd.x) * dpdxFine(seen);
    let all = row + (0.5 - is_odd.y) * dpdyFine(row);
    return select(seen, clamp(all, vec3f(0.0), vec3f(1.0)), PARTS > 1u);
}

// Whether the sun gets to the light map's texel at a place. Along joints of thin sheets, depths alone let light through.
fn is_sunlit(uv2: vec2f) -> bool {
    let size = vec2f(textureDimensions(sun_reaches));
    return textureLoad(sun_reaches, vec2i(clamp(uv2 * size, vec2f(0.0), size - 1.0)), 0).r > 0.0;
}

// 1 where a pixel or another of its 2 x 2, which take their mean, has `value` 1, else 0.
fn in_any_of_four(value: f32) -> f32 {
    let row = max(value, abs(dpdxFine(value)));
    return max(row, abs(dpdyFine(row)));
}

struct SunVaryings {
    @invariant @builtin(position) position: vec4f, // to the bit that of depth.wgsl
    @location(0) p_world: vec3f,
    @location(1) n_world: vec3f,
    @location(2) uv2: vec2f,
    @location(3) tangent_m: f32, // of the vertex's tangent plane: distance from the eye
}

@vertex fn vertex_main(@location(0) position: vec3f, @location(1) normal: vec3f, @location(3) uv2: vec2f) -> SunVaryings {
    let tangent_m = dot(position - frame.eye.xyz, normal);
    return SunVaryings(frame.clip_from_world * vec4f(position, 1.0), position, normal, uv2, tangent_m);
}

// A place whose sunlight is looked up, and the normal of the surface there.
struct SunPoint {
    p_world: vec3f,
    n_world: vec3f,
}

// The place on the smooth surface that a facet stands for: half as far above the facet as the tangent planes of its
// vertices, which is exact for equal curvature (after Hanika 2021, "Hacking the shadow terminator"). Only outwards.
fn on_smooth_surface(v: SunVaryings, side: f32) -> SunPoint {
    let bulge_m = 0.5 * side * (v.tangent_m - dot(v.p_world - frame.eye.xyz, v.n_world));
    let n = normalize(side * v.n_world);
    return SunPoint(v.p_world + max(bulge_m, 0.0) * n, n);
}

@fragment fn sun_main(v: SunVaryings, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let flat_normal = cross(dpdx(v.p_world), dpdy(v.p_world));
    let is_reached = is_sunlit(v.uv2);
    let of_four = in_any_of_four(select(0.0, 1.0, is_reached)); // texels of the others may be of other charts
    let side = select(-1.0, 1.0, front);
    let facing = dot(v.n_world, sun.towards.xyz) * side;
    let n = select(v.n_world, normalize(flat_normal), dot(flat_normal, flat_normal) > 0.0);
    let outwards = n * select(-1.0, 1.0, dot(n, v.n_world) * side > 0.0);
    // facets that turn away from the sun hide themselves, although the smooth surface is lit
    let bends = (dot(outwards, sun.towards.xyz) < 1.0 / SUN_STEEPEST) & (dot(outwards, v.n_world) * side > SUN_LEAST_BEND);
    var at = SunPoint(v.p_world, n);
    var seen = vec3f(0.0);
    // most of an interior gets no sun: what is outside this loop costs adapters in software as much there as in the sun
    var turns = select(0u, 1u, (of_four > 0.0) & (TRANSMITS | (facing > 0.0)));
    for (var i = 0u; i < turns; i++) {
        turn_sun_pattern(vec2u(v.position.xy));
        let share = sun_visibility(at.p_world, at.n_world);
        var passed = vec3f(1.0);
        for (var j = 0u; j < select(0u, 1u, PANES > 0u && share > 0.0); j++) { passed = sun_through_panes(at.p_world, at.n_world); }
        seen = max(seen, share * passed);
        turns = select(1u, 2u, bends & (share < 1.0) & (facing > 0.0));
        at = on_smooth_surface(v, side);
    }
    return vec4f(select(vec3f(0.0), mean_of_parts(seen, vec2u(v.position.xy)), is_reached), 1.0);
}
