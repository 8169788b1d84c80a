//! The frames of overhead.c, through the Rust interface. Their instructions are compared: `tools/c.sh overhead`

use sapwise::{Aabb, Adaptive, Body, Handle, Registry, Space};

#[unsafe(no_mangle)]
#[inline(never)]
fn measured_frame(space: &mut Space, handles: &[Handle], boxes: &[Aabb]) -> usize {
    space.set_all(handles, boxes).unwrap();
    space.update().unwrap();
    space.pairs().len()
}

fn main() {
    let n: usize = std::env::args().nth(1).map_or(100, |n| n.parse().unwrap());
    let mut state = 1_u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1 << 24) as f32
    };
    let (name, edge) = if n > 1000 { ("grid-sap@cpu1", 100.0) } else { ("brute@cpu1", 10.0) };
    let mut space = Space::with(Adaptive::only(name.parse().unwrap(), &Registry::with_cores(1)).unwrap());
    let (mut handles, mut pairs) = (Vec::new(), 0);
    for frame in 0..8 {
        let boxes: Vec<Aabb> = (0..n)
            .map(|_| {
                let min = [0; 3].map(|_| next() * edge);
                Aabb::new(min, min.map(|v| v + 1.0))
            })
            .collect();
        if frame == 0 {
            handles = space.insert_all(&boxes, Body::default()).unwrap();
        }
        pairs += measured_frame(&mut space, &handles, &boxes);
    }
    println!("{pairs} pairs");
}
