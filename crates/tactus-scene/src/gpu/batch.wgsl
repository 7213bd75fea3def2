// What all stages know. Poses run along y of a dispatch.

struct Batch {
    // Columns and rows of elements.
    elements: vec2<u32>,
    // Cells, and numbers between the stages, that a pose has room for.
    cells: u32,
    lines: u32,
    // Steps of the samples' x, then of their y, from one sample to the next along x and along y.
    steps: vec4<u32>,
}

// A pose's part of the buffers and of the lattice.
struct View {
    first_facet: u32,
    facets: u32,
    first: vec2<u32>,
    cells: vec2<u32>,
}
