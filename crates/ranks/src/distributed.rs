//! A broad phase over ranks.

use crate::balance::Balance;
use crate::bisect::bisect;
use crate::cuts::Cuts;
use crate::error::{DONE, Error, Outcome, error_of, outcome};
use crate::exchange::Exchange;
use crate::outbox::Outbox;
use crate::pairs::RankPairs;
use crate::record::{self, RankRecord};
use crate::sample::Sample;
use crate::search::{BOX_WORDS, LocalSearch, words};
use crate::share::{FACTORS, costs, pair_cost, shares};
use sapwise::algorithm::Load;
use sapwise::{Aabb, Adaptive, Registry, Tuning};
use std::time::Instant;

/// Words of a pair: the id of the owner's box, then the other.
const PAIR_WORDS: usize = 2;
/// Words that announce pairs: their number and the outcome of the search.
const ANSWER_WORDS: usize = 3;

/// Finds the pairs of boxes that are spread over ranks.
///
/// [`find_pairs`](Self::find_pairs) is collective: every rank calls it equally often. The owner of a box may change
/// from frame to frame. A frame is cheap if each rank owns boxes near each other, because only boxes in another
/// rank's region are sent.
pub struct Distributed<E> {
    exchange: E,
    search: LocalSearch,
    cuts: Cuts,
    balance: Balance,
    /// Cut after this many frames, whatever the times are.
    cut_every: Option<u64>,
    frames: u64,
    cut_ns: u64,
    /// The record of each rank in this frame.
    records: Vec<RankRecord>,
    boxes_out: Outbox<BOX_WORDS>,
    pairs_out: Outbox<PAIR_WORDS>,
    outgoing: Vec<u64>,
    incoming: Vec<u64>,
    received: Vec<u64>,
    report: FrameReport,
}

/// Counts of one frame on this rank.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct FrameReport {
    /// Own boxes.
    pub boxes: u64,
    /// Copies of them sent to other ranks.
    pub boxes_sent: u64,
    /// Boxes received from other ranks.
    pub boxes_received: u64,
    /// Boxes searched here: own ones in this region and all received ones.
    pub boxes_searched: u64,
    /// Pairs sent to the owners of their boxes.
    pub pairs_sent: u64,
    /// Pairs received from the ranks that found them.
    pub pairs_received: u64,
    /// Bytes of boxes, pairs and counts sent to other ranks, without those of cuts.
    pub bytes_sent: u64,
    /// Whether space was cut.
    pub cut: bool,
    /// Nanoseconds of the search, without any exchange.
    pub search_ns: u64,
    /// Bytes of memory for boxes and messages, without the algorithm, the found pairs and the exchange.
    pub memory_bytes: u64,
}

impl<E: Exchange> Distributed<E> {
    /// A broad phase over the ranks of `exchange`, with the registry and the tuning of each rank's own machine. With
    /// costs in the tuning the cuts follow the speed of the machines from the first frame on, with [`Tuning::usual`]
    /// once frames were timed.
    ///
    /// # Errors
    /// [`Error::Search`] on all ranks if no algorithm of the tuning of one rank can run there.
    pub fn new(exchange: impl Into<E>, registry: &Registry, tuning: Tuning) -> Result<Self, Error> {
        let mut exchange = exchange.into();
        let made = Adaptive::new(tuning, registry);
        let own = made.as_ref().map_or_else(|e| outcome(&Err(e.clone())), |_| DONE);
        agree(&mut exchange, own)?;
        let ranks = exchange.size();
        // `agree` has already returned this error, or that of a lower rank.
        let adaptive =
            made.map_err(|_| Error::Search { rank: exchange.rank(), failure: crate::Failure::NoAlgorithm })?;
        Ok(Self {
            exchange,
            search: LocalSearch::new(adaptive),
            cuts: Cuts::one(),
            balance: Balance::default(),
            cut_every: None,
            frames: 0,
            cut_ns: 0,
            records: vec![RankRecord::default(); ranks],
            boxes_out: Outbox::new(ranks),
            pairs_out: Outbox::new(ranks),
            outgoing: Vec::new(),
            incoming: Vec::new(),
            received: Vec::new(),
            report: FrameReport::default(),
        })
    }

    /// This rank, from 0.
    pub fn rank(&self) -> usize {
        self.exchange.rank()
    }

    /// The number of ranks.
    pub fn ranks(&self) -> usize {
        self.exchange.size()
    }

    /// The regions of the ranks. One region of all space before the first frame.
    pub fn cuts(&self) -> &Cuts {
        &self.cuts
    }

