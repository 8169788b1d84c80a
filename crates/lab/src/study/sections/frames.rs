//! Frames: time over objects, and the fastest algorithm over objects and density.

use super::builder::SectionBuilder;
use crate::Report;
use crate::page::Section;
use crate::spread;
use crate::study::curves::{self, Compared};
use crate::study::entry::Entry;
use crate::study::folder::Folder;
use crate::study::map;
use crate::study::material::Study;
use anyhow::Result;

pub(super) fn curves(study: &Study, folder: &mut Folder, missing: &mut Vec<String>) -> Result<Section> {
    let mut section = SectionBuilder::new("curves", "Time over objects", missing);
    section.text(
        "Figures 4, 6 and 7 of the paper, all of it measured. The curve of each side is its fastest algorithm at each size: medians with \
         quartiles as bars. The shades are the fields of optimal performance, by curves fitted to the same timings; the vertical lines are \
         the crossovers between them, hatched over their 90 % intervals.",
    );
    for (compared, drawn) in &study.drawn {
        if drawn.is_empty() {
            section.lacks(format!("{}: no report has timings of both sides", compared.title()));
            continue;
        }
        let reports: Vec<(usize, &Entry, &Report)> = drawn.iter().map(|(k, r)| (*k, &study.entries[*k], r)).collect();
        let of: Vec<usize> = drawn.iter().map(|d| d.0).collect();
        let told = format!(
            "{}: measured time of a frame over the number of objects, of up to four machines.",
            compared.title()
        );
        let figure = compared.figure(&reports);
        let id = compared.id();
        let [times, fields, crossovers] = curves::tables(&figure, &reports);
        let [of_fields, of_crossovers] = ["fields", "crossovers"].map(|what| format!("{id}-{what}"));
        let tables = [(id, &times), (of_fields.as_str(), &fields), (of_crossovers.as_str(), &crossovers)];
        section.push(folder.figure(id, &figure, &told, &of, &tables))?;
    }
    Ok(section.section)
}

pub(super) fn fields(study: &Study, folder: &mut Folder, missing: &mut Vec<String>) -> Result<Section> {
    let mut section = SectionBuilder::new("fields", "The fastest algorithm over objects and density", missing);
    section.text(
        "The map that the paper could not draw: the number of objects alone does not decide. Cells are boxes spread evenly that move as in \
         the scenario uniform: on the left by curves fitted to the machine's own timings, on the right predicted from its parameters by a \
         model that was trained without what the caption names. Points are what was timed, in all scenarios, so that a point may differ from \
         its cell.",
    );
    let threads = study.drawn.iter().find(|(compared, _)| *compared == Compared::Threads);
    let first = threads.and_then(|(_, drawn)| drawn.first()).map(|d| d.0).or_else(|| study.studied().first().copied());
    let Some(k) = first else {
        section.lacks("no report has timings that can be studied");
        return Ok(section.section);
    };
    match map::map(&study.entries[k], &study.profiles) {
        Err(why) => section.lacks(format!("{why:#}")),
        Ok(map) => {
            let known = |regret| format!("is {}", spread::percent(regret, map.range, 1));
            let regret = map.regret.map_or("is not known".to_owned(), known);
            let told = format!(
                "Held out of the training: the {} of this report. The mean regret (least to largest) of the predicted choices {regret}, at {} of {} points: \
                 at the others what was chosen was no longer timed. In {:.0} % of the cells both choose the same.",
                map.held_out,
                map.known,
                map.points,
                100.0 * map.agreeing
            );
            let [points, cells] = map.tables(k);
            let tables = [("field-map", &points), ("field-map-cells", &cells)];
            section.push(folder.figure("field-map", &map.figure, &told, &[k], &tables))?;
        }
    }
    Ok(section.section)
}
