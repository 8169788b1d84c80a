//! Machines unlike those of the training, and values that no machine has.

use super::*;

/// A model of a method on both processors whose ranges hold the machine below.
fn both() -> Model {
    let mut model = model(vec![
        method(BackendClass::Cpu, Scale::Cycle),
        MethodModel { gpu_kinds: vec![GpuKind::Discrete], ..method(BackendClass::Gpu, Scale::GpuDispatch) },
    ]);
    let ranges = [
        (ParameterId::ClockMeasuredGhz, 2.0, 5.0),
        (ParameterId::UsableCores, 2.0, 64.0),
        (ParameterId::BandwidthOneThreadGbPerS, 8.0, 50.0),
    ];
    let range =
        |(id, min, max): (ParameterId, _, _)| Range { parameter: id.to_string(), min, max, published: Vec::new() };
    model.ranges = ranges.map(range).to_vec();
    model
}

/// A machine of eight cores with one GPU.
fn machine(changes: &[(ParameterId, f64)]) -> Hardware {
    let mut figures = vec![
        (ParameterId::UsableCores, 8.0),
        (ParameterId::ClockMeasuredGhz, 4.0),
        (ParameterId::CacheLlcBytes, 3e7),
        (ParameterId::ForkJoinColdNs, 5000.0),
        (ParameterId::BandwidthOneThreadGbPerS, 20.0),
        (ParameterId::ScalingTwoThreadsRatio, 1.9),
        (ParameterId::ScalingAllThreadsRatio, 7.0),
    ];
    for (id, value) in changes {
        if let Some(figure) = figures.iter_mut().find(|f| f.0 == *id) {
            figure.1 = *value;
        }
    }
    let mut machine = hardware();
    machine.gpus.truncate(1);
    machine.parameters = parameters(&figures);
    machine
}

fn told(p: &Prediction, text: &str) -> bool {
    p.warnings.iter().any(|w| w.contains(text))
}

#[test]
fn a_thousand_cores_are_extrapolated() {
    let all = ids(&["brute@cpu1", "brute@cpu1024"]);
    let of_a_thousand = [(ParameterId::UsableCores, 1024.0), (ParameterId::ScalingAllThreadsRatio, 700.0)];
    let p = both().predict(&machine(&of_a_thousand), &all).unwrap();
    assert!(p.extrapolated && p.costs.len() == 2, "{:?}", p.warnings);
    assert!(told(&p, "usable_cores is 1024") && told(&p, "has seen 1 threads at most"), "{:?}", p.warnings);
    assert!(told(&p, "`sapwise probe --out report.json`"), "{:?}", p.warnings);
    let loads: Vec<Load> = (1..=20).map(|k| Load::of_objects(1 << k)).collect();
    assert_eq!(p.tuning("uniform", &loads).defect(), None);
    let p = both().predict(&machine(&[]), &ids(&["brute@cpu1"])).unwrap();
    assert!(!p.extrapolated && p.warnings.is_empty(), "{:?}", p.warnings);
}

#[test]
fn values_that_no_machine_has_are_refused_by_name() {
    for (name, values) in [
        // MHz for GHz, and the remains of a failed measurement.
        (ParameterId::ClockMeasuredGhz, &[4000.0, 0.0, -4.0, f64::NAN, f64::INFINITY][..]),
        // TB/s for GB/s, MB/s for GB/s, and a tenth of what memory did in 1998.
        (ParameterId::BandwidthOneThreadGbPerS, &[0.02, 20_000.0, 0.1]),
        (ParameterId::CacheLlcBytes, &[3e4, 0.0]),
        (ParameterId::UsableCores, &[0.0, 5000.0]),
        (ParameterId::ScalingTwoThreadsRatio, &[190.0]),
    ] {
        for &value in values {
            let prediction = both().predict(&machine(&[(name, value)]), &ids(&["brute@cpu1", "brute@gpu0"]));
            let error = prediction.unwrap_err().to_string();
            assert!(error.contains(name.as_str()) && error.contains("check its unit"), "{value}: {error}");
        }
    }
}

#[test]
fn an_implausible_parameter_of_a_gpu_costs_its_algorithms_only() {
    let all = ids(&["brute@cpu1", "brute@gpu0"]);
    let mut machine = machine(&[]);
    assert_eq!(both().predict(&machine, &all).unwrap().costs.len(), 2);
    let dispatch = machine.gpus[0].parameters.iter().position(|p| p.name == GpuParameterId::DispatchNs).unwrap();
    for (value, text) in
        [(None, "dispatch_ns of gpu0 is missing"), (Some(2.0), "dispatch_ns of gpu0 is 2, and no machine")]
    {
        machine.gpus[0].parameters[dispatch].value = value;
        let p = both().predict(&machine, &all).unwrap();
        assert!(told(&p, "brute@gpu0: left out") && told(&p, text), "{:?}", p.warnings);
        let left: Vec<String> = p.costs.iter().map(|c| c.algorithm.to_string()).collect();
        assert_eq!(left, ["brute@cpu1"]);
    }
}
