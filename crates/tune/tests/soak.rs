//! Many frames in which things go wrong at random: no pair is lost and no memory leaks.
//!
//! `Adaptive` runs `fragmentation` at small sizes, and each frame is compared with the double loop. At random, a GPU is
//! lost and comes back, pools change their size, frames fail, and the program restarts with what it has learned. Every
//! third program starts from a cache whose files are damaged, truncated, replaced by folders or
//! not writable. A run of a million frames takes minutes:
//!
//! ```sh
//! SAPWISE_SOAK_FRAMES=1000000 cargo test -p sapwise-tune --test soak -- --nocapture
//! ```
//!
//! One test only, because the counter sees every thread of the process.

#[path = "../../../tests/common/mod.rs"]
mod common;
#[path = "../../../tests/common/counting.rs"]
mod counting;
#[path = "soak/kept.rs"]
mod kept;

use common::{Random, naive};
use counting::LIVE;
use sapwise::tuning::Source;
use sapwise::{Adaptive, BroadPhase, Error, PairOrder, Pairs, Reason, Registry, Tuning};
use sapwise_scenes::Scenario;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::{Duration, Instant};

/// Default number of frames.
const FRAMES: u64 = if cfg!(feature = "long-tests") { 50_000 } else { 5000 };

/// Mean number of frames of a program.
const LIFE: u64 = if cfg!(feature = "long-tests") { 1000 } else { 250 };

/// Memory that may be in use at the end beyond that early on: rayon frees memory of ended threads late.
const SLACK_BYTES: isize = 64 << 10;

/// A slot for a GPU: even while it is empty, odd while there is one. The number differs for each device.
#[derive(Default)]
struct Slot(AtomicU64);

impl Slot {
    fn is_present(&self) -> bool {
        self.0.load(Relaxed) % 2 == 1
    }

    fn turn(&self) {
        self.0.fetch_add(1, Relaxed);
    }
}

/// An algorithm on a mock GPU: the device in the slot when it was created.
struct OnGpu {
    slot: Arc<Slot>,
    device: u64,
    inner: Box<dyn BroadPhase>,
}

const GPU: &str = "mock@gpu0";

fn lost() -> Error {
    Error::Unavailable { algorithm: GPU.parse().unwrap(), reason: "the device is lost".into() }
}

