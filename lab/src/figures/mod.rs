//! Pictures.

mod axis;
mod chart;
mod crossings;
mod curves;
mod font;
mod influence;
mod learning;
mod legend;
mod legended;
mod map;
mod mark;
mod paper;
mod ratios;
mod regrets;
mod replay;
mod style;
mod tabled;
mod times;
mod training;

use crate::exit::WrongUsage;
use paper::Area;
use plotters::element::Text;
use plotters::style::RGBColor;
use plotters_backend::text_anchor::{HPos, VPos};
use std::path::Path;
use style::{GAP, INK, SECONDARY, SMALL, TITLE, line_height};

pub(crate) use crossings::{CrossingPair, Crossings};
pub(crate) use curves::{Band, Crossing, Curve, CurvePanel, CurvePoint, Curves};
pub(crate) use influence::{Influence, InfluenceCell, Mark3};
pub(crate) use learning::{LearningCurve, LearningPoint, LearningWay};
pub(crate) use map::{FieldMap, MapCell, MapPanel, MapPoint};
pub(crate) use ratios::{RatioGroup, RatioKind, RatioValue, Ratios};
pub(crate) use regrets::{Regrets, Way};
pub use replay::ReplayPicture;
pub(crate) use tabled::Tabled;
pub(crate) use times::{TimePair, Times, TimesOf};
pub(crate) use training::Training;

/// Lines at most of a title, and of a paragraph of a caption: a name or command of a megabyte makes no picture of a mile.
const TITLE_LINES: usize = 3;
const CAPTION_LINES: usize = 12;

/// How a picture is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Picture {
    Svg,
    Png,
}

impl Picture {
    /// What the name of a file asks for.
    ///
    /// # Errors
    /// When it asks for neither.
    pub(crate) fn of(path: &Path) -> Result<Self, WrongUsage> {
        match path.extension().and_then(|e| e.to_str()) {
            Some("svg") => Ok(Self::Svg),
            Some("png") => Ok(Self::Png),
            _ => Err(WrongUsage(format!("--plot {}: name a file that ends in .svg or .png", path.display()))),
        }
    }
}

/// A picture of plain data.
pub(crate) trait Figure {
    /// What stands above it; nothing where this is empty.
    fn title(&self) -> &str;

    /// Width and height in units of what `draw_on` draws, without title and caption.
    fn size(&self) -> (u32, u32);

    /// Draws it from the upper left corner.
    ///
    /// # Errors
    /// When the picture can't be drawn.
    fn draw_on(&self, area: &Area<'_>) -> anyhow::Result<()>;

    /// The whole picture, each paragraph of the caption on lines of its own below: sources and the command that makes it.
    ///
    /// # Errors
    /// When the picture can't be drawn.
    fn draw(&self, picture: Picture, caption: &[String]) -> anyhow::Result<Vec<u8>> {
        let (width, height) = self.size();
        let room = width as i32 - 2 * GAP;
        let title = if self.title().is_empty() { Vec::new() } else { font::wrapped(self.title(), TITLE, room, TITLE_LINES) };
        let caption: Vec<String> = caption.iter().flat_map(|text| font::wrapped(text, SMALL, room, CAPTION_LINES)).collect();
        let top = block(&title, TITLE);
        let bottom = block(&caption, SMALL);
        paper::picture(picture, (width, top + height + bottom), |root| {
            let (above, rest) = root.split_vertically(top);
            let (body, below) = rest.split_vertically(height);
            lines(&above, &title, TITLE, INK)?;
            self.draw_on(&body)?;
            lines(&below, &caption, SMALL, SECONDARY)
        })
    }
}

/// Height of lines of text with room around them.
fn block(text: &[String], size: u32) -> u32 {
    if text.is_empty() { 0 } else { (text.len() as i32 * line_height(size) + 2 * GAP) as u32 }
}

fn lines(area: &Area<'_>, text: &[String], size: u32, colour: RGBColor) -> anyhow::Result<()> {
    for (k, line) in text.iter().enumerate() {
        let place = (GAP, GAP + k as i32 * line_height(size));
        area.draw(&Text::new(line.as_str(), place, style::text(size, colour, HPos::Left, VPos::Top)))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
