//! Coverage on made-up machines, and what a fold keeps.

use super::super::synthetic::{Machine, gpu_truth, truth};
use super::*;
use sapwise_scenes::Random;
use sapwise::hardware::ParameterId;
use sapwise::model::{Feature, ModelSchema, ModelTerm, Range, ResidualTerm, Scale, Validation};
use sapwise::{BackendClass, Model, Parameter, Source, Term, json};

/// A machine whose costs are off from any model's: both algorithms together by 30 %, each by 25 %, and one by up to 10 %
/// more that changes with the size.
struct MadeUp {
    hardware: Hardware,
    factors: [f64; 2],
    phase: f64,
}

impl MadeUp {
    fn new(seed: u64, k: usize) -> Self {
        let mut random = Random::named(seed, &["machine", &k.to_string()]);
        let figures = [
            (ParameterId::UsableCores, 1.0),
            (ParameterId::ClockMeasuredGhz, 3.0 * random.log_normal(0.2)),
            (ParameterId::CacheLlcBytes, 3e7),
        ];
        let parameters = figures.map(|(name, value)| Parameter::reported(name, value, "test")).into();
        let machine = sapwise::Machine { physical_id: format!("{k:016x}"), ..sapwise::Machine::default() };
        let both = random.log_normal(0.3);
        let factors = [(); 2].map(|()| both * random.log_normal(0.25));
        Self {
            hardware: Hardware { machine, parameters, gpus: Vec::new(), gpu_groups: Vec::new() },
            factors,
            phase: std::f64::consts::TAU * random.uniform(),
        }
    }

    /// Nanoseconds of brute and of sweep, which cross at about 160 objects.
    fn ns(&self, load: &Load) -> [f64; 2] {
        let bend = (0.1 * (f64::from(load.objects).ln() + self.phase).sin()).exp();
        let ghz = self.hardware.value(ParameterId::ClockMeasuredGhz).unwrap();
        let exact = [0.5 * Term::AllPairs.count(load, 0.0), 40.0 * f64::from(load.objects) * bend];
        [0, 1].map(|k| self.factors[k] * exact[k] / ghz)
    }

    fn crossing(&self) -> f64 {
        let above = |n: &u32| self.ns(&at(*n))[0] > self.ns(&at(*n))[1];
        f64::from((1..100_000).find(above).unwrap())
    }
}

fn at(objects: u32) -> Load {
    Load { objects, ..Load::default() }
}

fn algorithms() -> [AlgorithmId; 2] {
    ["brute@cpu1", "sap@cpu1"].map(|id| id.parse().unwrap())
}

fn one_term(name: &str, term: Term, unit: f64) -> MethodModel {
    MethodModel {
        method: name.to_owned(),
        max_threads: 1,
        terms: vec![ModelTerm { term, scale: Scale::Cycle, unit }],
        ..truth().remove(0)
    }
}

/// One unit for each of the two methods: the geometric mean over the machines.
fn fitted(machines: &[&MadeUp]) -> Vec<MethodModel> {
    let terms = [("brute", Term::AllPairs), ("sap", Term::Objects)];
    let unit = |k: usize| {
        let ratios = machines.iter().flat_map(|m| {
            let ghz = m.hardware.value(ParameterId::ClockMeasuredGhz).unwrap();
            sizes().map(move |n| (m.ns(&at(n))[k] * ghz / terms[k].1.count(&at(n), 0.0)).ln())
        });
        let ratios: Vec<f64> = ratios.collect();
        (ratios.iter().sum::<f64>() / ratios.len() as f64).exp()
    };
    [0, 1].map(|k| one_term(terms[k].0, terms[k].1, unit(k))).into()
}

fn sizes() -> impl Iterator<Item = u32> {
    (0..14).map(|k| 10 << k)
}

fn model(methods: Vec<MethodModel>, folds: Vec<Fold>, machines: usize) -> Model {
    let range = Range { parameter: ParameterId::ClockMeasuredGhz.to_owned(), min: 1.0, max: 9.0 };
    Model {
        schema: ModelSchema,
        name: "test".to_owned(),
        trained_on: Vec::new(),
        trained_on_counts: Vec::new(),
        ranges: vec![range],
        methods,
        validation: Validation {
            held_out: "physical machine".to_owned(),
            physical_machines: machines,
            profiles: machines,
            ..Validation::default()
        },
        clouds: Vec::new(),
        folds,
        prior: None,
    }
}