impl BroadPhase for OnGpu {
    fn find_pairs(&mut self, boxes: &[sapwise::Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        if self.slot.0.load(Relaxed) == self.device {
            return self.inner.find_pairs(boxes, pairs);
        }
        // Lost in the middle of its work: it leaves wrong pairs.
        pairs.clear();
        (1..boxes.len() as u32).for_each(|k| pairs.push(0, k));
        Err(lost())
    }
}

fn registry(cores: u32, slot: &Arc<Slot>) -> Registry {
    let mut registry = Registry::with_cores(cores);
    let slot = Arc::clone(slot);
    registry.add(GPU.parse().unwrap(), 1, move || {
        let device = slot.0.load(Relaxed);
        let inner = Registry::with_cores(1).create(&"sap@cpu1".parse().unwrap())?;
        if slot.is_present() { Ok(Box::new(OnGpu { slot: Arc::clone(&slot), device, inner })) } else { Err(lost()) }
    });
    registry
}

/// Returns a tuning of brute force for few boxes, and the GPU for many, or several threads if it is lost.
fn tuning() -> Tuning {
    let costs = [
        ("brute@cpu1", 100.0, 60.0),
        ("pair-cache@cpu1", 1500.0, 40.0),
        (GPU, 4000.0, 5.0),
        ("sap@cpu1", 2500.0, 45.0),
        ("grid-sap@cpu2", 4000.0, 25.0),
        ("brute@cpu2", 3000.0, 31.0),
        ("pair-cache@cpu3", 5000.0, 14.0),
        ("grid-sap@cpu4", 5500.0, 11.0),
    ];
    common::tuning(Registry::with_cores(1).entries(), 0.3, &costs)
}

/// Counts of events.
#[derive(Debug, Default)]
struct Tally {
    starts: u64,
    frames: u64,
    gpus_lost: u64,
    fell_back: u64,
    gpus_back: u64,
    pools: u64,
    invalid: u64,
    over_limit: u64,
    learned: u64,
    cached: u64,
    probed: u64,
    unreadable: u64,
    unwritable: u64,
    ran: BTreeMap<String, u64>,
}

/// Returns a uniform number below `most`.
fn below(random: &mut Random, most: u64) -> u64 {
    (f64::from(random.next()) * most as f64) as u64
}

/// A machine whose GPU comes and goes, and the number of usable cores.
struct Machine {
    slot: Arc<Slot>,
    cores: u32,
}

impl Machine {
    fn new(random: &mut Random) -> Self {
        let slot = Arc::new(Slot::default());
        if below(random, 4) > 0 {
            slot.turn();
        }
        Self { slot, cores: 1 + below(random, 4) as u32 }
    }
}

/// Runs a program from start to end. Returns its last tuning.
fn program(tuning: Tuning, frames: u64, random: &mut Random, tally: &mut Tally) -> Tuning {
    let mut machine = Machine::new(random);
    let mut adaptive = Adaptive::new(tuning, &registry(machine.cores, &machine.slot)).unwrap();
    // The costs are those of no machine: without learning they keep all algorithms busy.
    adaptive.set_learning(below(random, 4) == 0);
    tally.starts += 1;
    life(&mut adaptive, &mut machine, frames, random, tally);
    let learned = adaptive.learned();
    assert_eq!(learned.defect(), None);
    tally.learned += u64::from(learned.source == Source::Learned);
    learned
}

/// Runs frames of a scene, and compares each with the double loop.
fn life(adaptive: &mut Adaptive, machine: &mut Machine, frames: u64, random: &mut Random, tally: &mut Tally) {
    let Machine { slot, cores } = machine;
    let mut scene = Scenario::Fragmentation.start(10 + below(random, 400) as usize, below(random, 1 << 20));
    let mut pairs = Pairs::with_order(PairOrder::Canonical);
    let mut on_gpu = false;
    for _ in 0..frames {
        scene.advance();
        let boxes = scene.boxes();
        let expected = naive(boxes);
        if below(random, 100) == 0 {
            adaptive.set_learning(below(random, 4) == 0);
            adaptive.decide(boxes);
        }
        match below(random, 400) {
            // Rarely, and more often while it is in use.
            0 | 1 if slot.is_present() => {
                slot.turn();
                tally.gpus_lost += 1;
            }
            20..40 if on_gpu => {
                slot.turn();
                tally.gpus_lost += 1;
            }
            0..=7 if !slot.is_present() => {
                slot.turn();
                adaptive.revive(&registry(*cores, slot)).unwrap();
                tally.gpus_back += 1;
            }
            8 => {
                *cores = 1 + below(random, 4) as u32;
                adaptive.revive(&registry(*cores, slot)).unwrap();
                tally.pools += 1;
            }
            9 => {
                let mut wrong = boxes.to_vec();
                let index = below(random, wrong.len() as u64) as usize;
                wrong[index].max[1] = f32::NAN;
                let error = adaptive.find_pairs(&wrong, &mut pairs).unwrap_err();
                assert!(matches!(error, Error::InvalidBox { index: told, .. } if told == index), "{error}");
                tally.invalid += 1;
            }
            10 if !expected.is_empty() => {
                let limit = expected.len() - 1;
                pairs.set_limit(Some(limit));
                assert_eq!(adaptive.find_pairs(boxes, &mut pairs), Err(Error::TooManyPairs { limit }));
                pairs.set_limit(None);
                tally.over_limit += 1;
            }
            _ => {}
        }
        adaptive.find_pairs(boxes, &mut pairs).unwrap();
        let decision = adaptive.last_decision().unwrap();
        let (id, reason) = (decision.algorithm, decision.reason);
        assert!(pairs.as_slice() == expected, "{id}, {reason:?}, start {}, frame {}", tally.starts, scene.frame());
        // The reason of a decision stands until the next one.
        tally.fell_back += u64::from(reason == Reason::FellBack && on_gpu);
        let id = id.to_string();
        on_gpu = id == GPU;
        assert!(slot.is_present() || !on_gpu, "a GPU that is lost has run, start {}", tally.starts);
        *tally.ran.entry(id).or_default() += 1;
        tally.frames += 1;
    }
}

/// Returns the bytes in use, once they are no more than `lowest` or 50 milliseconds have passed: threads of the last
/// program may still end.
fn live_bytes(lowest: isize) -> isize {
    for _ in 0..50 {
        if LIVE.load(Relaxed) <= lowest {
            break;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    LIVE.load(Relaxed)
}

#[test]
fn failures_lose_no_pair_and_leak_no_memory() {
    let told = std::env::var("SAPWISE_SOAK_FRAMES");
    let frames: u64 = told.map_or(FRAMES, |text| text.parse().expect("SAPWISE_SOAK_FRAMES is a number of frames"));
    let began = Instant::now();
    let mut random = Random(0x5eed_50a4);
    let mut tally = Tally::default();
    let mut known = tuning();
    let mut kept = kept::Kept::new();
    let mut live = Vec::with_capacity(8 * (frames / LIFE) as usize + 64);
    let mut lowest = isize::MAX;
    // Times decide which algorithms run. On a busy machine six take longer.
    let most = 4 * frames;
    while tally.frames < frames || tally.ran.len() < 6 && tally.frames < most {
        let end = if tally.frames < frames { frames } else { most };
        let length = (LIFE / 2 + below(&mut random, LIFE)).min(end - tally.frames);
        // The two kinds take turns, so that a short run has enough of both. Files get damaged between the programs of
        // the second kind.
        if tally.starts % 3 == 2 {
            kept.program(length.div_ceil(4), &mut random, &mut tally);
        } else {
            let learned = program(known, length, &mut random, &mut tally);
            // A program uses what the previous one has learned, unless it was deleted.
            known = if below(&mut random, 2) == 0 { tuning() } else { learned };
        }
        lowest = lowest.min(live_bytes(lowest));
        live.push(live_bytes(lowest));
    }
    let (early, late) = (&live[live.len() / 4..live.len() / 2], &live[live.len() * 3 / 4..]);
    let least = |bytes: &[isize]| bytes.iter().copied().min().unwrap();
    let seconds = began.elapsed().as_secs_f64();
    let (early, late) = (least(early), least(late));
    println!("{tally:#?}\n{seconds:.1} s, {early} bytes in use early on, {late} at the end");
    assert!(late <= early + SLACK_BYTES, "{early} bytes in use early on, {late} at the end");
    for (what, times) in [
        ("a GPU was lost", tally.gpus_lost),
        ("it was lost in a frame of its own", tally.fell_back),
        ("a GPU came back", tally.gpus_back),
        ("pools of another size", tally.pools),
        ("an invalid box", tally.invalid),
        ("a limit on the pairs", tally.over_limit),
        ("learned tuning", tally.learned),
    ] {
        // Otherwise the seed misses what this test is for.
        assert!(times >= (frames / 20_000).max(1), "{what}: {times} times in {frames} frames");
    }
    assert!(tally.ran.len() >= 6, "{:?}", tally.ran);
    let Tally { cached, probed, unreadable, unwritable, .. } = tally;
    let least = [cached, probed, unreadable, unwritable].into_iter().min();
    assert!(least >= Some((frames / 100_000).max(1)), "{tally:?}");
}
