//! Pictures of plain data, as SVG and as PNG.

mod agreement;
mod axis;
mod canvas;
mod chart;
mod curves;
mod figure;
mod font;
mod influence;
mod legend;
mod legended;
mod map;
mod mark;
mod picture;
mod ranks;
mod ratios;
mod regrets;
mod replay;
mod style;
mod training;
mod verdict;

pub(crate) use agreement::{Agreement, AgreementGroup, AgreementPoint, Values};
pub(crate) use curves::{Band, CrossoverLine, Curve, CurvePanel, CurvePoint, Curves};
pub use figure::Figure;
pub(crate) use influence::{Influence, InfluenceCell};
pub(crate) use map::{FieldMap, MapCell, MapPanel, MapPoint};
pub use picture::{Picture, UnknownPicture};
pub use ranks::RanksPicture;
pub(crate) use ratios::{RatioGroup, RatioKind, RatioValue, Ratios};
pub(crate) use regrets::{Regrets, StrategyRegrets};
pub use replay::ReplayPicture;
pub use training::TrainingPicture;

#[cfg(test)]
mod tests;
