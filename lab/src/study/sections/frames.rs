//! Frames: time over objects, fields over objects and density, and how well both are predicted.

use super::Part;
use crate::page::Section;
use crate::figures::Training;
use crate::study::entry::Entry;
use crate::study::folder::Folder;
use crate::study::{Compared, Study, accuracy, map};
use anyhow::Result;

/// What the columns and rows of the scores mean.
const SCORES: &str = "Ways to choose an algorithm for a machine that was left out. Regret is the time of what is chosen over that of the best, less \
one; gap closed is 0 for the one algorithm that is best on average and 1 for the best at each point; in games, sizes count as often as games are \
assumed to have them (log-normal around 800); borders are off by the median of octaves between measured and predicted ones. Physics + ridge is \
what predict does, and ours + 8 samples corrects it by as many timings of the machine itself; frozen constants switch at a number that was \
written down; default and nearest machine take another machine's curves; full sweep has the machine's own.";

pub(super) fn curves(study: &Study, folder: &mut Folder, missing: &mut Vec<String>) -> Result<Section> {
    let mut part = Part::new("curves", "Time over objects", missing);
    part.text(
        "Figures 4, 6 and 7 of the paper. Each side is its fastest algorithm at each size, medians with quartiles; the shades are the fields \
         of optimal performance by curves fitted to the same timings, the lines where one side overtakes another, with 90 % intervals.",
    );
    for (compared, drawn) in &study.drawn {
        let reports: Vec<(&Entry, &sapwise::Report)> = drawn.iter().map(|(k, r)| (&study.entries[*k], r)).collect();
        let of: Vec<usize> = drawn.iter().map(|d| d.0).collect();
        if of.is_empty() {
            part.lacks(format!("{}: no report has timings of both sides", compared.title()));
            continue;
        }
        let told = format!("{}, by the number of objects, of up to four machines.", compared.title());
        part.push(folder.figure(compared.id(), &compared.figure(&reports), &told, &of))?;
    }
    Ok(part.section)
}

pub(super) fn fields(study: &Study, folder: &mut Folder, missing: &mut Vec<String>) -> Result<Section> {
    let mut part = Part::new("fields", "Tuning over objects and density", missing);
    part.text(
        "The map that the paper could not draw: the number of objects alone does not decide. Cells are boxes spread evenly that move as in \
         the scenario uniform, by curves fitted to the machine's own timings on the left, and on the right predicted from its parameters by a \
         model that was trained without what the caption says. Points are what was timed, scenarios that clump or rest among them, so that a point may differ from its cell.",
    );
    let threads = study.drawn.iter().find(|(compared, _)| *compared == Compared::Threads);
    let first = threads.and_then(|(_, drawn)| drawn.first()).map(|d| d.0).or_else(|| study.studied().first().copied());
    let drawn = first.map(|k| (k, map::map(&study.entries[k], &study.profiles)));
    match drawn {
        None => part.lacks("no report has timings that can be studied"),
        Some((_, Err(why))) => part.lacks(format!("{why:#}")),
        Some((k, Ok(map))) => {
            let regret = map.regret.map_or("is not known".to_owned(), |regret| format!("is {:.1} %", 100.0 * regret));
            let told = format!(
                "Left out of the training: the {} of this report. The mean regret of the predicted choices {regret}, at {} of {} points: at \
                 the others what was chosen had left the race and was not timed. In {:.0} % of the cells both choose the same.",
                map.held_out,
                map.known,
                map.points,
                100.0 * map.agreeing
            );
            part.push(folder.figure("field-map", &map.figure, &told, &[k]))?;
        }
    }
    Ok(part.section)
}

pub(super) fn prediction(study: &Study, folder: &mut Folder, missing: &mut Vec<String>) -> Result<Section> {
    let mut part = Part::new("prediction", "Can it be predicted?", missing);
    let trained = match &study.trained {
        Ok(trained) => trained,
        Err(why) => {
            part.lacks(why.clone());
            return Ok(part.section);
        }
    };
    let validation = &trained.model.validation;
    if validation.methods.is_empty() {
        part.lacks("nothing was left out: it takes two reports; add reports of other machines");
        return Ok(part.section);
    }
    if !trained.held.by_machine {
        part.lacks(format!(
            "there is one physical machine, and what is left out in turn is its {}: this says little about machines never seen",
            validation.held_out
        ));
    }
    let studied = study.studied();
    let pictures = Training::new(&trained.held, &validation.learning);
    part.push(folder.table("scores", SCORES, accuracy::scores(validation, &studied)))?;
    part.push(folder.table(
        "regrets",
        "Mean regret of each of them on what was left out.",
        accuracy::regrets(&trained.held, &study.entries),
    ))?;
    let told = "Mean regret on each of what was left out, from the least to the most, for each way to choose by itself.";
    part.push(folder.figure("regrets", &pictures.regrets, told, &studied))?;
    let told = "Times of what was left out, predicted from hardware parameters alone.";
    part.push(folder.figure("times", &pictures.times, told, &studied))?;
    let caption = "These times, thinned evenly where there are many.";
    part.push(folder.table("times", caption, accuracy::times(&trained.held, &study.entries)))?;
    let (sheet, figure) = accuracy::borders(&trained.held, &study.borders, &study.entries);
    if sheet.rows.is_empty() {
        part.lacks("no border was measured on what was left out");
    } else {
        let ends = trained.held.borders.iter().filter(|b| !b.beside.crosses).count();
        let told = format!(
            "Borders between fields, measured with 90 % intervals where these are known. Of {} predicted ones {ends} do not cross within the \
             sizes that were measured; the end beyond which they would stands for them, drawn apart.{}",
            trained.held.borders.len(),
            if trained.held.by_machine {
                ""
            } else {
                " One machine's report is left out with its vectors and with its threads: twice."
            }
        );
        part.push(folder.figure("crossings", &figure, &told, &studied))?;
        part.push(folder.table("crossings", "Every one of these borders.", sheet))?;
    }
    let Some(learning) = &pictures.learning else {
        part.lacks("there is no learning curve: it takes three physical machines");
        return Ok(part.section);
    };
    let told = "Regret by the number of physical machines in the training; bars hold 90 % of the trainings.";
    part.push(folder.figure("learning", learning, told, &studied))?;
    part.push(folder.table("learning", "The same in figures.", accuracy::learning(validation, &studied)))?;
    Ok(part.section)
}
