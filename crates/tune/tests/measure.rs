//! The contract of every measurement on any machine. No value is compared with a time: machines differ.

mod rules;

use std::collections::HashSet;

use sapwise_tune::hardware::ParameterId;
use sapwise_tune::measure::{self, Family, Options};
use sapwise_tune::{How, Parameter};

fn brief(threads: Option<u32>) -> Options {
    Options::default().with_threads(threads).brief(true)
}

fn check(p: &Parameter) {
    rules::check(p, 700);
}

#[test]
fn every_parameter_once_and_in_order() {
    let hardware = measure::hardware(&brief(None));
    let names: Vec<String> = hardware.parameters.iter().map(|p| p.name.clone()).collect();
    assert_eq!(names, ParameterId::ALL);
    hardware.parameters.iter().for_each(check);
    assert_eq!(hardware.defect(), None);
    assert!(hardware.parameters.iter().all(|p| p.source != "not measured"));
}

#[test]
fn families_share_out_the_parameters() {
    let mut seen = HashSet::new();
    for family in Family::ALL {
        assert_eq!(family.as_str().parse(), Ok(family));
        for name in family.parameters() {
            assert!(seen.insert(name), "{name} is in two families");
        }
        let measured: Vec<String> = measure::family(family, &brief(Some(1))).into_iter().map(|p| p.name).collect();
        assert_eq!(measured, family.parameters());
    }
    assert_eq!(seen, ParameterId::ALL.into_iter().collect());
    assert!("nonsense".parse::<Family>().is_err());
}

#[test]
fn one_thread_is_no_parallel_machine() {
    for threads in [0, 1] {
        let hardware = measure::hardware(&brief(Some(threads)));
        hardware.parameters.iter().for_each(check);
        assert_eq!(hardware.value(ParameterId::UsableCores), Some(1.0));
        assert_eq!(hardware.value(ParameterId::ScalingTwoThreadsRatio), None);
        assert_eq!(hardware.value(ParameterId::ScalingAllThreadsRatio), Some(1.0));
        assert_eq!(hardware.value(ParameterId::ForkJoinWarmNs), None);
        assert_eq!(hardware.value(ParameterId::CoreToCoreNs), None);
        let one = hardware.value(ParameterId::BandwidthOneThreadGbPerS);
        assert_eq!(one, hardware.value(ParameterId::BandwidthAllThreadsGbPerS));
    }
}

#[test]
fn the_clock_is_a_clock() {
    for p in measure::family(Family::Clock, &brief(None)) {
        assert!(p.value.is_none_or(|ghz| (0.1..10.0).contains(&ghz)), "{p:?}");
    }
}

#[test]
fn threads_can_be_lowered_but_not_raised() {
    let cores = |threads| measure::family(Family::Topology, &brief(threads))[0].value;
    assert_eq!(cores(Some(u32::MAX)), cores(None));
}

#[test]
fn assembling_fills_gaps_and_drops_unknown_names() {
    let measured = vec![
        Parameter::reported("nonsense", 1.0, "nobody"),
        Parameter::reported(ParameterId::MemoryBytes, 2.0, "first"),
        Parameter::reported(ParameterId::MemoryBytes, 3.0, "second"),
    ];
    let hardware = measure::assemble(measure::machine(), measured);
    let names: Vec<String> = hardware.parameters.iter().map(|p| p.name.clone()).collect();
    assert_eq!(names, ParameterId::ALL);
    assert_eq!(hardware.value(ParameterId::MemoryBytes), Some(2.0));
    assert!(hardware.parameters.iter().filter(|p| p.name != ParameterId::MemoryBytes).all(|p| p.how == How::Missing));
}
