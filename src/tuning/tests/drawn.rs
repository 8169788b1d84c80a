//! Random costs for tests.

use crate::cost::{Places, Residual, Work};
use crate::tuning::{AlgorithmCost, CostCurve, CostTerm, Term};
use crate::{Load, splitmix};
use std::sync::Arc;

/// Draws from 0 to 1.
fn draw(state: &mut u64) -> f64 {
    (splitmix::next(state) >> 11) as f64 / (1_u64 << 53) as f64
}

/// Returns random curves of many terms with residuals, and loads whose motion falls with the number of objects.
pub(in crate::tuning) fn drawn(seed: u64) -> (Vec<AlgorithmCost>, Vec<Load>) {
    let load = |k: i32| {
        let n = 10.0_f64.powf(f64::from(k) / 4.0).round();
        let strip_candidates = 3.0 * n.powf(1.2);
        Load::of_objects(n as u32).with_candidates(n.powf(1.6), strip_candidates).with_pairs(n).with_moved(n.powf(-0.2))
    };
    let loads: Vec<Load> = (4..=24).map(load).collect();
    let places = Arc::new(Places::new(loads.clone()));
    let mut state = seed;
    let costs = (0..16).map(|k| {
        let mut unit = |scale: f64| scale * (6.0 * draw(&mut state) - 3.0).exp();
        let terms = vec![
            CostTerm { term: Term::Call, unit_ns: unit(2000.0) },
            CostTerm { term: Term::Objects, unit_ns: unit(20.0) },
            CostTerm { term: Term::Sort, unit_ns: unit(1.0) },
            CostTerm { term: Term::ColdObjects, unit_ns: unit(5.0) },
            CostTerm { term: Term::AllPairs, unit_ns: unit(0.01) },
            CostTerm { term: Term::StripCandidates, unit_ns: unit(1.0) },
            CostTerm { term: Term::Moved, unit_ns: unit(20.0) },
        ];
        let weights = (0..places.loads().len()).map(|_| 0.4 * draw(&mut state)).collect();
        let residual = Residual::new(Arc::clone(&places), weights, false);
        let work = Arc::new(Work { cache_bytes: 1e6, ..Work::new(terms) });
        let curve = CostCurve { residual: Some(residual), ..CostCurve::of(work) };
        AlgorithmCost { algorithm: format!("m{k}@cpu1").parse().unwrap(), revision: 1, curve, spread_ln: 0.1 }
    });
    let costs = costs.collect();
    (costs, loads)
}
