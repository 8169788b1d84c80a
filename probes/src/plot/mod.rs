//! Pictures.

mod font;
mod mark;
mod simulation;
mod training;

use crate::exit::WrongUsage;
use plotters::coord::Shift;
use plotters::prelude::*;
use std::path::Path;

pub(crate) use simulation::simulation;
pub(crate) use training::training;

/// Colours that stay apart for colour-blind readers (Okabe and Ito 2008); black is kept for the adaptive module.
const COLOURS: [RGBColor; 7] = [
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(150, 150, 150),
];

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

fn colour(k: usize) -> RGBColor {
    COLOURS[k % COLOURS.len()]
}

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
    chart
        .configure_series_labels()
        .position(position)
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(180, 180, 180))
        .draw()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_of_the_file_says_how_it_is_stored() {
        assert_eq!(Picture::of(Path::new("a.svg")).unwrap(), Picture::Svg);
        assert_eq!(Picture::of(Path::new("b.c/a.png")).unwrap(), Picture::Png);
        for other in ["a", "a.pdf", "svg"] {
            assert!(Picture::of(Path::new(other)).unwrap_err().to_string().contains(".svg or .png"));
        }
    }
}
