//! The one style of all pictures.
//!
//! A page that shows them on a dark ground exchanges the four neutral colours by their values, so there is no other black, white or grey
//! than these outside of series.

use super::mark::Mark;
use plotters::prelude::*;
use plotters_backend::text_anchor::{HPos, Pos, VPos};

/// The ground.
pub(super) const GROUND: RGBColor = RGBColor(255, 255, 255);
/// Text, frames, and what stands for all algorithms together.
pub(super) const INK: RGBColor = RGBColor(0, 0, 0);
/// Captions, and lines that help to read.
pub(super) const SECONDARY: RGBColor = RGBColor(90, 90, 90);
/// Lines of a grid.
pub(super) const GRID: RGBColor = RGBColor(208, 208, 208);

/// Width in units of every figure of the study: on a page all letters then have the same size.
pub(super) const WIDTH: u32 = 1000;
/// Room between things and at the edges.
pub(super) const GAP: i32 = 12;

/// Sizes of letters.
pub(super) const TITLE: u32 = 22;
pub(super) const PANEL: u32 = 18;
pub(super) const AXIS: u32 = 17;
pub(super) const LABEL: u32 = 15;
pub(super) const SMALL: u32 = 14;

/// Height of a line of text of that size.
pub(super) const fn line_height(size: u32) -> i32 {
    size as i32 * 13 / 10
}

/// Six colours that stay apart for colour-blind readers (Okabe and Ito 2008), then five that do so less, for those who draw more; black is
/// kept for the adaptive module.
const COLOURS: [RGBColor; 11] = [
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(120, 94, 240),
    RGBColor(140, 90, 40),
    RGBColor(150, 150, 30),
    RGBColor(160, 40, 90),
    RGBColor(150, 150, 150),
];

/// The colour of the series at that position in the list of all.
pub(super) fn colour(k: usize) -> RGBColor {
    COLOURS[k % COLOURS.len()]
}

/// Its mark. There are six, so that two series with the same colour differ in it.
pub(super) fn mark(k: usize) -> Mark {
    [Mark::Disc, Mark::Triangle, Mark::Cross, Mark::Ring, Mark::Square, Mark::Plus][k % 6]
}

/// Lengths of its strokes and gaps in turn, none for a line without gaps. There are five: colour, mark and dashes together differ for 330
/// series.
pub(super) fn dashes(k: usize) -> &'static [i32] {
    [&[][..], &[8, 4], &[2, 4], &[12, 4, 2, 4], &[5, 3]][k % 5]
}

/// Text of a size and colour, with its left end, middle or right end at the place.
pub(super) fn text(size: u32, colour: RGBColor, h: HPos, v: VPos) -> TextStyle<'static> {
    super::font::SANS.into_font().resize(f64::from(size)).color(&colour).pos(Pos::new(h, v))
}

/// Opacity of fields behind curves.
pub(super) const FIELD: f64 = 0.2;
