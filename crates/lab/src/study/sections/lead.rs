//! The first words of the page: what was read, and what these machines can and can't say.

use crate::MethodScore;
use crate::spread;
use crate::study::influence::Influence;
use crate::study::material::Study;
use crate::study::rank::FEWEST_MACHINES;
use crate::text::{count, grouped};

/// The first words of the page.
pub(in crate::study) fn lead(study: &Study, influence: &Influence) -> Vec<String> {
    let mut lead = vec![format!(
        "Which hardware parameters decide how fast a broad-phase algorithm is and where another one overtakes it, and can that be predicted? \
         Section 6 of the paper of Avril, Gouranton and Arnaldi (ISVRI 2011) asks it; here {} of {} are asked, {} of them with timings \
         that are studied.",
        count(study.entries.len(), "report"),
        count(influence.machines, "physical machine"),
        grouped(study.studied().len() as u64),
    )];
    lead.extend(can_say(study, influence));
    lead
}

/// What the machines of the reports can say and what they can't, with the cause first.
pub(in crate::study) fn can_say(study: &Study, influence: &Influence) -> Vec<String> {
    let studied = study.studied();
    let mut said = Vec::new();
    match influence.machines {
        0 => said.push("No report has timings that can be studied; the section on limits says why.".to_owned()),
        1 => said.push(format!(
            "All timings are of one physical machine. They show how its algorithms compare, where one overtakes the next, and what it does to take \
             cores, vector lanes or bandwidth from it. They can't show how differences between machines shape performance, nor how well \
             a machine never seen is predicted: that takes reports of {FEWEST_MACHINES} machines or more."
        )),
        few if few < FEWEST_MACHINES => said.push(format!(
            "The timings are of {few} physical machines: too few to tell which parameters go with speed, which takes {FEWEST_MACHINES} or more."
        )),
        _ => {}
    }
    if !studied.is_empty() && studied.iter().all(|&k| study.entries[k].gpu().is_none()) {
        said.push(
            "None of the timed machines has a real GPU: software adapters run on the CPU. What the paper says of GPUs can neither be confirmed \
             nor refuted by these timings."
                .to_owned(),
        );
    }
    if influence.reports.len() < influence.machines && influence.machines > 1 {
        let some = grouped(influence.reports.len() as u64);
        said.push(format!("Rank correlations look at {some} of these machines, evenly chosen."));
    }
    said.extend(prediction(study));
    said
}

/// How well choices and crossovers are predicted, beside the best fixed algorithm.
fn prediction(study: &Study) -> Option<String> {
    let validation = &study.trained.as_ref().ok()?.training.validation;
    let ours = validation.methods.first()?;
    let single = validation.methods.iter().find(|m| m.name == crate::evaluate::SINGLE_BEST);
    let percent = |share: f64| spread::percent(share, None, 1);
    let all = |m: &MethodScore| Some(spread::percent(m.mean_regret, m.regret_range(), 1));
    let in_games = |m: &MethodScore| Some(spread::percent(m.mean_regret_in_games?, m.regret_range_in_games(), 1));
    let beside = |of: &dyn Fn(&MethodScore) -> Option<String>| {
        single.and_then(of).map_or(String::new(), |s| format!(", with the best single algorithm {s}"))
    };
    let mut text = format!(
        "Chosen by predictions from hardware parameters alone, with each {} held out in turn, a frame takes more time than with the best choice \
         by {}{}, averaged over scenarios and sizes",
        validation.held_out,
        all(ours)?,
        beside(&all),
    );
    if let Some(games) = in_games(ours) {
        text += &format!("; at the sizes that games are assumed to have, by {games}{}", beside(&in_games));
    }
    text += ". The least and the largest mean of what was held out stand in brackets.";
    if let (Some(octaves), Some(near)) = (ours.crossing_error_octaves, ours.crossings_within_half_octave) {
        text += &format!(
            " Predicted crossovers are off by {octaves:.2} octaves (a factor of {:.1}) at the median; {} of them lie within half an octave.",
            octaves.exp2(),
            percent(near)
        );
    }
    Some(text)
}
