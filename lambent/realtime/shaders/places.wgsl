// Four places of every pixel beside its middle, and steps from a pixel to the one whose light is at a
// place: four bits for each of the places.

// px right of and below the middle. With the middle they are a lattice: evenly spaced by a fifth along rows and columns,
// and along both diagonals, so that a line of any of these directions meets the same share of them, but for one.
const PLACES = array<vec2f, 4>(vec2f(0.2, 0.4), vec2f(0.4, -0.2), vec2f(-0.2, -0.4), vec2f(-0.4, 0.2));

const OWN = 0u;    // the light of the pixel itself
const MISSED = 4u; // no pixel near the place shows its surface

// Pixels by step 1 to 3: the nearest across a side, the other one, and the one between them.
fn step_of(place: vec2f, step: u32) -> vec2i {
    let side = vec2i(sign(place));
    let nearest = select(vec2i(0, side.y), vec2i(side.x, 0), abs(place.x) > abs(place.y));
    if (step == 3u) { return side; }
    return select(side - nearest, nearest, step == 1u);
}

fn step_at(steps: u32, i: u32) -> u32 {
    return (steps >> (4u * i)) & 15u;
}
