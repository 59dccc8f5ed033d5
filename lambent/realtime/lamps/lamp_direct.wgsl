// Direct light of lamps, pixel by pixel, with shadow maps of distances: the light map as shown does not hold it.
// A loop for each branch: adapters in software skip loops of no turns alone.

#include "lamp_record.wgsl"
#include "lamp_light.wgsl"

override LAMPS: u32 = 0u;
override LAMP_WORDS: u32 = 1u; // rows of lamps_reach by texel
override MIRRORS_OPENINGS: bool = false; // the mirrored view that the lobes read shows them

@group(3) @binding(3) var<uniform> point_lamps: array<PointLamp, 64>;
@group(3) @binding(4) var<storage, read> lamps_reach: array<vec4u>; // by texel of the light map: bits of lamps, then shares
@group(3) @binding(5) var lamp_discs: texture_2d_array<f32>; // distances by lamp, then profiles

const LAMP_BIAS = 1e-3; // of a distance: half floats, and facets beside the tangent plane
const LAMP_NEAR = 1.5;  // texels: what is nearer to a surface is that surface
const SEARCH_TAPS = 4u;
const OPENING_TAPS = 8u;
const WIDEST = 4.0; // (1 - t)/t of occluders next to the lamp

// Sums over lamps: irradiance on the viewer's side of the mesh, on the other, and by the normal of a normal map; and
// light through lobes.
struct OfLamps {
    here: vec3f,
    beyond: vec3f,
    bent: vec3f,
    specular: vec3f,
}

// Place in the unit disc, times sin(reach/2), of a direction in the lamp's axes.
fn in_disc(d: vec3f) -> vec2f {
    return d.xy * inverseSqrt(max(2.0 + 2.0 * d.z, 1e-12));
}

// Share of a lamp that is seen from a point at a distance along d, on a surface of normal n, both in the lamp's axes.
// The four texels around d are compared with the surface's tangent plane, whose inverse distance is linear in the
// direction, and so nearly in the texel; their results are weighted bilinearly.
fn lamp_visibility(lamp: u32, scale: f32, d: vec3f, distance_m: f32, n: vec3f) -> f32 {
    let size = vec2f(textureDimensions(lamp_discs));
    let s = in_disc(d);
    let place = (s / scale * 0.5 + 0.5) * size - 0.5;
    let base = floor(place);
    let f = place - base;
    let step = 2.0 * scale / size.x;
    let c = sqrt(max(1.0 - dot(s, s), 1e-6));
    let slope = step * (2.0 * c * n.xy - (2.0 * dot(n.xy, s) / c + 4.0 * n.z) * s); // change of n.d by texel
    let facing = dot(n, d);
    let corner = facing - dot(slope, f);
    let expected = vec4f(corner, corner + slope.x, corner + slope.y, corner + slope.x + slope.y) / (facing * distance_m); // 1/m
    let found_m = textureGather(0, lamp_discs, linear_sampler, (base + 1.0) / size, lamp).wzxy;
    let near_m = LAMP_NEAR * 2.0 * step * distance_m;
    let is_lit = (found_m * expected >= vec4f(1.0 - LAMP_BIAS)) | (found_m >= vec4f(distance_m - near_m));
    let lit = select(vec4f(0.0), vec4f(1.0), is_lit);
    let across = mix(lit.xz, lit.yw, f.x);
    return mix(across.x, across.y, f.y);
}

