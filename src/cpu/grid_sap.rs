//! A grid of strips over two axes, a sweep along the third inside each strip. From scratch every frame.
//!
//! Phase one, one task a thread: each thread sorts its share of the boxes into bins of its own, one for each strip that
//! a box touches. Phase two, several tasks a thread: each strip gathers its bins from all threads, sorts them along the
//! sweep axis and sweeps. Boxes much larger than a cell stand in no bin; each strip tests those that cross it.

use crate::aabb::Aabb;
use crate::broad_phase::{BroadPhase, check_count};
use crate::cpu::Threads;
use crate::cpu::columns::{Columns, ensure, order_key, part};
use crate::cpu::kernel::{All, InStrip, Query, query_rows, sweep_rows};
use crate::cpu::level::Simd;
use crate::cpu::workers::{Outputs, Workers};
use crate::error::Error;
use crate::load::{Cover, FramePlan, StripGrid, StripSpan};
use crate::pairs::Pairs;

/// The method; see the module.
#[derive(Debug)]
struct GridSap {
    workers: Workers,
    finder: Finder,
    outputs: Outputs,
}

/// The work without its output: pairs go into as many lists as the workers have tasks.
#[derive(Debug)]
pub(super) struct Finder {
    bins: Vec<Bins>,
    large: Large,
    tasks: Vec<Task>,
    simd: Simd,
}

/// What one thread makes of its share of the boxes.
#[derive(Debug, Default)]
struct Bins {
    /// Where the bin of each strip begins in `entries`; one more than there are strips.
    starts: Vec<u32>,
    /// The strips in which each box of the share stands.
    spans: Vec<StripSpan>,
    entries: Vec<Entry>,
    /// Positions in the input of the boxes kept apart; only the first `large_count` are of this frame.
    large: Vec<u32>,
    large_count: usize,
    /// What went wrong, to be reported after the phase.
    error: Option<Error>,
}

/// A box in a bin.
#[derive(Debug, Clone, Copy, Default)]
struct Entry {
    bounds: Aabb,
    id: u32,
    /// [`Cover::begins`] in this strip.
    begins: u32,
}

/// The boxes kept apart, ascending on the sweep axis.
#[derive(Debug, Default)]
struct Large {
    keys: Vec<u64>,
    columns: Columns,
    covers: Vec<Cover>,
}

/// Memory of one task of phase two.
#[derive(Debug, Default)]
struct Task {
    entries: Vec<Entry>,
    keys: Vec<u64>,
    columns: Columns,
    /// The furthest end on the sweep axis among all rows so far.
    ends: Vec<f32>,
    error: Option<Error>,
}

pub(super) fn create(threads: u32, pools: &Threads, simd: Simd) -> Result<Box<dyn BroadPhase>, Error> {
    let workers = Workers::new("grid-sap", threads, pools)?;
    let finder = Finder::new(&workers, simd);
    Ok(Box::new(GridSap { workers, finder, outputs: Outputs::default() }))
}

impl BroadPhase for GridSap {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        self.find_pairs_with(&FramePlan::default(), boxes, pairs)
    }

    fn find_pairs_with(&mut self, plan: &FramePlan, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        check_count(boxes.len())?;
        let Self { workers, finder, outputs } = self;
        let grid = plan.grid(boxes);
        outputs.collect(workers, pairs, |lists| finder.find(workers, &grid, boxes, lists))?;
        pairs.finish_on(workers)
    }

    fn prepare(&mut self, objects: usize) {
        self.finder.prepare(objects);
    }
}

impl Finder {
    /// Memory for any workers that have no more threads than these.
    pub(super) fn new(workers: &Workers, simd: Simd) -> Self {
        let bins = (0..workers.threads()).map(|_| Bins::default()).collect();
        let tasks = (0..workers.tasks()).map(|_| Task::default()).collect();
        Self { bins, large: Large::default(), tasks, simd }
    }

