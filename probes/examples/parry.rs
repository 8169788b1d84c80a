//! A command of your own: all of `sapwise`, with parry3d's bounding volume hierarchy as one more algorithm.
//!
//! ```sh
//! parry() { cargo run --release -p sapwise-cli --example parry -- "$@"; }
//! parry probe --no-gpus --out parry.json                      # times it beside ours, and verifies every answer
//! parry train parry.json --out with-parry.json                  # fits its cost, with terms of its own, beside those of ours
//! parry predict --model with-parry.json --out tuning.json     # where it is the fastest on this machine
//! parry run fragmentation --tuning tuning.json              # what choosing it saves
//! ```
//!
//! The manifest of a program outside of this repository needs `sapwise` and `sapwise-cli`.

use parry3d::bounding_volume::Aabb as Bounds;
use parry3d::partitioning::{Bvh, BvhBuildStrategy, BvhWorkspace};
use sapwise::model::Scale;
use sapwise::{Aabb, BroadPhase, Error, Incremental, Pairs, Product, Term};
use sapwise_cli::{Command, UserAlgorithm};
use std::process::ExitCode;

/// Visible to the test of this example, which is a command with the same `main`.
pub(crate) fn main() -> ExitCode {
    // The name stands in reports, models and tuning. The 1 is the revision: count it up whenever `find_pairs` gets faster or slower, so
    // that what was measured before is known to be stale. An algorithm on several threads is made by `UserAlgorithm::on_threads`.
    let tree = UserAlgorithm::on_one_thread("parry", 1, || Ok(Box::new(Tree::default())));
    Command::new().with(tree.terms(&terms())).run()
}

/// What a frame's time consists of: a tree visits about log2 n nodes to move an object and to find a pair. No grid method has such terms.
fn terms() -> [(Term, Scale); 4] {
    [
        (Term::Call, Scale::Cycle),
        (Term::Objects, Scale::Cycle),
        (Term::Product(Product::ONE.objects(1).log2_objects(1)), Scale::Cycle),
        (Term::Product(Product::ONE.pairs(1).log2_objects(1)), Scale::Cycle),
    ]
}

/// A tree that is kept from frame to frame, as rapier keeps it.
#[derive(Default)]
struct Tree {
    tree: Bvh,
    workspace: BvhWorkspace,
    /// The boxes of the frame before.
    before: Vec<Aabb>,
}

impl BroadPhase for Tree {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        // A box that can't be ordered would go missing in the tree without a word.
        if let Some((index, defect)) = boxes.iter().enumerate().find_map(|(k, b)| Some((k, b.defect()?))) {
            return Err(Error::InvalidBox { index, defect });
        }
        self.update(boxes);
        // Boxes that touch overlap in parry as well.
        self.tree.traverse_bvtt_single_tree::<false>(&mut self.workspace, &mut |a, b| pairs.push(a, b));
        pairs.finish()
    }

    /// The tree of the frame before makes this frame cheaper, so a probe lets some frames pass before it takes samples.
    fn as_incremental(&mut self) -> Option<&mut dyn Incremental> {
        Some(self)
    }
}

impl Incremental for Tree {}

impl Tree {
    /// Brings the tree from the boxes of the frame before to these.
    fn update(&mut self, boxes: &[Aabb]) {
        let (now, before) = (boxes.len(), self.before.len());
        let few = now / 4;
        // Frames need not be neighbours: between two of them another algorithm may have had its turn for a minute, and a probe goes on
        // to another scene. A tree over boxes that are all elsewhere now is slower than none.
        let jumped = boxes.iter().zip(&self.before).filter(|(b, old)| !b.overlaps(old)).count();
        if now.abs_diff(before) > few {
            // One by one takes longer than all at once.
            self.tree = Bvh::from_iter(BvhBuildStrategy::Binned, boxes.iter().map(bounds).enumerate());
        } else {
            (now..before).for_each(|k| self.tree.remove(k as u32));
            for (k, b) in (0..).zip(boxes) {
                self.tree.insert_or_update_partially(bounds(b), k, 0.0);
            }
            if jumped > few {
                self.tree.rebuild(&mut self.workspace, BvhBuildStrategy::Binned);
            } else {
                self.tree.optimize_incremental(&mut self.workspace);
                self.tree.refit(&mut self.workspace);
            }
        }
        self.before.clear();
        self.before.extend_from_slice(boxes);
    }
}

fn bounds(b: &Aabb) -> Bounds {
    Bounds::new(b.min.into(), b.max.into())
}
