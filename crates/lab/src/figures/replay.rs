//! Figure 8 of Avril, Gouranton and Arnaldi (ISVRI 2011): what the algorithms cost frame by frame, and which of them ran.

use super::Figure;
use super::axis::{Axis, Tick, time_unit};
use super::canvas::Area;
use super::chart::{ABOVE, BELOW, Chart, Frame, RIGHT, Stroke, fill, missing};
use super::legend::{Legend, Sign};
use super::mark::Mark;
use super::style::{self, GAP, GRID, INK, SECONDARY};
use crate::text::count;
use plotters::style::RGBColor;
use sapwise::{AlgorithmId, BackendClass};

/// Width, and heights of the charts of times and of objects, and of a row of the chart of what ran.
const WIDTH: i32 = 1500;
const TIMES: i32 = 480;
const ROW: i32 = 26;
const OBJECTS: i32 = 200;
/// Room on the left of the charts, for the names of algorithms.
const NAMES: i32 = 170;
/// Points of a curve at most: more can't be seen, and make an SVG of megabytes.
const POINTS: usize = 1200;
/// Marks on a curve.
const MARKS: usize = 12;
/// Algorithms that a panel shows at most: as many as there are colours that stay apart.
const MOST_SHOWN: usize = 10;

/// Frames, each with a value.
type Points = Vec<(usize, f64)>;

/// A replay as a picture. All lists hold a value a frame.
///
/// A panel for the GPUs and one for the CPU, where algorithms ran on both: above the times, those of the adaptive module in black; then which
/// algorithm ran, each in a row of its own; then the number of objects. A panel shows the algorithms that ran, those with most frames first, and
/// the best fixed algorithm on each number of GPUs or cores.
#[derive(Debug, Clone, PartialEq)]
pub struct ReplayPicture {
    /// The scenario or file that the frames come from.
    pub name: String,
    /// The fixed algorithms.
    pub algorithms: Vec<AlgorithmId>,
    /// The time of each of them at every frame, in nanoseconds; infinite where it was not timed.
    pub fixed_ns: Vec<Vec<f64>>,
    /// The time of the adaptive module, in nanoseconds.
    pub adaptive_ns: Vec<f64>,
    /// Number of objects.
    pub objects: Vec<usize>,
    /// What the adaptive module ran, as a position among the algorithms.
    pub ran: Vec<Option<usize>>,
    /// Whether it ran that to learn what it costs.
    pub explored: Vec<bool>,
    /// The frames from which on it ran another algorithm.
    pub switches: Vec<usize>,
    /// The frame from which on another program took a part of the CPU.
    pub co_runner_from: Option<usize>,
}

/// The adaptive module, the beginning of a co-runner, and the number of objects.
const ADAPTIVE: Stroke = Stroke::solid(INK, 2);
const CO_RUNNER: Stroke = Stroke::dashed(SECONDARY, 1);
const COUNT: Stroke = Stroke::solid(SECONDARY, 2);

/// One panel: a class of processors and the algorithms on it that are shown.
struct Panel {
    class: BackendClass,
    /// Positions among the algorithms.
    shown: Vec<usize>,
    /// Whether anything else ran: an algorithm of the other class, or one that is not shown.
    others: bool,
}

impl Panel {
    fn new(class: BackendClass, replay: &ReplayPicture) -> Self {
        let mut shown = replay.ran_on(class);
        for k in replay.best_on_each_width(class) {
            if !shown.contains(&k) {
                shown.push(k);
            }
        }
        shown.truncate(MOST_SHOWN);
        let others = replay.ran.iter().flatten().any(|k| !shown.contains(k));
        Self { class, shown, others }
    }

    /// The row of an algorithm among those of the panel, from the lowest up; the lowest is that of the others, where there are any.
    fn row(&self, k: usize) -> usize {
        self.shown.iter().position(|&own| own == k).map_or(0, |at| at + usize::from(self.others))
    }

    /// What the rows are called from the lowest up.
    fn rows(&self, replay: &ReplayPicture) -> Vec<String> {
        let other = self.others.then(|| "another".to_owned());
        let own = self.shown.iter().map(|&k| replay.algorithms[k].to_string());
        other.into_iter().chain(own).chain(["explored", "switches"].map(str::to_owned)).collect()
    }

    fn title(&self) -> &'static str {
        match self.class {
            BackendClass::Cpu => "CPU",
            BackendClass::Gpu => "GPUs",
        }
    }
}

/// What is said of a class of processors on which nothing ran.
fn absent(class: BackendClass) -> &'static str {
    match class {
        BackendClass::Gpu => "no GPU algorithm ran here",
        BackendClass::Cpu => "no algorithm ran on the CPU",
    }
}

