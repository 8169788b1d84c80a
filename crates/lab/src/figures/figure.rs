//! What a figure is, and how it stands on a picture with its title and its caption.

use super::canvas::{self, Area};
use super::font;
use super::picture::Picture;
use super::style::{self, GAP, INK, SECONDARY, SMALL, TITLE, line_height};
use plotters::element::Text;
use plotters::style::RGBColor;
use plotters_backend::text_anchor::{HPos, VPos};

/// Lines at most of a title, and of a paragraph of a caption: a name or command of a megabyte makes no picture of a mile.
const TITLE_LINES: usize = 3;
const CAPTION_LINES: usize = 12;

/// A picture of plain data.
///
/// Only the figures of this module can draw: the canvas is theirs.
pub trait Figure {
    /// What stands above it; nothing where this is empty.
    fn title(&self) -> &str;

    /// Width and height in units of what [`draw_on`](Self::draw_on) draws, without title and caption.
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
    fn draw(&self, format: Picture, caption: &[String]) -> anyhow::Result<Vec<u8>> {
        let (width, height) = self.size();
        let room = width as i32 - 2 * GAP;
        let title =
            if self.title().is_empty() { Vec::new() } else { font::wrapped(self.title(), TITLE, room, TITLE_LINES) };
        let caption: Vec<String> =
            caption.iter().flat_map(|text| font::wrapped(text, SMALL, room, CAPTION_LINES)).collect();
        let top = block(&title, TITLE);
        let bottom = block(&caption, SMALL);
        canvas::picture(format, (width, top + height + bottom), |root| {
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
