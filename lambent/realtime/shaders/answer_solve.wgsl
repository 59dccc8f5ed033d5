// Light between patches: B = D + F (a B + t B of the other side), by Jacobi's method (`lambent.core.answer.solved`).
//
// One workgroup solves for one light group, so that barriers order its sweeps and it stops when all patches have
// converged. Sweeps are split into submissions, and frames are drawn between them.

#include "answer.wgsl"

const LANES = 256u;

struct Solve {
    patches: u32,
    sweeps: u32,  // at most, in this call
    anew: u32,  // 1 in the first call
    tolerance: f32,  // largest relative change of a patch
}

@group(0) @binding(0) var<uniform> solve: Solve;
@group(0) @binding(1) var<storage, read> starts: array<u32>;  // first entry of each patch; end of the last patch's
@group(0) @binding(2) var<storage, read> entries: array<vec2u>;  // index of the sender, bits of its share
@group(0) @binding(3) var<storage, read> patches: array<vec2u>;  // material, patch on the other side
@group(0) @binding(4) var<storage, read> albedos: array<vec4f>;  // reflected by material, then transmitted
@group(0) @binding(5) var<storage, read> direct: array<f32>;
@group(0) @binding(6) var<storage, read_write> indirect: array<f32>;  // B - D
@group(0) @binding(7) var<storage, read_write> sent: array<f32>;
@group(0) @binding(8) var<storage, read_write> outcome: array<u32>;  // sweeps taken, whether it has converged

const ENDLESS = 1e30; // W/m^2; more light counts as diverged, since comparisons with infinities are unreliable

var<workgroup> moved: atomic<u32>;
var<workgroup> stands: u32;

fn light_of(p: u32) -> vec3f {
    let at = 3u * p;
    return vec3f(direct[at] + indirect[at], direct[at + 1u] + indirect[at + 1u], direct[at + 2u] + indirect[at + 2u]);
}

fn send(p: u32) {
    let about = patches[p];
    var light = light_of(p) * albedos[about.x].rgb;
    if (about.y != p) { light += light_of(about.y) * albedos[arrayLength(&albedos) / 2u + about.x].rgb; }
    sent[3u * p] = light.r;
    sent[3u * p + 1u] = light.g;
    sent[3u * p + 2u] = light.b;
}

// Light that arrives at a patch, at least 0: an equivalent albedo may be negative.
fn arrived(p: u32) -> vec3f {
    var sum = vec3f(0.0);
    for (var k = starts[p]; k < starts[p + 1u]; k++) {
        let at = 3u * entries[k].x;
        sum += bitcast<f32>(entries[k].y) * vec3f(sent[at], sent[at + 1u], sent[at + 2u]);
    }
    return max(sum, -vec3f(direct[3u * p], direct[3u * p + 1u], direct[3u * p + 2u]));
}

@compute @workgroup_size(256) fn solve_main(@builtin(local_invocation_index) lane: u32) {
    if (solve.anew != 0u) {
        for (var i = lane; i < 3u * solve.patches; i += LANES) { indirect[i] = 0.0; }
        if (lane == 0u) { outcome[0] = 0u; }
    }
    if (lane == 0u) { stands = select(outcome[1], 0u, solve.anew != 0u); }
    var taken = 0u;
    var done = workgroupUniformLoad(&stands);
    while (taken < solve.sweeps && done == 0u) {
        storageBarrier();
        for (var p = lane; p < solve.patches; p += LANES) { send(p); }
        if (lane == 0u) { atomicStore(&moved, 0u); }
        storageBarrier();
        workgroupBarrier();
        for (var p = lane; p < solve.patches; p += LANES) {
            let before = light_of(p);
            let now = arrived(p);
            indirect[3u * p] = now.r;
            indirect[3u * p + 1u] = now.g;
            indirect[3u * p + 2u] = now.b;
            let light = light_of(p);
            let moves = any(abs(light - before) > solve.tolerance * light + vec3f(NO_LIGHT));
            if (moves || any(light > vec3f(ENDLESS))) { atomicStore(&moved, 1u); }
        }
        workgroupBarrier();
        if (lane == 0u) { stands = 1u - atomicLoad(&moved); }
        done = workgroupUniformLoad(&stands);
        taken++;
    }
    if (lane == 0u) {
        outcome[0] += taken;
        outcome[1] = done;
    }
}
