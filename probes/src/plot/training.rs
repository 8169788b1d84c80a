//! How well a model did on machines that were left out, in three panels.

use super::colour;
use super::mark::{Mark, mark};
use crate::train::{Held, OURS, Time};
use plotters::coord::Shift;
use plotters::prelude::*;
use sapwise::model::{Learning, LearningScore};
use sapwise::{BackendClass, Model};

/// Width and height in pixels.
const SIZE: (u32, u32) = (1300, 1010);
/// Height of the two panels above, and of the line below.
const UPPER: u32 = 540;
const CAPTION: u32 = 34;
/// A regret below this can't be seen on a logarithmic axis: a tenth of a percent.
const LEAST_PERCENT: f64 = 0.1;
/// Ways to choose that are drawn, each with its colour, and what it is drawn with besides.
const WAYS: [(&str, usize, Mark); 6] = [
    (OURS, 4, Mark::Disc),
    ("random forest", 1, Mark::Triangle),
    ("nearest machine", 2, Mark::Cross),
    ("direct regression", 5, Mark::Ring),
    ("single best", 6, Mark::Square),
    ("full sweep", 0, Mark::Plus),
];

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Predicted against measured times of what was left out, the regret on each held-out machine, and the regret by the number of machines,
/// with the command that made it below. With fewer than three physical machines there is no number to learn from, and that panel is
/// left away.
///
/// # Errors
/// When the picture can't be drawn.
pub(crate) fn training(held: &Held, model: &Model, command: &str) -> anyhow::Result<String> {
    let learning = &model.validation.learning;
    let size = if learning.is_empty() { (SIZE.0, UPPER + CAPTION) } else { SIZE };
    super::svg(size, |root| {
        let (panels, line) = root.split_vertically(size.1 - CAPTION);
        let (upper, lower) = panels.split_vertically(UPPER);
        let (left, right) = upper.split_horizontally(SIZE.0 / 2);
        if held.times.is_empty() {
            let text = "Nothing was left out: there is one report only.";
            left.draw(&Text::new(text, (40, 60), ("sans-serif", 17).into_font()))?;
        } else {
            times(&left, held)?;
            regrets(&right, held)?;
        }
        if !learning.is_empty() {
            course(&lower, learning)?;
        }
        let simulated = if model.is_simulated() { "Simulated machines, no evidence of accuracy. " } else { "" };
        let machines = model.validation.physical_machines;
        let plural = if machines == 1 { "" } else { "s" };
        let caption = format!("{simulated}{machines} physical machine{plural}. Made by: {command}");
        line.draw(&Text::new(caption, (20, 8), ("sans-serif", 15).into_font()))?;
        Ok(())
    })
}

