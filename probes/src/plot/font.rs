//! The font of every picture.

use plotters::style::{FontStyle, register_font};

/// DejaVu Sans with the characters of ASCII; its licence is beside it.
const DEJAVU_SANS: &[u8] = include_bytes!("../../fonts/DejaVuSans-ASCII.ttf");

/// Makes the font known under the name that SVG viewers take for whichever they have without serifs.
///
/// # Errors
/// When the file that was built in is no font.
pub(super) fn register() -> anyhow::Result<()> {
    register_font("sans-serif", FontStyle::Normal, DEJAVU_SANS)
        .map_err(|_| anyhow::anyhow!("the font of the pictures is damaged"))
}
