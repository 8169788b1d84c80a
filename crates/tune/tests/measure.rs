//! The contract of every measurement on any machine. No value is compared with a time: machines differ.

use std::collections::HashSet;

use sapwise_tune::hardware::ParameterId;
use sapwise_tune::measure::{self, Family, Options};
use sapwise_tune::{How, Parameter};

fn brief(threads: Option<u32>) -> Options {
    Options::default().with_threads(threads).brief(true)
}

/// Checks the rules for a parameter on any machine.
fn check(p: &Parameter) {
    assert!(!p.source.is_empty(), "{p:?}");
    assert_eq!(p.value.is_none(), p.how == How::Missing, "{p:?}");
    assert_eq!(p.samples == 0, p.how == How::Missing, "{p:?}");
    assert!(p.value.is_none_or(|value| value.is_finite() && value >= 0.0), "{p:?}");
    assert!(p.dispersion.is_none_or(|dispersion| dispersion.is_finite() && dispersion >= 0.0), "{p:?}");
    assert!(p.dispersion.is_none() || p.samples >= 4, "{p:?}");
    assert!(p.foreign_load.is_none_or(|share| (0.0..=1.0).contains(&share)), "{p:?}");
    // The value follows from the raw samples, which are few enough for a file.
    assert_eq!(p.raw.is_empty(), p.how != How::Measured, "{p:?}");
    assert!(p.raw.len() <= 700, "{p:?}");
    assert!(p.how != How::Measured || p.recomputed() == p.value, "{p:?}");
    if p.how == How::Reported {
        assert_eq!((p.dispersion, p.spoiled, p.foreign_load), (None, 0, None), "{p:?}");
    }
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

#[test]
fn the_machine_id_is_stable() {
    let machine = measure::machine();
    assert_eq!(machine, measure::machine());
    assert_eq!(machine.physical_id.len(), 16);
    assert!(machine.physical_id.bytes().all(|b| b.is_ascii_hexdigit()));
    assert_eq!((machine.arch.as_str(), machine.os.as_str()), (std::env::consts::ARCH, std::env::consts::OS));
}
