//! What a frame asks of a GPU, counted instead of timed: how many dispatches wait for each other, and how many bytes its kernels move.

use super::sizes::{CELLS_OF_BLOCK, KEPT, raises};

/// What a frame of boxes that are on a GPU, and of pairs that stay there, asks of it in one submission.
///
/// Counted from the kernels: every element of a buffer that a kernel reads and every one that it writes, each once for each kernel, as where boxes are
/// spread evenly and pairs fall on them by chance. What neighbours share is taken to come from a cache, and so is what is added up or looked at
/// repeatedly: the bytes are those that no cache saves. Left out are the candidates of rows with more than four pairs, which are looked at once more when these are
/// written, a few percent of what `sap` moves, and the tree of the boxes that `grid-sap` keeps apart. Nothing here was measured: the tests of the library
/// hold the formula against kernels that mark what they touch, within 2 % where boxes are spread evenly and 5 % in clusters. Rows with more candidates
/// than one submission tests, as those of `sap` among a million boxes, take further submissions of three dispatches each.
///
/// ```
/// use sapwise::gpu::{Card, Traffic};
///
/// // A million boxes with half as many pairs, on a GPU of 3.35 TB/s that takes 5 us from one dispatch to the next.
/// let traffic = Traffic::of("grid-sap", 1_000_000, 500_000).unwrap();
/// assert!(traffic.dispatches <= 11 && traffic.bytes < 250e6);
/// // It has four candidates a box (`Load::strip_candidates`) to test, and tests 10^11 a second.
/// let card = Card::new(3.35e12, 5e-6, 1e11);
/// assert!(traffic.seconds(&card, 4e6) < 0.2e-3);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Traffic {
    /// Dispatches of which each waits for the one before; the clearing of the counts is taken for one.
    pub dispatches: u32,
    /// Bytes read and written.
    pub bytes: f64,
}

/// A GPU, as far as [`Traffic::seconds`] has to know it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Card {
    /// Bytes that its memory moves in a second.
    pub bytes_per_second: f64,
    /// Seconds from one dispatch to the next that waits for it.
    pub dispatch_seconds: f64,
    /// Boxes and nodes that it tests with rows in a second.
    pub tests_per_second: f64,
}

impl Card {
    /// With the bytes that its memory moves in a second, the seconds from one dispatch to the next, and its tests in a second.
    #[must_use]
    pub fn new(bytes_per_second: f64, dispatch_seconds: f64, tests_per_second: f64) -> Self {
        Self { bytes_per_second, dispatch_seconds, tests_per_second }
    }
}

/// A box as it comes, a sorted one, a word, one that is added to, and a pair.
const BOX: f64 = 24.0;
const SORTED: f64 = 32.0;
const WORD: f64 = 4.0;
const ADDED: f64 = 2.0 * WORD;
const PAIR: f64 = 2.0 * WORD;
/// Nodes of a tree for each box: an eighth, an eighth of that, and so on.
const NODES: f64 = 1.0 / 7.0;
/// Words of counts that the radix sort has for each box and pass: 256 digits in a block of 2048 boxes.
const COUNT: f64 = 256.0 / 2048.0;
/// Of as many slots as boxes that lie evenly the share that holds a box, 1 - 1/e, and the share that does or follows one that does.
const HELD: f64 = 0.632;
const HELD_OR_NEXT: f64 = 0.865;
/// The sum of a block of 64 rows, for each of them.
const SUM: f64 = WORD / 64.0;

impl Traffic {
    /// Of the method `sap`, `grid-sap` or `bvh`; `None` of another one.
    #[must_use]
    pub fn of(method: &str, objects: u32, pairs: u64) -> Option<Self> {
        let kernels = kernels(method, objects, pairs)?;
        Some(Self { dispatches: kernels.len() as u32, bytes: kernels.iter().map(|(_, bytes)| bytes).sum() })
    }

    /// Seconds on a card, of which the rows are tested with so many boxes: in `grid-sap` about
    /// [`Load::strip_candidates`](crate::Load::strip_candidates), in `sap` about [`Load::axis_candidates`](crate::Load::axis_candidates), in `bvh` as
    /// many boxes and nodes as its walks meet. Moving, waiting and testing are taken to follow each other.
    #[must_use]
    pub fn seconds(&self, card: &Card, tests: f64) -> f64 {
        let waiting = f64::from(self.dispatches) * card.dispatch_seconds;
        self.bytes / card.bytes_per_second + waiting + tests / card.tests_per_second
    }
}

