//! Objects that fall, pile up and are dropped again: `free-fall`.

use super::rng::{Rng, cube_root};
use sapwise::Aabb;

/// Frames from one drop to the next.
const CYCLE: u64 = 240;
/// 9.81 m/s^2 for cubes of one metre at 60 frames a second, in edges per frame squared.
const ACCELERATION: f32 = 9.81 / 3600.0;
/// Distance between columns, in edges.
const COLUMN: f32 = 1.2;
/// Greatest distance of an object from the axis of its column on x and y, in edges.
const JITTER: f32 = 0.15;
/// Distance between layers at rest, in edges: less than one, so that objects in contact overlap, as in engines.
const LAYER: f32 = 0.95;
/// Highest pile, in layers.
const LAYERS: u64 = 16;
/// Least height of a fall, in edges. Each layer falls by one more, and each object by up to 0.9 more.
const HEIGHT: f32 = 10.0;

/// Unit cubes in columns. Each falls along its column to its own place of rest; none is solved for contact.
#[derive(Debug, Clone)]
pub(super) struct Fall {
    objects: u64,
    layers: u64,
    /// Columns along one side of the floor.
    side: u64,
    /// Step through the places of rest from one object to the next; coprime to `objects`.
    stride: u64,
    /// The height at rest and the height of the fall of each object.
    heights: Vec<[f32; 2]>,
}

impl Fall {
    /// Columns for `objects`, as high as the floor is wide up to 16 layers.
    pub(super) fn new(objects: usize) -> Self {
        let count = objects as u64;
        let layers = (cube_root(objects as f64).ceil() as u64).clamp(1, LAYERS);
        let side = (count.div_ceil(layers) as f64).sqrt().ceil() as u64;
        // Objects that follow each other in the list lie far apart in the pile: a step of the golden section, made
        // coprime.
        let mut stride = (objects as f64 * 0.618_033_988_749_895) as u64;
        while gcd(stride, count) > 1 {
            stride += 1;
        }
        Self { objects: count, layers, side, stride, heights: vec![[0.0; 2]; objects] }
    }

    /// Lifts every object to a new height above its place of rest, and writes all boxes.
    pub(super) fn drop(&mut self, rng: &mut Rng, boxes: &mut Vec<Aabb>) {
        boxes.clear();
        let middle = self.side as f32 * 0.5;
        let mut place = 0;
        for height in &mut self.heights {
            let (column, layer) = (place / self.layers, (place % self.layers) as f32);
            let jitter = rng.signed3();
            let x = ((column % self.side) as f32 - middle) * COLUMN + jitter[0] * JITTER;
            let y = ((column / self.side) as f32 - middle) * COLUMN + jitter[1] * JITTER;
            *height = [layer * LAYER + 0.5, HEIGHT + layer + 0.45 * (jitter[2] + 1.0)];
            boxes.push(Aabb::cube([x, y, height[0] + height[1]], 0.5));
            place += self.stride;
            if place >= self.objects {
                place -= self.objects;
            }
        }
    }

    /// Moves every object that has not landed; drops all again at the end of a cycle.
    pub(super) fn advance(&mut self, frame: u64, rng: &mut Rng, boxes: &mut Vec<Aabb>) {
        let time = frame % CYCLE;
        if time == 0 {
            return self.drop(rng, boxes);
        }
        let fallen = |time: u64| 0.5 * ACCELERATION * (time * time) as f32;
        if fallen(time - 1) > HEIGHT + self.layers as f32 {
            // All objects have landed in an earlier frame.
            return;
        }
        let fallen = fallen(time);
        for (&[rest, height], aabb) in self.heights.iter().zip(boxes) {
            let z = rest + (height - fallen).max(0.0);
            aabb.min[2] = z - 0.5;
            aabb.max[2] = z + 0.5;
        }
    }
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}
