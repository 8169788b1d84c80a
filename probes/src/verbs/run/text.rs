//! What a person reads at the end of a run.

use super::answer::{Answer, Figures, LeftOut, Oracle, Slowed};
use super::tuning::{From, Origin};
use crate::args::{Run, Scene};
use crate::simulation::{Outcome, WINDOW};
use crate::table::{count, grouped};
use crate::terminal::{Axis, Chart, Series, Terminal};
use sapwise::stats::quantile;
use std::path::Path;

/// Totals, figures, what there is to say about them, and what to do next.
pub(super) fn text(arguments: &Run, answer: &Answer<'_>, origin: &Origin, outcome: &Outcome, terminal: Terminal) -> String {
    let head = format!(
        "{}, {} of {} objects, medians of {}, verified against each other",
        answer.scenario,
        count(answer.frames, "frame"),
        extent(answer),
        count(answer.repeats, "repeat")
    );
    let mut text = format!("{}\n", terminal.head(&head));
    text += &format!("Tuning: {}. {}\n\n", origin.text(), learning(answer));
    text += &totals(answer, terminal);
    for (id, LeftOut { after_frame, frames, at_least_ms }) in &answer.left_out {
        let after = after_frame.map_or("from the first on".to_owned(), |frame| format!("after frame {frame}"));
        text += &format!(
            "{id} sat out {} {after}: it was hopeless or failed; {at_least_ms:.2} ms without them\n",
            count(*frames, "frame")
        );
    }
    text += &format!("\n{}\n", figures(answer, terminal));
    text += &chart(answer, outcome, terminal).draw(terminal).map(|chart| format!("{chart}\n")).unwrap_or_default();
    text += &comparisons(answer);
    if let Some(slowed) = &answer.co_runner {
        text += &format!("\n{}", co_runner(slowed));
    }
    if let Some(load) = answer.foreign_load {
        text += &format!("\nOther programs took {:.0} % of the CPU, median over the frames.", load * 100.0);
    }
    for warning in &answer.warnings {
        text += &format!("\n{} {warning}", terminal.warning("warning:"));
    }
    if answer.interrupted {
        text += &format!("\n{} the repeats that were complete are shown.", terminal.warning("Interrupted:"));
    }
    for (verb, path) in [("Recorded", &arguments.record), ("Traced", &arguments.trace), ("Drawn", &arguments.plot)] {
        text += &path.as_ref().map(|p| format!("\n{verb} in {}.", p.display())).unwrap_or_default();
    }
    text + &format!("\nNext: {}", next_step(arguments, origin))
}

/// What tells more than this run did.
fn next_step(arguments: &Run, origin: &Origin) -> &'static str {
    match (origin.from, &arguments.plot) {
        (_, None) => "the same with --plot run.svg, which draws the decisions",
        (From::Prediction, _) => {
            "sapwise probe --out report.json, then the same with --tuning report.json, which are measured tuning"
        }
        (_, Some(_)) => "the same without --tuning, to see what a prediction is worth",
    }
}

/// The time of a frame over the frames: the adaptive module, the oracle and the best fixed algorithm.
fn chart(answer: &Answer<'_>, outcome: &Outcome, terminal: Terminal) -> Chart {
    // A frame for each column, as there are no more dots to tell them apart; between them the most is shown, that no dear frame is lost.
    let step = outcome.frames.len().div_ceil(terminal.plot_columns().unwrap_or(1)).max(1);
    let thinned = |ns: Vec<f64>| -> Vec<(f64, f64)> {
        let most = |some: &[f64]| some.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        ns.chunks(step).enumerate().map(|(k, some)| ((k * step) as f64, most(some) / 1e3)).collect()
    };
    let series = |name: &str, ns: Vec<f64>| Series { name: name.to_owned(), points: thinned(ns) };
    let mut all = vec![
        series("adaptive", outcome.frames.iter().map(|f| f.adaptive_ns).collect()),
        series("oracle", outcome.oracle.ns.clone()),
    ];
    if let Some((best, _)) = outcome.best_fixed() {
        let name = format!("best fixed, {}", outcome.fixed[best]);
        all.push(series(&name, outcome.frames.iter().map(|f| f.fixed_ns[best]).collect()));
    }
    let thinning = if step > 1 { format!(", the most of every {step}") } else { String::new() };
    let title = format!("{}: time of a frame (us) over frames{thinning}", answer.scenario);
    Chart { title, across: Axis::Linear, series: all }
}