/// The kernels of a method with the bytes that each moves, and the counts that are cleared.
fn kernels(method: &str, objects: u32, pairs: u64) -> Option<Vec<(&'static str, f64)>> {
    let n = f64::from(objects);
    let rows = Rows::of(n, pairs as f64);
    // Pairs and state of each row, and the pairs that are kept.
    let count = n * (SORTED + 2.0 * WORD + SUM) + rows.kept * WORD;
    // The number of a row's box is in the sorted one.
    let write = n * (WORD + SUM) + rows.with_pairs * SORTED + rows.read * WORD + pairs as f64 * PAIR;
    let mut kernels = vec![("positions", n * 2.0 * SUM), ("write", write)];
    let counts = n * COUNT * WORD;
    match method {
        "sap" | "bvh" => {
            let keys = if method == "sap" { "sweep_keys" } else { "curve_keys" };
            kernels.extend([("cleared", 4.0 * counts), (keys, n * (BOX + WORD) + 2.0 * counts)]);
            for pass in 0..4 {
                // The positions come into being in the first pass, and the last one counts no further digit.
                let values = if pass == 0 { 1.0 } else { 2.0 };
                let digits = if pass == 3 { 0.0 } else { 2.0 * counts };
                kernels
                    .extend([("add_counts", 2.0 * counts), ("scatter", counts + n * (2.0 + values) * WORD + digits)]);
            }
            kernels.push(("gather", n * (WORD + BOX + SORTED)));
        }
        "grid-sap" => {
            // About as many slots as boxes, and an eighth of that for those kept apart, in whole blocks.
            let block = f64::from(CELLS_OF_BLOCK);
            let cells = (n * 1.125 / block).ceil() * block * WORD;
            kernels.extend([
                ("cleared", cells),
                // Cells, reaches and ranks; counts turned into where cells begin; each box to its place; the sorted boxes with their cells.
                ("cell_keys", n * (BOX + 3.0 * WORD + HELD * ADDED)),
                ("add_up", cells),
                ("begin", 2.0 * cells),
                ("put", n * (3.0 * WORD + HELD * WORD + WORD)),
                ("gather_cells", n * (WORD + 2.0 * WORD + HELD_OR_NEXT * WORD + BOX + SORTED + WORD)),
            ]);
        }
        _ => return None,
    }
    match method {
        "sap" => kernels.push(("count", count)),
        "bvh" => {
            // Of the tree only the nodes are written again.
            kernels.extend(
                (0..raises(objects)).map(|k| ("raise_all", n * SORTED * (1.0 + NODES) / 512_f64.powi(k as i32))),
            );
            kernels.push(("count", count + n * NODES * SORTED));
        }
        _ => {
            // These look where the boxes kept apart begin, and end where there is none.
            kernels.extend((0..raises(objects)).map(|_| ("raise_large", 0.0)));
            // The cell of each row, and where the slots begin.
            kernels.push(("count", count + n * 2.0 * WORD));
        }
    }
    Some(kernels)
}

/// What becomes of pairs that fall on rows by chance.
struct Rows {
    /// Rows that have any.
    with_pairs: f64,
    /// Pairs that are kept while they are counted: the first few of each row.
    kept: f64,
    /// Those of them that are read again: rows with more pairs are tested once more instead.
    read: f64,
}

impl Rows {
    fn of(rows: f64, pairs: f64) -> Self {
        let mean = pairs / rows.max(1.0);
        // The share of rows with none, one, two pairs and so on is that of a Poisson distribution.
        let mut share = (-mean).exp();
        let (mut kept, mut read, mut few) = (0.0, 0.0, 0.0);
        let with_pairs = 1.0 - share;
        for k in 0..=KEPT {
            let held = f64::from(k);
            kept += share * held;
            read += share * held;
            few += share;
            share *= mean / (held + 1.0);
        }
        kept += (1.0 - few) * f64::from(KEPT);
        Self { with_pairs: rows * with_pairs, kept: rows * kept, read: rows * read }
    }
}

#[cfg(all(test, feature = "gpu"))]
mod tests {
    use super::*;
    use crate::gpu::engine::{Engine, Piece};
    use crate::gpu::kernel::{dispatched, marked};
    use crate::gpu::{Gpu, look::Look};
    use crate::load::SampledBoxes;
    use crate::pairs::Pairs;
    use crate::scene::{Scenario, Scene};
    use std::collections::BTreeMap;

