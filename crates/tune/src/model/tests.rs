mod extrapolation;

use super::*;
use crate::hardware::{GpuParameterId, ParameterId};
use crate::{GpuGroup, GpuHardware, Hardware, Machine, Parameter};
use sapwise::algorithm::{Backend, Entry, Load};
use sapwise::internals::GpuIdentity;
use std::collections::BTreeSet;

fn parameters(figures: &[(impl AsRef<str>, f64)]) -> Vec<Parameter> {
    figures.iter().map(|(name, value)| Parameter::reported(name, *value, "test")).collect()
}

fn gpu(index: u32, kind: GpuKind, figures: &[(GpuParameterId, f64)]) -> GpuHardware {
    let gpu = GpuIdentity::new(index, "test", kind);
    GpuHardware { gpu, parameters: parameters(figures) }
}

/// A discrete GPU with all parameters, and a slower one without the fitted slopes.
fn hardware() -> Hardware {
    let fast = [
        (GpuParameterId::RoundTripNs, 20_000.0),
        (GpuParameterId::ReadBackNs, 5000.0),
        (GpuParameterId::DispatchNs, 2000.0),
        (GpuParameterId::UploadGbPerS, 9.0),
        (GpuParameterId::UploadRateGbPerS, 10.0),
        (GpuParameterId::DownloadRateGbPerS, 8.0),
        (GpuParameterId::CopyGbPerS, 500.0),
        (GpuParameterId::ArithmeticGflopPerS, 1000.0),
    ];
    let slow = [
        (GpuParameterId::RoundTripNs, 30_000.0),
        (GpuParameterId::ReadBackNs, 1000.0),
        (GpuParameterId::DispatchNs, 1000.0),
        (GpuParameterId::UploadGbPerS, 5.0),
        (GpuParameterId::DownloadGbPerS, 4.0),
        (GpuParameterId::ReadGbPerS, 250.0),
        (GpuParameterId::ArithmeticGflopPerS, 500.0),
    ];
    let gpus = [fast.as_slice(), &slow].into_iter().zip(0..).map(|(figures, k)| gpu(k, GpuKind::Discrete, figures));
    let parameters = parameters(&[(ParameterId::ClockMeasuredGhz, 4.0)]);
    Hardware::new(Machine::default(), parameters).with_gpus(gpus.collect())
}

fn method(backend: BackendClass, scale: Scale) -> MethodModel {
    MethodModel {
        gpu_kinds: if backend == BackendClass::Gpu { vec![GpuKind::Software] } else { Vec::new() },
        terms: vec![ModelTerm { term: Term::Call, scale, unit: 2.0 }],
        spread_ln: 0.1,
        ..MethodModel::new("brute", backend, 1)
    }
}

fn model(methods: Vec<MethodModel>) -> Model {
    let range = |parameter: &str| Range { parameter: parameter.to_owned(), min: 1.0, max: 100.0, ..Range::default() };
    let ranges = [ParameterId::ClockMeasuredGhz.as_str(), "gpu/upload_gb_per_s", "gpu/copy_gb_per_s"].map(range);
    Model::new("test", methods, ranges.into())
}

fn ns(scale: Scale, hardware: &Hardware, gpus: &[u32]) -> f64 {
    scale.nanoseconds(hardware, &Backend::Gpu(gpus.to_vec())).unwrap()
}

fn ids(list: &[&str]) -> Vec<Entry> {
    list.iter().map(|id| Entry::new(id.parse().unwrap(), 1)).collect()
}

#[test]
fn a_gpu_has_its_slope_else_the_total_rate() {
    let h = hardware();
    assert_eq!((ns(Scale::GpuUploadByte, &h, &[0]), ns(Scale::GpuUploadByte, &h, &[1])), (0.1, 0.2));
    assert_eq!((ns(Scale::GpuDownloadByte, &h, &[0]), ns(Scale::GpuDownloadByte, &h, &[1])), (0.125, 0.25));
    assert_eq!((ns(Scale::GpuMemoryByte, &h, &[0]), ns(Scale::GpuMemoryByte, &h, &[1])), (0.002, 0.004));
    assert_eq!((ns(Scale::GpuRoundTrip, &h, &[0]), ns(Scale::GpuDispatch, &h, &[0])), (25_000.0, 2000.0));
    assert_eq!((ns(Scale::GpuOperation, &h, &[0]), ns(Scale::Cycle, &h, &[0])), (0.001, 0.25));
}