    /// Adds the pairs to `lists`, one for each task of `workers`; in each of them those that are near in space are near.
    pub(super) fn find(
        &mut self,
        workers: &Workers,
        grid: &StripGrid,
        boxes: &[Aabb],
        lists: &mut [Pairs],
    ) -> Result<(), Error> {
        let Self { bins, large, tasks, simd } = self;
        let threads = workers.threads();
        let (bins, tasks) = (&mut bins[..threads], &mut tasks[..workers.tasks()]);
        workers.each(bins, |k, bin| {
            let share = part(boxes.len(), k, threads);
            bin.error = bin.fill(grid, boxes, share).err();
        });
        bins.iter_mut().find_map(|b| b.error.take()).map_or(Ok(()), Err)?;
        large.gather(grid, boxes, bins)?;
        let (bins, large, strips, count) = (&*bins, &*large, grid.strips(), tasks.len());
        workers.each_with(tasks, lists, |k, task, list| {
            let strips = balanced(bins, strips, k, count)..balanced(bins, strips, k + 1, count);
            let rows = part(large.covers.len(), k, count);
            task.error = task.find(bins, large, grid, strips, rows, *simd, list).err();
        });
        tasks.iter_mut().find_map(|t| t.error.take()).map_or(Ok(()), Err)
    }

    pub(super) fn prepare(&mut self, objects: usize) {
        // A refused allocation is reported by the frame that needs it. Boxes stand in 1.6 strips on average.
        let share = objects / self.bins.len();
        for bin in &mut self.bins {
            let _ = ensure(&mut bin.entries, share + share * 5 / 8, "boxes in strips");
        }
    }
}

/// The first strip of part `k` of `parts` parts that hold equally many entries.
fn balanced(bins: &[Bins], strips: usize, k: usize, parts: usize) -> usize {
    let before = |strip: usize| bins.iter().map(|b| u64::from(b.starts[strip])).sum::<u64>();
    let wanted = before(strips) * k as u64 / parts as u64;
    if k == parts {
        return strips;
    }
    let (mut low, mut high) = (0, strips);
    while low < high {
        let middle = (low + high) / 2;
        if before(middle) < wanted { low = middle + 1 } else { high = middle }
    }
    low
}

impl Bins {
    /// Sorts a share of the boxes into bins. Where each goes is worked out once, in the pass that counts.
    fn fill(&mut self, grid: &StripGrid, boxes: &[Aabb], share: std::ops::Range<usize>) -> Result<(), Error> {
        let first = share.start;
        let share = &boxes[share];
        let strips = grid.strips();
        ensure(&mut self.starts, strips + 1, "strips")?;
        ensure(&mut self.spans, share.len(), "boxes in strips")?;
        // The axes are constants in each of the three, so that no index is computed.
        match grid.axis {
            0 => self.count::<0>(grid, share, first)?,
            1 => self.count::<1>(grid, share, first)?,
            _ => self.count::<2>(grid, share, first)?,
        }
        let starts = &mut self.starts[..=strips];
        let entries: u64 = starts.iter().map(|&s| u64::from(s)).sum();
        if u32::try_from(entries).is_err() {
            return Err(Error::OutOfMemory {
                what: "boxes in strips",
                elements: usize::try_from(entries).unwrap_or(usize::MAX),
            });
        }
        let mut total = 0_u32;
        for start in starts.iter_mut() {
            total += std::mem::replace(start, total);
        }
        ensure(&mut self.entries, total as usize, "boxes in strips")?;
        let entries = &mut self.entries[..total as usize];
        for ((&span, b), id) in self.spans.iter().zip(share).zip(first as u32..) {
            grid.each_strip(span, |strip, begins| {
                let at = &mut starts[strip];
                entries[*at as usize] = Entry { bounds: *b, id, begins };
                *at += 1;
            });
        }
        // Every start has moved to its bin's end, which is the start of the next.
        starts.copy_within(..strips, 1);
        starts[0] = 0;
        Ok(())
    }

    /// Finds the strips of each box and counts how many go into each bin.
    fn count<const AXIS: usize>(&mut self, grid: &StripGrid, share: &[Aabb], first: usize) -> Result<(), Error> {
        let starts = &mut self.starts[..=grid.strips()];
        starts.fill(0);
        self.large_count = 0;
        for ((b, span), k) in share.iter().zip(&mut self.spans).zip(first..) {
            if let Some(defect) = b.defect() {
                return Err(Error::InvalidBox { index: k, defect });
            }
            *span = grid.span::<AXIS>(b);
            if *span == StripSpan::APART {
                ensure(&mut self.large, self.large_count + 1, "large boxes")?;
                self.large[self.large_count] = k as u32;
                self.large_count += 1;
            }
            grid.each_strip(*span, |strip, _| starts[strip] += 1);
        }
        Ok(())
    }

    /// The bin of a strip.
    fn bin(&self, strip: usize) -> &[Entry] {
        &self.entries[self.starts[strip] as usize..self.starts[strip + 1] as usize]
    }
}

