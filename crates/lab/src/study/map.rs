//! Tuning over two axes, objects and density, measured beside predicted: the map that the paper could not draw.

use super::entry::Entry;
use crate::data::Profile;
use crate::data_table::{Cell, DataTable};
use crate::figures::{FieldMap, MapCell, MapPanel, MapPoint};
use crate::fit::measured_costs;
use crate::spread::range;
use crate::train::without;
use anyhow::Result;
use rayon::prelude::*;
use sapwise::stats::median;
use sapwise::{Aabb, AlgorithmCost, AlgorithmId, Load};
use sapwise_scenes::Random;

/// Cells on either axis.
const ACROSS: usize = 24;
const UP: usize = 16;
/// Boxes that a scene of a cell has, at most: the load is estimated from a sample, and scaled beyond.
const MOST_BOXES: u32 = 20_000;
/// Seed of these scenes.
const SEED: u64 = 1;

/// The map of one machine, with what it says in numbers.
pub(super) struct Map {
    pub(super) figure: FieldMap,
    /// What was held out of the training of the prediction, in words.
    pub(super) held_out: String,
    /// Mean regret of the predicted choices at the points where the choice was timed, how many these are, and of how many; none of none.
    pub(super) regret: Option<f64>,
    /// The least and the largest regret of such a point.
    pub(super) range: Option<[f64; 2]>,
    pub(super) known: usize,
    pub(super) points: usize,
    /// Share of the cells in which both choose the same.
    pub(super) agreeing: f64,
}

/// Draws the fastest algorithms of a machine by curves that were fitted to its own timings beside those that were predicted by a model that had
/// not seen it. Cells are boxes spread evenly that move as in the scenario of the slice; points are the scenarios that were timed.
///
/// # Errors
/// When nothing can be predicted.
pub(super) fn map(entry: &Entry, profiles: &[Profile]) -> Result<Map> {
    let profile = &entry.profile;
    let (model, held_out) = without(profiles, &profile.file)?;
    let measured = measured_costs(profile).0;
    let ids = profile.available();
    let predicted = model.predict(&profile.hardware, &profile.with_revisions(&ids)).map_err(anyhow::Error::msg)?.costs;
    let density = |load: &Load| load.pairs / f64::from(load.objects.max(1));
    let places: Vec<(f64, f64)> = profile
        .points
        .iter()
        .map(|p| (f64::from(p.load.objects), density(&p.load)))
        .filter(|(_, y)| *y > 0.0)
        .collect();
    let ends = |of: fn(&(f64, f64)) -> f64| {
        places.iter().map(of).fold((f64::INFINITY, 0.0_f64), |(a, b), v| (a.min(v), b.max(v)))
    };
    let (x, y) = (ends(|p| p.0), ends(|p| p.1));
    anyhow::ensure!(x.0 < x.1 && y.0 < y.1, "its points have one number of objects or one density only");
    let moved = profile.points.iter().filter(|p| p.scenario == "uniform").map(|p| p.load.moved).collect::<Vec<_>>();
    let moved = median(&moved).unwrap_or(1.0);
    let edges = |(low, high): (f64, f64), count: usize| -> Vec<f64> {
        (0..=count).map(|k| low * (high / low).powf(k as f64 / count as f64)).collect()
    };
    let (xs, ys) = (edges(x, ACROSS), edges(y, UP));
    let cells: Vec<(usize, usize)> = (0..ACROSS).flat_map(|i| (0..UP).map(move |j| (i, j))).collect();
    let loads: Vec<Load> = cells
        .par_iter()
        .map(|&(i, j)| spread_evenly((xs[i] * xs[i + 1]).sqrt(), (ys[j] * ys[j + 1]).sqrt(), moved))
        .collect();
    let best = |costs: &[AlgorithmCost], load: &Load| {
        let of = |id: &AlgorithmId| costs.iter().find(|c| c.algorithm == *id).map(|c| c.curve.cost_ns(load));
        let known = ids.iter().enumerate().filter_map(|(k, id)| Some((k, of(id)?)));
        known.min_by(|a, b| a.1.total_cmp(&b.1)).map(|b| b.0)
    };
    let grid = |costs: &[AlgorithmCost]| -> Vec<Option<usize>> { loads.iter().map(|load| best(costs, load)).collect() };
    let (by_measured, by_predicted) = (grid(&measured), grid(&predicted));
    let mut points: [Vec<MapPoint>; 2] = Default::default();
    let mut regrets = Vec::new();
    for spot in profile.points.iter().filter(|p| density(&p.load) > 0.0) {
        let position = |k: u16| ids.iter().position(|id| id == profile.id(k));
        let own = spot.medians.iter().filter_map(|&(k, ns)| Some((position(k)?, ns)));
        let Some((fastest, least)) = own.clone().min_by(|a, b| a.1.total_cmp(&b.1)) else { continue };
        let at =
            |algorithm, loss| MapPoint { x: f64::from(spot.load.objects), y: density(&spot.load), algorithm, loss };
        points[0].push(at(fastest, None));
        let Some(chosen) = best(&predicted, &spot.load) else { continue };
        // What was chosen and not timed had left the race; how much it loses is not known.
        let loss = own.clone().find(|o| o.0 == chosen).map(|o| o.1 / least - 1.0);
        regrets.extend(loss);
        points[1].push(at(chosen, loss));
    }
    let agreeing = by_measured.iter().zip(&by_predicted).filter(|(a, b)| a == b).count() as f64 / cells.len() as f64;
    let panel = |title: &str, grid: Vec<Option<usize>>, points: Vec<MapPoint>| {
        let cell = |(&(i, j), algorithm): (&(usize, usize), Option<usize>)| {
            Some(MapCell { x: (xs[i], xs[i + 1]), y: (ys[j], ys[j + 1]), algorithm: algorithm? })
        };
        MapPanel { title: title.to_owned(), grid: cells.iter().zip(grid).filter_map(cell).collect(), points }
    };
    let [at_measured, at_predicted] = points;
    let count = at_measured.len();
    let panels = vec![panel("measured", by_measured, at_measured), panel("predicted", by_predicted, at_predicted)];
    let names = ids.iter().enumerate().map(|(k, id)| (id.to_string(), k)).collect();
    let title = format!("Fastest algorithm over objects and density: {}", entry.name);
    let figure = FieldMap { title, names, x, y, y_name: "overlapping pairs of an object".to_owned(), panels };
    let (known, points) = (regrets.len(), count);
    let regret = (known > 0).then(|| regrets.iter().sum::<f64>() / known as f64);
    let range = range(&regrets);
    Ok(Map { figure, held_out, regret, range, known, points, agreeing })
}

