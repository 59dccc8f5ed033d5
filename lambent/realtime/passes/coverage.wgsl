// The surface at four places of every pixel besides its centre, after Chajdas, McGuire and Luebke 2011 ("Subpixel
// reconstruction antialiasing for deferred shading"): the surface of the pixel, of a neighbour, or one that no
// neighbour shows. Depths are reversed, near/z, and so linear in the image along a plane.

#include "screen.wgsl"
#include "places.wgsl"

@group(0) @binding(0) var depths: texture_2d<f32>;
@group(0) @binding(1) var depths_0: texture_2d<f32>; // at each place
@group(0) @binding(2) var depths_1: texture_2d<f32>;
@group(0) @binding(3) var depths_2: texture_2d<f32>;
@group(0) @binding(4) var depths_3: texture_2d<f32>;

const SAME_SURFACE = 0.004; // largest deviation on one surface, relative to the depth
const STEEPEST = 0.1;       // largest slope of one surface between neighbours, relative to the depth, per px

fn depth_of(at: vec2i) -> f32 {
    return textureLoad(depths, clamp(at, vec2i(0), vec2i(textureDimensions(depths)) - 1), 0).r;
}

// Slope (per px) of the depth of a pixel's surface along `along`, from the neighbour more likely to show the surface.
fn slope_along(at: vec2i, here: f32, along: vec2i) -> f32 {
    let after = depth_of(at + along) - here;
    let before = here - depth_of(at - along);
    let least = select(before, after, abs(after) < abs(before));
    return select(0.0, least, abs(least) <= STEEPEST * here);
}

fn slope(at: vec2i, here: f32) -> vec2f {
    return vec2f(slope_along(at, here, vec2i(1, 0)), slope_along(at, here, vec2i(0, 1)));
}

fn is_on(depth: f32, predicted: f32) -> bool {
    return abs(depth - predicted) <= SAME_SURFACE * max(depth, predicted);
}

// Step from a pixel to the one that shows the surface of `depth` at place `i`, not the pixel's own; or MISSED.
fn step_to(at: vec2i, i: u32, depth: f32) -> u32 {
    let size = vec2i(textureDimensions(depths));
    for (var k = 1u; k < MISSED; k++) {
        let offset = step_of(PLACES[i], k);
        let other = at + offset;
        if (any(other < vec2i(0)) || any(other >= size)) { continue; }
        let there = depth_of(other);
        if (is_on(depth, there + dot(slope(other, there), PLACES[i] - vec2f(offset)))) { return k; }
    }
    return MISSED;
}

@fragment fn coverage_main(screen: Screen) -> @location(0) vec4u {
    let at = vec2i(screen.position.xy);
    let here = depth_of(at);
    let rise = slope(at, here);
    let found = vec4f(
        textureLoad(depths_0, at, 0).r, textureLoad(depths_1, at, 0).r, textureLoad(depths_2, at, 0).r,
        textureLoad(depths_3, at, 0).r,
    );
    var steps = 0u;
    for (var i = 0u; i < 4u; i++) {
        if (!is_on(found[i], here + dot(rise, PLACES[i]))) { steps |= step_to(at, i, found[i]) << (4u * i); }
    }
    return vec4u(steps, 0u, 0u, 0u);
}