    /// Counts of the last frame.
    pub fn last_frame(&self) -> &FrameReport {
        &self.report
    }

    /// The time of the slowest rank over that of equally busy ranks, minus one; `None` while times are unknown.
    pub fn imbalance(&self) -> Option<f64> {
        self.balance.imbalance
    }

    /// The broad phase of this rank's region.
    pub fn adaptive(&self) -> &Adaptive {
        &self.search.adaptive
    }

    /// The same, mutable: to turn learning and exploring on or off.
    pub fn adaptive_mut(&mut self) -> &mut Adaptive {
        &mut self.search.adaptive
    }

    /// The full error of this rank's last search, if it failed.
    pub fn search_error(&self) -> Option<&sapwise::Error> {
        self.search.error.as_ref()
    }

    /// Cuts space after every `frames` frames; `None`, the default, cuts when the times of the ranks say that it
    /// pays. All ranks pass the same. For reproducible cuts: times differ between runs.
    pub fn set_cut_every(&mut self, frames: Option<u64>) {
        self.cut_every = frames;
    }

    /// Replaces the content of `pairs` with the overlapping or touching pairs of this rank's boxes and the boxes of
    /// all ranks.
    ///
    /// `ids` has one id for each box, which names it in `pairs`. Two boxes with the same id are two boxes.
    ///
    /// # Errors
    /// The same on all ranks: [`Error::InvalidBox`] and [`Error::MissingIds`] before the search, [`Error::Search`] and
    /// [`Error::TooManyPairs`] after it. The content of `pairs` is then unspecified.
    pub fn find_pairs(&mut self, boxes: &[Aabb], ids: &[u64], pairs: &mut RankPairs) -> Result<(), Error> {
        pairs.clear();
        self.report = FrameReport { boxes: boxes.len() as u64, ..FrameReport::default() };
        if self.ranks() == 1 {
            return self.find_alone(boxes, ids, pairs);
        }
        let due = self.cut_every.map_or(self.balance.due, |every| self.frames.is_multiple_of(every.max(1)));
        self.frames += 1;
        if due {
            self.cut(boxes);
        }
        let own = self.route(boxes, ids);
        self.exchange_records(RankRecord { mirrored: pairs.is_mirrored(), limited: pairs.limit().is_some(), ..own });
        self.balance.observe(&self.records);
        if let Some(error) = RankRecord::error(&self.records) {
            return Err(error);
        }
        self.exchange_boxes();
        let began = Instant::now();
        let outcome = outcome(&self.search.run());
        self.report.search_ns = began.elapsed().as_nanos() as u64;
        self.pairs_out.clear();
        if outcome == DONE {
            self.sort_found(pairs);
        }
        self.return_pairs(outcome, pairs)?;
        self.report.memory_bytes = self.bytes() as u64;
        pairs.finish();
        Ok(())
    }

    /// Runs a frame of a single rank, without copying boxes.
    fn find_alone(&mut self, boxes: &[Aabb], ids: &[u64], pairs: &mut RankPairs) -> Result<(), Error> {
        if ids.len() != boxes.len() {
            return Err(Error::MissingIds { rank: 0, boxes: boxes.len() as u64, ids: ids.len() as u64 });
        }
        let began = Instant::now();
        let result = self.search.run_on(boxes, pairs.limit());
        if let Err(sapwise::Error::InvalidBox { index, defect }) = result {
            return Err(Error::InvalidBox { rank: 0, index: index as u64, defect });
        }
        error_of(0, outcome(&result)).map_or(Ok(()), Err)?;
        self.report.search_ns = began.elapsed().as_nanos() as u64;
        self.report.boxes_searched = boxes.len() as u64;
        pairs.extend(self.search.found.iter().map(|&(i, j)| {
            let (a, b) = (ids[i as usize], ids[j as usize]);
            (a.min(b), a.max(b))
        }));
        pairs.finish();
        Ok(())
    }

