//! The field map: the fastest algorithm over objects and density, measured beside predicted.

use super::{Material, Page, title};
use crate::data::Profile;
use crate::figures::{Cell, FieldMap, MapPanel};
use crate::text::position_or_push;
use crate::train::without;
use anyhow::{Result, ensure};
use rayon::prelude::*;
use sapwise::Aabb;
use sapwise::algorithm::Load;
use sapwise::tuning::AlgorithmCost;
use sapwise_scenes::Random;
use sapwise_tune::stats::median;
use std::collections::BTreeSet;

/// Cells on either axis.
const ACROSS: usize = 24;
const UP: usize = 16;
/// Most boxes of the scene of a cell. The load of larger cells is scaled from that of this number.
const MOST_BOXES: u32 = 20_000;
const SEED: u64 = 1;

pub(super) fn section(material: &Material, page: &mut Page) -> Result<()> {
    page.section("Fields over objects and density");
    // Of the hosts that timed the most methods, the first.
    let methods = |p: &&Profile| p.available().iter().map(|id| id.method().to_owned()).collect::<BTreeSet<_>>().len();
    let Some(profile) = material.whole_hosts().into_iter().rev().max_by_key(methods) else {
        page.lacks("The field map: no report has timings.");
        return Ok(());
    };
    match map(material, profile) {
        Err(why) => page.lacks(&format!("The field map: {why:#}.")),
        Ok((map, held_out)) => {
            let predicted = match held_out {
                Some(held_out) => format!("Predicted: by a model that was trained without this {held_out}."),
                None => "Nothing is predicted: that takes another report.".to_owned(),
            };
            let caption = format!(
                "The fastest algorithm for evenly spread boxes that move as in the scenario uniform. Measured: by \
                 curves fitted to the \
                 timings of {}; points are the frames that were timed, of all scenarios. {predicted}",
                title(profile)
            );
            page.figure("field-map.svg", map.svg()?, &caption);
        }
    }
    Ok(())
}

/// Returns the map of a profile, and the name of the part that was held out for its predicted side. A single report
/// has no predicted side.
fn map(material: &Material, profile: &Profile) -> Result<(FieldMap, Option<String>)> {
    let tuning = material.profiles.iter().zip(&material.tunings).find(|(p, _)| std::ptr::eq(*p, profile));
    let measured = tuning.and_then(|(_, tuning)| tuning.as_ref()).map(|t| &t.costs[..]).unwrap_or_default();
    let other = without(&material.profiles, &profile.file).ok();
    let available = profile.with_revisions(&profile.available());
    let predicted = other.as_ref().and_then(|(model, _)| model.predict(&profile.hardware, &available).ok());
    let density = |load: &Load| load.pairs / f64::from(load.objects.max(1));
    let timed = || profile.points.iter().filter(|s| density(&s.load) > 0.0);
    let ends = |of: &dyn Fn(&Load) -> f64| {
        timed().map(|s| of(&s.load)).fold((f64::INFINITY, 0.0_f64), |(low, high), v| (low.min(v), high.max(v)))
    };
    let (x, y) = (ends(&|load| f64::from(load.objects)), ends(&density));
    ensure!(x.0 < x.1 && y.0 < y.1, "its frames have one number of objects or one density only");
    let moved: Vec<f64> = profile.points.iter().filter(|p| p.scenario == "uniform").map(|p| p.load.moved).collect();
    let moved = median(&moved).unwrap_or(1.0);
    let edge = |(low, high): (f64, f64), k: usize, count: usize| low * (high / low).powf(k as f64 / count as f64);
    let cell = |k: usize| {
        let (i, j) = (k / UP, k % UP);
        let corner = |i, j| (edge(x, i, ACROSS), edge(y, j, UP));
        let (from, to) = (corner(i, j), corner(i + 1, j + 1));
        (from, to, spread_evenly((from.0 * to.0).sqrt(), (from.1 * to.1).sqrt(), moved))
    };
    let cells: Vec<_> = (0..ACROSS * UP).into_par_iter().map(cell).collect();
    let mut names: Vec<String> = Vec::new();
    let mut place = |name: String| position_or_push(&mut names, name);
    let mut fields = |costs: &[AlgorithmCost]| -> Vec<Cell> {
        let best = |load: &Load| {
            costs.iter().min_by(|a, b| a.curve.cost_ns(load).total_cmp(&b.curve.cost_ns(load))).map(|c| &c.algorithm)
        };
        let field = |&(from, to, load): &_| Some(Cell { from, to, algorithm: place(best(&load)?.to_string()) });
        cells.iter().filter_map(field).collect()
    };
    let measured = fields(measured);
    let predicted = predicted.map(|prediction| fields(&prediction.costs));
    let point = |spot: &crate::data::Spot| {
        let best = spot.medians.iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
        Some((f64::from(spot.load.objects), density(&spot.load), place(profile.id(best.0).to_string())))
    };
    let points = timed().filter_map(point).collect();
    let mut panels =
        vec![MapPanel { title: "measured; dots: frames of all scenarios".to_owned(), cells: measured, points }];
    let without = other.as_ref().map_or("", |(_, held_out)| held_out);
    let told = format!("predicted without this {without}");
    panels.extend(predicted.map(|cells| MapPanel { title: told, cells, points: Vec::new() }));
    let map = FieldMap {
        title: format!("{}: fastest over objects and density, moving as in uniform", title(profile)),
        names,
        y_name: "overlapping pairs of an object",
        panels,
    };
    Ok((map, other.map(|(_, held_out)| held_out)))
}