/// What stands below the picture: the figures, where the tuning comes from, and the command that makes it again.
pub(super) fn caption(arguments: &Run, answer: &Answer<'_>, origin: &Origin) -> [String; 3] {
    let Figures { regret, switches, explored, .. } = answer.figures;
    let name = answer.scenario;
    [
        format!(
            "{name}: regret {}, {switches} switch{}, {} explored; medians of {}, decisions of the last",
            percent(regret),
            if switches == 1 { "" } else { "es" },
            count(explored, "frame"),
            count(answer.repeats, "repeat")
        ),
        format!("Tuning: {}. {}", origin.text(), learning(answer)),
        format!("Made by: {}", command(arguments)),
    ]
}

fn extent(answer: &Answer<'_>) -> String {
    let [min, max] = [answer.objects.min, answer.objects.max].map(|n| grouped(n as u64));
    if min == max { max } else { format!("{min} to {max}") }
}

fn learning(answer: &Answer<'_>) -> &'static str {
    match (answer.learning, answer.exploring) {
        (true, true) => "Learning and exploring.",
        (true, false) => "Learning, without exploring.",
        (false, _) => "Without learning.",
    }
}

fn totals(answer: &Answer<'_>, terminal: Terminal) -> String {
    let oracle = answer.total_ms.oracle;
    let row = |name: &str, ms: f64| vec![name.to_owned(), format!("{ms:.2}"), format!("{:.3}", ms / oracle)];
    let mut fixed: Vec<(&String, f64)> = answer.total_ms.fixed.iter().map(|(id, ms)| (id, *ms)).collect();
    fixed.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut rows = vec![["run by", "total ms", "over the oracle"].map(str::to_owned).to_vec()];
    rows.push(row("oracle (best at every frame)", oracle));
    rows.push(row("adaptive", answer.total_ms.adaptive));
    rows.extend(fixed.iter().map(|(id, ms)| row(id, *ms)));
    terminal.table(&rows)
}

/// The figures of all frames and of each part.
fn figures(answer: &Answer<'_>, terminal: Terminal) -> String {
    let head = ["frames", "regret", "middle half of repeats", "of windows", "switches", "explored", "worst frame"];
    let row = |frames: String, f: &Figures| {
        let within = f.regret_quartiles.map_or("-".to_owned(), |[a, b]| format!("{} to {}", percent(a), percent(b)));
        let worst = f.worst_frame.zip(f.worst_frame_at);
        let worst = worst.map_or("-".to_owned(), |(ratio, at)| format!("{ratio:.2} times the oracle's, frame {at}"));
        vec![
            frames,
            percent(f.regret),
            within,
            percent(f.window_regret),
            f.switches.to_string(),
            f.explored.to_string(),
            worst,
        ]
    };
    let mut rows = vec![head.map(str::to_owned).to_vec(), row("all".to_owned(), &answer.figures)];
    rows.extend(answer.parts.iter().map(|p| row(format!("{} to {}", p.from_frame, p.to_frame), &p.figures)));
    terminal.table(&rows)
}

fn comparisons(answer: &Answer<'_>) -> String {
    let mut lines = Vec::new();
    if !answer.best_fixed.is_empty() {
        lines.push(format!("{} of the time of the best fixed, {}.", times(answer.over_best_fixed), answer.best_fixed));
    }
    if let Some(largest) = &answer.best_at_largest {
        let objects = grouped(largest.objects as u64);
        let over = match largest.over {
            Some(over) => format!("{} of the time of", times(over)),
            None => "No total to compare with of".to_owned(),
        };
        lines.push(format!("{over} {}, the best where there are most objects ({objects}).", largest.algorithm));
    }
    lines.push(format!(
        "Of windows: against the best algorithm of every {WINDOW} frames together. One that keeps work makes it anew now and then; the oracle of \
         every frame takes\nits cheap frames and leaves that one to another, which nobody can."
    ));
    lines.push(match answer.oracle {
        Oracle::Halves => format!(
            "The oracle's algorithms are chosen by one half of the repeats and timed in the other. Against the least time of every \
             frame,\nwhich luck has a part in, the regret is {}.",
            percent(answer.figures.optimistic_regret)
        ),
        Oracle::Optimistic => {
            "One repeat: the oracle has the least time of every frame, in which luck has a part; two or more --repeats leave it out."
                .to_owned()
        }
    });
    lines.join("\n")
}

fn co_runner(slowed: &Slowed) -> String {
    let reached = match slowed.slowdown {
        Some(ratio) => format!("a loop beside the frames then took {ratio:.2} times as long"),
        None => "no frame ran before, to compare with".to_owned(),
    };
    let own: Vec<f64> = slowed.slowdown_of.values().copied().flatten().collect();
    let range = [0.5, 0.0, 1.0].map(|q| quantile(&own, q));
    let of_fixed = match range {
        [Some(median), Some(least), Some(most)] => {
            format!(",\nthe fixed algorithms {median:.2} times ({least:.2} to {most:.2}) on frames with as many objects")
        }
        _ => String::new(),
    };
    let threads = count(slowed.threads as usize, "thread");
    format!("From frame {} on {threads} ran beside it: {reached}{of_fixed}.", slowed.from_frame)
}

fn times(ratio: f64) -> String {
    format!("Adaptive takes {ratio:.3}")
}

fn percent(share: f64) -> String {
    format!("{:.2} %", share * 100.0)
}

/// The command that makes the picture again, without folders, which are of this machine alone.
fn command(arguments: &Run) -> String {
    let name = |path: &Path| path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let mut words = vec!["sapwise run".to_owned()];
    words.push(match &arguments.scene {
        Scene::Scenario(scenario) => scenario.to_string(),
        Scene::Stream(path) => name(path),
    });
    match &arguments.tuning {
        Some(path) => words.push(format!("--tuning {}", name(path))),
        None => words.push(format!("--samples {}", arguments.samples)),
    }
    words.extend(arguments.objects.map(|n| format!("--objects {n}")));
    words.extend(arguments.swing.map(|least| format!("--swing {least}")));
    words.extend(arguments.frames.map(|n| format!("--frames {n}")));
    words.push(format!("--repeats {} --seed {}", arguments.repeats, arguments.seed));
    words.extend(arguments.co_runner.map(|c| format!("--co-runner {c}")));
    for (flag, given) in [("--no-learning", arguments.no_learning), ("--no-exploring", arguments.no_exploring)] {
        words.extend(given.then(|| flag.to_owned()));
    }
    for (flag, given) in [("--no-gpus", arguments.gpus.no_gpus), ("--software-gpus", arguments.gpus.software_gpus)] {
        words.extend(given.then(|| flag.to_owned()));
    }
    words.extend(arguments.gpus.only.iter().map(|gpu| format!("--gpu {gpu}")));
    words.extend(arguments.plot.as_deref().map(|path| format!("--plot {}", name(path))));
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::{Arguments, Verb};
    use clap::Parser;

    #[test]
    fn the_command_below_a_picture_makes_it_again() {
        let said = |words: &str| match Arguments::parse_from(words.split(' ')).verb {
            Verb::Run(run) => command(&run),
            _ => panic!("another verb"),
        };
        for words in [
            "sapwise run slab --samples 8 --repeats 6 --seed 1",
            "sapwise run uniform --tuning t.json --objects 9 --swing 3 --frames 7 --repeats 2 --seed 4 --no-gpus",
            "sapwise run s.npy --samples 0 --repeats 1 --seed 1 --co-runner 3:2 --no-learning --no-exploring --plot p.png",
            "sapwise run mixed --samples 8 --repeats 6 --seed 1 --gpu 0 --gpu 2 --plot p.svg",
        ] {
            assert_eq!(said(words), words);
        }
        let named = said("sapwise run /a/s.npy --tuning /b/t.json --plot c/p.svg");
        assert_eq!(named, "sapwise run s.npy --tuning t.json --repeats 6 --seed 1 --plot p.svg");
    }
}
