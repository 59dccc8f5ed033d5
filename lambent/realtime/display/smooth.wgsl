// Edges of the display image, blended: fast approximate antialiasing (Lottes 2009), written from the published idea.
// A step of luma runs along an edge. The distances to the edge's ends give the share of the pixel beyond the edge, and
// the image is read with that shift across it. Works on the encoded image, as perceived, so lamps' edges are smoothed
// too.

#include "screen.wgsl"

@group(0) @binding(0) var shown: texture_2d<f32>;
@group(0) @binding(1) var linear_sampler: sampler;

const LEAST_STEP = 0.02;     // of luma; smaller steps stay
const LEAST_CONTRAST = 0.04; // of a step, relative to the brighter side
const STRIDES = array<f32, 8>(1.0, 1.0, 1.0, 1.0, 1.5, 2.0, 2.0, 3.0); // px
const DETAIL = 0.75; // largest shift (px) of a pixel that differs from all its neighbours

fn luma(encoded: vec3f) -> f32 {
    return dot(encoded, vec3f(0.299, 0.587, 0.114));
}

fn pixel(at: vec2i) -> vec4f {
    return textureLoad(shown, clamp(at, vec2i(0), vec2i(textureDimensions(shown)) - 1), 0);
}

fn pixel_luma(at: vec2i) -> f32 {
    return luma(pixel(at).rgb);
}

fn sampled(position: vec2f) -> vec3f {
    return textureSampleLevel(shown, linear_sampler, position / vec2f(textureDimensions(shown)), 0.0).rgb;
}

// x: px from `start`, a point between the two sides of the edge, to its end in `direction`, or to the end of the
// search; y: luma there minus `middle`, the mean of both sides.
fn edge_end(start: vec2f, direction: vec2f, middle: f32, tolerance: f32) -> vec2f {
    var reached = 0.0;
    var found = vec2f(0.0);
    for (var i = 0u; i < 8u; i++) {
        reached += STRIDES[i];
        // the edge ends between this sample and the previous one
        found = vec2f(reached - 0.5 * STRIDES[i], luma(sampled(start + reached * direction)) - middle);
        if (abs(found.y) >= tolerance) { break; }
    }
    return found;
}

@fragment fn smooth_main(screen: Screen) -> @location(0) vec4f {
    let at = vec2i(screen.position.xy);
    let here = vec4f(textureLoad(shown, at, 0).rgb, 1.0);
    let north = pixel(at + vec2i(0, -1));
    let south = pixel(at + vec2i(0, 1));
    let west = pixel(at + vec2i(-1, 0));
    let east = pixel(at + vec2i(1, 0));
    // cover.wgsl has blended these pixels; blending again would dim thin lines.
    if (min(min(north.a, south.a), min(min(west.a, east.a), textureLoad(shown, at, 0).a)) < 1.0) { return here; }
    let m = luma(here.rgb);
    let n = luma(north.rgb);
    let s = luma(south.rgb);
    let w = luma(west.rgb);
    let e = luma(east.rgb);
    let high = max(m, max(max(n, s), max(w, e)));
    let range = high - min(m, min(min(n, s), min(w, e)));
    if (range < max(LEAST_STEP, LEAST_CONTRAST * high)) { return here; }

    let nw = pixel_luma(at + vec2i(-1, -1));
    let ne = pixel_luma(at + vec2i(1, -1));
    let sw = pixel_luma(at + vec2i(-1, 1));
    let se = pixel_luma(at + vec2i(1, 1));
    let down = abs(nw - 2.0 * w + sw) + 2.0 * abs(n - 2.0 * m + s) + abs(ne - 2.0 * e + se);
    let right = abs(nw - 2.0 * n + ne) + 2.0 * abs(w - 2.0 * m + e) + abs(sw - 2.0 * s + se);
    let horizontal = down >= right;
    let along = select(vec2f(0.0, 1.0), vec2f(1.0, 0.0), horizontal);
    let before = select(w, n, horizontal);
    let after = select(e, s, horizontal);
    let backward = abs(before - m) >= abs(after - m);
    let across = select(1.0, -1.0, backward) * along.yx;
    let beyond = select(after, before, backward);

    let middle = 0.5 * (m + beyond);
    let start = screen.position.xy + 0.5 * across;
    let tolerance = 0.25 * abs(beyond - m);
    let one = edge_end(start, -along, middle, tolerance);
    let other = edge_end(start, along, middle, tolerance);
    let nearer = select(other, one, one.x < other.x);
    let covered = 0.5 - nearer.x / (one.x + other.x);
    // At the near end, the luma turns to the far side's if the edge leaves this pixel, to this side's if it enters.
    let shift = select(0.0, covered, (nearer.y < 0.0) != (m < middle));

    // Difference of a pixel from its surroundings, relative to the step: a third at a straight edge, two thirds on a
    // thin line, all on a dot.
    let around = (2.0 * (n + s + w + e) + nw + ne + sw + se) / 12.0;
    let detail = DETAIL * smoothstep(1.0 / 3.0, 1.0, abs(around - m) / range);
    return vec4f(sampled(screen.position.xy + max(shift, detail) * across), here.a);
}
