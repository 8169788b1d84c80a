//! A frame with two axes, and what is drawn in it.

use super::axis::{Axis, Lies};
use super::canvas::Area;
use super::font;
use super::mark::{Mark, mark};
use super::style::{self, AXIS, GRID, INK, LABEL, PANEL, SECONDARY, line_height};
use plotters::prelude::*;
use plotters_backend::text_anchor::{HPos, VPos};

/// A place in units of its area.
pub(super) type Position = (i32, i32);

/// A rectangle of an area.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Frame {
    pub(super) left: i32,
    pub(super) top: i32,
    pub(super) right: i32,
    pub(super) bottom: i32,
}

impl Frame {
    pub(super) fn width(self) -> i32 {
        self.right - self.left
    }

    pub(super) fn height(self) -> i32 {
        self.bottom - self.top
    }

    /// What is left after taking that much away on the left, above, on the right and below.
    pub(super) fn within(self, left: i32, top: i32, right: i32, bottom: i32) -> Self {
        Self { left: self.left + left, top: self.top + top, right: self.right - right, bottom: self.bottom - bottom }
    }

    /// That many frames of the same size in rows of `columns`, with a gap between them.
    pub(super) fn parts(self, count: usize, columns: usize, gap: i32) -> Vec<Self> {
        let (columns, rows) = (columns.max(1) as i32, count.div_ceil(columns.max(1)).max(1) as i32);
        let (width, height) = ((self.width() + gap) / columns, (self.height() + gap) / rows);
        let part = |k: i32| {
            let (left, top) = (self.left + k % columns * width, self.top + k / columns * height);
            Self { left, top, right: left + width - gap, bottom: top + height - gap }
        };
        (0..count as i32).map(part).collect()
    }
}

/// Room beside a chart for numbers and names of the axes.
pub(super) const LEFT: i32 = 74;
pub(super) const BELOW: i32 = 50;
/// The last number below may stand in the middle below the corner.
pub(super) const RIGHT: i32 = 22;
pub(super) const ABOVE: i32 = 30;

/// A line: its colour, width and dashes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stroke {
    pub(super) colour: RGBColor,
    pub(super) width: u32,
    pub(super) dashes: &'static [i32],
}

impl Stroke {
    /// That of the series at a position.
    pub(super) fn of(k: usize) -> Self {
        Self { colour: style::colour(k), width: 2, dashes: style::dashes(k) }
    }

    pub(super) const fn solid(colour: RGBColor, width: u32) -> Self {
        Self { colour, width, dashes: &[] }
    }

    pub(super) const fn dashed(colour: RGBColor, width: u32) -> Self {
        Self { colour, width, dashes: &[5, 4] }
    }
}

/// A chart under way.
pub(super) struct Chart<'a, 'p> {
    area: &'a Area<'p>,
    /// Without what stands beside the axes.
    pub(super) frame: Frame,
    pub(super) x: Axis,
    pub(super) y: Axis,
}

impl<'a, 'p> Chart<'a, 'p> {
    pub(super) fn new(area: &'a Area<'p>, frame: Frame, x: Axis, y: Axis) -> Self {
        Self { area, frame, x, y }
    }

