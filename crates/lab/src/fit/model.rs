//! A model, fitted to profiles.

use super::designs::Designs;
use crate::data::{COMPARED, COMPARED_OF_GPUS, Profile, is_real};
use crate::spread;
use anyhow::{Result, bail};
use sapwise::algorithm::Backend;
use sapwise_tune::model::{GPU_PREFIX, Range};
use sapwise_tune::{GpuHardware, Model};
use std::sync::Arc;

/// Fits a model to the chosen profiles. Returns it with a sentence for each method that was left out.
///
/// # Errors
/// When no method could be fitted, or a regression fails.
pub fn model(designs: &Designs<'_>, chosen: &[bool], name: &str) -> Result<(Model, Vec<String>)> {
    let (methods, notes) = designs.fit(chosen)?;
    let profiles: Vec<&Profile> =
        designs.profiles.iter().zip(chosen).filter(|(_, chosen)| **chosen).map(|(p, _)| p).collect();
    let mut model = Model::new(name, methods, ranges(&profiles));
    model.places = Arc::clone(&designs.basis.places);
    if let Some(defect) = model.defect() {
        bail!("no model could be fitted: {}", [vec![defect], notes].concat().join("; "));
    }
    Ok((model, notes))
}

/// Returns the ranges of the parameters of machines, then of the GPUs that were timed. Software adapters count only
/// if there is no real GPU: a range from them to one card would hold almost any other GPU.
fn ranges(profiles: &[&Profile]) -> Vec<Range> {
    let machine = COMPARED
        .into_iter()
        .filter_map(|name| range(name.to_string(), profiles.iter().filter_map(|p| p.hardware.value(name)).collect()));
    let mut timed: Vec<&GpuHardware> = profiles.iter().flat_map(|p| timed_gpus(p)).collect();
    if timed.iter().any(|g| is_real(g)) {
        timed.retain(|g| is_real(g));
    }
    let gpus = COMPARED_OF_GPUS
        .into_iter()
        .filter_map(|name| range(format!("{GPU_PREFIX}{name}"), timed.iter().filter_map(|g| g.value(name)).collect()));
    machine.chain(gpus).collect()
}

fn range(parameter: String, values: Vec<f64>) -> Option<Range> {
    let [min, max] = spread::range(&values)?;
    Some(Range { parameter, min, max, published: Vec::new() })
}

/// Returns the GPUs of a profile that an algorithm was timed on.
fn timed_gpus(profile: &Profile) -> impl Iterator<Item = &GpuHardware> {
    let used = |k: u32| {
        let on = |backend: &Backend| matches!(backend, Backend::Gpu(list) if list.contains(&k));
        profile.algorithms.iter().any(|t| on(t.id.backend()))
    };
    profile.hardware.gpus.iter().filter(move |g| used(g.gpu.index))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::{Machine, profiles};
    use sapwise_tune::GpuKind;

    #[test]
    fn the_ranges_of_gpus_are_of_the_real_ones_where_there_is_one() {
        let mut all = profiles(Machine::family_with_gpus().into_iter().take(2));
        let of_gpus = |profiles: &[Profile]| -> Vec<(f64, f64)> {
            let ranges = ranges(&profiles.iter().collect::<Vec<_>>());
            ranges.iter().filter(|r| r.parameter.starts_with(GPU_PREFIX)).map(|r| (r.min, r.max)).collect()
        };
        let software = |p: &mut Profile| p.hardware.gpus.iter_mut().for_each(|g| g.gpu.kind = GpuKind::Software);
        let both = of_gpus(&all);
        // The uploads of the three GPUs: 9, 12 and 5 GB/s.
        assert!(both.contains(&(5.0, 12.0)), "{both:?}");
        software(&mut all[0]);
        let second = of_gpus(&all[1..]);
        assert_eq!(of_gpus(&all), second);
        assert_ne!(both, second);
        software(&mut all[1]);
        assert_eq!(of_gpus(&all), both);
    }
}