#[test]
fn several_gpus_have_the_slowest_latency_and_limited_rates() {
    let mut h = hardware();
    let both = [0, 1];
    assert_eq!((ns(Scale::GpuRoundTrip, &h, &both), ns(Scale::GpuDispatch, &h, &both)), (31_000.0, 2000.0));
    assert_eq!((ns(Scale::GpuUploadByte, &h, &both), ns(Scale::GpuOperation, &h, &both)), (1.0 / 15.0, 1.0 / 1500.0));
    let ratios = [
        (GpuParameterId::GroupUploadRatio, 1.2),
        (GpuParameterId::GroupRoundTripRatio, 2.0),
        (GpuParameterId::GroupArithmeticRatio, 1.9),
    ];
    h.gpu_groups.push(GpuGroup { gpus: both.to_vec(), parameters: parameters(&ratios) });
    assert_eq!((ns(Scale::GpuRoundTrip, &h, &both), ns(Scale::GpuDispatch, &h, &both)), (62_000.0, 2000.0));
    // 1.2 times the fastest is less than the sum, 1.9 times the fastest is more.
    assert_eq!((ns(Scale::GpuUploadByte, &h, &both), ns(Scale::GpuOperation, &h, &both)), (1.0 / 12.0, 1.0 / 1500.0));
    assert_eq!(ns(Scale::GpuUploadByte, &h, &[0]), 0.1);
}

#[test]
fn scales_and_helpers_of_the_other_processor_are_refused() {
    let h = hardware();
    for (scale, backend) in [(Scale::Lane, Backend::Gpu(vec![0])), (Scale::GpuDispatch, Backend::Cpu(2))] {
        let error = scale.nanoseconds(&h, &backend).unwrap_err().to_string();
        assert!(error.contains(&format!("{backend} has no scale")), "{error}");
    }
    let wrong = model(vec![method(BackendClass::Cpu, Scale::GpuDispatch)]);
    assert!(wrong.defect().unwrap().contains("gpu_dispatch"));
    let helped = MethodModel {
        helpers: Some(HelpersModel::new(0.0, 0.0, 0.0, 0)),
        ..method(BackendClass::Gpu, Scale::GpuDispatch)
    };
    assert!(model(vec![helped]).defect().unwrap().contains("helpers are of the CPU"));
}

#[test]
fn software_training_warns_of_a_real_gpu() {
    let model = model(vec![method(BackendClass::Gpu, Scale::GpuRoundTrip)]);
    assert_eq!(model.defect(), None);
    let mut h = hardware();
    let p = model.predict(&h, &ids(&["brute@gpu1"])).unwrap();
    assert!(p.extrapolated && p.warnings.len() == 1 && p.warnings[0].contains("no real GPU"), "{:?}", p.warnings);
    assert_eq!(p.costs[0].curve.cost_ns(&Load::default()), 62_000.0);
    h.gpus[1].gpu.kind = GpuKind::Software;
    let p = model.predict(&h, &ids(&["brute@gpu1"])).unwrap();
    assert!(!p.extrapolated && p.warnings.is_empty(), "{:?}", p.warnings);
}

#[test]
fn a_missing_parameter_of_a_gpu_costs_its_algorithms_only() {
    let model = model(vec![method(BackendClass::Gpu, Scale::GpuMemoryByte)]);
    let mut h = hardware();
    let all = ids(&["brute@gpu0", "brute@gpu1", "brute@gpu0+1", "brute@gpu2", "sap@gpu0", "brute@cpu1"]);
    let p = model.predict(&h, &all).unwrap();
    let told = |p: &Prediction, text: &str| p.warnings.iter().any(|w| w.contains(text));
    assert_eq!(p.costs.len(), 3, "{:?}", p.warnings);
    for text in [
        "brute@gpu2: left out, since the hardware holds no gpu2",
        "sap@gpu0, brute@cpu1: left out, since the model",
        "copy_gb_per_s of gpu0 is 500.0 GB/s, outside",
        "brute@gpu0+1: the model has seen 1 GPUs at most",
        "gpu0+1: how these GPUs work together was not measured",
    ] {
        assert!(told(&p, text), "{text}: {:?}", p.warnings);
    }
    let missing = Parameter::missing(GpuParameterId::CopyGbPerS, "the driver crashed");
    h.gpus[0].parameters.retain(|p| p.name != GpuParameterId::CopyGbPerS);
    h.gpus[0].parameters.push(missing);
    let p = model.predict(&h, &all).unwrap();
    assert_eq!(p.costs.len(), 1);
    let missing = "the parameter copy_gb_per_s of gpu0 is missing: the driver crashed";
    assert!(told(&p, &format!("brute@gpu0, brute@gpu0+1: left out, since {missing}")), "{:?}", p.warnings);
}