    /// The grid and the numbers beside it, with what the axes are.
    pub(super) fn grid(&self, title: &str, x_name: &str, y_name: &str) -> anyhow::Result<()> {
        let Frame { left, top, right, bottom } = self.frame;
        for tick in self.y.ticks(self.frame.height(), Lies::Upright) {
            let Some(y) = self.y.share(tick.value).map(|share| self.up(share)) else { continue };
            path(self.area, &[(left, y), (right, y)], Stroke::solid(GRID, 1))?;
            words(self.area, &tick.label, (left - 6, y), LABEL, INK, HPos::Right, VPos::Center)?;
        }
        for tick in self.x.ticks(self.frame.width(), Lies::Flat) {
            let Some(x) = self.x.share(tick.value).map(|share| self.across(share)) else { continue };
            path(self.area, &[(x, top), (x, bottom)], Stroke::solid(GRID, 1))?;
            words(self.area, &tick.label, (x, bottom + 6), LABEL, INK, HPos::Center, VPos::Top)?;
        }
        self.border()?;
        let (middle, centre) = ((left + right) / 2, (top + bottom) / 2);
        for x_name in font::wrapped(x_name, AXIS, right - left + RIGHT, 1) {
            words(self.area, &x_name, (middle, bottom + 8 + line_height(LABEL)), AXIS, INK, HPos::Center, VPos::Top)?;
        }
        // It may go on beside what is above and below.
        for y_name in font::wrapped(y_name, AXIS, bottom - top + BELOW, 1).into_iter().filter(|name| !name.is_empty()) {
            let turned = style::text(AXIS, INK, HPos::Center, VPos::Center).transform(FontTransform::Rotate270);
            self.area.draw(&Text::new(y_name, (left - LEFT + 14, centre), turned))?;
        }
        for line in font::wrapped(title, PANEL, self.frame.width(), 1).iter().filter(|line| !line.is_empty()) {
            words(self.area, line, (left, top - 8), PANEL, INK, HPos::Left, VPos::Bottom)?;
        }
        Ok(())
    }

    pub(super) fn border(&self) -> anyhow::Result<()> {
        let Frame { left, top, right, bottom } = self.frame;
        let corners = [(left, top), (right, top), (right, bottom), (left, bottom), (left, top)];
        path(self.area, &corners, Stroke::solid(SECONDARY, 1))
    }

    fn across(&self, share: f64) -> i32 {
        self.frame.left + (share * f64::from(self.frame.width())).round() as i32
    }

    fn up(&self, share: f64) -> i32 {
        self.frame.bottom - (share * f64::from(self.frame.height())).round() as i32
    }

    /// Where a pair of values is. `None` where one of them has no place on its axis.
    pub(super) fn place(&self, x: f64, y: f64) -> Option<Position> {
        Some((self.across(self.x.share(x)?), self.up(self.y.share(y)?)))
    }

    /// The rectangle between two values of each axis, cut at its ends.
    pub(super) fn rectangle(&self, x: (f64, f64), y: (f64, f64)) -> Option<Frame> {
        let (left, right) = (self.across(self.x.end(x.0)?), self.across(self.x.end(x.1)?));
        let (bottom, top) = (self.up(self.y.end(y.0)?), self.up(self.y.end(y.1)?));
        (left < right && top < bottom).then_some(Frame { left, top, right, bottom })
    }

    /// A line through these values, in pieces where one has no place.
    pub(super) fn line(&self, values: impl IntoIterator<Item = (f64, f64)>, line: Stroke) -> anyhow::Result<()> {
        let places: Vec<Option<Position>> = values.into_iter().map(|(x, y)| self.place(x, y)).collect();
        for piece in places.split(Option::is_none) {
            let piece: Vec<Position> = piece.iter().flatten().copied().collect();
            path(self.area, &piece, line)?;
        }
        Ok(())
    }

    /// A bar from one value to another above `x`.
    pub(super) fn bar(&self, x: f64, low: f64, high: f64, line: Stroke) -> anyhow::Result<()> {
        let ends = (self.x.share(x), self.y.end(low), self.y.end(high));
        let (Some(x), Some(low), Some(high)) = ends else { return Ok(()) };
        self.capped((self.across(x), self.up(low)), (self.across(x), self.up(high)), line)
    }

    /// A bar from one value to another beside `y`.
    pub(super) fn flat_bar(&self, y: f64, low: f64, high: f64, line: Stroke) -> anyhow::Result<()> {
        let ends = (self.y.share(y), self.x.end(low), self.x.end(high));
        let (Some(y), Some(low), Some(high)) = ends else { return Ok(()) };
        self.capped((self.across(low), self.up(y)), (self.across(high), self.up(y)), line)
    }

