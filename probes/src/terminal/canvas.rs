//! Characters to draw on: each holds two by four dots of Braille, or in ASCII the letter of a series.

use super::Terminal;
use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind};
use std::convert::Infallible;

/// What a character without dots is in Braille.
const NO_DOTS: u32 = 0x2800;
/// The bit of each dot, by row and column: the fourth row was added to Braille later.
const DOTS: [[u32; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

/// One character.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Cell {
    dots: u32,
    /// Which series the dots or the text belong to.
    series: Option<usize>,
    /// Hides the dots.
    text: Option<char>,
}

/// A canvas for plotters, whose pixels are dots and whose colours are numbers of series ([`colour_of`]); black is the frame.
pub(super) struct Canvas {
    terminal: Terminal,
    columns: usize,
    cells: Vec<Cell>,
}

/// What plotters draws a series with.
pub(super) fn colour_of(series: usize) -> plotters::style::RGBColor {
    plotters::style::RGBColor(series as u8 + 1, 0, 0)
}

/// Dots of a character across and down. In ASCII all of one show the same: they are there because plotters keeps labels at least two
/// away from the frame, which would be a blank line.
pub(super) fn dots(terminal: Terminal) -> (i32, i32) {
    if terminal.unicode { (2, 4) } else { (2, 2) }
}

impl Canvas {
    pub(super) fn new(terminal: Terminal, columns: usize, lines: usize) -> Self {
        Self { terminal, columns, cells: vec![Cell::default(); columns * lines] }
    }

    /// The lines, without blanks at their ends.
    pub(super) fn text(&self) -> String {
        let mut text = String::new();
        for line in self.cells.chunks(self.columns) {
            let end = line.iter().rposition(|c| *c != Cell::default()).map_or(0, |last| last + 1);
            for run in line[..end].chunk_by(|a, b| a.series == b.series) {
                let shown: String = run.iter().map(|c| self.shown(*c)).collect();
                text += &run[0].series.map_or(shown.clone(), |k| self.terminal.series(k, &shown));
            }
            text.push('\n');
        }
        text
    }

    fn shown(&self, cell: Cell) -> char {
        match cell {
            Cell { text: Some(text), .. } => text,
            Cell { dots: 0, .. } => ' ',
            Cell { dots, .. } if self.terminal.unicode => char::from_u32(NO_DOTS + dots).unwrap_or(' '),
            // Without colours and dots the letter of the series is all there is.
            Cell { series, .. } => letter(series.unwrap_or(0)),
        }
    }

    /// The character that holds a dot, and the place of the dot in it.
    fn cell(&mut self, (x, y): BackendCoord) -> Option<(&mut Cell, usize, usize)> {
        let (across, down) = dots(self.terminal);
        let (column, line) = (x.div_euclid(across), y.div_euclid(down));
        let column = usize::try_from(column).ok().filter(|&c| c < self.columns)?;
        let at = usize::try_from(line).ok()? * self.columns + column;
        Some((self.cells.get_mut(at)?, x.rem_euclid(across) as usize, y.rem_euclid(down) as usize))
    }

    /// Puts a character of the frame.
    fn frame(&mut self, at: BackendCoord, horizontal: bool) {
        let unicode = self.terminal.unicode;
        let Some((cell, ..)) = self.cell(at) else { return };
        let [across, down, left, below] = if unicode { ['─', '│', '┤', '┬'] } else { ['-', '|', '+', '+'] };
        // The lines of the frame come first, then the marks on them.
        cell.text = Some(match (cell.text, horizontal) {
            (Some(there), true) if there == down || there == left => left,
            (Some(there), false) if there == across || there == below => below,
            (_, true) => across,
            (_, false) => down,
        });
    }
}

/// The letter of a series.
pub(super) fn letter(series: usize) -> char {
    char::from(b'a' + (series % 26) as u8)
}

impl DrawingBackend for Canvas {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        let (across, down) = dots(self.terminal);
        ((self.columns as i32 * across) as u32, ((self.cells.len() / self.columns) as i32 * down) as u32)
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, at: BackendCoord, colour: BackendColor) -> Drawn {
        let series = usize::from(colour.rgb.0).checked_sub(1);
        if let Some((cell, x, y)) = self.cell(at) {
            cell.dots |= DOTS[y][x];
            cell.series = series;
        }
        Ok(())
    }

    /// One dot for each step of the longer side. That of plotters blurs an edge over two dots, which have no shades.
    fn draw_line<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S) -> Drawn {
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let steps = dx.abs().max(dy.abs());
        let framing = style.color().rgb == (0, 0, 0);
        for k in 0..=steps {
            let along = |from: i32, by: i32| from + (f64::from(by * k) / f64::from(steps.max(1))).round() as i32;
            let at = (along(from.0, dx), along(from.1, dy));
            if framing {
                self.frame(at, dy == 0);
            } else {
                self.draw_pixel(at, style.color())?;
            }
        }
        Ok(())
    }

    fn draw_text<T: BackendTextStyle>(&mut self, text: &str, style: &T, (x, y): BackendCoord) -> Drawn {
        let (across, down) = dots(self.terminal);
        let width = text.chars().count() as i32;
        let left = x.div_euclid(across)
            - match style.anchor().h_pos {
                HPos::Left => 0,
                HPos::Center => width / 2,
                HPos::Right => width,
            };
        let line = match style.anchor().v_pos {
            VPos::Top | VPos::Center => y.div_euclid(down),
            VPos::Bottom => y.div_euclid(down) - 1,
        };
        let series = usize::from(style.color().rgb.0).checked_sub(1);
        for (k, character) in text.chars().enumerate() {
            if let Some((cell, ..)) = self.cell(((left + k as i32) * across, line * down)) {
                *cell = Cell { dots: 0, series, text: Some(character) };
            }
        }
        Ok(())
    }

    fn estimate_text_size<T: BackendTextStyle>(
        &self,
        text: &str,
        _: &T,
    ) -> Result<(u32, u32), DrawingErrorKind<Infallible>> {
        let (across, down) = dots(self.terminal);
        Ok(((text.chars().count() as i32 * across) as u32, down as u32))
    }
}