    /// Cuts space by the boxes, the loads and the speeds of all ranks.
    fn cut(&mut self, boxes: &[Aabb]) {
        let began = Instant::now();
        let ranks = self.ranks();
        // Before the first cuts the load of the own boxes, wherever they are, stands for that of a region.
        let regional = self.search.load().filter(|load| load.objects > 0 && self.cuts.regions().len() == ranks);
        let load = regional.unwrap_or_else(|| Load::estimate(boxes, None, None));
        let mean = self.mean_load(&load);
        let predict = self.search.predictor();
        let time = |factor: f64| {
            let objects = (f64::from(mean.objects) * factor).clamp(1.0, f64::from(u32::MAX));
            predict(&mean.rescaled(objects as u32, mean.pairs * factor))
        };
        // Cost of this region over that of a mean region on this rank, so that its speed cancels. From boxes and
        // pairs, which are exact: candidates are estimated from a few hundred boxes and would add noise.
        let work = regional.map_or(1.0, |load| predict(&mean.rescaled(load.objects, load.pairs)) / predict(&mean));
        let own = FACTORS.map(time).into_iter().chain([work, pair_cost(&mean, &predict)]);
        let words = gather(&mut self.exchange, &own.map(f64::to_bits).collect::<Vec<_>>());
        let numbers = |words: &[u64]| words.iter().map(|&v| f64::from_bits(v)).collect();
        let all: Vec<Vec<f64>> = words.chunks_exact(FACTORS.len() + 2).map(numbers).collect();
        let times: Vec<_> = all.iter().map(|words| std::array::from_fn(|k| words[k])).collect();
        let pair_cost = all.iter().map(|words| words[FACTORS.len() + 1]).sum::<f64>() / ranks as f64;
        // The boxes of the last frame, because their pairs are known, unless the scene has changed.
        let known = self.cuts.regions().len() == ranks && self.balance.same_scene && self.search.whole;
        let mut samples = if known {
            self.search.samples(&self.cuts.regions()[self.rank()], pair_cost)
        } else {
            Sample::of(boxes, Sample::MOST)
        };
        if self.cuts.regions().len() == ranks {
            let mut owned = Sample::weights(&samples, &self.cuts);
            self.exchange.sum(&mut owned);
            let works: Vec<f64> = all.iter().map(|words| words[FACTORS.len()]).collect();
            Sample::weigh(&mut samples, &self.cuts, &costs(&works, &owned));
        }
        self.cuts = bisect(&mut samples, &shares(&times), &mut |values| self.exchange.sum(values));
        self.search.times.clear();
        self.balance.cut();
        self.cut_ns = began.elapsed().as_nanos() as u64;
        self.report.cut = true;
    }

    /// The mean of the loads of all ranks.
    fn mean_load(&mut self, load: &Load) -> Load {
        const PARTS: f64 = 1e6;
        let count = |v: f64| v.clamp(0.0, 1e18) as u64;
        let objects = f64::from(load.objects);
        let mut sums = [
            u64::from(load.objects),
            count(load.axis_candidates),
            count(load.strip_candidates),
            count(load.pairs),
            count(load.moved * objects * PARTS),
            count(load.moved_share * objects * PARTS),
        ];
        self.exchange.sum(&mut sums);
        let [objects, axis, strip, pairs, moved, moved_share] = sums.map(|s| s as f64);
        let mean = |v: f64| v / self.ranks() as f64;
        Load::of_objects(mean(objects).clamp(1.0, f64::from(u32::MAX)) as u32)
            .with_candidates(mean(axis), mean(strip))
            .with_pairs(mean(pairs))
            .with_moved(moved / PARTS / objects.max(1.0))
            .with_moved_share(moved_share / PARTS / objects.max(1.0))
    }

    /// Puts each box where it is searched: here or into the outbox. Ends at the first invalid box.
    fn route(&mut self, boxes: &[Aabb], ids: &[u64]) -> RankRecord {
        let own = self.rank();
        let region = self.cuts.regions()[own];
        let (search, outbox) = (&mut self.search, &mut self.boxes_out);
        search.clear();
        outbox.clear();
        let medians = search.times.medians().unwrap_or((0, 0));
        let mut record = RankRecord::timed(boxes.len() as u64, medians.0, medians.1);
        (record.ids, record.cut_ns) = (ids.len() as u64, self.cut_ns);
        for ((index, b), &id) in (0..).zip(boxes).zip(ids) {
            if let Some(defect) = b.defect() {
                record.defect = Some((index, defect));
                break;
            }
            if region.holds_all_of(b) {
                search.keep(*b, id);
            } else {
                self.cuts.each_rank_of(b, |rank| {
                    if rank == own { search.keep(*b, id) } else { outbox.push(rank, words(b, id)) }
                });
            }
        }
        record
    }