impl Map {
    /// The frames that were timed, with what was fastest and what was chosen; and the cells, with what is predicted for each.
    pub(super) fn tables(&self, report: usize) -> [DataTable; 2] {
        let density = "overlapping pairs of an object";
        let mut points = DataTable::new([
            ("choice", "choice"),
            ("algorithm", "algorithm"),
            ("objects", "objects"),
            (density, "pairs_per_object"),
            ("regret", "regret_share"),
        ]);
        let mut cells = DataTable::new([
            ("choice", "choice"),
            ("algorithm", "algorithm"),
            ("from (objects)", "from_objects"),
            ("to (objects)", "to_objects"),
            ("from (pairs of an object)", "from_pairs_per_object"),
            ("to (pairs of an object)", "to_pairs_per_object"),
        ]);
        let name = |algorithm: usize| Cell::text(self.figure.names.get(algorithm).map_or("", |name| &name.0));
        for panel in &self.figure.panels {
            for p in &panel.points {
                let regret = p.loss.map_or_else(|| Cell::Missing("the choice was not timed".to_owned()), Cell::percent);
                let heads = [Cell::text(&panel.title), name(p.algorithm)];
                points.push([&heads[..], &[p.x, p.y].map(Cell::exact), &[regret]].concat(), &[report]);
            }
            for c in &panel.grid {
                let heads = [Cell::text(&panel.title), name(c.algorithm)];
                cells.push([&heads[..], &[c.x.0, c.x.1, c.y.0, c.y.1].map(Cell::exact)].concat(), &[report]);
            }
        }
        [points, cells]
    }
}

/// The load of `objects` unit cubes spread evenly, each in `pairs_of_object` pairs.
fn spread_evenly(objects: f64, pairs_of_object: f64, moved: f64) -> Load {
    let objects = objects.round().max(2.0) as u32;
    let few = objects.min(MOST_BOXES);
    // Two cubes overlap where their middles differ by at most one on each axis: 8 of the volume, half as many pairs as neighbours.
    let edge = (4.0 * f64::from(few) / pairs_of_object).cbrt() as f32;
    let mut random = Random::named(SEED, &["map"]);
    let mut middle = || [(); 3].map(|()| random.uniform() as f32 * edge);
    let boxes: Vec<Aabb> = (0..few).map(|_| Aabb::cube(middle(), 0.5)).collect();
    let load = Load::estimate(&boxes, Some(f64::from(few) * pairs_of_object), Some(moved));
    if few == objects {
        return load;
    }
    // A world that grows with its objects: each is next to as many as before, and shares an axis with as many as its cross-section holds,
    // which grows with the power 2/3 and not 1 as in `Load::rescaled`, whose world stays.
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
        // More boxes in a world that grows with them are estimated like the scene itself.
        let [small, large] = [20_000.0, 160_000.0].map(|n| spread_evenly(n, 0.5, 0.1));
        assert_eq!((small.pairs, large.pairs), (10_000.0, 80_000.0));
        let growth = large.axis_candidates / small.axis_candidates;
        assert!((growth - 32.0).abs() < 0.1, "{growth}");
        assert!(large.strip_candidates >= large.pairs && large.axis_candidates > large.strip_candidates);
        // And the scene has about as many pairs as it says.
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
