//! What pictures are drawn on: SVG and PNG behind one type, so that a figure is drawn by one function and both look the same.

use super::font;
use super::picture::Picture;
use super::style::GROUND;
use anyhow::ensure;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingErrorKind};
use std::io;

/// Pixels of a PNG in a unit, which is a pixel of an SVG: with one, letters have too few to be read with ease.
pub(super) const PNG_UNIT: u32 = 2;

/// Pixels of a PNG at most: this many take 800 MB while it is drawn.
const MOST_PIXELS: u64 = 1 << 28;

/// A picture under way. Lengths are in units.
pub(crate) type Area<'a> = DrawingArea<Canvas<'a>, Shift>;

/// Takes what is drawn in units, and text of any characters.
pub struct Canvas<'a>(Kind<'a>);

enum Kind<'a> {
    Svg(SVGBackend<'a>),
    Png(BitMapBackend<'a>),
}

type Drawn = Result<(), DrawingErrorKind<io::Error>>;

/// A picture of that width and height in units.
///
/// # Errors
/// When it can't be drawn, as a PNG of more pixels than memory may have room for.
pub(super) fn picture(
    picture: Picture,
    (width, height): (u32, u32),
    draw: impl FnOnce(&Area<'_>) -> anyhow::Result<()>,
) -> anyhow::Result<Vec<u8>> {
    let finish = |kind: Kind<'_>| {
        let root = Canvas(kind).into_drawing_area();
        root.fill(&GROUND)?;
        draw(&root)?;
        anyhow::Ok(root.present()?)
    };
    if picture == Picture::Svg {
        let mut svg = String::new();
        finish(Kind::Svg(SVGBackend::with_string(&mut svg, (width, height))))?;
        return Ok(svg.into_bytes());
    }
    let (width, height) = (width * PNG_UNIT, height * PNG_UNIT);
    let count = u64::from(width) * u64::from(height);
    ensure!(count <= MOST_PIXELS, "a PNG would have {width} x {height} pixels; draw fewer things, or an SVG");
    let mut pixels = vec![0; 3 * count as usize];
    finish(Kind::Png(BitMapBackend::with_buffer(&mut pixels, (width, height))))?;
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header()?.write_image_data(&pixels)?;
    Ok(file)
}

/// A colour and a width in pixels.
struct Pen(BackendColor, u32);

impl BackendStyle for Pen {
    fn color(&self) -> BackendColor {
        self.0
    }

    fn stroke_width(&self) -> u32 {
        self.1
    }
}

/// The pen of a PNG for one in units.
fn pen(style: &impl BackendStyle) -> Pen {
    Pen(style.color(), style.stroke_width() * PNG_UNIT)
}

fn pixels((x, y): BackendCoord) -> BackendCoord {
    (x * PNG_UNIT as i32, y * PNG_UNIT as i32)
}

fn of_png(done: Result<(), DrawingErrorKind<<BitMapBackend<'_> as DrawingBackend>::ErrorType>>) -> Drawn {
    done.map_err(|error| match error {
        DrawingErrorKind::DrawingError(e) => DrawingErrorKind::DrawingError(io::Error::other(e)),
        DrawingErrorKind::FontError(e) => DrawingErrorKind::FontError(e),
    })
}

impl DrawingBackend for Canvas<'_> {
    type ErrorType = io::Error;

    fn get_size(&self) -> (u32, u32) {
        match &self.0 {
            Kind::Svg(svg) => svg.get_size(),
            Kind::Png(png) => {
                let (width, height) = png.get_size();
                (width / PNG_UNIT, height / PNG_UNIT)
            }
        }
    }

    fn ensure_prepared(&mut self) -> Drawn {
        match &mut self.0 {
            Kind::Svg(svg) => svg.ensure_prepared(),
            Kind::Png(png) => of_png(png.ensure_prepared()),
        }
    }

    fn present(&mut self) -> Drawn {
        match &mut self.0 {
            Kind::Svg(svg) => svg.present(),
            Kind::Png(png) => of_png(png.present()),
        }
    }

    fn draw_pixel(&mut self, at: BackendCoord, colour: BackendColor) -> Drawn {
        self.draw_rect(at, (at.0 + 1, at.1 + 1), &Pen(colour, 1), true)
    }

    fn draw_line<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S) -> Drawn {
        match &mut self.0 {
            Kind::Svg(svg) => svg.draw_line(from, to, style),
            Kind::Png(png) => of_png(png.draw_line(pixels(from), pixels(to), &pen(style))),
        }
    }

    fn draw_rect<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S, fill: bool) -> Drawn {
        if !fill {
            // That of SVG leaves the width of the line out.
            let corners = [from, (to.0, from.1), to, (from.0, to.1), from];
            return self.draw_path(corners, style);
        }
        match &mut self.0 {
            Kind::Svg(svg) => svg.draw_rect(from, to, style, fill),
            Kind::Png(png) => of_png(png.draw_rect(pixels(from), pixels(to), &pen(style), fill)),
        }
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(&mut self, path: I, style: &S) -> Drawn {
        match &mut self.0 {
            Kind::Svg(svg) => svg.draw_path(path, style),
            Kind::Png(png) => of_png(png.draw_path(path.into_iter().map(pixels), &pen(style))),
        }
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(&mut self, path: I, style: &S) -> Drawn {
        match &mut self.0 {
            Kind::Svg(svg) => svg.fill_polygon(path, style),
            Kind::Png(png) => of_png(png.fill_polygon(path.into_iter().map(pixels), &pen(style))),
        }
    }

    fn draw_circle<S: BackendStyle>(&mut self, at: BackendCoord, radius: u32, style: &S, fill: bool) -> Drawn {
        match &mut self.0 {
            Kind::Svg(svg) => svg.draw_circle(at, radius, style, fill),
            Kind::Png(png) => of_png(png.draw_circle(pixels(at), radius * PNG_UNIT, &pen(style), fill)),
        }
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, at: BackendCoord) -> Drawn {
        let png = match &mut self.0 {
            Kind::Svg(svg) => return svg.draw_text(&font::sound(text), style, at),
            Kind::Png(png) => png,
        };
        // As an SVG has it.
        let em = font::em(style.size()) * f64::from(PNG_UNIT);
        let lower = match style.anchor().v_pos {
            VPos::Top => 0.76,
            VPos::Center => 0.27,
            VPos::Bottom => -0.27,
        };
        let left = match style.anchor().h_pos {
            HPos::Left => 0.0,
            HPos::Center => 0.5,
            HPos::Right => 1.0,
        };
        let from = ((-left * font::width_in(text, em)).round() as i32, (lower * em).round() as i32);
        let (x, y) = pixels(at);
        let (turned, colour) = (style.transform(), style.color());
        of_png(font::draw(text, em, |(dx, dy), share| {
            let (dx, dy) = turned.transform(from.0 + dx, from.1 + dy);
            png.draw_pixel((x + dx, y + dy), colour.mix(share))
        }))
    }
}