    /// With short lines across its ends. One of no length would be a spot beside the mark.
    fn capped(&self, a: Position, b: Position, line: Stroke) -> anyhow::Result<()> {
        if a == b {
            return Ok(());
        }
        let cap = if a.0 == b.0 { (3, 0) } else { (0, 3) };
        path(self.area, &[a, b], line)?;
        for (x, y) in [a, b] {
            path(self.area, &[(x - cap.0, y - cap.1), (x + cap.0, y + cap.1)], line)?;
        }
        Ok(())
    }

    pub(super) fn mark(&self, x: f64, y: f64, shape: Mark, colour: RGBColor, size: i32) -> anyhow::Result<()> {
        if let Some(place) = self.place(x, y) {
            self.area.draw(&mark(place, shape, colour, size))?;
        }
        Ok(())
    }

    /// A line over the whole height.
    pub(super) fn upright(&self, x: f64, line: Stroke) -> anyhow::Result<()> {
        let Some(x) = self.x.share(x).map(|share| self.across(share)) else { return Ok(()) };
        path(self.area, &[(x, self.frame.bottom), (x, self.frame.top)], line)
    }

    /// Lines where the second value is the first times a factor. Both axes must be logarithmic and the same.
    pub(super) fn factors(&self, factors: &[(f64, Stroke)]) -> anyhow::Result<()> {
        let (low, high) = self.x.ends();
        for &(factor, line) in factors {
            let ends = [low.max(low / factor), high.min(high / factor)];
            self.line(ends.map(|x| (x, x * factor)), line)?;
        }
        Ok(())
    }

    /// The numbers of the flat axis once more, above a chart that may be too high to see both ends.
    pub(super) fn numbers_above(&self) -> anyhow::Result<()> {
        for tick in self.x.ticks(self.frame.width(), Lies::Flat) {
            let Some(x) = self.x.share(tick.value).map(|share| self.across(share)) else { continue };
            words(self.area, &tick.label, (x, self.frame.top - 12), LABEL, INK, HPos::Center, VPos::Center)?;
        }
        Ok(())
    }

    /// What is missing, in the middle of an empty frame.
    pub(super) fn missing(&self, sentence: &str) -> anyhow::Result<()> {
        missing(self.area, self.frame, sentence)
    }
}

/// A frame with a sentence in it.
pub(super) fn missing(area: &Area<'_>, frame: Frame, sentence: &str) -> anyhow::Result<()> {
    let Frame { left, top, right, bottom } = frame;
    path(area, &[(left, top), (right, top), (right, bottom), (left, bottom), (left, top)], Stroke::solid(GRID, 1))?;
    let lines = font::wrapped(sentence, AXIS, frame.width() - 20, 6);
    let first = (top + bottom - (lines.len() as i32 - 1) * line_height(AXIS)) / 2;
    for (k, line) in lines.iter().enumerate() {
        let place = ((left + right) / 2, first + k as i32 * line_height(AXIS));
        words(area, line, place, AXIS, SECONDARY, HPos::Center, VPos::Center)?;
    }
    Ok(())
}

/// Text at a place.
pub(super) fn words(
    area: &Area<'_>,
    text: &str,
    place: Position,
    size: u32,
    colour: RGBColor,
    h: HPos,
    v: VPos,
) -> anyhow::Result<()> {
    if text.is_empty() {
        return Ok(());
    }
    Ok(area.draw(&Text::new(text.to_owned(), place, style::text(size, colour, h, v)))?)
}

/// A rectangle in one colour.
pub(super) fn fill(area: &Area<'_>, frame: Frame, colour: RGBColor, alpha: f64) -> anyhow::Result<()> {
    let Frame { left, top, right, bottom } = frame;
    Ok(area.draw(&Rectangle::new([(left, top), (right, bottom)], colour.mix(alpha).filled()))?)
}

