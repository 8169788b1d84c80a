//! How well a model did on machines that were left out: three figures, alone or together.

use super::chart::Frame;
use super::legended::Legended;
use super::paper::Area;
use super::style::GAP;
use super::{Figure, LearningCurve, LearningPoint, LearningWay, Regrets, TimePair, Times, TimesOf, Way};
use crate::train::{Held, OURS, Time};
use sapwise::BackendClass;
use sapwise::model::Learning;

/// Width of the three together, height of the two above and of the one below.
const WIDTH: i32 = 1400;
const UPPER: i32 = 640;
const LOWER: i32 = 480;
/// Ways to choose that are drawn; their positions give colours and marks.
const WAYS: [&str; 6] = [OURS, "random forest", "nearest machine", "direct regression", "single best", "full sweep"];

/// Predicted against measured times of what was left out, the regret on each held-out machine, and the regret by the number of machines.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Training {
    pub(crate) times: Times,
    pub(crate) regrets: Regrets,
    /// With fewer than three physical machines there is no number to learn from.
    pub(crate) learning: Option<LearningCurve>,
}

impl Training {
    pub(crate) fn new(held: &Held, learning: &[Learning]) -> Self {
        let learning = (!learning.is_empty()).then(|| learning_curve(learning));
        Self { times: times(held), regrets: regrets(held), learning }
    }
}

fn times(held: &Held) -> Times {
    let mut methods: Vec<(BackendClass, &str)> = held.times.iter().map(|t| (t.class, &t.method[..])).collect();
    methods.sort_unstable();
    methods.dedup();
    let of = |(style, (class, method)): (usize, (BackendClass, &str))| {
        let own = held.times.iter().filter(|t| (t.class, &t.method[..]) == (class, method));
        let pair = |t: &Time| TimePair { measured_ns: t.measured_ns, predicted_ns: t.predicted_ns };
        TimesOf { name: format!("{method} on the {class}"), style, pairs: own.map(pair).collect() }
    };
    let title = "What was left out: predicted and measured times".to_owned();
    Times { title, methods: methods.into_iter().enumerate().map(of).collect() }
}

fn regrets(held: &Held) -> Regrets {
    let of = |(style, name): (usize, &str)| {
        let regrets = held.regrets.iter().find(|r| r.0 == name)?.1.clone();
        Some(Way { name: name.to_owned(), style, regrets })
    };
    let unit = if held.by_machine { "physical machine" } else { "profile" };
    let title = format!("Regret on each held-out {unit}");
    Regrets { title, unit: unit.to_owned(), ways: WAYS.into_iter().enumerate().filter_map(of).collect() }
}

/// The full sweep learns nothing from other machines.
fn learning_curve(learning: &[Learning]) -> LearningCurve {
    let of = |(style, name): (usize, &str)| {
        let point = |l: &Learning| {
            let own = l.methods.iter().find(|m| m.name == name)?;
            let machines = l.machines as f64;
            Some(LearningPoint { machines, mean_regret: own.mean_regret, low: own.low, high: own.high })
        };
        LearningWay { name: name.to_owned(), style, points: learning.iter().filter_map(point).collect() }
    };
    let ways = WAYS.into_iter().enumerate().filter(|w| w.1 != "full sweep").map(of);
    let title = "Regret by the number of machines in the training".to_owned();
    LearningCurve { title, ways: ways.filter(|w| !w.points.is_empty()).collect() }
}

impl Figure for Training {
    fn title(&self) -> &str {
        ""
    }

    fn size(&self) -> (u32, u32) {
        (WIDTH as u32, (UPPER + self.learning.as_ref().map_or(0, |_| LOWER)) as u32)
    }

    fn draw_on(&self, area: &Area<'_>) -> anyhow::Result<()> {
        let upper = Frame { left: 0, top: 0, right: WIDTH, bottom: UPPER };
        let halves = upper.parts(2, 2, 0);
        self.times.draw_in(area, halves[0])?;
        self.regrets.draw_in(area, halves[1])?;
        match &self.learning {
            Some(learning) => learning.draw_in(area, Frame { top: UPPER + GAP, bottom: UPPER + LOWER, ..upper }),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::Picture;
    use sapwise::model::LearningScore;

    fn drawn(held: &Held, learning: Vec<Learning>) -> String {
        let caption = ["Made by: sapwise train a.json".to_owned()];
        String::from_utf8(Training::new(held, &learning).draw(Picture::Svg, &caption).unwrap()).unwrap()
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
        let regrets = WAYS.iter().map(|w| (*w, vec![0.0, 0.05, 0.4])).collect();
        let held =
            Held { times: vec![time("sap", 2e3), time("grid-sap", 5e6)], regrets, by_machine: true, ..Held::default() };
        let score = |name: &str| LearningScore { name: name.to_owned(), mean_regret: 0.05, low: 0.0, high: 0.3 };
        let of = |machines| Learning { machines, trainings: 8, methods: WAYS.iter().map(|w| score(w)).collect() };
        let svg = drawn(&held, vec![of(2), of(12)]);
        let needed = ["sap on the", "grid-sap on the", "random forest", "Made by: sapwise train a.json"];
        assert!(needed.iter().all(|text| svg.contains(text)), "{svg}");
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }

    #[test]
    fn what_is_missing_is_told() {
        let svg = drawn(&Held::default(), Vec::new());
        assert!(svg.contains("there is one report only") && !svg.contains("machines in the training"), "{svg}");
    }
}