/// Means over equal numbers of frames, few enough to be seen, each at its first frame. Infinite times are left out.
fn curve(values: &[f64]) -> Points {
    let step = values.len().div_ceil(POINTS).max(1);
    let mean = |(k, chunk): (usize, &[f64])| {
        let ran: Vec<f64> = chunk.iter().copied().filter(|v| v.is_finite()).collect();
        (!ran.is_empty()).then(|| (k * step, ran.iter().sum::<f64>() / ran.len() as f64))
    };
    values.chunks(step).enumerate().filter_map(mean).collect()
}

impl ReplayPicture {
    /// In how many frames each algorithm ran.
    fn frames_run(&self) -> Vec<usize> {
        let mut counts = vec![0; self.algorithms.len()];
        self.ran.iter().flatten().for_each(|&k| counts[k] += 1);
        counts
    }

    fn is_on(&self, k: usize, class: BackendClass) -> bool {
        self.algorithms[k].backend().class() == class
    }

    /// The algorithms of a class that ran, those with most frames first.
    fn ran_on(&self, class: BackendClass) -> Vec<usize> {
        let counts = self.frames_run();
        let mut ran: Vec<usize> = (0..counts.len()).filter(|&k| counts[k] > 0 && self.is_on(k, class)).collect();
        ran.sort_by_key(|&k| std::cmp::Reverse(counts[k]));
        ran
    }

    /// The algorithm with the smallest total on each number of cores or GPUs. One that was not timed at every frame has no total.
    fn best_on_each_width(&self, class: BackendClass) -> Vec<usize> {
        let width = |k: usize| self.algorithms[k].backend().width();
        let mut widths: Vec<u32> = (0..self.algorithms.len()).filter(|&k| self.is_on(k, class)).map(width).collect();
        widths.sort_unstable();
        widths.dedup();
        let total = |k: usize| self.fixed_ns[k].iter().sum::<f64>();
        let best = |of: u32| {
            let own =
                (0..self.algorithms.len()).filter(|&k| self.is_on(k, class) && width(k) == of && total(k).is_finite());
            own.min_by(|&a, &b| total(a).total_cmp(&total(b)))
        };
        widths.into_iter().filter_map(best).collect()
    }

    /// The classes on which algorithms ran; one that is alone has the whole width.
    fn panels(&self) -> Vec<Panel> {
        let all = [BackendClass::Gpu, BackendClass::Cpu].map(|class| Panel::new(class, self));
        let alone = all.iter().filter(|p| !p.shown.is_empty()).count() == 1;
        all.into_iter().filter(|p| !alone || !p.shown.is_empty()).collect()
    }

    /// The algorithms that no panel shows: they ran in few frames or in none, and others on as many threads or GPUs are faster.
    #[must_use]
    pub fn not_drawn(&self) -> Vec<&AlgorithmId> {
        let panels = self.panels();
        let is_shown = |k: &usize| panels.iter().any(|panel| panel.shown.contains(k));
        (0..self.algorithms.len()).filter(|k| !is_shown(k)).map(|k| &self.algorithms[k]).collect()
    }

    fn legend(&self, panel: &Panel, width: i32) -> Legend {
        let counts = self.frames_run();
        let entry = |(at, &k): (usize, &usize)| {
            let ran =
                if counts[k] == 0 { "never ran".to_owned() } else { format!("ran in {}", count(counts[k], "frame")) };
            (Sign::Marked(at), format!("{}: {ran}", self.algorithms[k]))
        };
        let mut entries: Vec<(Sign, String)> = panel.shown.iter().enumerate().map(entry).collect();
        entries.push((Sign::Stroke(ADAPTIVE), "adaptive".to_owned()));
        if self.co_runner_from.is_some() {
            entries.push((Sign::Stroke(CO_RUNNER), "a co-runner begins".to_owned()));
        }
        Legend::new(entries, width - 2 * GAP)
    }

    /// Height of the chart of what ran.
    fn rows_height(&self, panels: &[Panel]) -> i32 {
        let rows = panels.iter().map(|p| p.rows(self).len()).max().unwrap_or(0);
        rows as i32 * ROW + 2 * GAP
    }

    fn panel(&self, area: &Area<'_>, frame: Frame, panel: &Panel, rows: i32) -> anyhow::Result<()> {
        let Frame { left, top, right, .. } = frame.within(NAMES, ABOVE, RIGHT, 0);
        let height = TIMES + rows + OBJECTS;
        if panel.shown.is_empty() {
            return missing(area, Frame { left, top, right, bottom: top + height - BELOW }, absent(panel.class));
        }
        let strip = |top: i32, height: i32, below: i32| Frame { left, top, right, bottom: top + height - below };
        self.times(area, strip(top, TIMES, 26), panel)?;
        self.choices(area, strip(top + TIMES, rows, GAP), panel)?;
        self.objects(area, strip(top + TIMES + rows, OBJECTS, BELOW))?;
        self.legend(panel, right - frame.left).draw(area, (frame.left + GAP, top + height))
    }

    /// The frames from the first to the last.
    fn frames(&self) -> Axis {
        Axis::linear(0.0, self.objects.len().max(1) as f64)
    }

