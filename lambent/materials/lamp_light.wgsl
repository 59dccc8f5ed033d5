// A lobe lit by one small lamp, in closed form; tests compare it with quadrature over the lamp. Needs scattering.wgsl.
//
// A lamp is a mean direction w and two vectors a, b, the principal deviations of its directions. f cos_i is a smooth
// factor g times the density P = D h_z^4 of slopes s = (h_x, h_y)/h_z. With H = w + o not normalised,
//     s = H_xy/H_z,  J a = (a_xy - s a_z)/H_z,  g = tint |H|^3/(2 H_z^4) cos_i^(1 - alpha)/cos_o^alpha.
// A Gaussian P of the matrix diag(mx^2, my^2), averaged over a Gaussian lamp, is a Gaussian of the matrix
//     M = diag(mx^2, my^2) + 2 sum (J a)(J a)^T:
// the lobe is widened and keeps its integral. Other lobes may have no variance: theirs is taken from the radius at half
// of their height (slope_curve.widening). If
// log g changes by q_a and q_b along a and b, completing the square gives the mean of g P: its value at w with
// s + q_a J a + q_b J b, times exp((q_a^2 + q_b^2)/2). For a lamp that sets, the part above the horizon counts.

const LAMBENT_HORIZON = 1.2;  // times the summed heights of a and b: reach of a lamp above and below its centre
const LAMBENT_LAMP_COS_MIN = 1e-3;
const LAMBENT_REACH_MIN = 1e-5;

// Mean of f |cos_i| over a lamp, 1/sr: wi its mean direction where the lobe is one about the mirror direction, a and b
// the deviations of its directions in the same frame.
fn lambent_lamp_response(lobe: LambentLobe, wo: vec3f, wi: vec3f, a: vec3f, b: vec3f) -> vec3f {
    let reach = LAMBENT_HORIZON * (abs(a.z) + abs(b.z)) + LAMBENT_REACH_MIN;
    let cos_i = max(select(wi.z, 0.5 * (wi.z + reach), wi.z < reach), LAMBENT_LAMP_COS_MIN);
    let cos_o = max(wo.z, LAMBENT_LAMP_COS_MIN);
    let total = vec3f(wi.xy + wo.xy, cos_i + cos_o);
    let length2 = dot(total, total);
    // one division for four reciprocals, which dominate the cost on a processor
    let per_pair = vec2f(reach * total.z, cos_i * length2);
    let inverse = 1.0 / (per_pair.x * per_pair.y);
    let per_length2 = per_pair.x * cos_i * inverse;
    let per_cos_i = per_pair.x * length2 * inverse;
    let per_z = per_pair.y * reach * inverse;
    let up = clamp(0.5 + 0.5 * wi.z * per_pair.y * total.z * inverse, 0.0, 1.0);  // share above the horizon
    let rise = up * vec2f(a.z, b.z);
    let middle = total.xy * per_z;
    let ja = (a.xy - middle * rise.x) * per_z;
    let jb = (b.xy - middle * rise.y) * per_z;
    let along = vec2f(dot(a.xy, total.xy), dot(b.xy, total.xy)) + rise * total.z;
    let bent = along * (3.0 * per_length2) - rise * (4.0 * per_z - (1.0 - lobe.alpha) * per_cos_i);
    let tilt = clamp(bent, vec2f(-1.0), vec2f(1.0));  // beyond, g is not log-linear
    let slope = middle + tilt.x * ja + tilt.y * jb;
    let wider = lobe.widening;
    let m = vec2f(lobe.mx * lobe.mx, lobe.my * lobe.my) + wider * (ja * ja + jb * jb);
    let xy = wider * (ja.x * ja.y + jb.x * jb.y);
    let per_det = 1.0 / (m.x * m.y - xy * xy);
    let distance2 = max(dot(m.yx, slope * slope) - 2.0 * xy * slope.x * slope.y, 0.0) * per_det;
    let exponent = 0.72134752 * dot(tilt, tilt) + (1.0 - lobe.alpha) * log2(cos_i) - lobe.alpha * log2(cos_o);
    let fall = -1.44269504 * lambent_log_density(distance2, lobe);
    let per_z2 = per_z * per_z;
    let size = sqrt(per_det * length2 * length2 * length2) * per_z2 * per_z2 * (0.5 / LAMBENT_PI);
    return up * exp2(exponent - fall) * size * lambent_tint(min(0.5 * sqrt(length2), 1.0), lobe);
}