/// Each time as a point, by method; the black line is where the prediction is right, the grey ones a factor of two beside it.
fn times(area: &Area<'_>, held: &Held) -> anyhow::Result<()> {
    let microseconds = |ns: f64| ns / 1e3;
    let all = || held.times.iter().flat_map(|t| [t.measured_ns, t.predicted_ns]).map(microseconds);
    let low = all().fold(f64::INFINITY, f64::min) / 1.5;
    let high = all().fold(0.0, f64::max) * 1.5;
    let mut chart = ChartBuilder::on(area)
        .caption("What was left out: predicted and measured times", ("sans-serif", 18))
        .margin(10)
        .set_label_area_size(LabelAreaPosition::Left, 80)
        .set_label_area_size(LabelAreaPosition::Bottom, 45)
        .build_cartesian_2d((low..high).log_scale(), (low..high).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("measured time of a frame (us)")
        .y_desc("predicted time of a frame (us)")
        .light_line_style(WHITE)
        .axis_desc_style(("sans-serif", 15))
        .label_style(("sans-serif", 13))
        .x_label_formatter(&|us| number(*us))
        .y_label_formatter(&|us| number(*us))
        .draw()?;
    for (factor, grey) in [(0.5, 150), (1.0, 0), (2.0, 150)] {
        let ends = [
            (low.max(low / factor), low.max(low / factor) * factor),
            (high.min(high / factor), high.min(high / factor) * factor),
        ];
        chart.draw_series(LineSeries::new(ends, RGBColor(grey, grey, grey).stroke_width(1)))?;
    }
    let mut methods: Vec<(BackendClass, &str)> = held.times.iter().map(|t| (t.class, &t.method[..])).collect();
    methods.sort_unstable();
    methods.dedup();
    for (k, &(class, method)) in methods.iter().enumerate() {
        let own = held.times.iter().filter(|t| (t.class, &t.method[..]) == (class, method));
        let shape = [Mark::Disc, Mark::Triangle, Mark::Cross, Mark::Ring, Mark::Square, Mark::Plus][k % 6];
        let at = |t: &Time| (microseconds(t.measured_ns), microseconds(t.predicted_ns));
        chart
            .draw_series(own.map(|t| mark(at(t), shape, colour(k), 3)))?
            .label(format!("{method} on the {class}"))
            .legend(move |(x, y)| mark((x + 8, y), shape, colour(k), 4));
    }
    super::legend(&mut chart, SeriesLabelPosition::UpperLeft)
}

/// The mean regret on each held-out machine, from the least to the most for each way to choose by itself: at 95 is the 95th percentile.
fn regrets(area: &Area<'_>, held: &Held) -> anyhow::Result<()> {
    let ways: Vec<(&str, usize, Mark, Vec<f64>)> = WAYS
        .into_iter()
        .filter_map(|(name, k, shape)| {
            let mut regrets = held.regrets.iter().find(|r| r.0 == name)?.1.clone();
            regrets.sort_by(f64::total_cmp);
            Some((name, k, shape, regrets.into_iter().map(seen).collect()))
        })
        .collect();
    // Room for the names above the highest curve.
    let high = ways.iter().flat_map(|w| &w.3).copied().fold(1.0, f64::max) * 12.0;
    let unit = if held.by_machine { "physical machine" } else { "profile" };
    let mut chart = ChartBuilder::on(area)
        .caption(format!("Regret on each held-out {unit}"), ("sans-serif", 18))
        .margin(10)
        .set_label_area_size(LabelAreaPosition::Left, 70)
        .set_label_area_size(LabelAreaPosition::Bottom, 45)
        .build_cartesian_2d(0.0..100.0, (LEAST_PERCENT / 1.2..high).log_scale())?;
    chart
        .configure_mesh()
        .x_desc(format!("share of the held-out {unit}s with no more regret (%)"))
        .y_desc(format!("mean regret (%, {LEAST_PERCENT} or less at the bottom)"))
        .light_line_style(WHITE)
        .axis_desc_style(("sans-serif", 15))
        .label_style(("sans-serif", 13))
        .x_label_formatter(&|share| format!("{share:.0}"))
        .y_label_formatter(&|percent| number(*percent))
        .draw()?;
    for (name, k, shape, regrets) in ways {
        let share = |at: usize| 100.0 * (at as f64 + 0.5) / regrets.len() as f64;
        let points: Vec<(f64, f64)> = regrets.iter().enumerate().map(|(at, r)| (share(at), *r)).collect();
        let step = points.len().div_ceil(20).max(1);
        chart.draw_series(LineSeries::new(points.iter().copied(), colour(k).stroke_width(2)))?;
        chart
            .draw_series(points.iter().step_by(step).map(|&at| mark(at, shape, colour(k), 4)))?
            .label(name)
            .legend(move |(x, y)| mark((x + 8, y), shape, colour(k), 4));
    }
    super::legend(&mut chart, SeriesLabelPosition::UpperLeft)
}

/// The mean regret by the number of machines in the training, with bars from the 5th to the 95th percentile over the trainings.
fn course(area: &Area<'_>, learning: &[Learning]) -> anyhow::Result<()> {
    let machines = |l: &Learning| l.machines as f64;
    let first = learning.first().map_or(1.0, machines) / 1.2;
    // Room for the names beside the last bars.
    let last = learning.last().map_or(2.0, machines) * 1.2;
    let right = last * (last / first).powf(0.22);
    let drawn: Vec<&str> = WAYS.iter().map(|w| w.0).filter(|name| *name != "full sweep").collect();
    let high = learning.iter().flat_map(|l| &l.methods).filter(|m| drawn.contains(&&m.name[..])).map(|m| seen(m.high));
    let high = high.fold(1.0, f64::max) * 1.5;
    let mut chart = ChartBuilder::on(area)
        .caption("Regret by the number of machines in the training", ("sans-serif", 18))
        .margin(10)
        .set_label_area_size(LabelAreaPosition::Left, 80)
        .set_label_area_size(LabelAreaPosition::Bottom, 45)
        .build_cartesian_2d((first..right).log_scale(), (LEAST_PERCENT / 1.2..high).log_scale())?;
    let counts: Vec<f64> = learning.iter().map(machines).collect();
    chart
        .configure_mesh()
        .x_desc("physical machines in the training (beside each other for legibility)")
        .y_desc("regret (%), bars: 90 % of trainings")
        .light_line_style(WHITE)
        .axis_desc_style(("sans-serif", 15))
        .label_style(("sans-serif", 13))
        .disable_x_mesh()
        .x_label_formatter(&|_| String::new())
        .y_label_formatter(&|percent| number(*percent))
        .draw()?;
    for &count in &counts {
        let bottom = LEAST_PERCENT / 1.2;
        let label = Text::new(format!("{count}"), (0, 6), ("sans-serif", 13).into_font());
        chart.draw_series([EmptyElement::at((count, bottom)) + label])?;
    }
    for (place, (name, k, shape)) in WAYS.into_iter().filter(|w| drawn.contains(&w.0)).enumerate() {
        let score = |l: &Learning| -> Option<(f64, LearningScore)> {
            let own = l.methods.iter().find(|m| m.name == name)?;
            Some((machines(l) * (last / first).powf(0.008 * (place as f64 - 2.0)), own.clone()))
        };
        let scores: Vec<(f64, LearningScore)> = learning.iter().filter_map(score).collect();
        let means: Vec<(f64, f64)> = scores.iter().map(|(x, s)| (*x, seen(s.mean_regret))).collect();
        chart.draw_series(
            scores.iter().map(|(x, s)| PathElement::new([(*x, seen(s.low)), (*x, seen(s.high))], colour(k).stroke_width(1))),
        )?;
        chart.draw_series(LineSeries::new(means.iter().copied(), colour(k).stroke_width(2)))?;
        chart
            .draw_series(means.iter().map(|&at| mark(at, shape, colour(k), 5)))?
            .label(name)
            .legend(move |(x, y)| mark((x + 8, y), shape, colour(k), 4));
    }
    super::legend(&mut chart, SeriesLabelPosition::UpperRight)
}

/// A regret in percent, no less than what the axis shows.
fn seen(regret: f64) -> f64 {
    (regret * 100.0).max(LEAST_PERCENT)
}

/// A number without an exponent.
fn number(value: f64) -> String {
    if value < 1.0 { format!("{value}") } else { format!("{value:.0}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sapwise::model::Validation;

    fn drawn(held: &Held, learning: Vec<Learning>) -> String {
        let mut model = Model::built_in().unwrap();
        model.validation = Validation { physical_machines: 7, learning, ..Validation::default() };
        training(held, &model, "sapwise train a.json").unwrap()
    }

    #[test]
    fn every_way_and_the_command_are_drawn() {
        let time = |method: &str, ns: f64| Time {
            file: "a.json".to_owned(),
            objects: 100,
            method: method.to_owned(),
            class: BackendClass::Cpu,
            measured_ns: ns,
            predicted_ns: 1.3 * ns,
        };
        let regrets = WAYS.iter().map(|w| (w.0, vec![0.0, 0.05, 0.4])).collect();
        let held =
            Held { times: vec![time("sweep", 2e3), time("strips", 5e6)], regrets, by_machine: true, ..Held::default() };
        let score = |name: &str| LearningScore { name: name.to_owned(), mean_regret: 0.05, low: 0.0, high: 0.3 };
        let of = |machines| Learning { machines, trainings: 8, methods: WAYS.iter().map(|w| score(w.0)).collect() };
        let svg = drawn(&held, vec![of(2), of(12)]);
        let needed =
            ["sweep on the", "strips on the", "random forest", "7 physical machines. Made by: sapwise train a.json"];
        assert!(needed.iter().all(|text| svg.contains(text)), "{svg}");
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }

    #[test]
    fn what_is_missing_is_told() {
        let svg = drawn(&Held::default(), Vec::new());
        assert!(svg.contains("there is one report only") && !svg.contains("machines in the training"), "{svg}");
    }
}