fn trained(machines: &[MadeUp]) -> Model {
    let ids = algorithms();
    let fit = |held: Vec<usize>| {
        let of = |m: &&MadeUp| !held.iter().any(|&k| machines[k].hardware == m.hardware);
        let held_out = held.iter().map(|&k| HeldOut {
            hardware: &machines[k].hardware,
            points: sizes().map(|n| (at(n), ids.iter().zip(machines[k].ns(&at(n))).collect())).collect(),
        });
        Fit { methods: fitted(&machines.iter().filter(of).collect::<Vec<_>>()), held_out: held_out.collect() }
    };
    let dealt = (0..MOST_FOLDS).map(|k| (k..machines.len()).step_by(MOST_FOLDS).collect());
    let folds = dealt.map(|held| fold(&fit(held))).collect();
    model(fitted(&machines.iter().collect::<Vec<_>>()), folds, machines.len())
}

#[test]
fn intervals_hold_the_times_and_the_crossings_of_nine_new_machines_in_ten() {
    let slice: Vec<Load> = sizes().map(at).collect();
    let ids = algorithms();
    let wanted: Vec<(AlgorithmId, u32)> = ids.iter().map(|id| (id.clone(), 1)).collect();
    for count in [12, 30] {
        let (mut times, mut crossings, mut widths) = (0, 0, Vec::new());
        let (trainings, tests) = (12, 40);
        for training in 0..trainings {
            let machines: Vec<MadeUp> = (0..count).map(|k| MadeUp::new(training, k)).collect();
            let model = trained(&machines);
            assert_eq!((model.defect(), model.folds.len()), (None, 10));
            for k in 1000..1000 + tests {
                let new = MadeUp::new(training, k);
                let prediction = model.predict(&new.hardware, &wanted).unwrap();
                let load = at(10 << (k % 14));
                let (low, high) = prediction.interval_ns(&ids[1], &load).unwrap();
                times += usize::from((low..=high).contains(&new.ns(&load)[1]));
                let tuning = prediction.tuning("uniform", &slice);
                assert_eq!((tuning.defect(), tuning.crossovers.len()), (None, 1));
                let (low, high) = tuning.crossovers[0].interval().unwrap();
                crossings += usize::from((low..=high).contains(&new.crossing()));
                widths.push((high / low).ln() / 2.0);
            }
        }
        let all = (trainings as usize * tests) as f64;
        let (times, crossings) = (times as f64 / all, crossings as f64 / all);
        widths.sort_by(f64::total_cmp);
        let width = widths[widths.len() / 2];
        // The logarithm of a crossing has a deviation of about 0.36, of which 90 % are 0.6 to either side.
        assert!((0.8..=1.0).contains(&times) && (0.8..=1.0).contains(&crossings), "{count}: {times} {crossings}");
        assert!((0.4..1.4).contains(&width), "{count}: {width}");
    }
}

#[test]
fn errors_that_two_algorithms_share_leave_their_ratio_alone_and_folds_repeat() {
    let machines: Vec<MadeUp> = (0..20).map(|k| MadeUp::new(5, k)).collect();
    let model = trained(&machines);
    assert!(model.folds.iter().all(|f| f.machines == 2 && f.errors.len() == 2 && f.errors[0].against.len() == 1));
    let alike: Vec<MadeUp> = (0..20)
        .map(|k| {
            let m = MadeUp::new(5, k);
            MadeUp { factors: [m.factors[0]; 2], ..m }
        })
        .collect();
    let of = trained(&alike);
    let worst = of.folds.iter().map(|f| f.errors[0].against[0].2[QUANTILES.len() - 1]).fold(0.0, f64::max);
    let apart = of.folds.iter().map(|f| f.errors[0].ln_errors[QUANTILES.len() - 1]).fold(0.0, f64::max);
    assert!(worst < 0.35 && apart > 0.5, "{worst} {apart}");
    assert_eq!(trained(&machines), model);
}

#[test]
fn every_machine_weighs_the_same_and_quantiles_are_rounded_up() {
    let errors = ByMachine::from([(0, vec![0.1001; 99]), (1, vec![1.0])]);
    assert_eq!(quantiles(&errors), [0.101, 0.101, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]);
    let errors = ByMachine::from([(0, (1..=100).map(|k| f64::from(k) / 100.0).collect())]);
    assert_eq!(quantiles(&errors), QUANTILES);
}

