// One level and face of the cube that split_sum.wgsl reads: each texel's light averaged over an isotropic lobe about
// it, seen from above (n = v = r), by filtered importance samples (Colbert & Krivanek 2007).

#include "screen.wgsl"
#include "lobes.wgsl"
#include "directions.wgsl"

struct Prefilter {
    s: vec4f, // columns of the face: direction = s clip.x + t clip.y + axis
    t: vec4f,
    axis: vec4f,
    m: f32,
    texels: f32, // half the log2 of texels per unit area of the source
    level: f32,  // level of the source for m = 0
    padding: f32,
}

@group(0) @binding(0) var<uniform> prefilter: Prefilter;
@group(0) @binding(1) var linear_sampler: sampler;
@group(0) @binding(2) var<storage, read> samples: array<vec4f>; // r cos phi, r sin phi, log2(S)/2, unused
@group(0) @binding(3) var source: texture_cube<f32>;

@fragment fn prefilter_main(screen: Screen) -> @location(0) vec4f {
    let raw = prefilter.s.xyz * screen.clip.x + prefilter.t.xyz * screen.clip.y + prefilter.axis.xyz;
    let n = normalize(raw);
    if (prefilter.m <= 0.0) { return textureSampleLevel(source, linear_sampler, n, prefilter.level); }
    let t = normalize(perpendicular(n));
    let b = cross(n, t);
    var sum = vec4f(0.0);
    var weight = 0.0;
    let count = arrayLength(&samples);
    for (var k = 0u; k < count; k++) {
        let h = lambent_from_slopes(prefilter.m * samples[k].xy);
        let w = lambent_mirrored(vec3f(0.0, 0.0, 1.0), h);
        if (w.z <= 0.0) { continue; }
        let direction = w.x * t + w.y * b + w.z * n;
        let major = max_norm(direction);
        // 1/(n pdf) = S 4 pi m^2 h_z^4/n sr, stretched by 1/major^3 on the cube
        let level = samples[k].z + log2(prefilter.m) + 2.0 * log2(h.z) - 1.5 * log2(major) + prefilter.texels;
        sum += w.z * textureSampleLevel(source, linear_sampler, direction, max(level, 0.0));
        weight += w.z;
    }
    return sum / weight;
}