/// Returns the load of unit cubes spread evenly, each in this number of pairs.
fn spread_evenly(objects: f64, pairs_of_object: f64, moved: f64) -> Load {
    let objects = objects.round().max(2.0) as u32;
    let few = objects.min(MOST_BOXES);
    // Two cubes overlap if their middles differ by at most one on each axis, a volume of 8. There are half as many
    // pairs as neighbours.
    let edge = (4.0 * f64::from(few) / pairs_of_object).cbrt() as f32;
    let mut random = Random::named(SEED, &["map"]);
    let mut middle = || [(); 3].map(|()| random.uniform() as f32 * edge);
    let boxes: Vec<Aabb> = (0..few).map(|_| Aabb::cube(middle(), 0.5)).collect();
    let load = Load::estimate(&boxes, Some(f64::from(few) * pairs_of_object), None);
    // The world grows with its objects. Pairs and candidates in strips grow in proportion, candidates on an axis with
    // the power 5/3: each object shares the axis with all objects in its slab.
    let growth = f64::from(objects) / f64::from(few);
    Load::of_objects(objects)
        .with_candidates(load.axis_candidates * growth.powf(5.0 / 3.0), load.strip_candidates * growth)
        .with_pairs(load.pairs * growth)
        .with_moved(moved)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sapwise::{Pairs, Registry};

    #[test]
    fn a_cell_has_the_density_that_it_is_drawn_at() {
        let [small, large] = [20_000.0, 160_000.0].map(|n| spread_evenly(n, 0.5, 0.1));
        assert_eq!((small.pairs, large.pairs), (10_000.0, 80_000.0));
        let growth = large.axis_candidates / small.axis_candidates;
        assert!((growth - 32.0).abs() < 0.1, "{growth}");
        // The scene has about the stated number of pairs.
        let edge = (4.0 * 4000.0 / 0.5_f64).cbrt() as f32;
        let mut random = Random::named(SEED, &["map"]);
        let boxes: Vec<Aabb> =
            (0..4000).map(|_| Aabb::cube([(); 3].map(|()| random.uniform() as f32 * edge), 0.5)).collect();
        let mut pairs = Pairs::new();
        Registry::with_cores(1).create(&"brute@cpu1".parse().unwrap()).unwrap().find_pairs(&boxes, &mut pairs).unwrap();
        let ratio = pairs.len() as f64 / 2000.0;
        assert!((0.85..1.15).contains(&ratio), "{ratio}");
    }
}
