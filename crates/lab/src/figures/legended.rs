//! Figures of one chart whose legend stands below it, alone or as a part of another figure.

use super::Figure;
use super::canvas::Area;
use super::chart::{ABOVE, BELOW, Frame, LEFT, RIGHT};
use super::legend::Legend;
use super::style::{GAP, WIDTH};

/// Height of the chart with what stands around it, where it is alone.
const ALONE: i32 = 480;

/// One chart with the names of what is in it.
pub(super) trait Legended: Figure {
    /// The names, in so much room.
    fn legend(&self, width: i32) -> Legend;

    /// Draws the chart into its frame, with this title above it; none where it is empty.
    ///
    /// # Errors
    /// When it can't be drawn.
    fn chart(&self, area: &Area<'_>, frame: Frame, title: &str) -> anyhow::Result<()>;

    /// Chart and names below each other, the title above.
    ///
    /// # Errors
    /// When it can't be drawn.
    fn draw_in(&self, area: &Area<'_>, frame: Frame) -> anyhow::Result<()> {
        self.draw_titled(area, frame, self.title())
    }

    /// Width and height where it is alone.
    fn size_alone(&self) -> (u32, u32) {
        (WIDTH, (ALONE + self.legend(WIDTH as i32 - 2 * GAP).height()) as u32)
    }

    /// The same alone. The title stands above the whole figure then.
    ///
    /// # Errors
    /// When it can't be drawn.
    fn draw_alone(&self, area: &Area<'_>) -> anyhow::Result<()> {
        let frame = Frame { left: GAP, top: 0, right: WIDTH as i32 - GAP, bottom: self.size_alone().1 as i32 };
        self.draw_titled(area, frame, "")
    }

    /// # Errors
    /// When it can't be drawn.
    fn draw_titled(&self, area: &Area<'_>, frame: Frame, title: &str) -> anyhow::Result<()> {
        let legend = self.legend(frame.width());
        self.chart(area, frame.within(LEFT, ABOVE, RIGHT, BELOW + GAP + legend.height()), title)?;
        legend.draw(area, (frame.left + GAP, frame.bottom - legend.height()))
    }
}