#[test]
fn a_fold_is_what_its_fit_is() {
    let machine = Machine::family_with_gpus().remove(1);
    let hardware = machine.hardware();
    let slope = |feature, centre| ResidualTerm { feature, centre, slope: 0.012_345_678 };
    let residual = vec![slope(Feature::Log2Objects, 10.0), slope(Feature::Log2ObjectsSquared, 120.0)];
    let methods: Vec<MethodModel> =
        truth().into_iter().map(|m| MethodModel { residual: residual.clone(), residual_intercept: 0.1, ..m }).collect();
    let profile = Profile::of("", &machine.report());
    let folds = [fold(&Fit { methods: methods.clone(), held_out: vec![HeldOut::of(&profile)] })];
    // Without GPU methods there are no errors of GPU algorithms.
    assert!(folds[0].errors.iter().all(|e| e.role.backend == BackendClass::Cpu) && folds[0].errors.len() == 8);
    let mine = model(methods, Vec::new(), 1);
    // The same curves from a model whose methods are those of the fold.
    let of_fold = |m: &FoldMethod| MethodModel {
        residual: m.slopes.iter().map(|&(feature, slope)| ResidualTerm { feature, centre: 0.0, slope }).collect(),
        residual_intercept: m.intercept,
        terms: m.terms.iter().map(|&(term, scale, unit)| ModelTerm { term, scale, unit }).collect(),
        ..mine.methods.iter().find(|o| o.method == m.method).unwrap().clone()
    };
    for m in &folds[0].methods {
        let id: AlgorithmId = format!("{}@cpu2", m.method).parse().unwrap();
        let of_model = mine.method(&id).unwrap().curve(&hardware, id.backend()).unwrap();
        let of_fold = of_fold(m).curve(&hardware, id.backend()).unwrap();
        for n in sizes() {
            assert!((of_fold.cost_ns(&at(n)) / of_model.cost_ns(&at(n)) - 1.0).abs() < 1e-4, "{} {n}", m.method);
        }
    }
}

#[test]
fn a_model_of_ten_folds_and_all_roles_stays_under_200_kb() {
    let mut machine = Machine::family_with_gpus().remove(1);
    machine.noise = 0.3;
    let profile = Profile::of("", &machine.report());
    let slope = |&feature: &Feature| ResidualTerm { feature, centre: 11.234_567_89, slope: -0.012_345_678 };
    let methods: Vec<MethodModel> = truth()
        .into_iter()
        .chain(gpu_truth())
        .map(|m| {
            let terms = m.terms.iter().map(|t| ModelTerm { unit: t.unit * 1.234_567_89, ..*t }).collect();
            MethodModel { residual: Feature::of(m.backend).iter().map(slope).collect(), terms, ..m }
        })
        .collect();
    let one = fold(&Fit { methods: methods.clone(), held_out: vec![HeldOut::of(&profile)] });
    let folds = vec![one; MOST_FOLDS];
    // Eight roles on the CPU and six on GPUs; with four threads and two GPUs all but one GPU meet others of their role.
    assert_eq!(folds[0].errors.len(), 14);
    assert!(folds[0].errors.iter().map(|e| e.against.len()).sum::<usize>() > 91);
    let text = json::write_model(&model(methods.clone(), folds, 10)).unwrap();
    assert!(text.len() < 200_000, "{} bytes", text.len());
    assert!(json::model(&text).is_ok());
}

/// Ten machines: the family, and three of it with another clock.
fn ten() -> Vec<Profile> {
    let mut machines = Machine::family();
    for (k, name) in ["0000000000000011", "0000000000000012", "0000000000000013"].into_iter().enumerate() {
        machines.push(Machine { name, ghz: 0.8 * machines[k].ghz, ..machines[k].clone() });
    }
    machines.iter().map(|m| Profile::of(&format!("{}.json", m.name), &m.report())).collect()
}

#[test]
fn ten_machines_give_ten_folds_and_nine_none() {
    let profiles = ten();
    let of = |profiles: &[Profile]| folds(profiles, &Designs::new(profiles)).unwrap();
    assert!(of(&profiles[..9]).is_empty());
    let folds = of(&profiles);
    assert!(folds.len() == 10 && folds.iter().all(|f| f.machines == 1 && f.methods.len() == 4), "{folds:?}");
    let (methods, _) = Designs::new(&profiles).fit(&[true; 10]).unwrap();
    let model = model(methods, folds, 10);
    assert_eq!(model.defect(), None);
    let wanted: Vec<(AlgorithmId, u32)> = profiles[2].algorithms.iter().map(|t| (t.id.clone(), t.revision)).collect();
    let slice: Vec<Load> = profiles[2].points.iter().filter(|s| s.scenario == "uniform").map(|s| s.load).collect();
    let tuning = model.predict(&profiles[2].hardware, &wanted).unwrap().tuning("uniform", &slice);
    assert!(tuning.source == Source::Predicted && !tuning.crossovers.is_empty());
    let intervals: Option<Vec<(f64, f64)>> = tuning.crossovers.iter().map(|b| b.interval()).collect();
    let intervals = intervals.expect(&tuning.interval_basis);
    // The machines are what the model says up to 2 % of noise. Where two costs run along each other the interval is wide all the
    // same.
    assert!(intervals.iter().any(|(low, high)| high / low < 1.5), "{:?}", tuning.crossovers);
}
