// Samples of the progressive mode: an additive sequence (Roberts 2018), rotated per pixel and lobe (Cranley & Patterson
// 1976).

// Hash of a pixel, three words (Jarzynski & Olano 2020, pcg3d).
fn pixel_hash(pixel: vec2u, lobe: u32) -> vec3u {
    var v = vec3u(pixel, lobe) * 1664525u + 1013904223u;
    v.x += v.y * v.z; v.y += v.z * v.x; v.z += v.x * v.y;
    v ^= v >> vec3u(16u);
    v.x += v.y * v.z; v.y += v.z * v.x; v.z += v.x * v.y;
    return v;
}

// Sample k in [0, 1)^2. Integers modulo 2^32 are exact for any k; floats would lose the sequence after thousands.
fn sequence(offset: vec2u, k: u32) -> vec2f {
    let bits = offset + k * vec2u(3242174889u, 2447445413u);
    return (vec2f(bits >> vec2u(8u)) + 0.5) / 16777216.0;
}
