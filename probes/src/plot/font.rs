//! The font of every picture.

use plotters::style::{FontDesc, FontFamily, FontStyle, FontTransform, register_font};

/// DejaVu Sans with the characters of ASCII; its licence is beside it.
const DEJAVU_SANS: &[u8] = include_bytes!("../../fonts/DejaVuSans-ASCII.ttf");
/// The name that SVG viewers take for whichever they have without serifs.
pub(super) const SANS: FontFamily<'static> = FontFamily::SansSerif;
/// Height of a line of it in em, which is what plotters takes for the size.
pub(super) const LINE: f64 = 1.164;

/// Makes the font known.
///
/// # Errors
/// When the file that was built in is no font.
pub(super) fn register() -> anyhow::Result<()> {
    register_font(SANS.as_str(), FontStyle::Normal, DEJAVU_SANS)
        .map_err(|_| anyhow::anyhow!("the font of the pictures is damaged"))
}

/// Text for an SVG. XML has no place for most control characters, even escaped, and those that turn the direction of what follows would
/// turn names around: each becomes a question mark.
pub(super) fn sound(text: &str) -> String {
    let turns = |c| matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let bad = |c: char| c.is_control() || turns(c) || matches!(c, '\u{fffe}' | '\u{ffff}');
    text.chars().map(|c| if bad(c) { '?' } else { c }).collect()
}

/// Text for a PNG: the font that is built in has no other characters than those of ASCII.
pub(super) fn drawable(text: &str) -> String {
    text.chars().map(|c| if c == ' ' || c.is_ascii_graphic() { c } else { '?' }).collect()
}

/// The width of a text in units. Characters that the font lacks are as wide as its widest: an SVG shows them.
///
/// # Panics
/// Never after `register`; before, a letter is half of its size wide.
pub(super) fn width(text: &str, size: u32) -> i32 {
    let known: String = text.chars().map(|c| if c == ' ' || c.is_ascii_graphic() { c } else { '@' }).collect();
    let font = FontDesc::new(SANS, f64::from(size) / 1.24 * LINE, FontStyle::Normal).transform(FontTransform::None);
    font.box_size(&known).map_or_else(|_| known.len() as i32 * size as i32 / 2, |(width, _)| width as i32 + 1)
}

/// The words of a text in lines of at most that width, at most `most` of them. A word that is wider is cut; what does not fit ends in
/// three dots.
pub(super) fn wrapped(text: &str, size: u32, room: i32, most: usize) -> Vec<String> {
    let fits = |line: &str| width(line, size) <= room;
    let mut lines: Vec<String> = vec![String::new()];
    for word in text.split(' ') {
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
