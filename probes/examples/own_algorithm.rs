//! A command of your own: all of `sapwise`, with one more algorithm.
//!
//! ```sh
//! own() { cargo run --release -p sapwise-cli --example own_algorithm -- "$@"; }
//! own probe --no-gpus --out own.json                      # times it beside ours and verifies every answer
//! own train own.json --out with-own.json                  # fits its cost, with terms of its own
//! own predict --model with-own.json --out tuning.json     # shows where it is the fastest on this machine
//! own run fragmentation --tuning tuning.json              # shows what choosing it saves
//! ```
//!
//! The manifest of a program outside this repository needs `sapwise` and `sapwise-cli`.

use sapwise::tuning::{Product, Term};
use sapwise::{Aabb, BroadPhase, Error, Pairs};
use sapwise_cli::{Command, UserAlgorithm};
use sapwise_tune::model::Scale;
use std::process::ExitCode;

/// Visible to the test of this example, which is a command with the same `main`.
pub(crate) fn main() -> ExitCode {
    // The name appears in reports, models and tunings. The 1 is the revision: raise it whenever `find_pairs` gets
    // faster or slower, so that older measurements are recognised as stale. `UserAlgorithm::on_threads` adds an
    // algorithm on several threads.
    let sweep = UserAlgorithm::on_one_thread("sweep", 1, || Ok(Box::new(Sweep::default())));
    Command::new().with(sweep.terms(&terms())).run()
}

/// The terms of a frame's time: a call, a sort of n boxes, and the pairs whose intervals on x overlap.
fn terms() -> [(Term, Scale); 4] {
    [
        (Term::Call, Scale::Cycle),
        (Term::Objects, Scale::Cycle),
        (Term::Product(Product { objects: 1, log2_objects: 1, ..Product::ONE }), Scale::Cycle),
        (Term::Product(Product { pairs: 1, log2_objects: 1, ..Product::ONE }), Scale::Cycle),
    ]
}

/// Sorts the boxes by their lower x and compares each with those that begin before it ends.
#[derive(Default)]
struct Sweep {
    order: Vec<u32>,
}

impl BroadPhase for Sweep {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        if let Some((index, defect)) = boxes.iter().enumerate().find_map(|(k, b)| Some((k, b.defect()?))) {
            return Err(Error::InvalidBox { index, defect });
        }
        self.order.clear();
        self.order.extend(0..boxes.len() as u32);
        let lower = |k: u32| boxes[k as usize].min[0];
        self.order.sort_unstable_by(|&a, &b| lower(a).total_cmp(&lower(b)));
        for (at, &a) in self.order.iter().enumerate() {
            let end = boxes[a as usize].max[0];
            for &b in self.order[at + 1..].iter().take_while(|&&b| lower(b) <= end) {
                if boxes[a as usize].overlaps(&boxes[b as usize]) {
                    pairs.push(a.min(b), a.max(b));
                }
            }
        }
        pairs.finish()
    }
}
