//! A replay as the plain data that a picture is drawn from.

use super::outcome::Outcome;
use super::settings::ReplaySettings;
use sapwise_lab::figures::Replay;

/// The picture of a replay, with paragraphs below it.
pub(crate) fn picture(settings: &ReplaySettings, outcome: &Outcome, caption: Vec<String>) -> Replay {
    let frames = &outcome.frames;
    let times = |k: usize| frames.iter().map(|f| f.fixed_ns[k]).collect();
    Replay {
        title: settings.source.name().to_owned(),
        chosen_ns: frames.iter().map(|f| f.adaptive_ns).collect(),
        chosen: outcome.last_taken().iter().map(|t| t.chosen).collect(),
        fixed: outcome.fixed.iter().enumerate().map(|(k, id)| (id.to_string(), times(k))).collect(),
        caption,
    }
}
