//! Boxes, filter, limit and order, which an input changes from frame to frame.

use crate::oracle::{Answer, answer};
use crate::source::{Random, Source};
use sapwise::{Aabb, Filter, Membership, PairOrder, Pairs};

/// Most boxes: enough for three threads to share a frame, and few enough for the oracle to take milliseconds.
const MOST_BOXES: usize = 4000;

/// Most pairs: each is compared with the oracle for every algorithm.
const MOST_PAIRS: u64 = 4000;

/// Bounds at the limits of what can be ordered.
const SPECIAL: [f32; 12] = [
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::MAX,
    f32::MIN,
    0.0,
    -0.0,
    1.0e-42,
    -1.0e-42,
    f32::MIN_POSITIVE,
    1.0e30,
    0.5,
];

/// The boxes of a frame.
#[derive(Debug, Default)]
pub struct Scene {
    boxes: Vec<Aabb>,
    memberships: Option<Vec<Membership>>,
    limit: Option<usize>,
    canonical: bool,
}

impl Scene {
    /// Returns the boxes of the present frame.
    pub fn boxes(&self) -> &[Aabb] {
        &self.boxes
    }

    /// Returns an empty list with the order, limit and filter.
    pub fn room(&self) -> Pairs {
        let mut pairs = Pairs::with_order(if self.canonical { PairOrder::Canonical } else { PairOrder::Any });
        pairs.set_limit(self.limit);
        pairs.set_filter(self.memberships.clone().map(Filter::new));
        pairs
    }

    /// Returns the right answer. First removes boxes from a scene with too many pairs.
    pub fn answer(&mut self) -> Answer {
        loop {
            let answer = answer(&self.boxes, self.memberships.as_deref(), self.limit);
            if answer.overlapping <= MOST_PAIRS {
                return answer;
            }
            self.boxes.truncate(self.boxes.len() / 2);
        }
    }

    /// Changes the scene as the next bytes of the input say.
    pub fn edit(&mut self, source: &mut Source<'_>) {
        match source.byte() % 14 {
            0 => self.add(source),
            1 => self.add_many(source),
            2 => self.shake(source),
            3 => self.remove(source),
            4 => self.reorder(source),
            5 => self.filter(source),
            6 => self.limit = Some(source.below(5000)),
            7 => self.limit = None,
            8 => self.canonical = !self.canonical,
            9 => self.spoil(source),
            10 => self.scale(source),
            11 => self.flatten(source),
            12 => self.grow(source),
            _ => self.boxes.clear(),
        }
    }

    /// Adds a few boxes, each of four bytes.
    fn add(&mut self, source: &mut Source<'_>) {
        for _ in 0..source.byte() % 16 {
            let centre = [0; 3].map(|_| source.signed() * 16.0);
            self.push(Aabb::cube(centre, f32::from(source.byte() % 16) * 0.25));
        }
    }

    /// Adds up to 255 boxes, sometimes up to 2048: few boxes find the same faults sooner.
    fn add_many(&mut self, source: &mut Source<'_>) {
        let (mut random, few) = (source.random(), usize::from(source.byte()));
        let count = if few % 32 == 31 { source.below(2048) } else { few };
        let world = [0; 3].map(|_| f32::from(source.byte()) * 0.25);
        for _ in 0..count {
            self.push(Aabb::cube(world.map(|side| random.unit() * side), random.unit()));
        }
    }

    fn push(&mut self, b: Aabb) {
        if self.boxes.len() < MOST_BOXES {
            self.boxes.push(b);
        }
    }

    /// Moves some boxes a little or a lot.
    fn shake(&mut self, source: &mut Source<'_>) {
        let (mut random, share) = (source.random(), f32::from(source.byte()) / 255.0);
        let by = 2.0_f32.powi(i32::from(source.byte() % 16) - 10);
        for b in &mut self.boxes {
            if random.unit() <= share {
                let by = [0; 3].map(|_| (random.unit() - 0.5) * by);
                b.min = [0, 1, 2].map(|k| b.min[k] + by[k]);
                b.max = [0, 1, 2].map(|k| b.max[k] + by[k]);
            }
        }
    }

    /// Removes boxes by `swap_remove`, as engines do.
    fn remove(&mut self, source: &mut Source<'_>) {
        for _ in 0..source.byte() {
            if !self.boxes.is_empty() {
                self.boxes.swap_remove(source.below(self.boxes.len()));
            }
        }
    }

    fn reorder(&mut self, source: &mut Source<'_>) {
        match source.byte() % 4 {
            0 => self.boxes.reverse(),
            1 if !self.boxes.is_empty() => self.boxes.rotate_left(1),
            2 => self.boxes.sort_by(|a, b| a.min[0].total_cmp(&b.min[0])),
            _ => {
                let mut random = source.random();
                (1..self.boxes.len()).for_each(|k| self.boxes.swap(k, random.below(k + 1)));
            }
        }
    }

    fn filter(&mut self, source: &mut Source<'_>) {
        let kind = source.byte() % 4;
        let mut random = source.random();
        let count = match kind {
            0 => return self.memberships = None,
            1 => self.boxes.len(),
            // Too few, and too many.
            2 => self.boxes.len() / 2,
            _ => self.boxes.len() + 10,
        };
        self.memberships = Some((0..count).map(|_| membership(&mut random)).collect());
    }

    /// Writes a special bound, or removes invalid boxes.
    fn spoil(&mut self, source: &mut Source<'_>) {
        if self.boxes.is_empty() {
            return;
        }
        let at = source.below(self.boxes.len());
        let (axis, what) = (usize::from(source.byte() % 3), source.byte());
        let value = SPECIAL[usize::from(source.byte()) % SPECIAL.len()];
        let b = &mut self.boxes[at];
        match what % 4 {
            0 => b.min[axis] = value,
            1 => b.max[axis] = value,
            2 => (b.min[axis], b.max[axis]) = (value, value),
            _ => self.boxes.retain(|b| (0..3).all(|k| b.min[k] <= b.max[k])),
        }
    }

    /// Scales by a power of two along an axis: to infinity, to nothing, or between.
    fn scale(&mut self, source: &mut Source<'_>) {
        let (axis, by) = (usize::from(source.byte() % 3), 2.0_f32.powi(i32::from(source.byte() as i8)));
        for b in &mut self.boxes {
            (b.min[axis], b.max[axis]) = (b.min[axis] * by, b.max[axis] * by);
        }
    }

    fn flatten(&mut self, source: &mut Source<'_>) {
        let (axis, at) = (usize::from(source.byte() % 3), source.signed());
        self.boxes.iter_mut().for_each(|b| (b.min[axis], b.max[axis]) = (at, at));
    }

    /// Makes a few boxes long, wide or large.
    fn grow(&mut self, source: &mut Source<'_>) {
        for _ in 0..source.byte() % 8 {
            if self.boxes.is_empty() {
                return;
            }
            let at = source.below(self.boxes.len());
            let by = [0; 3].map(|_| f32::from(source.byte()));
            let b = &mut self.boxes[at];
            b.max = [0, 1, 2].map(|k| b.max[k] + by[k]);
        }
    }
}

/// Returns one or two of four groups, and a mask without one or two. One box in four is fixed, and three in
/// four have one of three owners.
fn membership(random: &mut Random) -> Membership {
    let mut groups = || 1 << random.below(4) | 1 << random.below(4);
    let (groups, mask) = (groups(), !groups());
    Membership { groups, mask, fixed: random.below(4) == 0, owner: random.below(4) as u32 }
}
