// Diffuse light for a bent normal, from the dominant direction of the light at the mesh's normal.

// E(bent)/E(n) for light of the dominant direction d: the mean of incident directions, weighted by irradiance, in the
// frame of n and bent. The light is modelled as a share a of a uniform hemisphere, whose mean is 2/3 n, and one lamp in
// direction l: d = a 2/3 n + (1 - a) l with |l| = 1 gives a. Exact for either alone. Directions below the mesh's own
// horizon are dark.
fn bent_share(d: vec3f, n: vec3f, bent: vec3f) -> f32 {
    let square = dot(d, d);
    if (square < 1e-6) { return 1.0; }
    // 5/9 a^2 - 2 h a + c = 0: smaller root, without cancellation
    let h = 1.0 - 2.0 / 3.0 * dot(d, n);
    let c = max(1.0 - square, 0.0);
    let a = min(c / (h + sqrt(max(h * h - 5.0 / 9.0 * c, 0.0)) + 1e-6), 1.0);
    let l = d - a * 2.0 / 3.0 * n; // times 1 - a
    let lamp = max(dot(l, bent), 0.0) / max(dot(l, n), 0.05 * length(l) + 1e-6);
    return a * 0.5 * (1.0 + dot(n, bent)) + (1.0 - a) * lamp;
}
