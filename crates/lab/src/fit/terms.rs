//! The terms of the time of a method.

use sapwise::algorithm::BackendClass;
use sapwise::tuning::Term;
use sapwise_tune::model::Scale;

/// Counts of a frame that share one unit: a factor, a term and a scale each.
#[derive(Debug, Clone, PartialEq)]
pub struct Component(pub Vec<(f64, Term, Scale)>);

impl Component {
    /// One term with a unit of its own.
    pub fn of(term: Term, scale: Scale) -> Self {
        Self(vec![(1.0, term, scale)])
    }
}

/// Returns the terms that count the box pairs that a method tests. The tests of other methods are left out: they
/// correlate with its own on one machine, and would grow differently beyond the measured sizes.
fn tests(method: &str) -> &'static [Term] {
    match method {
        "brute" => &[Term::AllPairs],
        "sap" => &[Term::AxisCandidates],
        "grid-sap" => &[Term::StripCandidates],
        // A tree tests in proportion to objects and pairs. Cached pairs are tested one by one, and found again in few
        // frames.
        "bvh" | "pair-cache" => &[],
        _ => &[Term::AllPairs, Term::AxisCandidates, Term::StripCandidates],
    }
}

/// Returns the method that another one falls back to when that is cheaper: a tree, when boxes move too far for cached
/// pairs.
pub fn fallback_method(method: &str) -> Option<&'static str> {
    (method == "pair-cache").then_some("bvh")
}

/// Returns whether a method sorts the boxes in every frame. `pair-cache` sorts them in few, or when the tree takes
/// over.
fn sorts(method: &str) -> bool {
    !matches!(method, "brute" | "pair-cache")
}

/// Returns whether a frame may be cheaper when boxes move little.
pub(crate) fn is_incremental(method: &str) -> bool {
    !matches!(method, "brute" | "sap" | "grid-sap" | "bvh")
}

/// Returns the components of the time of a method, on one thread or on any number of GPUs.
///
/// Of components that can't be distinguished the first one is used. So the order matters when all machines are alike:
/// lanes before cycles, the work of the GPU before that of the CPU for it.
pub fn components(method: &str, class: BackendClass) -> Vec<Component> {
    match class {
        BackendClass::Cpu => on_cpu(method).into_iter().map(|(term, scale)| Component::of(term, scale)).collect(),
        BackendClass::Gpu => on_gpus(method),
    }
}

fn on_cpu(method: &str) -> Vec<(Term, Scale)> {
    use {Scale::*, Term::*};
    let mut list = vec![(Call, Cycle), (Objects, Cycle)];
    if sorts(method) {
        list.push((Sort, Cycle));
    }
    if method != "brute" {
        list.push((ColdObjects, Byte));
    }
    list.extend(tests(method).iter().flat_map(|&t| [(t, Lane), (t, Cycle)]));
    // A vector tests nodes of a tree and writes pairs.
    if method == "bvh" {
        list.push((Objects, Lane));
    }
    list.extend([(Pairs, Lane), (Pairs, Cycle)]);
    if is_incremental(method) {
        list.extend([(MovedShare, Cycle), (Moved, Cycle)]);
    }
    list
}

/// Bytes of a box and of a pair.
const BOX: f64 = 24.0;
const PAIR: f64 = 8.0;

/// Returns the components of a frame on GPUs: dispatches that wait for each other, the bytes that the kernels read and
/// write for each box and for each pair, and the transfers.
///
/// Dispatches and bytes are counted from the kernels, for 100 000 evenly spread boxes: each element of a buffer once
/// for each kernel that touches it. A fit finds only by how much a dispatch or a byte of the method is more expensive
/// than one that a hardware parameter was measured with. A card that was not measured is assumed to have the same
/// ratios.
fn on_gpus(method: &str) -> Vec<Component> {
    use {Scale::*, Term::*};
    let (dispatches, of_box, of_pair) = match method {
        "sap" => (14.0, 204.25, 36.1345),
        "grid-sap" => (11.0, 204.9887, 36.1345),
        "bvh" => (16.0, 245.4643, 36.1345),
        // Brute force is not counted: it reads each box once.
        _ => (1.0, BOX, PAIR),
    };
    let mut list = vec![
        Component::of(Call, GpuRoundTrip),
        Component(vec![(dispatches, Call, GpuDispatch)]),
        Component(vec![(BOX, Objects, GpuUploadByte)]),
        // Uploaded and downloaded data are copied once more.
        Component(vec![(of_box + 2.0 * BOX, Objects, GpuMemoryByte), (of_pair + 2.0 * PAIR, Pairs, GpuMemoryByte)]),
    ];
    // The nodes that a box is tested with.
    let tests = if method == "bvh" { &[Objects] } else { tests(method) };
    list.extend(tests.iter().map(|&t| Component::of(t, GpuOperation)));
    // The CPU takes boxes into mapped memory and pairs out of it, which the transfers hold only in part.
    list.extend([
        Component(vec![(PAIR, Pairs, GpuDownloadByte)]),
        Component::of(Objects, Cycle),
        Component::of(Pairs, Cycle),
    ]);
    list
}
