//! Pictures.

mod axis;
mod chart;
mod crossings;
mod curves;
mod font;
mod influence;
mod legend;
mod map;
mod mark;
mod paper;
mod ratios;
mod simulation;
mod style;
mod tabled;
mod training;

use crate::exit::WrongUsage;
use paper::Area;
use plotters_backend::text_anchor::{HPos, VPos};
use std::path::Path;
use style::{GAP, INK, SECONDARY, SMALL, TITLE, line_height};

pub(crate) use crossings::{CrossingPair, Crossings};
pub(crate) use curves::{Band, Crossing, Curve, CurvePanel, CurvePoint, Curves};
pub(crate) use influence::{Influence, InfluenceCell, Mark3};
pub(crate) use map::{FieldMap, MapCell, MapPanel, MapPoint};
pub(crate) use ratios::{RatioGroup, RatioKind, RatioValue, Ratios};
pub(crate) use simulation::simulation;
pub(crate) use tabled::Tabled;
pub(crate) use training::training;

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
        font::register()?;
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
    if text.is_empty() { 0 } else { (text.len() as i32 * line_height(size) + GAP) as u32 }
}

fn lines(area: &Area<'_>, text: &[String], size: u32, colour: RGBColor) -> anyhow::Result<()> {
    for (k, line) in text.iter().enumerate() {
        let place = (GAP, GAP / 2 + k as i32 * line_height(size));
        area.draw(&Text::new(line.as_str(), place, style::text(size, colour, HPos::Left, VPos::Top)))?;
    }
    Ok(())
}

use plotters::coord::Shift;
use plotters::prelude::*;
use style::colour;

/// An SVG of that width and height.
///
/// # Errors
/// When it can't be drawn.
fn svg(
    size: (u32, u32),
    draw: impl FnOnce(&DrawingArea<SVGBackend<'_>, Shift>) -> anyhow::Result<()>,
) -> anyhow::Result<String> {
    font::register()?;
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        draw(&root)?;
        root.present()?;
    }
    Ok(svg)
}

/// A PNG of that width and height.
///
/// # Errors
/// When it can't be drawn.
fn png(
    size: (u32, u32),
    draw: impl FnOnce(&DrawingArea<BitMapBackend<'_>, Shift>) -> anyhow::Result<()>,
) -> anyhow::Result<Vec<u8>> {
    font::register()?;
    let mut pixels = vec![0; 3 * size.0 as usize * size.1 as usize];
    {
        let root = BitMapBackend::with_buffer(&mut pixels, size).into_drawing_area();
        root.fill(&WHITE)?;
        draw(&root)?;
        root.present()?;
    }
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, size.0, size.1);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header()?.write_image_data(&pixels)?;
    Ok(file)
}

/// Draws the names of the series of a chart.
fn legend<'a, D, C>(chart: &mut ChartContext<'a, D, C>, position: SeriesLabelPosition) -> anyhow::Result<()>
where
    D: DrawingBackend + 'a,
    D::ErrorType: 'static,
    C: CoordTranslate,
{
    chart.configure_series_labels().position(position).background_style(WHITE.mix(0.85)).border_style(style::GRID).draw()?;
    Ok(())
}

#[cfg(test)]
mod tests;
