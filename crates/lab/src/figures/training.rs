//! How well a model did on what was held out: two figures, alone or together.

use super::canvas::Area;
use super::chart::Frame;
use super::legended::Legended;
use super::{Agreement, AgreementGroup, AgreementPoint, Figure, Regrets, StrategyRegrets, Values};
use crate::evaluate::{HeldOut, OURS, Time};
use sapwise::BackendClass;

/// Width of both together, and their height.
const WIDTH: i32 = 1400;
const HEIGHT: i32 = 640;
/// Strategies that are drawn; their positions decide colours and marks.
const STRATEGIES: [&str; 6] =
    [OURS, "random forest", "nearest machine", "direct regression", "single best", "full sweep"];

/// Predicted over measured times of what was held out, and the regret on each held-out machine.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TrainingPicture {
    /// Predicted and measured times of a frame.
    pub(crate) times: Agreement,
    /// The regrets of some strategies.
    pub(crate) regrets: Regrets,
}

impl TrainingPicture {
    /// The picture of a validation.
    #[must_use]
    pub fn new(held_out: &HeldOut) -> Self {
        Self { times: times(held_out), regrets: regrets(held_out) }
    }
}

fn times(held_out: &HeldOut) -> Agreement {
    let mut methods: Vec<(BackendClass, &str)> =
        held_out.times.iter().map(|t| (t.algorithm.backend().class(), t.algorithm.method())).collect();
    methods.sort_unstable();
    methods.dedup();
    let of = |(style, (class, method)): (usize, (BackendClass, &str))| {
        let is_own = |t: &&Time| (t.algorithm.backend().class(), t.algorithm.method()) == (class, method);
        let point = |t: &Time| AgreementPoint { measured: t.measured_ns, predicted: t.predicted_ns, interval: None };
        let points = held_out.times.iter().filter(is_own).map(point).collect();
        AgreementGroup { name: format!("{method} on the {class}"), style, points }
    };
    Agreement {
        title: "Predicted and measured times of what was held out".to_owned(),
        values: Values::TimesNs,
        groups: methods.into_iter().enumerate().map(of).collect(),
    }
}

fn regrets(held_out: &HeldOut) -> Regrets {
    let of = |(style, name): (usize, &str)| {
        let regrets = held_out.regrets.iter().find(|r| r.0 == name)?.1.clone();
        Some(StrategyRegrets { name: name.to_owned(), style, regrets })
    };
    let unit = if held_out.by_machine { "physical machine" } else { "profile" };
    let title = format!("Regret on each held-out {unit}");
    Regrets { title, unit: unit.to_owned(), strategies: STRATEGIES.into_iter().enumerate().filter_map(of).collect() }
}

impl Figure for TrainingPicture {
    fn title(&self) -> &str {
        ""
    }

    fn size(&self) -> (u32, u32) {
        (WIDTH as u32, HEIGHT as u32)
    }

    fn draw_on(&self, area: &Area<'_>) -> anyhow::Result<()> {
        let halves = Frame { left: 0, top: 0, right: WIDTH, bottom: HEIGHT }.parts(2, 2, 0);
        self.times.draw_in(area, halves[0])?;
        self.regrets.draw_in(area, halves[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figures::Picture;

    fn drawn(held_out: &HeldOut) -> String {
        let caption = ["Made by: sapwise train a.json".to_owned()];
        String::from_utf8(TrainingPicture::new(held_out).draw(Picture::Svg, &caption).unwrap()).unwrap()
    }

    #[test]
    fn every_strategy_and_the_command_are_drawn() {
        let time = |algorithm: &str, ns: f64| Time {
            file: "a.json".to_owned(),
            scenario: "uniform".to_owned(),
            objects: 100,
            algorithm: algorithm.parse().unwrap(),
            measured_ns: ns,
            predicted_ns: 1.3 * ns,
        };
        let regrets = STRATEGIES.iter().map(|s| (*s, vec![0.0, 0.05, 0.4])).collect();
        let times = vec![time("sap@cpu1", 2e3), time("grid-sap@cpu2", 5e6)];
        let held_out = HeldOut { times, regrets, by_machine: true, ..HeldOut::default() };
        let svg = drawn(&held_out);
        let needed = ["sap on the", "grid-sap on the", "random forest", "Made by: sapwise train a.json"];
        assert!(needed.iter().all(|text| svg.contains(text)), "{svg}");
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
        assert!(drawn(&HeldOut::default()).contains("there is one report only"));
    }
}