impl Large {
    fn gather(&mut self, grid: &StripGrid, boxes: &[Aabb], bins: &[Bins]) -> Result<(), Error> {
        let ids = || bins.iter().flat_map(|b| &b.large[..b.large_count]);
        let count = ids().count();
        ensure(&mut self.keys, count, "large boxes")?;
        let keys = &mut self.keys[..count];
        for (key, &id) in keys.iter_mut().zip(ids()) {
            *key = u64::from(order_key(boxes[id as usize].min[grid.axis])) << 32 | u64::from(id);
        }
        keys.sort_unstable();
        self.columns.resize(count)?;
        self.covers.clear();
        self.covers.try_reserve(count).map_err(|_| Error::OutOfMemory { what: "large boxes", elements: count })?;
        let mut columns = self.columns.as_mut();
        for (at, &key) in keys.iter().enumerate() {
            let id = key as u32;
            columns.set(at, &boxes[id as usize], grid.axis, id);
            self.covers.push(grid.cover(&boxes[id as usize]));
        }
        Ok(())
    }
}

impl Task {
    #[expect(clippy::too_many_arguments, reason = "the frame's shared state, each part borrowed on its own")]
    fn find(
        &mut self,
        bins: &[Bins],
        large: &Large,
        grid: &StripGrid,
        strips: std::ops::Range<usize>,
        large_rows: std::ops::Range<usize>,
        simd: Simd,
        pairs: &mut Pairs,
    ) -> Result<(), Error> {
        for strip in strips {
            self.sort(bins, strip, grid.axis)?;
            let boxes = self.columns.len();
            sweep_rows::<InStrip>(simd, &self.columns, 0..boxes, pairs);
            if !large.covers.is_empty() && boxes > 0 {
                self.query_large(large, grid.cell(strip), simd, pairs)?;
            }
        }
        sweep_rows::<All>(simd, &large.columns, large_rows, pairs);
        Ok(())
    }

    /// Brings the boxes of a strip into columns that ascend on the sweep axis.
    fn sort(&mut self, bins: &[Bins], strip: usize, axis: usize) -> Result<(), Error> {
        let entries: &[Entry] = if let [only] = bins {
            only.bin(strip)
        } else {
            self.entries.clear();
            let elements = bins.iter().map(|b| b.bin(strip).len()).sum();
            let refused = |_| Error::OutOfMemory { what: "boxes in strips", elements };
            self.entries.try_reserve(elements).map_err(refused)?;
            bins.iter().for_each(|b| self.entries.extend_from_slice(b.bin(strip)));
            &self.entries
        };
        ensure(&mut self.keys, entries.len(), "sort keys")?;
        self.columns.resize(entries.len())?;
        let keys = &mut self.keys[..entries.len()];
        for (at, (key, entry)) in keys.iter_mut().zip(entries).enumerate() {
            *key = u64::from(order_key(entry.bounds.min[axis])) << 32 | at as u64;
        }
        keys.sort_unstable();
        let mut columns = self.columns.as_mut();
        for (at, &key) in keys.iter().enumerate() {
            let entry = &entries[key as u32 as usize];
            columns.set(at, &entry.bounds, axis, entry.id);
            columns.begins[at] = entry.begins;
        }
        Ok(())
    }

    /// Tests the large boxes that cross a strip against the boxes in it.
    fn query_large(&mut self, large: &Large, cell: [u32; 2], simd: Simd, pairs: &mut Pairs) -> Result<(), Error> {
        let Self { columns, ends, .. } = self;
        ensure(ends, columns.len(), "ends of boxes")?;
        let ends = &mut ends[..columns.len()];
        let mut furthest = f32::NEG_INFINITY;
        for (end, &high) in ends.iter_mut().zip(columns.high(0)) {
            furthest = furthest.max(high);
            *end = furthest;
        }
        let of = &large.columns;
        for (k, cover) in large.covers.iter().enumerate().filter(|(_, c)| c.contains(cell)) {
            let query = Query {
                low: [0, 1, 2].map(|a| of.low(a)[k]),
                high: [0, 1, 2].map(|a| of.high(a)[k]),
                id: of.ids()[k],
                begins: cover.begins(cell),
            };
            // No row before this one ends late enough to be hit.
            let start = ends.partition_point(|&end| end < query.low[0]);
            query_rows(simd, columns, start, &query, pairs);
        }
        Ok(())
    }
}
