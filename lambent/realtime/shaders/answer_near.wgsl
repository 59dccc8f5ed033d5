// Means over eight points near a texel or around another point, packed in words (`lambent.realtime.answered.gpu_answer`).

const NEAR = 8u;
const WORDS = 10u;  // eight points, then eight shares

// Mean of `indirect` over the points `near` row `k`.
fn mean_near(k: u32) -> vec3f {
    var sum = vec3f(0.0);
    var shares = 0.0;
    for (var n = 0u; n < NEAR; n++) {
        let at = 3u * near[WORDS * k + n];
        let share = f32(extractBits(near[WORDS * k + NEAR + n / 4u], 8u * (n % 4u), 8u));
        sum += share * vec3f(indirect[at], indirect[at + 1u], indirect[at + 2u]);
        shares += share;
    }
    return sum / shares;
}
