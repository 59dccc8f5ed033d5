// Layers of the texture that holds the specular light of planar reflectors (passes/planar.py).

const PLANAR_ROUGH = 0;  // light of lobes that neighbouring pixels sample in turns; a: distance in the mirror direction
const PLANAR_SHARP = 1;  // of all others; a: surface_number of planar.wgsl, 0 where no reflector is
const PLANAR_NARROW = 2; // weighted rough light of five pixels of a row; a: weights
const PLANAR_WIDE = 3;   // of nine
const PLANAR_LEAST = 4;  // x: least distance in the mirror direction, of nine
