// Four places of every pixel besides its centre, and steps from a pixel to the one with the light of a place: four bits
// per place.

// px right of and below the centre. With the centre they form a lattice, evenly spaced by a fifth along rows, columns
// and both diagonals, so that a line in any of these directions covers the same number of places, up to one.
const PLACES = array<vec2f, 4>(vec2f(0.2, 0.4), vec2f(0.4, -0.2), vec2f(-0.2, -0.4), vec2f(-0.4, 0.2));

const OWN = 0u;    // the light of the pixel itself
const MISSED = 4u; // no pixel near the place shows its surface

// Pixels by step 1 to 3: the nearest edge neighbour, the other edge neighbour, and the corner between them.
fn step_of(place: vec2f, step: u32) -> vec2i {
    let side = vec2i(sign(place));
    let nearest = select(vec2i(0, side.y), vec2i(side.x, 0), abs(place.x) > abs(place.y));
    if (step == 3u) { return side; }
    return select(side - nearest, nearest, step == 1u);
}

fn step_at(steps: u32, i: u32) -> u32 {
    return (steps >> (4u * i)) & 15u;
}
