//! How well times, crossovers and choices are predicted.

use super::builder::SectionBuilder;
use crate::figures::TrainingPicture;
use crate::page::Section;
use crate::study::accuracy;
use crate::study::folder::Folder;
use crate::study::material::Study;
use anyhow::Result;

/// What the columns and rows of the scores mean.
const SCORES: &str = "Strategies that choose an algorithm for what was held out. Regret is the time of what is chosen over that of the best, less \
one; least and largest are the means of the machine, or of the report where all are of one machine, that was served best and worst; an unseen scenario was held out beside the machine, and is what to expect of your own scenes; by means, the means over frames judge in place of medians; in games, sizes count as often as games are assumed to have them (log-normal around 800 objects); crossovers are off by the median of octaves \
(factors of two) between measured and predicted ones; the gap is 0 % closed by the one algorithm that is best on average and 100 % by the oracle, which \
is best at each point: a strategy that costs more than that one algorithm closes none of it. Physics + load is what predict does; ours + 8 \
samples corrects it by as many timings of the machine itself; frozen constants switch at a number of objects that an engine has written down (64 or 1000); default and nearest machine take \
another machine's curves; full sweep has the machine's own timings, by which it is judged.";

pub(super) fn prediction(study: &Study, folder: &mut Folder, missing: &mut Vec<String>) -> Result<Section> {
    let mut section = SectionBuilder::new("prediction", "Can it be predicted?", missing);
    let trained = match &study.trained {
        Ok(trained) => trained,
        Err(why) => {
            section.lacks(why.clone());
            return Ok(section.section);
        }
    };
    let (validation, held_out) = (&trained.training.validation, &trained.held_out);
    if validation.methods.is_empty() {
        section.lacks("nothing was held out: it takes two reports; add reports of other machines");
        return Ok(section.section);
    }
    if !held_out.by_machine {
        section.lacks(format!(
            "there is one physical machine, and what is held out in turn is its {}: this says little about machines never seen",
            validation.held_out
        ));
    }
    let studied = study.studied();
    let TrainingPicture { times, regrets } = TrainingPicture::new(held_out);
    let [of_regrets, of_times] =
        [accuracy::regrets(held_out, &study.entries), accuracy::times(held_out, &study.entries)];
    let told = "Mean regret on each of what was held out, from the least to the most, for each strategy by itself.";
    section.push(folder.figure("regrets", &regrets, told, &studied, &[("regrets", &of_regrets)]))?;
    section.push(folder.table("scores", SCORES, accuracy::scores(validation, &studied)))?;
    let told = "Times of what was held out, predicted from hardware parameters alone.";
    section.push(folder.figure("times", &times, told, &studied, &[("times", &of_times)]))?;
    let (crossovers, figure) = accuracy::crossovers(held_out, &study.crossovers, &study.entries);
    if crossovers.rows.is_empty() {
        section.lacks("no crossover was measured on what was held out");
    } else {
        let ends = held_out.crossovers.iter().filter(|b| !b.compared.crosses).count();
        let twice = if held_out.by_machine {
            ""
        } else {
            " A report is held out twice: with its vectors and with its threads."
        };
        let told = format!(
            "Crossovers between fields, measured with 90 % intervals where these are known. Of {} predicted ones {ends} do not cross within the \
             sizes that were measured; the end beyond which they would stands for them, drawn apart.{twice}",
            held_out.crossovers.len(),
        );
        section.push(folder.figure("crossovers", &figure, &told, &studied, &[("crossovers", &crossovers)]))?;
        section.push(folder.table("crossovers", "Each of these crossovers.", crossovers))?;
    }
    section.push(folder.table("regrets", "Mean regret of each strategy on each of what was held out.", of_regrets))?;
    let caption = "Predicted and measured times, thinned evenly where there are many.";
    section.push(folder.table("times", caption, of_times))?;
    Ok(section.section)
}