    /// For each kernel the bytes that the formula says and those that the marks of a frame say.
    fn said_and_marked(
        gpu: &Gpu,
        method: &'static str,
        scenario: Scenario,
        objects: u32,
    ) -> BTreeMap<&'static str, [f64; 2]> {
        let mut scene = Scene::start(scenario, objects as usize, 3);
        scene.advance();
        let boxes = scene.boxes();
        let mut engine = marked::marking(|| Engine::new(gpu.clone(), method)).unwrap();
        let params = engine.plan(objects, || Look::at(&SampledBoxes::from(boxes)));
        // The first frame makes room for all pairs.
        let mut pairs = Pairs::new();
        engine.start(Piece { boxes, ids: None }, params).unwrap();
        engine.finish(&mut pairs).unwrap();
        marked::moved(gpu).unwrap();
        engine.start(Piece { boxes, ids: None }, params).unwrap();
        let moved = marked::moved(gpu).unwrap();
        engine.finish(&mut Pairs::new()).unwrap();

        let said = kernels(method, objects, pairs.len() as u64).unwrap();
        assert_eq!(moved.len() + 1, said.len(), "{method}: all kernels mark");
        // What is cleared no kernel writes.
        let cleared =
            if method == "grid-sap" { params.cell_blocks * CELLS_OF_BLOCK } else { 4 * 256 * objects.div_ceil(2048) };
        let moved = moved.into_iter().chain([("cleared", f64::from(cleared) * WORD)]);
        let mut bytes = BTreeMap::<_, [f64; 2]>::new();
        for (list, k) in [(said, 0), (moved.collect(), 1)] {
            for (kernel, some) in list {
                bytes.entry(kernel).or_default()[k] += some;
            }
        }
        bytes
    }

    #[test]
    fn as_many_bytes_are_marked() {
        let Some(gpu) = crate::gpu::first_for_tests() else { return };
        // In clusters many slots of `grid-sap` are empty, and rows differ more in their pairs than by chance. A kernel may be off by half of what all
        // may be off together, in bytes.
        for (scenario, off) in [(Scenario::Uniform, 0.02), (Scenario::Clustered, 0.05)] {
            for method in ["sap", "grid-sap", "bvh"] {
                let bytes = said_and_marked(&gpu, method, scenario, 20_000);
                let [said, marked] = [0, 1].map(|k| bytes.values().map(|b| b[k]).sum::<f64>());
                assert!(
                    (said / marked - 1.0).abs() < off,
                    "{method}, {scenario:?}: {said} and {marked} bytes, {bytes:?}"
                );
                for (kernel, [said, of_marks]) in &bytes {
                    let share = (said - of_marks).abs() / marked;
                    assert!(
                        share < off / 2.0,
                        "{method}, {scenario:?}: {kernel} is off by {share} of {marked} bytes, {bytes:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn as_many_dispatches_are_recorded() {
        let Some(gpu) = crate::gpu::first_for_tests() else { return };
        for objects in [1000, 40_000] {
            let mut scene = Scene::start(Scenario::Uniform, objects, 3);
            scene.advance();
            let boxes = scene.boxes();
            for method in ["sap", "grid-sap", "bvh"] {
                let mut engine = Engine::new(gpu.clone(), method).unwrap();
                let params = engine.plan(objects as u32, || Look::at(&SampledBoxes::from(boxes)));
                let before = dispatched();
                engine.start(Piece { boxes, ids: None }, params).unwrap();
                let cleared = 1;
                let recorded = dispatched() - before + cleared;
                assert_eq!(
                    Traffic::of(method, objects as u32, 0).unwrap().dispatches,
                    recorded,
                    "{method}, {objects} boxes"
                );
                engine.finish(&mut Pairs::new()).unwrap();
            }
        }
        assert_eq!(Traffic::of("brute", 1000, 0), None);
    }

    #[test]
    fn a_million_boxes_need_few_dispatches() {
        let dispatches = |method: &str| Traffic::of(method, 1_000_000, 480_000).unwrap().dispatches - 1;
        assert_eq!((dispatches("grid-sap"), dispatches("sap"), dispatches("bvh")), (10, 13, 15));
    }

    #[test]
    fn a_card_moves_and_waits_and_tests() {
        let traffic = Traffic { dispatches: 2, bytes: 3e9 };
        assert_eq!(traffic.seconds(&Card::new(1e9, 0.5, 1e6), 2e6), 3.0 + 1.0 + 2.0);
    }
}
