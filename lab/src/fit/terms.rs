//! What the time of a method may consist of.

use sapwise::model::Scale;
use sapwise::{BackendClass, Term};

/// What a method tests. The tests of the other methods are left out: within one machine they correlate with its own, and would
/// grow differently beyond the sizes that were measured.
fn tests(method: &str) -> &'static [Term] {
    match method {
        "brute" => &[Term::AllPairs],
        "sap" => &[Term::AxisCandidates],
        "grid-sap" => &[Term::StripCandidates],
        // A tree tests what is near, which objects and pairs tell. Kept pairs are tested one by one, and found again in few frames.
        "bvh" | "pair-cache" => &[],
        _ => &[Term::AllPairs, Term::AxisCandidates, Term::StripCandidates],
    }
}

/// The method that another one falls back to where that is cheaper: a tree takes over where boxes move too far for kept pairs.
pub fn fallback_method(method: &str) -> Option<&'static str> {
    (method == "pair-cache").then_some("bvh")
}

/// Whether the boxes are sorted in every frame. `pair-cache` sorts them in few, or where the tree takes over.
fn sorts(method: &str) -> bool {
    !matches!(method, "brute" | "pair-cache")
}

/// Whether a frame may be cheaper where boxes move little.
fn is_incremental(method: &str) -> bool {
    !matches!(method, "brute" | "sap" | "grid-sap" | "bvh")
}

/// The physical terms of a method over machines, for any number of threads or GPUs.
///
/// Of columns that can't be told apart the first one is used, so that the order matters where all machines are alike: work of
/// the lanes before work of the cycles, divided work before serial work, the GPU's work before that of the CPU for it.
pub fn terms(method: &str, class: BackendClass) -> Vec<(Term, Scale)> {
    use {Scale::*, Term::*};
    let sorts = sorts(method);
    let tests = tests(method).iter();
    let mut list;
    match class {
        BackendClass::Cpu => {
            list = vec![(Call, Cycle), (Call, ForkJoin), (Objects, SharedCycle)];
            if sorts {
                list.push((Sort, SharedCycle));
            }
            if method != "brute" {
                list.push((ColdObjects, Byte));
            }
            list.extend(tests.flat_map(|&t| [(t, SharedLane), (t, SharedCycle)]));
            list.push((Pairs, SharedCycle));
            if is_incremental(method) {
                list.push((Moved, SharedCycle));
            }
            list.extend([(Objects, SharedLine), (Objects, Cycle)]);
            if sorts {
                list.push((Sort, Cycle));
            }
        }
        BackendClass::Gpu => {
            list = vec![(Call, GpuRoundTrip), (Call, GpuDispatch), (Objects, GpuUploadByte), (Objects, GpuMemoryByte)];
            if sorts {
                list.push((Sort, GpuMemoryByte));
            }
            list.extend(tests.map(|&t| (t, GpuOperation)));
            // The CPU takes boxes into mapped memory and pairs out of it, which the transfers hold only in part.
            list.extend([(Pairs, GpuDownloadByte), (Objects, Cycle), (Pairs, Cycle)]);
        }
    }
    list
}

/// The terms of a method within one machine, where everything but the load is constant.
pub fn terms_of_one_machine(method: &str, class: BackendClass) -> Vec<Term> {
    let mut list = vec![Term::Call, Term::Objects];
    if sorts(method) {
        list.push(Term::Sort);
    }
    // The caches of the CPU say nothing about a GPU.
    if class == BackendClass::Cpu {
        list.push(Term::ColdObjects);
    }
    list.extend(tests(method));
    list.push(Term::Pairs);
    if class == BackendClass::Cpu && is_incremental(method) {
        list.push(Term::Moved);
    }
    list
}