    /// Sends this record to every rank, with the number of boxes that it gets, and receives those of all ranks.
    fn exchange_records(&mut self, own: RankRecord) {
        self.outgoing.clear();
        for &count in &self.boxes_out.counts {
            self.outgoing.extend(RankRecord { sends: count as u64, ..own }.words());
        }
        self.incoming.resize(self.outgoing.len(), 0);
        self.exchange.all_to_all(&self.outgoing, &mut self.incoming);
        self.report.bytes_sent += 8 * (self.outgoing.len() - record::WORDS) as u64;
        self.records.clear();
        self.records.extend(self.incoming.chunks_exact(record::WORDS).map(RankRecord::of));
    }

    fn exchange_boxes(&mut self) {
        let counts: Vec<usize> = self.records.iter().map(|r| r.sends as usize).collect();
        let boxes: usize = counts.iter().sum();
        let (sent, report) = (self.boxes_out.len(), &mut self.report);
        (report.boxes_sent, report.boxes_received) = (sent as u64, boxes as u64);
        report.bytes_sent += (8 * BOX_WORDS * sent) as u64;
        self.boxes_out.exchange(&mut self.exchange, &counts, &mut self.received);
        self.search.receive(&self.received, counts.into_iter());
        self.report.boxes_searched = self.search.boxes.len() as u64;
    }

    /// Hands the pairs that this region reports to the owners of their boxes.
    fn sort_found(&mut self, pairs: &mut RankPairs) {
        let own = self.rank();
        let region = self.cuts.regions()[own];
        let search = &self.search;
        let mut deliver = |owner: usize, id: u64, other: u64| {
            if owner == own { pairs.push(id, other) } else { self.pairs_out.push(owner, [id, other]) }
        };
        for &(i, j) in &search.found {
            let (a, b) = (&search.boxes[i as usize], &search.boxes[j as usize]);
            if !region.finds(a, b) {
                continue;
            }
            let end = |at: u32| (search.ids[at as usize], search.owner(at, own));
            let (first, second) = (end(i).min(end(j)), end(i).max(end(j)));
            deliver(first.1, first.0, second.0);
            if second.1 != first.1 && self.records[second.1].mirrored {
                deliver(second.1, second.0, first.0);
            }
        }
    }

    /// Sends pairs to their owners and receives those of own boxes, unless a rank failed.
    fn return_pairs(&mut self, outcome: Outcome, pairs: &mut RankPairs) -> Result<(), Error> {
        self.outgoing.clear();
        for &count in &self.pairs_out.counts {
            self.outgoing.extend([count as u64, outcome[0], outcome[1]]);
        }
        self.incoming.resize(self.outgoing.len(), 0);
        self.exchange.all_to_all(&self.outgoing, &mut self.incoming);
        let answers = || self.incoming.chunks_exact(ANSWER_WORDS);
        if let Some(error) = answers().enumerate().find_map(|(rank, a)| error_of(rank, [a[1], a[2]])) {
            return Err(error);
        }
        let counts: Vec<usize> = answers().map(|a| a[0] as usize).collect();
        let more = counts.iter().sum();
        if self.records.iter().any(|r| r.limited) {
            agree(&mut self.exchange, pairs.outcome_with(more))?;
        }
        let sent = self.pairs_out.len();
        self.report.bytes_sent += 8 * (self.outgoing.len() - ANSWER_WORDS + sent * PAIR_WORDS) as u64;
        (self.report.pairs_sent, self.report.pairs_received) = (sent as u64, more as u64);
        self.pairs_out.exchange(&mut self.exchange, &counts, &mut self.received);
        pairs.extend(self.received.chunks_exact(PAIR_WORDS).map(|w| (w[0], w[1])));
        Ok(())
    }

    fn bytes(&self) -> usize {
        let words = self.outgoing.capacity() + self.incoming.capacity() + self.received.capacity();
        8 * words + self.search.bytes() + self.boxes_out.bytes() + self.pairs_out.bytes()
    }
}

/// Returns the words of all ranks, those of the lowest first.
fn gather(exchange: &mut impl Exchange, own: &[u64]) -> Vec<u64> {
    // Only one rank has something other than 0 in each place, so the sum is its word.
    let mut words = vec![0; own.len() * exchange.size()];
    let at = own.len() * exchange.rank();
    words[at..at + own.len()].copy_from_slice(own);
    exchange.sum(&mut words);
    words
}

/// Returns the error of the lowest rank that has one, on every rank.
fn agree(exchange: &mut impl Exchange, own: Outcome) -> Result<(), Error> {
    let words = gather(exchange, &own);
    let error = words.chunks_exact(2).enumerate().find_map(|(rank, w)| error_of(rank, [w[0], w[1]]));
    error.map_or(Ok(()), Err)
}