// Share of a lamp's opening, an ellipse of these half axes in m, that is seen from a point at `away` m, otherwise as
// above: percentage-closer soft shadows (Fernando 2005). Of occluders at a share t of the way from the lamp, the points
// of the opening see places that lie (1 - t)/t apart as they do.
fn opening_visibility(lamp: u32, scale: f32, away: vec3f, half_axes: vec2f, normal: vec3f) -> f32 {
    let n = select(normal, -normal, dot(normal, away) > 0.0);
    let plane = dot(n, away);
    let size = vec2f(textureDimensions(lamp_discs));
    var t = 0.0;
    var found = 0.0;
    for (var k = 0u; k < SEARCH_TAPS; k++) {
        let towards = away + vec3f(spiral(k, SEARCH_TAPS) * half_axes, 0.0);
        let per_m = inverseSqrt(dot(towards, towards));
        let there = in_disc(towards * per_m) / scale * 0.5 + 0.5;
        let first_m = textureLoad(lamp_discs, vec2u(saturate(there) * (size - 1.0)), lamp, 0).r;
        let of_plane = first_m * dot(n, towards) * per_m / plane; // share of the way to the tangent plane
        let blocks = of_plane < 1.0 - LAMP_BIAS && all(there == saturate(there));
        t += select(0.0, of_plane, blocks);
        found += select(0.0, 1.0, blocks);
    }
    let apart = select(0.0, min(found / max(t, 1e-6) - 1.0, WIDEST), found > 0.0);
    var sum = 0.0;
    for (var k = 0u; k < OPENING_TAPS; k++) {
        let towards = away + vec3f(spiral(k, OPENING_TAPS) * half_axes * apart, 0.0);
        let square = dot(towards, towards);
        let d = towards * inverseSqrt(square);
        sum += lamp_visibility(lamp, scale, d, plane / min(dot(n, d), -1e-4), n);
    }
    return sum / f32(OPENING_TAPS);
}

// Point k of n in the unit disc, of equal area each (Vogel 1979).
fn spiral(k: u32, n: u32) -> vec2f {
    let turn = 2.3999632 * f32(k);
    return sqrt((f32(k) + 0.5) / f32(n)) * vec2f(cos(turn), sin(turn));
}

// A pixel under lamps: the mesh's normal on the viewer's side, the triangle's, and one bent by a normal map, world space.
struct UnderLamps {
    p_world: vec3f,
    n: vec3f,
    flat_normal: vec3f,
    bent: vec3f,
    wo: vec3f,
}

// Intensity over a lamp's largest, at a place of its disc in the unit square.
fn profile_at(it: PointLamp, place: vec2f) -> f32 {
    return textureSampleLevel(lamp_discs, linear_sampler, place, LAMPS + u32(it.along.w), 0.0).r;
}

// The four texels around a pixel: rows of lamps_reach, and their weights.
struct Corners {
    rows: vec4u,
    weights: vec4f,
}

fn corners_at(uv2: vec2f) -> Corners {
    let size = vec2f(textureDimensions(light_maps));
    let place = uv2 * size - 0.5;
    let low = vec2u(clamp(floor(place), vec2f(0.0), size - 1.0));
    let high = vec2u(clamp(floor(place) + 1.0, vec2f(0.0), size - 1.0));
    let f = fract(place);
    let width = u32(size.x);
    let texels = vec4u(low.y, low.y, high.y, high.y) * width + vec4u(low.x, high.x, low.x, high.x);
    let g = 1.0 - f;
    return Corners(texels * LAMP_WORDS, vec4f(g.x * g.y, f.x * g.y, g.x * f.y, f.x * f.y));
}

// Visible shares of opening `number` at these texels.
fn shares_at(number: u32, around: Corners) -> vec4f {
    let row = 1u + number / 16u;
    let word = number / 4u % 4u;
    let bytes = vec4u(
        lamps_reach[around.rows.x + row][word], lamps_reach[around.rows.y + row][word],
        lamps_reach[around.rows.z + row][word], lamps_reach[around.rows.w + row][word],
    );
    let shares = (bytes >> vec4u(8u * (number % 4u))) & vec4u(255u);
    return vec4f(shares) / 255.0;
}