    fn times(&self, area: &Area<'_>, frame: Frame, panel: &Panel) -> anyhow::Result<()> {
        let adaptive = curve(&self.adaptive_ns);
        let curves: Vec<Points> = panel.shown.iter().map(|&k| curve(&self.fixed_ns[k])).collect();
        let all = || curves.iter().flatten().chain(&adaptive).map(|point| point.1);
        let (name, unit) = time_unit(all());
        let chart = Chart::new(area, frame, self.frames(), Axis::log(all().map(|ns| ns / unit), 1.5));
        let mut title = format!("{} ({})", panel.title(), self.name);
        if self.algorithms.iter().all(|id| id.backend().class() == panel.class) {
            let other = if panel.class == BackendClass::Cpu { BackendClass::Gpu } else { BackendClass::Cpu };
            title += &format!("; {}", absent(other));
        }
        chart.grid(&title, "", &format!("time of a frame ({name})"))?;
        let drawn = |points: &Points| points.iter().map(|&(at, ns)| (at as f64, ns / unit)).collect::<Vec<_>>();
        for (at, own) in curves.iter().enumerate() {
            chart.line(drawn(own), Stroke::solid(style::colour(at), 2))?;
            // Each begins elsewhere, so that marks of curves at one height are beside each other.
            let every = own.len().div_ceil(MARKS).max(1);
            for (x, y) in drawn(own).into_iter().skip(at * every / curves.len()).step_by(every) {
                chart.mark(x, y, style::mark(at), style::colour(at), 4)?;
            }
        }
        chart.line(drawn(&adaptive), ADAPTIVE)?;
        match self.co_runner_from {
            Some(from) => chart.upright(from as f64, CO_RUNNER),
            None => Ok(()),
        }
    }

    /// What ran in each frame: a row for each algorithm, the black line through those that ran.
    fn choices(&self, area: &Area<'_>, frame: Frame, panel: &Panel) -> anyhow::Result<()> {
        let names = panel.rows(self);
        let middle = |row: usize| row as f64 + 0.5;
        let rows = Axis::linear(0.0, names.len() as f64);
        let top = names.len();
        let names = names.into_iter().enumerate().map(|(row, label)| Tick { value: middle(row), label }).collect();
        let frames = self.ran.len();
        let across = Axis::linear(0.0, frames.max(1) as f64).with_names(Vec::new());
        let chart = Chart::new(area, frame, across, rows.with_names(names));
        chart.grid("", "", "")?;
        // Frames in a row that are alike are one rectangle and one line.
        let mut line: Vec<(f64, f64)> = Vec::new();
        let mut first = 0;
        for at in 1..=frames {
            if at < frames && self.ran[at] == self.ran[first] {
                continue;
            }
            if let Some(k) = self.ran[first] {
                let shown = panel.shown.iter().position(|&own| own == k);
                let shade: RGBColor = shown.map_or(GRID, style::colour);
                let row = panel.row(k);
                if let Some(frame) = chart.rectangle((first as f64, at as f64), (row as f64, row as f64 + 1.0)) {
                    fill(area, frame, shade, 0.75)?;
                }
                line.extend([first, at].map(|end| (end as f64, middle(row))));
            }
            first = at;
        }
        chart.line(line, ADAPTIVE)?;
        for &at in &self.switches {
            chart.line([top - 1, top].map(|y| (at as f64, y as f64)), Stroke::solid(INK, 1))?;
        }
        for (at, _) in self.explored.iter().enumerate().filter(|(_, explored)| **explored) {
            chart.mark(at as f64, middle(top - 2), Mark::Ring, INK, 5)?;
        }
        Ok(())
    }

    fn objects(&self, area: &Area<'_>, frame: Frame) -> anyhow::Result<()> {
        let counts: Vec<f64> = self.objects.iter().map(|&n| n.max(1) as f64).collect();
        let line = curve(&counts);
        let chart = Chart::new(area, frame, self.frames(), Axis::log(line.iter().map(|p| p.1), 1.2));
        chart.grid("", "frame", "objects")?;
        chart.line(line.into_iter().map(|(at, n)| (at as f64, n)), COUNT)
    }
}

impl Figure for ReplayPicture {
    fn title(&self) -> &str {
        ""
    }

    fn size(&self) -> (u32, u32) {
        let panels = self.panels();
        let legends = panels.iter().map(|panel| self.legend(panel, WIDTH / panels.len() as i32).height());
        let height = ABOVE + TIMES + self.rows_height(&panels) + OBJECTS + legends.max().unwrap_or(0);
        (WIDTH as u32, height as u32)
    }

    fn draw_on(&self, area: &Area<'_>) -> anyhow::Result<()> {
        let whole = Frame { left: 0, top: 0, right: WIDTH, bottom: self.size().1 as i32 };
        let panels = self.panels();
        let rows = self.rows_height(&panels);
        for (panel, frame) in panels.iter().zip(whole.parts(panels.len(), panels.len(), 0)) {
            self.panel(area, frame, panel, rows)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
