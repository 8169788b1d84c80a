//! The cost curve of a method on a backend of a machine.

use super::needed::needed;
use super::{Feature, MethodModel, ModelTerm, PredictError, ResidualTerm, Scale};
use crate::hardware::{Hardware, ParameterId};
use crate::{Backend, BackendClass, CostCurve, CostTerm, Knot};

/// Objects at which the correction of a predicted curve is tabulated: 2^3 to 2^24, every octave.
const CORRECTION_OCTAVES: std::ops::RangeInclusive<u32> = 3..=24;

/// The figures of one backend of a machine, each looked up once: a method and its folds share them.
pub(super) struct Figures<'a> {
    hardware: &'a Hardware,
    backend: &'a Backend,
    scales: Vec<(Scale, Result<f64, PredictError>)>,
    features: Vec<(Feature, Result<f64, PredictError>)>,
    cache: Option<Result<f64, PredictError>>,
}

/// What a curve is made of, of a model or of one of its folds.
pub(super) struct Formula<T, R> {
    pub(super) class: BackendClass,
    pub(super) terms: T,
    /// Terms of the other way, where there is one.
    pub(super) fallback_terms: T,
    pub(super) intercept: f64,
    pub(super) residual: R,
    /// Fewest and most objects that were timed; the residual is held constant beyond.
    pub(super) objects: (u32, u32),
}

impl<'a> Figures<'a> {
    pub(super) fn new(hardware: &'a Hardware, backend: &'a Backend) -> Self {
        Self { hardware, backend, scales: Vec::new(), features: Vec::new(), cache: None }
    }

    fn nanoseconds(&mut self, scale: Scale) -> Result<f64, PredictError> {
        if let Some((_, known)) = self.scales.iter().find(|s| s.0 == scale) {
            return known.clone();
        }
        let looked_up = scale.nanoseconds(self.hardware, self.backend);
        self.scales.push((scale, looked_up.clone()));
        looked_up
    }

    /// The terms with what a unit of each takes, those of the same count together.
    fn costs(&mut self, terms: impl Iterator<Item = ModelTerm>) -> Result<Vec<CostTerm>, PredictError> {
        let mut costs: Vec<CostTerm> = Vec::new();
        for t in terms.filter(|t| t.unit > 0.0) {
            let unit_ns = t.unit * self.nanoseconds(t.scale)?;
            match costs.iter_mut().find(|c| c.term == t.term) {
                Some(same) => same.unit_ns += unit_ns,
                None => costs.push(CostTerm { term: t.term, unit_ns }),
            }
        }
        Ok(costs)
    }

    fn feature(&mut self, feature: Feature) -> Result<f64, PredictError> {
        if let Some((_, known)) = self.features.iter().find(|f| f.0 == feature) {
            return known.clone();
        }
        let looked_up = feature.of_machine(self.hardware, self.backend);
        self.features.push((feature, looked_up.clone()));
        looked_up
    }

    fn cache_bytes(&mut self) -> Result<f64, PredictError> {
        let hardware = self.hardware;
        self.cache.get_or_insert_with(|| needed(hardware, ParameterId::CacheLlcBytes)).clone()
    }
}

impl<T: Iterator<Item = ModelTerm>, R: Iterator<Item = ResidualTerm>> Formula<T, R> {
    /// # Errors
    /// Names the hardware parameter or the GPU that is missing.
    pub(super) fn curve(self, figures: &mut Figures<'_>) -> Result<CostCurve, PredictError> {
        let (terms, fallback_terms) = (figures.costs(self.terms)?, figures.costs(self.fallback_terms)?);
        // What depends on the machine alone is added up once for all octaves.
        let (mut fixed, mut with_load, mut corrected) = (self.intercept, Vec::with_capacity(2), self.intercept != 0.0);
        for r in self.residual {
            corrected = true;
            if r.feature.of_octaves(0.0, figures.backend).is_some() {
                with_load.push(r);
            } else {
                fixed += r.slope * (figures.feature(r.feature)? - r.centre);
            }
        }
        let mut correction = Vec::new();
        let backend = figures.backend;
        if corrected {
            let (fewest, most) = self.objects;
            correction.extend(CORRECTION_OCTAVES.map(|octave| {
                let octaves = f64::from((1 << octave).min(most).max(fewest).max(1)).log2();
                let slope = |r: &ResidualTerm| r.slope * (r.feature.of_octaves(octaves, backend).unwrap_or(0.0) - r.centre);
                Knot { log2_objects: f64::from(octave), ln_factor: fixed + with_load.iter().map(slope).sum::<f64>() }
            }));
        }
        let cache_bytes = match self.class {
            BackendClass::Cpu => figures.cache_bytes()?,
            // No term of a GPU depends on the caches of the CPU.
            BackendClass::Gpu => 0.0,
        };
        let curve = CostCurve { terms, fallback_terms, cache_bytes, correction };
        curve.defect().map_or(Ok(curve), |e| Err(PredictError::Curve(e)))
    }
}

impl MethodModel {
    pub(super) fn formula(&self) -> Formula<impl Iterator<Item = ModelTerm>, impl Iterator<Item = ResidualTerm>> {
        Formula {
            class: self.backend,
            terms: self.terms.iter().copied(),
            fallback_terms: self.fallback_terms.iter().copied(),
            intercept: self.residual_intercept,
            residual: self.residual.iter().copied(),
            objects: (self.min_objects, self.max_objects),
        }
    }

    /// The cost curve of this method on a backend of a machine.
    ///
    /// # Errors
    /// Names the hardware parameter or the GPU that is missing, or what is wrong with the curve.
    pub fn curve(&self, hardware: &Hardware, backend: &Backend) -> Result<CostCurve, PredictError> {
        self.formula().curve(&mut Figures::new(hardware, backend))
    }
}
