//! Boxes that are declared fixed: peers keep them in a tree of their own, as engines do.

use sapwise::{Aabb, BroadPhase, Error, Pairs};

/// A tree that is built once and queried.
pub(crate) trait Ground: Send + Sync {
    fn build(boxes: &[Aabb]) -> Self;

    /// Calls `found` with the position of each box that overlaps this one.
    fn query(&self, b: &Aabb, found: impl FnMut(u32));
}

/// An algorithm for the boxes that move, and a tree for the fixed ones, which the first frame builds. Each box that
/// moves queries that tree. Without a filter the algorithm gets all boxes.
///
/// The flags stay as they are in the first frame.
pub(crate) struct Grounded<G, P> {
    algorithm: P,
    ground: Option<G>,
    fixed: Vec<u32>,
    movers: Vec<u32>,
    /// Boxes of the movers.
    boxes: Vec<Aabb>,
    among: Pairs,
}

impl<G: Ground, P: BroadPhase> Grounded<G, P> {
    pub(crate) fn new(algorithm: P) -> Self {
        let (fixed, movers, boxes) = (Vec::new(), Vec::new(), Vec::new());
        Self { algorithm, ground: None, fixed, movers, boxes, among: Pairs::new() }
    }
}

impl<G: Ground, P: BroadPhase> BroadPhase for Grounded<G, P> {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        let Some(filter) = pairs.filter() else { return self.algorithm.find_pairs(boxes, pairs) };
        let (fixed, movers) = (&mut self.fixed, &mut self.movers);
        let ground = self.ground.get_or_insert_with(|| {
            (*fixed, *movers) = (0..boxes.len() as u32).partition(|&k| filter.memberships[k as usize].fixed);
            let ground: Vec<Aabb> = fixed.iter().map(|&k| boxes[k as usize]).collect();
            G::build(&ground)
        });
        pairs.clear();
        self.boxes.clear();
        self.boxes.extend(movers.iter().map(|&k| boxes[k as usize]));
        self.algorithm.find_pairs(&self.boxes, &mut self.among)?;
        self.among.iter().for_each(|&(a, b)| pairs.push(movers[a as usize], movers[b as usize]));
        for (&k, b) in movers.iter().zip(&self.boxes) {
            ground.query(b, |at| pairs.push(k, fixed[at as usize]));
        }
        pairs.finish()
    }
}
