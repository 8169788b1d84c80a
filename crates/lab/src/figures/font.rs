//! The font of every picture.

use ab_glyph::{Font, FontRef, PxScale, ScaleFont, point};
use plotters::style::FontFamily;
use std::sync::LazyLock;

/// The name that SVG viewers take for whichever they have without serifs.
pub(super) const SANS: FontFamily<'static> = FontFamily::SansSerif;
/// DejaVu Sans with the characters of ASCII; its licence is beside it.
static DEJAVU_SANS: LazyLock<Option<FontRef<'static>>> =
    LazyLock::new(|| FontRef::try_from_slice(include_bytes!("../../fonts/DejaVuSans-ASCII.ttf")).ok());

/// Pixels of an em for a size in plotters, which is that of a line.
pub(super) fn em(size: f64) -> f64 {
    size / 1.24
}

/// Tells where each character of a text begins, and returns where the last one ends.
fn laid_out(font: &FontRef<'static>, text: &str, em: f64, mut each: impl FnMut(f32, char)) -> f32 {
    let scaled = font.as_scaled(scale(font, em));
    let mut x = 0.0;
    let mut last = None;
    for c in text.chars() {
        let glyph = scaled.glyph_id(c);
        x += last.map_or(0.0, |last| scaled.kern(last, glyph));
        each(x, c);
        x += scaled.h_advance(glyph);
        last = Some(glyph);
    }
    x
}

/// ab_glyph counts the height of a line, which is larger than the em.
fn scale(font: &FontRef<'static>, em: f64) -> PxScale {
    let line = font.units_per_em().map_or(1.0, |units| font.height_unscaled() / units);
    PxScale::from(em as f32 * line)
}

/// Draws text of any characters; those that the font lacks become question marks. `dot` takes a place from the beginning of the base line
/// and how much of it is covered.
pub(super) fn draw<E>(text: &str, em: f64, mut dot: impl FnMut((i32, i32), f64) -> Result<(), E>) -> Result<(), E> {
    let Some(font) = DEJAVU_SANS.as_ref() else { return Ok(()) };
    let mut glyphs = Vec::new();
    laid_out(font, &drawable(text), em, |x, c| {
        glyphs.extend(font.outline_glyph(font.glyph_id(c).with_scale_and_position(scale(font, em), point(x, 0.0))));
    });
    for glyph in glyphs {
        let corner = glyph.px_bounds().min;
        let mut covered = Vec::new();
        glyph.draw(|x, y, share| covered.push((x, y, share)));
        for (x, y, share) in covered {
            dot((corner.x as i32 + x as i32, corner.y as i32 + y as i32), f64::from(share.clamp(0.0, 1.0)))?;
        }
    }
    Ok(())
}

/// Text for an SVG. XML has no place for most control characters, even escaped, and those that turn the direction of what follows would
/// turn names around: each becomes a question mark.
pub(super) fn sound(text: &str) -> String {
    let turns = |c| matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let bad = |c: char| c.is_control() || turns(c) || matches!(c, '\u{fffe}' | '\u{ffff}');
    text.chars().map(|c| if bad(c) { '?' } else { c }).collect()
}

/// Text for a PNG: the font that is built in has no other characters than those of ASCII.
fn drawable(text: &str) -> String {
    text.chars().map(|c| if c == ' ' || c.is_ascii_graphic() { c } else { '?' }).collect()
}

/// The width of a text in units. Characters that the font lacks are as wide as its widest: an SVG shows them.
pub(super) fn width(text: &str, size: u32) -> i32 {
    let known: String = text.chars().map(|c| if c == ' ' || c.is_ascii_graphic() { c } else { '@' }).collect();
    width_in(&known, em(f64::from(size))).ceil() as i32
}

/// The width in pixels of what `draw` draws.
pub(super) fn width_in(text: &str, em: f64) -> f64 {
    DEJAVU_SANS.as_ref().map_or(0.0, |font| f64::from(laid_out(font, &drawable(text), em, |_, _| {})))
}

/// The words of a text in lines of at most that width, at most `most` of them. A word that is wider is cut; what does not fit ends in
/// three dots.
pub(super) fn wrapped(text: &str, size: u32, room: i32, most: usize) -> Vec<String> {
    let fits = |line: &str| width(line, size) <= room;
    let mut lines: Vec<String> = vec![String::new()];
    for word in text.split(' ') {
        if lines.len() > most {
            break;
        }
        let last = lines.len() - 1;
        let joined = if lines[last].is_empty() { word.to_owned() } else { format!("{} {word}", lines[last]) };
        if fits(&joined) {
            lines[last] = joined;
            continue;
        }
        if !lines[last].is_empty() {
            lines.push(String::new());
        }
        for letter in word.chars() {
            // The rest of a word of a megabyte is not drawn and need not be measured.
            if lines.len() > most {
                break;
            }
            let last = lines.len() - 1;
            let longer = format!("{}{letter}", lines[last]);
            if fits(&longer) || lines[last].is_empty() {
                lines[last] = longer;
            } else {
                lines.push(letter.to_string());
            }
        }
    }
    if lines.len() > most {
        lines.truncate(most);
        if let Some(last) = lines.last_mut() {
            while !last.is_empty() && !fits(&format!("{last}...")) {
                last.pop();
            }
            last.push_str("...");
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_font_that_is_built_in_is_one() {
        assert!(DEJAVU_SANS.is_some());
        let mut dots = 0.0;
        draw("Ag", 20.0, |_, share| {
            dots += share;
            Ok::<_, ()>(())
        })
        .unwrap();
        assert!((50.0..300.0).contains(&dots), "{dots}");
        // The widths of DejaVu Sans in em: 0.684 and 1.0.
        assert!((width_in("AA", 100.0) - 136.8).abs() < 1.0 && (width_in("@", 100.0) - 100.0).abs() < 1.0);
        assert_eq!(width("\u{3042}", 20), width("@", 20));
    }

    #[test]
    fn what_a_picture_cannot_show_becomes_a_question_mark() {
        assert_eq!(sound("a<é\u{1}\n\u{202e}\u{ffff}b"), "a<é????b");
        assert_eq!(drawable("a<é\u{1}b"), "a<??b");
    }

    #[test]
    fn lines_have_whole_words_where_they_fit() {
        let room = width("made by sapwise", 15);
        assert_eq!(wrapped("made by sapwise run", 15, room, 9), ["made by sapwise", "run"]);
        let long = wrapped(&"x".repeat(300), 15, room, 9);
        assert!(long.len() > 1 && long.len() <= 9 && long.iter().all(|l| width(l, 15) <= room), "{long:?}");
        let cut = wrapped("made by sapwise run and more", 15, room, 1);
        assert!(cut.len() == 1 && cut[0].ends_with("...") && width(&cut[0], 15) <= room, "{cut:?}");
        assert_eq!(wrapped("", 15, room, 9), [""]);
        assert_eq!(wrapped("words", 15, 0, 1), ["..."]);
    }
}