/// A line through places, in strokes where it has dashes.
pub(super) fn path(area: &Area<'_>, places: &[Position], line: Stroke) -> anyhow::Result<()> {
    let mut places = places.to_vec();
    // The polygon that a PNG makes of a wide line has no direction between two points at one place.
    places.dedup();
    if places.len() < 2 {
        return Ok(());
    }
    let style = line.colour.stroke_width(line.width);
    if line.dashes.is_empty() {
        return Ok(area.draw(&PathElement::new(places, style))?);
    }
    for stroke in strokes(&places, line.dashes) {
        area.draw(&PathElement::new(stroke, style))?;
    }
    Ok(())
}

/// The strokes of a dashed line; gaps go around its corners.
fn strokes(places: &[Position], dashes: &[i32]) -> Vec<Vec<Position>> {
    let mut strokes = Vec::new();
    let (mut k, mut left) = (0, f64::from(dashes[0]));
    let mut stroke = vec![places[0]];
    for pair in places.windows(2) {
        let [from, to] = [pair[0], pair[1]].map(|(x, y)| (f64::from(x), f64::from(y)));
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let length = dx.hypot(dy);
        let mut done = 0.0;
        while length - done > left {
            done += left;
            let share = done / length;
            let place = ((from.0 + dx * share).round() as i32, (from.1 + dy * share).round() as i32);
            if k % 2 == 0 {
                stroke.push(place);
                strokes.push(std::mem::take(&mut stroke));
            }
            k += 1;
            stroke = vec![place];
            left = f64::from(dashes[k % dashes.len()]);
        }
        left -= length - done;
        stroke.push(pair[1]);
    }
    if k % 2 == 0 {
        strokes.push(stroke);
    }
    strokes.iter_mut().for_each(|stroke| stroke.dedup());
    strokes.retain(|stroke| stroke.len() > 1);
    strokes
}

/// Lines over a rectangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Hatch {
    None,
    Rising,
    Falling,
    Flat,
    Crossed,
    /// Closer than those of fields.
    Interval,
}

impl Hatch {
    /// That of the field of the series at a position.
    pub(super) fn of(k: usize) -> Self {
        [Self::None, Self::Rising, Self::Falling, Self::Flat, Self::Crossed][k % 5]
    }
}

/// Draws lines over a rectangle, which tell fields apart without colours. They go on in the next rectangle as if it were the same.
pub(super) fn hatch(area: &Area<'_>, frame: Frame, hatch: Hatch, colour: RGBColor) -> anyhow::Result<()> {
    let every = if hatch == Hatch::Interval { 9 } else { 12 };
    let rising = matches!(hatch, Hatch::Rising | Hatch::Crossed | Hatch::Interval);
    let falling = matches!(hatch, Hatch::Falling | Hatch::Crossed);
    let flat = hatch == Hatch::Flat;
    let line = Stroke::solid(colour, 1);
    let Frame { left, top, right, bottom } = frame;
    let first = |low: i32| low + (every - low.rem_euclid(every)) % every;
    if rising {
        // Those of x + y = sum.
        for sum in (first(left + top)..right + bottom).step_by(every as usize) {
            let (a, b) = (left.max(sum - bottom), right.min(sum - top));
            if a < b {
                path(area, &[(a, sum - a), (b, sum - b)], line)?;
            }
        }
    }
    if falling {
        // Those of x - y = difference.
        for difference in (first(left - bottom)..right - top).step_by(every as usize) {
            let (a, b) = (left.max(difference + top), right.min(difference + bottom));
            if a < b {
                path(area, &[(a, a - difference), (b, b - difference)], line)?;
            }
        }
    }
    if flat {
        for y in (first(top)..bottom).step_by(every as usize) {
            path(area, &[(left, y), (right, y)], line)?;
        }
    }
    Ok(())
}
