//! Shapes that stay apart in print without colours.

use plotters::element::{Drawable, PointCollection};
use plotters::prelude::*;
use plotters_backend::{BackendCoord, DrawingErrorKind};

/// The shape of a point.
#[derive(Debug, Clone, Copy)]
pub(super) enum Mark {
    Disc,
    Triangle,
    Cross,
    Ring,
    Square,
    Plus,
    /// Not of a series: a disc below a mark, of paper, so that what is behind does not cross it.
    Ground,
}

/// A shape at a place, in data coordinates or in pixels, with the number of pixels from its middle to its edge.
pub(super) fn mark<C>(at: C, mark: Mark, colour: RGBColor, size: i32) -> Shape<C> {
    Shape { at, mark, colour, size }
}

/// An element of a chart. Those of plotters are of a type each, which a series of one shape out of several can't be.
pub(super) struct Shape<C> {
    at: C,
    mark: Mark,
    colour: RGBColor,
    size: i32,
}

impl<'a, C> PointCollection<'a, C> for &'a Shape<C> {
    type Point = &'a C;
    type IntoIter = std::iter::Once<&'a C>;

    fn point_iter(self) -> Self::IntoIter {
        std::iter::once(&self.at)
    }
}

impl<C, D: DrawingBackend> Drawable<D> for Shape<C> {
    fn draw<I: Iterator<Item = BackendCoord>>(
        &self,
        mut places: I,
        backend: &mut D,
        _: (u32, u32),
    ) -> Result<(), DrawingErrorKind<D::ErrorType>> {
        let Some((x, y)) = places.next() else { return Ok(()) };
        let (r, line) = (self.size, self.colour.stroke_width(2));
        match self.mark {
            Mark::Disc | Mark::Ground => backend.draw_circle((x, y), r as u32, &self.colour, true),
            Mark::Ring => backend.draw_circle((x, y), r as u32, &line, false),
            Mark::Triangle => {
                backend.fill_polygon([(x - r - 1, y + r), (x + r + 1, y + r), (x, y - r - 1)], &self.colour)
            }
            Mark::Square => backend.draw_rect((x - r, y - r), (x + r, y + r), &line, false),
            Mark::Cross => {
                backend.draw_line((x - r, y - r), (x + r, y + r), &line)?;
                backend.draw_line((x - r, y + r), (x + r, y - r), &line)
            }
            Mark::Plus => {
                backend.draw_line((x - r - 1, y), (x + r + 1, y), &line)?;
                backend.draw_line((x, y - r - 1), (x, y + r + 1), &line)
            }
        }
    }
}