fn lit_by(lamp: u32, before: OfLamps, at: UnderLamps, around: Corners, s: Surface, in_shadow: bool) -> OfLamps {
    var sum = before;
    let it = point_lamps[lamp];
    let away = at.p_world - it.place.xyz;
    let square = max(dot(away, away), 1e-12);
    let per_m = inverseSqrt(square);
    let to_axes = transpose(mat3x3f(it.across.xyz, it.down.xyz, it.along.xyz));
    let d = to_axes * (away * per_m);
    let half_axes = vec2f(it.across.w, it.down.w);
    let has_opening = half_axes.x > 0.0;
    var share = profile_at(it, in_disc(d) / it.place.w * 0.5 + 0.5);
    for (var k = 0u; k < select(0u, 1u, in_shadow && share > 0.0 && !has_opening); k++) {
        share *= lamp_visibility(lamp, it.place.w, d, square * per_m, to_axes * at.flat_normal);
    }
    var looks_up = in_shadow && has_opening && share > 0.0;
    for (var k = 0u; k < select(0u, 1u, has_opening && it.intensity.w >= 0.0); k++) {
        let shares = shares_at(u32(it.intensity.w), around);
        looks_up = looks_up && any(shares != shares.xxxx);
        share *= select(dot(shares, around.weights), 1.0, looks_up);
    }
    for (var k = 0u; k < select(0u, 1u, looks_up); k++) {
        share *= opening_visibility(lamp, it.place.w, to_axes * away, half_axes, to_axes * at.flat_normal);
    }
    let light = share / (square + half_axes.x * half_axes.y) * it.intensity.rgb;
    let w = -away * per_m;
    let facing = dot(at.n, w);
    sum.here += max(facing, 0.0) * light;
    sum.beyond += max(-facing, 0.0) * light;
    sum.bent += select(0.0, max(dot(at.bent, w), 0.0), facing > 0.0) * light;
    let wi = vec3f(dot(w, s.t), dot(w, s.b), dot(w, s.n));
    for (var i = 0u; i < select(0u, LOBES, share > 0.0 && !(has_opening && MIRRORS_OPENINGS)); i++) {
        let lobe = lobe_here(i, s).lobe;
        let sides = on_side(lobe, vec3f(1.0));
        let to_lobe = transpose(mat3x3f(sides.x * s.t, sides.y * s.b, sides.z * s.n));
        let along = on_side(lobe, wi);
        let a = rejection(to_lobe * it.across.xyz * (0.5 * half_axes.x * per_m), along);
        let b = rejection(to_lobe * it.down.xyz * (0.5 * half_axes.y * per_m), along);
        let response = lambent_lamp_response(lobe, at.wo, along, a, b);
        sum.specular += select(vec3f(0.0), light * response, lobe_adds(lobe));
    }
    return sum;
}

// Radiance of the opening of a lamp in a unit direction of world space.
fn radiance_of_opening(lamp: u32, towards: vec3f) -> vec3f {
    let it = point_lamps[lamp];
    let d = transpose(mat3x3f(it.across.xyz, it.down.xyz, it.along.xyz)) * towards;
    let place = in_disc(d) / it.place.w * 0.5 + 0.5;
    let share = profile_at(it, place);
    let faces = abs(d) * it.faces.xyz;
    let silhouette = mix(length(faces), dot(faces, vec3f(1.0)), it.faces.w);
    let inside = select(0.0, 1.0, all(place == saturate(place)));
    return inside * share / max(silhouette, 0.01 * length(it.faces.xyz)) * it.intensity.rgb;
}

fn light_of_lamps(at: UnderLamps, uv2: vec2f, s: Surface) -> OfLamps {
    var sum = OfLamps(vec3f(0.0), vec3f(0.0), vec3f(0.0), vec3f(0.0));
    let size = vec2f(textureDimensions(light_maps));
    let texel = vec2u(clamp(uv2 * size, vec2f(0.0), size - 1.0));
    let words = (LAMPS + 31u) / 32u;
    let around = corners_at(uv2);
    for (var word = 0u; word < words; word++) {
        let reach = lamps_reach[(texel.y * u32(size.x) + texel.x) * LAMP_WORDS];
        var left = reach[word];
        while (left != 0u) {
            let bit = firstTrailingBit(left);
            left &= left - 1u;
            sum = lit_by(32u * word + bit, sum, at, around, s, ((reach[2u + word] >> bit) & 1u) != 0u);
        }
    }
    return sum;
}