#[test]
fn hardware_with_impossible_gpus_is_refused() {
    assert_eq!(hardware().defect(), None);
    let defect = |change: &dyn Fn(&mut Hardware)| {
        let mut h = hardware();
        change(&mut h);
        h.defect().unwrap().to_string()
    };
    assert!(defect(&|h| h.gpus[1].parameters[0].value = Some(-1.0)).contains("gpu1"));
    assert!(defect(&|h| h.gpus[1].gpu.index = 0).contains("twice"));
    let group = |gpus: &[u32]| GpuGroup { gpus: gpus.to_vec(), parameters: Vec::new() };
    for gpus in [&[0][..], &[1, 0], &[0, 7]] {
        assert!(defect(&|h| h.gpu_groups.push(group(gpus))).contains("not a group"));
    }
    assert!(defect(&|h| h.gpu_groups = vec![group(&[0, 1]), group(&[0, 1])]).contains("twice"));
}

#[test]
fn helpers_read_the_scaling_between_two_and_all_threads() {
    let figures = [
        (ParameterId::ClockReportedGhz, 2.0),
        (ParameterId::UsableCores, 8.0),
        (ParameterId::ForkJoinColdNs, 1000.0),
        (ParameterId::ScalingTwoThreadsRatio, 2.0),
        (ParameterId::ScalingAllThreadsRatio, 4.0),
    ];
    let machine = Hardware { parameters: parameters(&figures), gpus: Vec::new(), ..hardware() };
    let helpers = HelpersModel::new(100.0, 0.5, 0.0, 0);
    let of = |threads| helpers.on(&machine, threads).unwrap().unwrap();
    assert_eq!((of(2).call_ns, of(2).late_ns, of(2).speed_up), (50.0, 500.0, 2.0));
    // Four threads are half way from two to eight on logarithmic axes, and half way from there to four.
    assert!((of(4).speed_up - (8.0_f64.sqrt() * 4.0).sqrt()).abs() < 1e-12);
    assert!((of(16).speed_up - 32.0_f64.sqrt()).abs() < 1e-12);
    assert!(helpers.on(&hardware(), 2).is_err() && helpers.on(&hardware(), 1) == Ok(None));
}

#[test]
fn another_revision_waits_for_new_reports() {
    let other = [Entry::new("brute@cpu1".parse().unwrap(), 2)];
    let error = model(vec![method(BackendClass::Cpu, Scale::Cycle)]).predict(&hardware(), &other).unwrap_err();
    assert!(error.to_string().contains("train on new reports"), "{error}");
}

#[test]
fn a_method_falls_back_to_one_that_the_model_holds() {
    let mut both = vec![method(BackendClass::Cpu, Scale::Cycle), method(BackendClass::Cpu, Scale::Cycle)];
    both[1].method = "other".to_owned();
    both[0].fallback = Some(FallbackModel { method: "other".to_owned(), factor: 0.5 });
    let whole = model(both.clone());
    assert_eq!(whole.defect(), None);
    let mut machine = hardware();
    machine.parameters.extend(parameters(&[(ParameterId::CacheLlcBytes, 3e7)]));
    let p = whole.predict(&machine, &ids(&["brute@cpu1", "other@cpu1"])).unwrap();
    // Two cycles of a quarter of a nanosecond, and half of that.
    assert_eq!((p.costs[0].curve.cost_ns(&Load::default()), p.costs[1].curve.cost_ns(&Load::default())), (0.25, 0.5));
    both[1].fallback = Some(FallbackModel { method: "brute".to_owned(), factor: 1.0 });
    assert!(model(both.clone()).defect().unwrap().contains("falls back"));
    assert!(model(both[..1].to_vec()).defect().unwrap().contains("no such method"));
}

#[test]
fn the_table_marks_what_a_model_reads() {
    let scales = Scale::ALL.iter().flat_map(|s| s.parameters());
    let read = scales.chain(HelpersModel::PARAMETERS).copied().chain([ParameterId::CacheLlcBytes]);
    let marked = ParameterId::ALL.into_iter().filter(|id| id.quantity().read_by_model);
    assert_eq!(read.collect::<BTreeSet<_>>(), marked.collect());
}
