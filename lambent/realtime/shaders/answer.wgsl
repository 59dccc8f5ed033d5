// What every stage of `lambent.core.answer` on a GPU knows. Light is three floats by patch, point or texel, tightly packed.

#include "answer_constants.wgsl"

// Ratio of light now to light as baked: 1 where there was next to none.
fn ratio_of(now: vec3f, baked: vec3f, least: f32) -> vec3f {
    let known = baked > vec3f(least);
    return select(vec3f(1.0), clamp(now / select(vec3f(1.0), baked, known), vec3f(0.0), vec3f(MOST_RATIO)), known);
}
